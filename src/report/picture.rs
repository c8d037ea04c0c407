//! A picture of a cell, and making it smaller.

use std::borrow::Cow;

use super::sheet::SheetError;
use crate::raster::Layer;

/// Three planes of linear light.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    width: u32,
    height: u32,
    rgb: [Cow<'a, [f32]>; 3],
}

impl<'a> Picture<'a> {
    /// The R, G and B planes of a layer, borrowed.
    ///
    /// # Errors
    /// If one of them is missing, the layer is empty, or a plane does not fill its window.
    pub fn of(layer: &'a Layer) -> Result<Self, SheetError> {
        let not_rgb = |why| SheetError::NotAPicture { layer: layer.name.clone(), why };
        let rgb = layer.rgb().ok_or_else(|| not_rgb("it has no channels R, G and B"))?;
        if layer.window.pixels() == 0 {
            return Err(not_rgb("it has no pixels"));
        }
        if rgb.iter().any(|plane| plane.len() != layer.window.pixels()) {
            return Err(not_rgb("a channel does not fill its window"));
        }
        Ok(Self { width: layer.window.width, height: layer.window.height, rgb: rgb.map(Cow::Borrowed) })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The size when it is made at most `width` columns wide, the aspect kept; it is never made larger.
    pub fn size_within(&self, width: u32) -> [u32; 2] {
        if self.width <= width {
            return [self.width, self.height];
        }
        let width = width.max(1);
        let height = (f64::from(self.height) * f64::from(width) / f64::from(self.width)).round();
        [width, (height as u32).max(1)]
    }

    /// The picture at most `width` columns wide. Each new pixel is the mean of the light on its area; a pixel that is not finite
    /// stays visible as one.
    pub fn shrunk(&self, width: u32) -> Picture<'a> {
        let [width, height] = self.size_within(width);
        if width == self.width {
            return self.clone();
        }
        let columns = spans(self.width, width);
        let rows = spans(self.height, height);
        let rgb = [0, 1, 2].map(|c| Cow::Owned(self.averaged(&self.rgb[c], &columns, &rows)));
        Picture { width, height, rgb }
    }

    /// The picture on its own, so that the layer may go.
    pub fn into_owned(self) -> Picture<'static> {
        let rgb = self.rgb.map(|plane| Cow::Owned(plane.into_owned()));
        Picture { width: self.width, height: self.height, rgb }
    }

    /// The pixel in a column and row that are inside.
    pub(crate) fn pixel(&self, x: u32, y: u32) -> [f32; 3] {
        let i = y as usize * self.width as usize + x as usize;
        [self.rgb[0][i], self.rgb[1][i], self.rgb[2][i]]
    }

    fn averaged(&self, plane: &[f32], columns: &[Span], rows: &[Span]) -> Vec<f32> {
        let mut means = Vec::with_capacity(columns.len() * rows.len());
        for row in rows {
            let area = row.sum_of_weights();
            let mut sums = vec![0.0f64; columns.len()];
            for (y, weight) in row.weights() {
                let line = &plane[y * self.width as usize..][..self.width as usize];
                for (sum, column) in sums.iter_mut().zip(columns) {
                    let across: f64 = column.weights().map(|(x, w)| w * f64::from(line[x])).sum();
                    *sum += weight * across / column.sum_of_weights();
                }
            }
            means.extend(sums.iter().map(|sum| (sum / area) as f32));
        }
        means
    }
}

/// The part of a line of pixels that one new pixel covers, its ends possibly inside a pixel.
#[derive(Clone, Copy, Debug)]
struct Span {
    start: f64,
    end: f64,
    last: usize,
}

/// The spans of `new` pixels over `old` ones.
fn spans(old: u32, new: u32) -> Vec<Span> {
    let edge = |i: u32| f64::from(i) * f64::from(old) / f64::from(new);
    (0..new).map(|i| Span { start: edge(i), end: edge(i + 1), last: old as usize - 1 }).collect()
}

impl Span {
    /// Each pixel it touches with the share that it covers.
    fn weights(self) -> impl Iterator<Item = (usize, f64)> {
        let last = ((self.end.ceil() as usize).saturating_sub(1)).min(self.last);
        (self.start as usize..=last)
            .map(move |i| {
                let share = self.end.min((i + 1) as f64) - self.start.max(i as f64);
                (i, share)
            })
            .filter(|(_, share)| *share > 0.0)
    }

    fn sum_of_weights(self) -> f64 {
        self.weights().map(|(_, w)| w).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Window;

    fn layer(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Layer {
        let plane: Vec<f32> =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
        Layer::new("beauty", Window::sized(width, height))
            .with("R", plane.clone())
            .with("G", plane.clone())
            .with("B", plane)
    }

    #[test]
    fn halving_takes_the_mean_of_the_light() {
        let layer = layer(4, 2, |x, y| (x + 4 * y) as f32);
        let small = Picture::of(&layer).unwrap().shrunk(2);
        assert_eq!((small.width(), small.height()), (2, 1));
        assert_eq!(small.pixel(0, 0), [2.5; 3]);
        assert_eq!(small.pixel(1, 0), [4.5; 3]);
    }

    #[test]
    fn any_ratio_keeps_the_mean_and_a_constant() {
        let ramp = layer(101, 67, |x, y| (x * 3 + y * y) as f32);
        let mean = |p: &Picture| {
            let sum: f64 =
                (0..p.height()).flat_map(|y| (0..p.width()).map(move |x| f64::from(p.pixel(x, y)[1]))).sum();
            sum / f64::from(p.width() * p.height())
        };
        let whole = Picture::of(&ramp).unwrap();
        for width in [1, 2, 37, 50, 100] {
            let small = whole.shrunk(width);
            assert_eq!(small.width(), width);
            assert!((mean(&small) / mean(&whole) - 1.0).abs() < 1e-6, "{width}");
        }
        let flat = layer(101, 67, |_, _| 0.3);
        let small = Picture::of(&flat).unwrap().shrunk(29);
        assert!((0..29).all(|x| small.pixel(x, 3) == [0.3; 3]));
    }

    #[test]
    fn nothing_is_enlarged_and_what_is_not_finite_spreads() {
        let layer = layer(6, 3, |x, _| if x == 3 { f32::NAN } else { 1.0 });
        let picture = Picture::of(&layer).unwrap();
        assert_eq!(picture.shrunk(50).width(), 6);
        let small = picture.shrunk(3);
        assert!(small.pixel(1, 0)[0].is_nan());
        assert_eq!(small.pixel(2, 0), [1.0; 3]);
    }

    #[test]
    fn a_layer_that_is_no_picture_is_refused() {
        let depth = Layer::new("data", Window::sized(1, 1)).with("Z", vec![1.0]);
        assert!(matches!(Picture::of(&depth), Err(SheetError::NotAPicture { .. })));
        let mut torn = layer(2, 2, |_, _| 0.0);
        torn.channels[1].values.pop();
        assert!(matches!(Picture::of(&torn), Err(SheetError::NotAPicture { .. })));
        assert!(matches!(Picture::of(&layer(0, 4, |_, _| 0.0)), Err(SheetError::NotAPicture { .. })));
    }
}
