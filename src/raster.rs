//! A float image with named layers: what a render makes, a file holds and a comparison reads.

use std::fmt;

/// A rectangle of pixels, possibly off the origin, as EXR's data and display windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Window {
    /// The leftmost column.
    pub x: i32,
    /// The topmost row.
    pub y: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Window {
    /// A window at the origin.
    pub const fn sized(width: u32, height: u32) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// The number of pixels.
    pub const fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The smallest window that holds both.
    pub fn union(&self, other: &Self) -> Self {
        let x = self.x.min(other.x);
        let y = self.y.min(other.y);
        let right = self.right().max(other.right());
        let bottom = self.bottom().max(other.bottom());
        Self { x, y, width: (right - i64::from(x)) as u32, height: (bottom - i64::from(y)) as u32 }
    }

    /// One past the rightmost column.
    pub const fn right(&self) -> i64 {
        self.x as i64 + self.width as i64
    }

    /// One past the lowest row.
    pub const fn bottom(&self) -> i64 {
        self.y as i64 + self.height as i64
    }

    /// The row-major index of a pixel, if it is inside.
    pub fn index_of(&self, x: i32, y: i32) -> Option<usize> {
        let inside =
            x >= self.x && y >= self.y && i64::from(x) < self.right() && i64::from(y) < self.bottom();
        inside.then(|| {
            (i64::from(y) - i64::from(self.y)) as usize * self.width as usize
                + (i64::from(x) - i64::from(self.x)) as usize
        })
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} × {}", self.width, self.height)?;
        if (self.x, self.y) != (0, 0) {
            write!(f, " at ({}, {})", self.x, self.y)?;
        }
        Ok(())
    }
}

/// How a channel is (or was) stored in a file; in memory it is always `f32`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SampleType {
    /// 32-bit float.
    #[default]
    F32,
    /// 16-bit float.
    F16,
    /// 32-bit unsigned integer.
    U32,
    /// 8-bit unsigned integer, scaled to [0, 1].
    U8,
    /// 16-bit unsigned integer, scaled to [0, 1].
    U16,
}

/// One plane of values, row-major, as many as the raster's window has pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The full name, such as `R` or `albedo.R`.
    pub name: String,
    /// The type in a file.
    pub stored_as: SampleType,
    /// One value a pixel.
    pub values: Vec<f32>,
}

impl Channel {
    /// A 32-bit float channel.
    pub fn new(name: impl Into<String>, values: Vec<f32>) -> Self {
        Self { name: name.into(), stored_as: SampleType::F32, values }
    }
}

/// A custom attribute of a file's header.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text.
    Text(String),
    /// A whole number.
    Int(i32),
    /// A float.
    Float(f32),
}

/// One part of an image file: channels over one data window.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The part's name, `beauty` or `data` in our own files; empty where a file gives none.
    pub name: String,
    /// Where the values are.
    pub window: Window,
    /// The planes, in the file's order.
    pub channels: Vec<Channel>,
    /// Custom attributes, by name, in order.
    pub attributes: Vec<(String, Attribute)>,
}

impl Layer {
    /// A layer without channels.
    pub fn new(name: impl Into<String>, window: Window) -> Self {
        Self { name: name.into(), window, channels: Vec::new(), attributes: Vec::new() }
    }

    /// Adds a 32-bit float channel.
    ///
    /// # Panics
    /// If the number of values is not the window's number of pixels.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: Vec<f32>) -> Self {
        assert_eq!(values.len(), self.window.pixels(), "a channel must fill its window");
        self.channels.push(Channel::new(name, values));
        self
    }

    /// The channel of that name.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// The attribute of that name.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, a)| a)
    }

    /// The R, G and B planes, if all are there.
    pub fn rgb(&self) -> Option<[&[f32]; 3]> {
        Some([&self.channel("R")?.values, &self.channel("G")?.values, &self.channel("B")?.values])
    }
}

/// An image file's content: one or more layers over a display window. There is always at least one layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// The picture's frame.
    pub display: Window,
    /// The parts; the first is the picture.
    pub layers: Vec<Layer>,
}

impl Raster {
    /// A raster of one layer whose window is the display window.
    pub fn single(layer: Layer) -> Self {
        Self { display: layer.window, layers: vec![layer] }
    }

    /// The layer of that name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|l| l.name == name)
    }

    /// The first layer: the picture.
    pub fn picture(&self) -> &Layer {
        &self.layers[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn union_holds_both_windows_and_indices_are_row_major() {
        let a = Window { x: -2, y: 1, width: 3, height: 2 };
        let b = Window::sized(4, 2);
        let u = a.union(&b);
        assert_eq!(u, Window { x: -2, y: 0, width: 6, height: 3 });
        assert_eq!(u.index_of(-2, 0), Some(0));
        assert_eq!(u.index_of(3, 2), Some(17));
        assert_eq!(u.index_of(4, 0), None);
    }
}
