//! A picture of what differs.

use crate::raster::{Layer, Raster, Window};

use super::CompareError;
use super::view::{Region, View, index};

/// The absolute difference of two images' first layers times `scale`, over the region that holds both data windows.
///
/// Channels pair as in [`idiff`](mod@super::idiff): by their place in OpenImageIO's order, with the first image's names (the
/// second's beyond them); what an image lacks is 0. A difference with a value that is not finite is not finite, so it shows.
///
/// # Errors
/// If an image has no layers, a channel does not fill its window, or the windows are too far apart.
pub fn diff_image(a: &Raster, b: &Raster, scale: f32) -> Result<Raster, CompareError> {
    let first = |raster: &Raster, name: &str| match raster.layers.first() {
        Some(layer) => Ok(layer.clone()),
        None => Err(CompareError::NoLayers { name: name.into() }),
    };
    let (layer_a, layer_b) = (first(a, "the first image")?, first(b, "the second image")?);
    let (a, b) = (View::new(&layer_a)?, View::new(&layer_b)?);
    let channels = a.channels.len().max(b.channels.len());
    let region = Region::new(&a.window, &b.window, channels)?;
    let start = (region.xs.start, region.ys.start);
    let window = Window {
        // The region starts where one of the windows does, and is bounded.
        x: start.0 as i32,
        y: start.1 as i32,
        width: region.width() as u32,
        height: region.height() as u32,
    };
    let mut layer = Layer::new("difference", window);
    for channel in 0..channels {
        let named = a.channels.get(channel).or_else(|| b.channels.get(channel));
        let values = region
            .iter()
            .map(|(x, y)| {
                let of = |view: &View<'_>| view.value(channel, index(&view.window, x, y));
                (of(&a) - of(&b)).abs() * scale
            })
            .collect();
        let name = unused(&layer, named.map_or("", |c| &c.name));
        layer = layer.with(name, values);
    }
    Ok(Raster::single(layer))
}

/// The name, marked if the layer has one like it: the two images' names can overlap at different places.
fn unused(layer: &Layer, name: &str) -> String {
    let mut name = name.to_owned();
    while layer.channel(&name).is_some() {
        name.push('\'');
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_difference_covers_both_windows_and_is_scaled() {
        let a = Layer::new("", Window::sized(2, 1)).with("G", vec![1.0, 2.0]).with("R", vec![0.0, 0.5]);
        let b = Layer::new("", Window { x: 1, y: 0, width: 2, height: 1 }).with("R", vec![1.5, 4.0]);
        let diff = diff_image(&Raster::single(a), &Raster::single(b), 2.0).unwrap();
        let layer = diff.picture();
        assert_eq!(layer.window, Window::sized(3, 1));
        assert_eq!(layer.channel("R").unwrap().values, [0.0, 2.0, 8.0]);
        assert_eq!(layer.channel("G").unwrap().values, [2.0, 4.0, 0.0]);
    }

    #[test]
    fn names_that_overlap_stay_apart() {
        let a = Layer::new("", Window::sized(1, 1)).with("B", vec![1.0]);
        let b = Layer::new("", Window::sized(1, 1)).with("G", vec![1.0]).with("B", vec![3.0]);
        let diff = diff_image(&Raster::single(a), &Raster::single(b), 1.0).unwrap();
        let names: Vec<_> = diff.picture().channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["B", "B'"]);
    }
}
