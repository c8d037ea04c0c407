//! Following a glTF `uri`: relative file names with %-escapes, and data: URIs.

use super::error::UriProblem;

/// What a `uri` leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// A file, relative to the scene's folder.
    File(String),
    /// The bytes themselves.
    Data(Vec<u8>),
}

/// What `uri` leads to. `..` and the like stay in the name: reading the file refuses them.
pub(super) fn resolve(uri: &str) -> Result<Target, UriProblem> {
    if let Some(rest) = strip_prefix_ignoring_case(uri, "data:") {
        let (header, data) = rest.split_once(',').ok_or(UriProblem::Comma)?;
        let base64 = header.to_ascii_lowercase().ends_with(";base64");
        return if base64 { decode_base64(data.as_bytes()) } else { decode_percent(data) }.map(Target::Data);
    }
    if has_scheme(uri) {
        return Err(UriProblem::Scheme);
    }
    let name = String::from_utf8(decode_percent(uri)?).map_err(|_| UriProblem::Percent)?;
    Ok(Target::File(name))
}

/// Whether `uri` begins with a scheme (RFC 3986, 3.1) or names an authority.
fn has_scheme(uri: &str) -> bool {
    let scheme = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_alphabetic())
            && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
    };
    uri.starts_with("//") || uri.split_once(':').is_some_and(|(before, _)| scheme(before))
}

fn strip_prefix_ignoring_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then(|| &text[prefix.len()..])
}

/// `text` with every %XX replaced by its byte.
fn decode_percent(text: &str) -> Result<Vec<u8>, UriProblem> {
    let hex = |byte: Option<u8>| {
        byte.and_then(|b| (b as char).to_digit(16)).map(|d| d as u8).ok_or(UriProblem::Percent)
    };
    let mut bytes = text.bytes();
    let mut decoded = Vec::with_capacity(text.len());
    while let Some(byte) = bytes.next() {
        decoded.push(match byte {
            b'%' => hex(bytes.next())? << 4 | hex(bytes.next())?,
            other => other,
        });
    }
    Ok(decoded)
}

/// Base64 (RFC 4648, section 4); padding may be missing.
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, UriProblem> {
    let unpadded = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    if unpadded.len() % 4 == 1 || (unpadded.len() < text.len() && !text.len().is_multiple_of(4)) {
        return Err(UriProblem::Base64);
    }
    let digit = |byte: u8| match byte {
        b'A'..=b'Z' => Ok(byte - b'A'),
        b'a'..=b'z' => Ok(byte - b'a' + 26),
        b'0'..=b'9' => Ok(byte - b'0' + 52),
        b'+' => Ok(62),
        b'/' => Ok(63),
        _ => Err(UriProblem::Base64),
    };
    let mut decoded = Vec::with_capacity(unpadded.len() / 4 * 3 + 2);
    for quad in unpadded.chunks(4) {
        let mut bits = 0u32;
        for (i, &byte) in quad.iter().enumerate() {
            bits |= u32::from(digit(byte)?) << (18 - 6 * i);
        }
        decoded.extend_from_slice(&bits.to_be_bytes()[1..quad.len()]);
    }
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_in_the_standard() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmE=", "fooba"),
        ] {
            assert_eq!(decode_base64(text.as_bytes()), Ok(bytes.as_bytes().to_vec()), "{text}");
        }
        for text in ["Z", "Zm9vY", "Zm 9", "Zg=", "Zm9v=", "Z===", "!!!!", "Zm=v"] {
            assert_eq!(decode_base64(text.as_bytes()), Err(UriProblem::Base64), "{text}");
        }
    }

    #[test]
    fn names_are_unescaped_and_schemes_refused() {
        let file = |name: &str| Ok(Target::File(name.into()));
        assert_eq!(resolve("a%20b.bin"), file("a b.bin"));
        assert_eq!(resolve("tex/%C3%A4.png"), file("tex/ä.png"));
        assert_eq!(resolve("./a:b"), file("./a:b"));
        for bad in ["a%2", "a%", "%zz", "%FF", "%+1"] {
            assert_eq!(resolve(bad), Err(UriProblem::Percent), "{bad}");
        }
        for bad in ["http://host/a", "file:///etc/passwd", "C:\\a", "//host/a"] {
            assert_eq!(resolve(bad), Err(UriProblem::Scheme), "{bad}");
        }
    }

    #[test]
    fn data_uris_hold_their_bytes() {
        assert_eq!(resolve("data:application/octet-stream;base64,AAEC"), Ok(Target::Data(vec![0, 1, 2])));
        assert_eq!(resolve("DATA:,a%20b"), Ok(Target::Data(b"a b".to_vec())));
        assert_eq!(resolve("data:;base64"), Err(UriProblem::Comma));
    }
}
