//! The name that somebody probably meant.

/// Words longer than this are not compared: the distance takes the product of the lengths.
const MAX_LENGTH: usize = 64;

/// The candidate most like `word`, if one is like it at all. Case, hyphens and spaces count as no difference.
pub(crate) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > MAX_LENGTH {
        return None;
    }
    let plain = |text: &str| text.to_lowercase().replace(['-', ' '], "_");
    let word = plain(word);
    let mut best: Option<(f64, &str)> = None;
    for candidate in candidates.into_iter().filter(|c| c.len() <= MAX_LENGTH) {
        let likeness = strsim::normalized_damerau_levenshtein(&word, &plain(candidate));
        if likeness >= 0.5 && best.is_none_or(|(most, _)| likeness > most) {
            best = Some((likeness, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// The names as a sentence lists them, `` `a`, `b` ``, at most twelve of them.
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    const MOST: usize = 12;
    let mut text: Vec<String> = names.iter().take(MOST).map(|n| format!("`{}`", n.as_ref())).collect();
    if names.len() > MOST {
        text.push(format!("and {} more", names.len() - MOST));
    }
    text.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_finger_and_other_spellings_find_the_name() {
        let known = ["roughness", "base_color", "metallic"];
        assert_eq!(nearest("roughnes", known), Some("roughness"));
        assert_eq!(nearest("baseColor", known), Some("base_color"));
        assert_eq!(nearest("base-color", known), Some("base_color"));
        assert_eq!(nearest("zzz", known), None);
        assert_eq!(nearest(&"r".repeat(1_000_000), known), None);
    }

    #[test]
    fn long_lists_are_cut() {
        let names: Vec<String> = (0..15).map(|i| i.to_string()).collect();
        assert!(listed(&names).ends_with("`11`, and 3 more"));
    }
}
