//! Lights without a surface, and the environment.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Affine3A, Mat3A, Vec3, Vec3A};

use super::Told;
use super::element::Element;
use crate::convert::Quality;
use crate::imagefile::{ImageFileError, Interleaved, encode_texture};
use crate::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use crate::scene::light::{Light, LightKind};
use crate::scene::texture::{Encoding, Image};
use crate::scene::{Material, Scene};

/// The file with the environment's image.
pub(super) const ENVIRONMENT: &str = "environment.exr";

/// The emitter of a light without a surface.
pub(super) fn emitter(light: &Light) -> (Element, Vec<Told>) {
    let strength = light.color * light.intensity;
    let mut told = Vec::new();
    let ends = ("light", Quality::Dropped, "Mitsuba's light does not end at a range");
    let element = match light.kind {
        LightKind::Point { position, range } => {
            told.extend(range.map(|_| ends));
            Element::plugin("emitter", "point")
                .vector("point", "position", position)
                .rgb("intensity", strength)
        }
        LightKind::Directional { direction } => Element::plugin("emitter", "directional")
            .vector("vector", "direction", direction)
            .rgb("irradiance", strength),
        LightKind::Spot { position, direction, inner, outer, range } => {
            told.extend(range.map(|_| ends));
            let reason = "between the cones Mitsuba's light falls linearly with the angle, ours with the square of a ramp in its cosine: half-way it is about 1.3 times as bright";
            told.push(("light", Quality::Approximated, reason));
            // The two angles must differ.
            let inner = inner.min(outer * 0.999);
            Element::plugin("emitter", "spot")
                .rgb("intensity", strength)
                .float("cutoff_angle", outer.to_degrees())
                .float("beam_width", inner.to_degrees())
                .transform("to_world", looking(position, direction))
        }
    };
    (element, told)
}

/// The place from which z points along `direction`.
fn looking(position: Vec3, direction: Vec3) -> Affine3A {
    let (x, y) = direction.any_orthonormal_pair();
    Affine3A { matrix3: Mat3A::from_cols(x.into(), y.into(), direction.into()), translation: position.into() }
}

/// The emitter of an environment.
pub(super) fn environment(environment: &Environment, scene: &Scene<Material>) -> (Element, Option<Told>) {
    let EnvironmentMap::Image { mapping, image } = environment.map else {
        let radiance = environment.color * environment.intensity;
        return (Element::plugin("emitter", "constant").rgb("radiance", radiance), None);
    };
    let image = &scene.images[image.0 as usize];
    // In Mitsuba the image begins at -z and goes on over x, with y up. Ours begins at -x and goes on over -z; Aris' begins at -x and
    // goes on over y, with z up and the first column's middle, not its edge, at the beginning.
    let (turned, told) = match mapping {
        Equirectangular::YUp => (Mat3A::from_rotation_y(environment.rotation + FRAC_PI_2), None),
        Equirectangular::Aris => {
            let half_a_column = PI / columns(image.width, mapping) as f32;
            let axes = Mat3A::from_cols(Vec3A::Y, Vec3A::Z, Vec3A::X);
            let reason = "Aris' image ends where it begins, Mitsuba's goes on: the last column is the first";
            let told = ("environment", Quality::Approximated, reason);
            (Mat3A::from_rotation_z(environment.rotation + half_a_column) * axes, Some(told))
        }
    };
    let to_world = Affine3A { matrix3: turned, translation: Vec3A::ZERO };
    let element = Element::plugin("emitter", "envmap").string("filename", ENVIRONMENT);
    let element = element.transform("to_world", to_world);
    (element, told)
}

/// The environment's radiance as Mitsuba interpolates it: columns with their centres at half-integers, rows from pole to pole.
///
/// # Errors
/// If the image is too large to be encoded.
pub(super) fn environment_image(
    environment: &Environment,
    mapping: Equirectangular,
    image: &Image,
) -> Result<Vec<u8>, ImageFileError> {
    let scale = environment.color * environment.intensity;
    let (width, height) = (columns(image.width, mapping), image.height);
    let texel = |x: u32, y: u32| image.texel(x, y, Encoding::Linear).color * scale;
    let rows: Vec<[u32; 2]> = match mapping {
        // Ours have their centres at half-integers: every second row is one of them, and between them lies what is interpolated.
        Equirectangular::YUp => {
            (0..=2 * height).map(|row| [row.saturating_sub(1) / 2, (row / 2).min(height - 1)]).collect()
        }
        Equirectangular::Aris => (0..height).map(|row| [row, row]).collect(),
    };
    let values: Vec<f32> = rows
        .iter()
        .flat_map(|&[a, b]| (0..width).flat_map(move |x| texel(x, a).lerp(texel(x, b), 0.5).to_array()))
        .collect();
    encode_texture(width, rows.len() as u32, 3, Interleaved::F32(&values))
}

/// How many columns of an image go round the circle.
fn columns(width: u32, mapping: Equirectangular) -> u32 {
    match mapping {
        Equirectangular::YUp => width,
        // From the first column's middle to the last one's.
        Equirectangular::Aris => (width - 1).max(1),
    }
}
