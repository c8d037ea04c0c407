//! Numbers as `idiff` prints them: C++ streams for statistics, shortest round-trip for pixel values.

/// `%g` of C with `precision` significant digits: what a C++ stream prints.
pub(super) fn general(value: f64, precision: usize) -> String {
    if value.is_nan() {
        return if value.is_sign_negative() { "-nan" } else { "nan" }.into();
    }
    if value.is_infinite() {
        return if value < 0.0 { "-inf" } else { "inf" }.into();
    }
    if value == 0.0 {
        return if value.is_sign_negative() { "-0" } else { "0" }.into();
    }
    let scientific = format!("{:.*e}", precision - 1, value);
    let (digits, exponent) = decimal(&scientific);
    place(value < 0.0, digits.trim_end_matches('0'), exponent, precision as i32)
}

/// The shortest digits that give the same float back, as the fmt library prints a float: scientific below 1e-4 and from
/// 1e7 on. Of several as short it takes the nearest, and of two as near the even one; Rust's own takes the larger.
pub(super) fn shortest(value: f32) -> String {
    if value.is_nan() {
        return if value.is_sign_negative() { "-nan" } else { "nan" }.into();
    }
    if value.is_infinite() {
        return if value < 0.0 { "-inf" } else { "inf" }.into();
    }
    if value == 0.0 {
        return if value.is_sign_negative() { "-0" } else { "0" }.into();
    }
    let scientific = format!("{value:e}");
    let (mut digits, mut exponent) = decimal(&scientific);
    let nearest = format!("{:.*e}", digits.len() - 1, f64::from(value));
    if nearest.parse() == Ok(value) {
        (digits, exponent) = decimal(&nearest);
    }
    place(value < 0.0, &digits, exponent, 7)
}

/// The digits and the exponent of Rust's scientific notation, `-d.ddde-x`.
fn decimal(scientific: &str) -> (String, i32) {
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((scientific, "0"));
    let digits = mantissa.chars().filter(char::is_ascii_digit).collect();
    (digits, exponent.parse().unwrap_or(0))
}

/// Puts the point: plain for exponents from -4 up to `upper`, else scientific with at least two exponent digits.
fn place(negative: bool, digits: &str, exponent: i32, upper: i32) -> String {
    let sign = if negative { "-" } else { "" };
    let count = digits.len() as i32;
    if exponent < -4 || exponent >= upper {
        let (first, rest) = digits.split_at(1.min(digits.len()));
        let point = if rest.is_empty() { "" } else { "." };
        let exponent_sign = if exponent < 0 { '-' } else { '+' };
        return format!("{sign}{first}{point}{rest}e{exponent_sign}{:02}", exponent.abs());
    }
    if exponent < 0 {
        return format!("{sign}0.{}{digits}", "0".repeat((-exponent - 1) as usize));
    }
    if count <= exponent + 1 {
        return format!("{sign}{digits}{}", "0".repeat((exponent + 1 - count) as usize));
    }
    let (whole, fraction) = digits.split_at((exponent + 1) as usize);
    format!("{sign}{whole}.{fraction}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_have_six_digits_as_in_a_stream() {
        for (value, expected) in [
            (0.000333333333, "0.000333333"),
            (44.771212547, "44.7712"),
            (1e-6_f32.into(), "1e-06"),
            (0.0000123456789, "1.23457e-05"),
            (1234567.0, "1.23457e+06"),
            (999999.5, "1e+06"),
            (123456.0, "123456"),
            (100.0, "100"),
            (0.1_f32.into(), "0.1"),
            (1e100, "1e+100"),
            (0.0, "0"),
            (-2.5, "-2.5"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(general(value, 6), expected);
        }
        assert_eq!(general(2.0 / 3.0 * 100.0, 3), "66.7");
        assert_eq!(general(1350.0, 3), "1.35e+03");
    }

    #[test]
    fn pixel_values_are_the_shortest_that_round_trip() {
        for (value, expected) in [
            (0.837_884_66, "0.83788466"),
            (1234567.0, "1234567"),
            (12345678.0, "1.2345678e+07"),
            (1e7, "1e+07"),
            (0.5, "0.5"),
            (3e38, "3e+38"),
            (0.0001, "0.0001"),
            (0.00001, "1e-05"),
            (449.0 / 256.0, "1.7539062"),
            (-0.000_939_369_2, "-0.0009393692"),
            (f32::NEG_INFINITY, "-inf"),
            (-0.0, "-0"),
        ] {
            assert_eq!(shortest(value), expected);
        }
    }
}
