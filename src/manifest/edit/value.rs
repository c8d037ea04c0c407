//! Values as the types that fields take.

use glam::Vec3;

use crate::color::{Rgb, linear_from_srgb};
use crate::record::Value;

/// The value is not what the field takes; the field knows how to say what that is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mismatch;

/// What became of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// It has the new value.
    Set,
    /// This one has no such field, for the reason given; the value would have been right.
    NotApplicable(&'static str),
}

/// A finite number in [low, high] that is still in there as `f32`.
pub(super) fn number(value: &Value, low: f32, high: f32) -> Result<f32, Mismatch> {
    let Value::Number(n) = *value else { return Err(Mismatch) };
    let n = n as f32;
    if n.is_finite() && (low..=high).contains(&n) { Ok(n) } else { Err(Mismatch) }
}

/// A finite number.
pub(super) fn any_number(value: &Value) -> Result<f32, Mismatch> {
    number(value, f32::MIN, f32::MAX)
}

/// A finite number of at least 0.
pub(super) fn not_negative(value: &Value) -> Result<f32, Mismatch> {
    number(value, 0.0, f32::MAX)
}

/// A finite number above 0.
pub(super) fn positive(value: &Value) -> Result<f32, Mismatch> {
    number(value, f32::MIN_POSITIVE, f32::MAX)
}

/// Degrees in [low, high] as radians.
pub(super) fn degrees(value: &Value, low: f64, high: f64) -> Result<f32, Mismatch> {
    match *value {
        Value::Number(n) if (low..=high).contains(&n) => Ok(n.to_radians() as f32),
        _ => Err(Mismatch),
    }
}

/// Any finite number of degrees as radians in (-2π, 2π).
pub(super) fn any_degrees(value: &Value) -> Result<f32, Mismatch> {
    match *value {
        Value::Number(n) if n.is_finite() => Ok((n % 360.0).to_radians() as f32),
        _ => Err(Mismatch),
    }
}

/// A whole number in [low, high].
pub(super) fn whole(value: &Value, low: u64, high: u64) -> Result<u64, Mismatch> {
    match *value {
        Value::Number(n) if n.fract() == 0.0 && (low as f64..=high as f64).contains(&n) => Ok(n as u64),
        _ => Err(Mismatch),
    }
}

/// Text that is not empty.
pub(super) fn text(value: &Value) -> Result<&str, Mismatch> {
    match value {
        Value::Text(t) if !t.is_empty() => Ok(t),
        _ => Err(Mismatch),
    }
}

/// `true` or `false`.
pub(super) fn flag(value: &Value) -> Result<bool, Mismatch> {
    match *value {
        Value::Bool(flag) => Ok(flag),
        _ => Err(Mismatch),
    }
}

/// One of the variants that `from_name` knows.
pub(super) fn choice<T>(value: &Value, from_name: impl Fn(&str) -> Option<T>) -> Result<T, Mismatch> {
    text(value).and_then(|t| from_name(t).ok_or(Mismatch))
}

/// `false` for none, or what `read` reads.
pub(super) fn or_none<T>(
    value: &Value,
    read: impl Fn(&Value) -> Result<T, Mismatch>,
) -> Result<Option<T>, Mismatch> {
    match value {
        Value::Bool(false) => Ok(None),
        other => read(other).map(Some),
    }
}

/// Exactly `N` finite numbers.
pub(super) fn numbers<const N: usize>(value: &Value) -> Result<[f32; N], Mismatch> {
    let Value::List(items) = value else { return Err(Mismatch) };
    let items: &[Value; N] = items.as_slice().try_into().map_err(|_| Mismatch)?;
    let mut out = [0.0; N];
    for (slot, item) in out.iter_mut().zip(items) {
        *slot = any_number(item)?;
    }
    Ok(out)
}

/// A vector.
pub(super) fn vector(value: &Value) -> Result<Vec3, Mismatch> {
    numbers::<3>(value).map(Vec3::from)
}

/// A vector made one metre long.
pub(super) fn direction(value: &Value) -> Result<Vec3, Mismatch> {
    vector(value)?.try_normalize().ok_or(Mismatch)
}

/// A linear colour with channels in [0, max], or sRGB hexadecimal text.
pub(super) fn color(value: &Value, max: f32) -> Result<Rgb, Mismatch> {
    if let Value::Text(text) = value {
        return hex_color(text).ok_or(Mismatch);
    }
    let rgb = numbers::<3>(value)?;
    if rgb.iter().all(|c| (0.0..=max).contains(c)) { Ok(Rgb::from(rgb)) } else { Err(Mismatch) }
}

/// `#rrggbb`, sRGB-encoded, as a linear colour.
fn hex_color(text: &str) -> Option<Rgb> {
    let digits =
        text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let channel = |i: usize| {
        let code = u8::from_str_radix(&digits[2 * i..2 * i + 2], 16).ok()?;
        Some(linear_from_srgb(f32::from(code) / 255.0))
    };
    Some(Rgb::new(channel(0)?, channel(1)?, channel(2)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hexadecimal_colours_are_srgb() {
        let c = color(&Value::Text("#ff8000".into()), 1.0).unwrap();
        assert_eq!((c.r, c.b), (1.0, 0.0));
        assert!((c.g - 0.215_86).abs() < 1e-4, "{c:?}");
        for bad in ["ff8000", "#ff80", "#gg0000", "#ff80é", ""] {
            assert_eq!(color(&Value::Text(bad.into()), 1.0), Err(Mismatch), "{bad}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_as_f32_are_refused() {
        for n in [f64::NAN, f64::INFINITY, 1e39, -1e39] {
            assert_eq!(any_number(&Value::Number(n)), Err(Mismatch));
            assert_eq!(numbers::<1>(&Value::List(vec![Value::Number(n)])), Err(Mismatch));
            assert_eq!(whole(&Value::Number(n), 0, 10), Err(Mismatch));
        }
        assert_eq!(any_degrees(&Value::Number(f64::NAN)), Err(Mismatch));
        assert_eq!(whole(&Value::Number(1.5), 0, 10), Err(Mismatch));
        assert_eq!(whole(&Value::Number(-1.0), 0, 10), Err(Mismatch));
    }
}
