//! Fields of the environment.

use std::path::Path;
use std::sync::Arc;

use super::ImageLoader;
use super::error::EditError;
use super::field::EnvironmentField;
use super::value::{self, Mismatch};
use crate::color::Rgb;
use crate::record::Value;
use crate::scene::environment::{EnvironmentMap, Equirectangular};
use crate::scene::texture::{Encoding, Pixels};
use crate::scene::{Environment, Image, ImageId, Scene};

/// What an environment is made of.
enum Kind {
    None,
    Constant,
}

/// Sets every field but the image. White of intensity 1 is made first where there is no environment.
pub(super) fn set(
    environment: &mut Option<Environment>,
    field: EnvironmentField,
    value: &Value,
) -> Result<(), Mismatch> {
    let made = |e: &mut Option<Environment>| e.take().unwrap_or_else(|| Environment::constant(Rgb::WHITE));
    match field {
        EnvironmentField::Kind => {
            let kind = value::choice(value, |name| match name {
                "none" => Some(Kind::None),
                "constant" => Some(Kind::Constant),
                _ => None,
            })?;
            *environment = match kind {
                Kind::None => None,
                Kind::Constant => Some(Environment { map: EnvironmentMap::Constant, ..made(environment) }),
            };
        }
        EnvironmentField::Color => {
            let color = value::color(value, f32::MAX)?;
            *environment = Some(Environment { color, ..made(environment) });
        }
        EnvironmentField::Intensity => {
            let intensity = value::not_negative(value)?;
            *environment = Some(Environment { intensity, ..made(environment) });
        }
        EnvironmentField::Rotation => {
            let rotation = value::any_degrees(value)?;
            *environment = Some(Environment { rotation, ..made(environment) });
        }
        EnvironmentField::Image => {
            value::text(value)?;
        }
    }
    Ok(())
}

/// Loads `file` as the environment's image. The mapping stays that of the image it replaces, and is y-up where there was none.
pub(super) fn set_image<M>(
    scene: &mut Scene<M>,
    file: &Path,
    load_image: &mut ImageLoader<'_>,
) -> Result<(), EditError> {
    let image = load_image(file).map_err(|cause| EditError::Image { file: file.to_owned(), cause })?;
    let image = radiance(image, file)?;
    let mapping = match scene.environment {
        Some(Environment { map: EnvironmentMap::Image { mapping, .. }, .. }) => mapping,
        _ => Equirectangular::YUp,
    };
    let id = ImageId(scene.images.len() as u32);
    scene.images.push(image);
    let before = scene.environment.take().unwrap_or_else(|| Environment::constant(Rgb::WHITE));
    scene.environment = Some(Environment { map: EnvironmentMap::Image { image: id, mapping }, ..before });
    Ok(())
}

/// Linear floats without negative values; 8 and 16 bits are decoded as sRGB.
fn radiance(image: Arc<Image>, file: &Path) -> Result<Arc<Image>, EditError> {
    let expected =
        (image.width as usize).saturating_mul(image.height as usize).saturating_mul(image.channels.into());
    let found = match &image.pixels {
        Pixels::U8(v) => v.len(),
        Pixels::U16(v) => v.len(),
        Pixels::F32(v) => v.len(),
        Pixels::Undecoded => 0,
    };
    if found != expected || found == 0 || !(1..=4).contains(&image.channels) {
        return Err(EditError::ImageSize { file: file.to_owned(), found, expected });
    }
    let Pixels::F32(values) = &image.pixels else {
        let (width, height) = (image.width, image.height);
        let mut values = Vec::with_capacity(width as usize * height as usize * 3);
        for y in 0..height {
            for x in 0..width {
                values.extend(image.texel(x, y, Encoding::Srgb).color.to_array());
            }
        }
        let name = image.name.clone();
        return Ok(Arc::new(Image { name, width, height, channels: 3, pixels: Pixels::F32(values) }));
    };
    if !values.iter().all(|v| v.is_finite()) {
        return Err(EditError::ImageNotFinite { file: file.to_owned() });
    }
    if values.iter().all(|v| *v >= 0.0) {
        return Ok(image);
    }
    let values = values.iter().map(|v| v.max(0.0)).collect();
    let Image { name, width, height, channels, .. } = (*image).clone();
    Ok(Arc::new(Image { name, width, height, channels, pixels: Pixels::F32(values) }))
}
