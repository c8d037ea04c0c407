//! Point, spot and directional lights, as KHR_lights_punctual defines them.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use super::bounds::{Cone, LightBounds};
use super::{Light, LightKind, LightPlace, LightSample};
use crate::math::Real;

/// Light sent out, in watts for colours in W/sr: how often the light is chosen depends on it.
pub(super) fn power(light: &Light, scene_radius: f32) -> f64 {
    let strength = f64::from(light.color.luminance()) * f64::from(light.intensity);
    let solid_angle = match light.kind {
        LightKind::Point { .. } => 4.0 * std::f64::consts::PI,
        LightKind::Spot { inner, outer, .. } => {
            let middle = 0.5 * (Real::cos(f64::from(inner)) + Real::cos(f64::from(outer)));
            2.0 * std::f64::consts::PI * (1.0 - middle)
        }
        // Irradiance times the scene's cross-section.
        LightKind::Directional { .. } => {
            std::f64::consts::PI * f64::from(scene_radius) * f64::from(scene_radius)
        }
    };
    strength * solid_angle
}

/// Light sent out straight ahead, in W/sr.
pub(super) fn intensity(light: &Light) -> f64 {
    f64::from(light.color.luminance()) * f64::from(light.intensity)
}

/// Where a spot's edge is hard: floats can't tell the cosine of a smaller angle from 1, nor bounds what is within it.
const COSINE_MARGIN: f32 = 1e-3;

/// Where a light is that has a place, and where it shines.
pub(super) fn bounds(light: &Light) -> LightBounds {
    let (place, axis, spread, emission) = match light.kind {
        LightKind::Point { position, .. } => (position, Vec3::Y, PI, FRAC_PI_2),
        LightKind::Spot { position, direction, inner, outer, .. } => {
            (position, direction, inner, (outer - inner).max(0.0) + COSINE_MARGIN)
        }
        LightKind::Directional { direction } => (Vec3::ZERO, direction, 0.0, 0.0),
    };
    let cone = Cone { axis, spread, emission, both_sides: false };
    LightBounds { low: place, high: place, intensity: 1.0, cone }
}

/// What arrives at `from`, if anything does; `probability` is that of choosing this light.
pub(super) fn sample(light: &Light, from: Vec3, probability: f32) -> Option<LightSample> {
    let color = light.color * light.intensity;
    let (position, range, falloff): (Vec3, Option<f32>, &dyn Fn(Vec3) -> f32) = match &light.kind {
        LightKind::Directional { direction } => {
            let place = LightPlace::Far { radiance: color, sky: None };
            return Some(LightSample { wi: -*direction, place, pdf: probability });
        }
        LightKind::Point { position, range } => (*position, *range, &|_| 1.0),
        LightKind::Spot { position, direction, inner, outer, range } => {
            (*position, *range, &|wi| cone(-wi.dot(*direction), *inner, *outer))
        }
    };
    let to_light = position - from;
    let distance_squared = to_light.length_squared();
    let wi = to_light.try_normalize()?;
    let arriving = color * (falloff(wi) * window(distance_squared, range) / distance_squared);
    let lit = arriving.is_finite() && !arriving.is_black();
    lit.then_some(LightSample {
        wi,
        place: LightPlace::Point { position, radiance: arriving },
        pdf: probability,
    })
}

/// KHR_lights_punctual's recommended angular attenuation: the square of a linear ramp between the cosines of the half angles.
fn cone(cos: f32, inner: f32, outer: f32) -> f32 {
    let (cos_inner, cos_outer) = (Real::cos(inner), Real::cos(outer));
    let scale = 1.0 / (cos_inner - cos_outer).max(0.001);
    let ramp = ((cos - cos_outer) * scale).clamp(0.0, 1.0);
    ramp * ramp
}

/// KHR_lights_punctual's recommended window: 1 near the light, 0 from `range` on.
fn window(distance_squared: f32, range: Option<f32>) -> f32 {
    let Some(range) = range else { return 1.0 };
    let ratio = distance_squared / (range * range);
    (1.0 - ratio * ratio).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgb;

    fn white(kind: LightKind) -> Light {
        Light { kind, color: Rgb::WHITE, intensity: 1.0 }
    }

    fn arriving(kind: LightKind, from: Vec3) -> f32 {
        match sample(&white(kind), from, 1.0).map(|s| s.place) {
            Some(LightPlace::Point { radiance, .. } | LightPlace::Far { radiance, .. }) => radiance.r,
            _ => 0.0,
        }
    }

    #[test]
    fn points_fall_with_the_square_of_the_distance_and_end_at_their_range() {
        let point = |range| LightKind::Point { position: Vec3::ZERO, range };
        assert_eq!(arriving(point(None), Vec3::X * 2.0), 0.25);
        assert_eq!(arriving(point(Some(2.0)), Vec3::X * 2.0), 0.0);
        assert!((arriving(point(Some(2.0)), Vec3::X) - (1.0 - 1.0 / 16.0)).abs() < 1e-6);
    }

    #[test]
    fn spots_shine_inside_their_cone_alone() {
        let spot =
            LightKind::Spot { position: Vec3::Y, direction: -Vec3::Y, inner: 0.3, outer: 0.6, range: None };
        assert_eq!(arriving(spot, Vec3::ZERO), 1.0);
        assert_eq!(arriving(spot, Vec3::X), 0.0);
        assert_eq!(arriving(spot, Vec3::Y * 2.0), 0.0);
        let edge = arriving(spot, Vec3::X * 0.5);
        assert!(edge > 0.0 && edge < 0.8);
    }

    #[test]
    fn the_light_itself_is_not_lit() {
        let point = LightKind::Point { position: Vec3::ZERO, range: None };
        assert_eq!(arriving(point, Vec3::ZERO), 0.0);
    }
}
