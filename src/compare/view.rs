//! A layer as OpenImageIO sees it: channels in its order, everything outside the data window 0.

use crate::imagefile::MAX_VALUES;
use crate::raster::{Channel, Layer, SampleType, Window};

use super::CompareError;

/// The order of a layer's well-known suffixes, from OpenImageIO 3.2, `exrinput.cpp`, `compute_special_index`.
const SPECIAL: [&str; 20] = [
    "R", "Red", "G", "Green", "B", "Blue", "Y", "real", "imag", "A", "Alpha", "AR", "RA", "AG", "GA", "AB",
    "BA", "Z", "Depth", "Zback",
];

/// The same where X comes with Y or Z: a position or normal, `compute_special_index_xyz`.
const SPECIAL_XYZ: [&str; 22] = [
    "R", "Red", "G", "Green", "B", "Blue", "X", "Y", "Z", "real", "imag", "A", "Alpha", "AR", "RA", "AG",
    "GA", "AB", "BA", "Depth", "Zback", "",
];

/// The group before the last dot, the dot included, and the suffix after it.
fn split(name: &str) -> (&str, &str) {
    match name.rfind('.') {
        Some(dot) => name.split_at(dot + 1),
        None => ("", name),
    }
}

/// The channels' indices in OpenImageIO's order: by group, then well-known suffixes first, then by suffix.
pub(super) fn canonical_order(names: &[&str]) -> Vec<usize> {
    let is = |name: &str, group: &str, suffix: &str| {
        let (g, s) = split(name);
        g == group && s.eq_ignore_ascii_case(suffix)
    };
    let rank = |name: &str| {
        let (group, suffix) = split(name);
        let has = |suffix| names.iter().any(|other| is(other, group, suffix));
        let list: &[&str] = if has("X") && (has("Y") || has("Z")) { &SPECIAL_XYZ } else { &SPECIAL };
        list.iter().position(|s| !s.is_empty() && s.eq_ignore_ascii_case(suffix)).unwrap_or(usize::MAX)
    };
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_cached_key(|&i| {
        let (group, suffix) = split(names[i]);
        (group.as_bytes().to_vec(), rank(names[i]), suffix.as_bytes().to_vec())
    });
    order
}

/// Whether OpenImageIO would take the channels for luminance and chroma, `is_luminance_chroma`.
pub(super) fn is_luminance_chroma(names: &[&str]) -> bool {
    let has = |suffix: &str| names.iter().any(|name| split(name).1.eq_ignore_ascii_case(suffix));
    let alpha = names.len() == 3 || (names.len() == 4 && (has("A") || has("Alpha")));
    alpha && has("Y") && has("BY") && has("RY")
}

/// A layer with its channels in OpenImageIO's order.
pub(super) struct View<'a> {
    pub(super) window: Window,
    pub(super) channels: Vec<&'a Channel>,
}

impl<'a> View<'a> {
    /// A view, if every channel fills the window.
    pub(super) fn new(layer: &'a Layer) -> Result<Self, CompareError> {
        let expected = layer.window.pixels();
        for channel in &layer.channels {
            let has = channel.values.len();
            if has != expected {
                return Err(CompareError::Channel { channel: channel.name.clone(), has, expected });
            }
        }
        let names: Vec<&str> = layer.channels.iter().map(|c| c.name.as_str()).collect();
        if is_luminance_chroma(&names) {
            return Err(CompareError::LuminanceChroma);
        }
        let channels = canonical_order(&names).into_iter().map(|i| &layer.channels[i]).collect();
        Ok(Self { window: layer.window, channels })
    }

    /// The value of a channel at a pixel's index, as OpenImageIO converts it to float: integers over their maximum.
    pub(super) fn value(&self, channel: usize, index: Option<usize>) -> f32 {
        match (self.channels.get(channel), index) {
            (Some(channel), Some(index)) => match channel.stored_as {
                SampleType::U32 => channel.values[index] * (1.0 / 4_294_967_295.0_f32),
                _ => channel.values[index],
            },
            _ => 0.0,
        }
    }
}

/// The rectangle that holds two data windows, in numbers that cannot overflow.
pub(super) struct Region {
    pub(super) xs: std::ops::Range<i64>,
    pub(super) ys: std::ops::Range<i64>,
}

impl Region {
    /// The region of two windows, if the work on it is bounded.
    pub(super) fn new(a: &Window, b: &Window, channels: usize) -> Result<Self, CompareError> {
        let region = Self {
            xs: i64::from(a.x.min(b.x))..a.right().max(b.right()),
            ys: i64::from(a.y.min(b.y))..a.bottom().max(b.bottom()),
        };
        let (width, height) = (region.width(), region.height());
        if width.saturating_mul(height).saturating_mul(channels as u64) > MAX_VALUES {
            return Err(CompareError::RegionTooLarge { width, height, channels });
        }
        Ok(region)
    }

    pub(super) fn width(&self) -> u64 {
        self.xs.end.saturating_sub(self.xs.start).max(0) as u64
    }

    pub(super) fn height(&self) -> u64 {
        self.ys.end.saturating_sub(self.ys.start).max(0) as u64
    }

    pub(super) fn pixels(&self) -> u64 {
        self.width() * self.height()
    }

    /// Every pixel, row by row.
    pub(super) fn iter(&self) -> impl Iterator<Item = (i64, i64)> + use<'_> {
        self.ys.clone().flat_map(|y| self.xs.clone().map(move |x| (x, y)))
    }
}

/// The index of a pixel in a window, if it is inside.
pub(super) fn index(window: &Window, x: i64, y: i64) -> Option<usize> {
    window.index_of(i32::try_from(x).ok()?, i32::try_from(y).ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names as given, and as OpenImageIO 3.2.2 lists them after writing and reading an EXR.
    #[test]
    fn channels_stand_in_open_image_ios_order() {
        for (given, expected) in [
            ("B G R", "R G B"),
            ("AG Depth albedo.R AR variance.B alpha", "alpha AR AG Depth albedo.R variance.B"),
            ("Y green N.y N.z real l.A y", "green Y y real N.y N.z l.A"),
            ("U variance.B n.Y X z l.Z R", "R X z U l.Z n.Y variance.B"),
            (
                "Z albedo.B albedo.G albedo.R normal.Z normal.Y normal.X samples",
                "Z samples albedo.R albedo.G albedo.B normal.X normal.Y normal.Z",
            ),
            ("a.R a-x.R a+.R R", "R a+.R a-x.R a.R"),
            ("a A r R", "R r A a"),
            (".R R ..B a..B", "R .R ..B a..B"),
        ] {
            let names: Vec<&str> = given.split(' ').collect();
            let ordered: Vec<&str> = canonical_order(&names).into_iter().map(|i| names[i]).collect();
            assert_eq!(ordered.join(" "), expected);
        }
    }

    #[test]
    fn windows_far_apart_are_refused() {
        let a = Window::sized(1, 1);
        let b = Window { x: i32::MAX - 1, y: i32::MAX - 1, width: 1, height: 1 };
        assert!(matches!(Region::new(&a, &b, 1), Err(CompareError::RegionTooLarge { .. })));
    }
}
