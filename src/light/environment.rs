//! The environment as a light: radiance by direction, sampled in proportion to it.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::environment_table::{EnvironmentTable, EnvironmentTables, Partner};
use crate::color::Rgb;
use crate::math::{Real, warp};
use crate::scene::Image;
use crate::scene::environment::{Environment, EnvironmentMap, Equirectangular};
use crate::scene::texture::{Encoding, Wrap, whole_and_rest};

/// The environment, ready to be looked up and sampled.
#[derive(Debug)]
pub struct EnvironmentLight {
    scale: Rgb,
    map: Map,
    /// ∫ luminance dω, to the accuracy of one row's height.
    total_luminance: f64,
    sampled_luminance: f64,
}

/// A direction of an environment, as its image counts: fractions of a turn and of the polar angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPlace(Vec2);

#[derive(Debug)]
enum Map {
    Constant,
    Image(ImageMap),
}

#[derive(Debug)]
struct ImageMap {
    image: Arc<Image>,
    mapping: Equirectangular,
    /// Sine and cosine of the rotation about the up axis.
    rotation: [f32; 2],
    table: Arc<EnvironmentTable>,
}

impl EnvironmentLight {
    /// Prepares an environment; `image` is the one its map names, `partner` what else looks for its light. The table comes from
    /// `tables`.
    pub fn new(
        environment: &Environment,
        image: Option<&Arc<Image>>,
        partner: Partner,
        tables: &EnvironmentTables,
    ) -> Self {
        let scale = environment.color * environment.intensity;
        match (&environment.map, image) {
            (&EnvironmentMap::Image { mapping, .. }, Some(image)) => {
                let table = tables.get(image, mapping, partner);
                let total_luminance = table.total_luminance(scale);
                let sampled_luminance = total_luminance * table.share();
                let rotation = [Real::sin(environment.rotation), Real::cos(environment.rotation)];
                let map = Map::Image(ImageMap { image: Arc::clone(image), mapping, rotation, table });
                Self { scale, map, total_luminance, sampled_luminance }
            }
            _ => {
                let total_luminance = f64::from(scale.luminance()) * 4.0 * std::f64::consts::PI;
                // Nothing exceeds the mean.
                let sampled_luminance = if partner == Partner::Bsdf { 0.0 } else { total_luminance };
                Self { scale, map: Map::Constant, total_luminance, sampled_luminance }
            }
        }
    }

    /// ∫ luminance dω over the sphere, to the accuracy of one row's height.
    pub fn total_luminance(&self) -> f64 {
        self.total_luminance
    }

    /// How much of [`Self::total_luminance`] is for [`Self::sample`] to find: it decides how often the environment is chosen.
    pub fn sampled_luminance(&self) -> f64 {
        self.sampled_luminance
    }

    /// The radiance that arrives from the unit direction `wi`.
    pub fn radiance(&self, wi: Vec3) -> Rgb {
        self.radiance_at(self.place(wi))
    }

    /// A direction, where that is, and its density per unit solid angle, for light that falls on a surface of unit `normal`, or on none:
    /// from everywhere. `digits` continue those of `u`.
    pub fn sample(
        &self,
        normal: Option<Vec3>,
        u: [f32; 2],
        digits: [f32; 2],
    ) -> Option<(Vec3, SkyPlace, f32)> {
        match &self.map {
            Map::Constant => {
                let wi: Vec3 = warp::uniform_sphere(u).into();
                Some((wi, self.place(wi), 1.0 / (4.0 * PI)))
            }
            Map::Image(map) => {
                let (azimuth, cos_theta, pdf) = map.table.sample(map.turned(normal), u, digits)?;
                let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
                let wi = map.direction(azimuth, sin_theta, cos_theta).normalize();
                let polar = Real::atan2(sin_theta, cos_theta) / PI;
                Some((wi, SkyPlace(Vec2::new(azimuth, polar)), pdf))
            }
        }
    }

    /// Where a unit direction is.
    pub fn place(&self, wi: Vec3) -> SkyPlace {
        match &self.map {
            Map::Constant => SkyPlace(Vec2::ZERO),
            Map::Image(map) => SkyPlace(map.coordinates(wi)),
        }
    }

    /// The radiance that arrives from a place.
    pub fn radiance_at(&self, SkyPlace(uv): SkyPlace) -> Rgb {
        match &self.map {
            Map::Constant => self.scale,
            Map::Image(map) => map.interpolate(uv) * self.scale,
        }
    }

    /// The density of [`Self::sample`] per unit solid angle.
    pub fn pdf(&self, normal: Option<Vec3>, SkyPlace(uv): SkyPlace) -> f32 {
        match &self.map {
            Map::Constant => 1.0 / (4.0 * PI),
            Map::Image(map) => map.table.pdf(map.turned(normal), uv.x, uv.y),
        }
    }
}

impl ImageMap {
    /// The interpolated image at (u, v) in [0, 1]², v from the top.
    fn interpolate(&self, uv: Vec2) -> Rgb {
        let (w, h) = (self.image.width, self.image.height);
        let (x, y, wrap) = match self.mapping {
            Equirectangular::YUp => (uv.x * w as f32 - 0.5, uv.y * h as f32 - 0.5, Wrap::Repeat),
            Equirectangular::Aris => (uv.x * (w - 1) as f32, uv.y * (h - 1) as f32, Wrap::Clamp),
        };
        let ((x, tx), (y, ty)) = (whole_and_rest(x), whole_and_rest(y));
        let (x0, x1) = (wrap.pixel(x, w), wrap.pixel(x + 1, w));
        let (y0, y1) = (Wrap::Clamp.pixel(y, h), Wrap::Clamp.pixel(y + 1, h));
        let places = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
        let [a, b, c, d] = self.image.texels(places, Encoding::Linear).map(|texel| texel.color);
        a.lerp(b, tx).lerp(c.lerp(d, tx), ty)
    }

    /// Where in [0, 1]² a direction is: u by azimuth, v by the polar angle from the top.
    fn coordinates(&self, wi: Vec3) -> Vec2 {
        let [sin, cos] = self.rotation;
        // Beside the pole's cosine its sine: near the pole the cosine tells nothing.
        let (u, sin_theta, cos_theta) = match self.mapping {
            Equirectangular::YUp => {
                // The image turns by the rotation, the look-up against it.
                let (x, z) = (wi.x * cos - wi.z * sin, wi.x * sin + wi.z * cos);
                (0.5 + Real::atan2(z, x) / TAU, Vec2::new(x, z).length(), wi.y)
            }
            Equirectangular::Aris => {
                let (x, y) = (wi.x * cos + wi.y * sin, wi.y * cos - wi.x * sin);
                (0.5 - Real::atan2(y, x) / TAU, Vec2::new(x, y).length(), wi.z)
            }
        };
        Vec2::new(u, Real::atan2(sin_theta, cos_theta) / PI)
    }

    /// A surface's normal where the table has its directions.
    #[inline]
    fn turned(&self, normal: Option<Vec3>) -> Option<Vec3> {
        let [sin, cos] = self.rotation;
        normal.map(|n| match self.mapping {
            Equirectangular::YUp => Vec3::new(n.z * sin - n.x * cos, -(n.x * sin + n.z * cos), n.y),
            Equirectangular::Aris => Vec3::new(-(n.x * cos + n.y * sin), n.y * cos - n.x * sin, n.z),
        })
    }

    /// The direction at a fraction of a turn, and at a polar angle.
    fn direction(&self, u: f32, sin_theta: f32, cos_theta: f32) -> Vec3 {
        let [sin, cos] = self.rotation;
        let (sin_turn, cos_turn) = u.sin_cos_turn();
        match self.mapping {
            Equirectangular::YUp => {
                let (x, z) = (-sin_theta * cos_turn, -sin_theta * sin_turn);
                Vec3::new(x * cos + z * sin, cos_theta, z * cos - x * sin)
            }
            Equirectangular::Aris => {
                let (x, y) = (-sin_theta * cos_turn, sin_theta * sin_turn);
                Vec3::new(x * cos - y * sin, y * cos + x * sin, cos_theta)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{combine, unit_f32};
    use crate::scene::ImageId;
    use crate::scene::texture::Pixels;

    fn image(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Arc<Image> {
        let pixels =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
        Arc::new(Image { name: "test".into(), width, height, channels: 1, pixels: Pixels::F32(pixels) })
    }

    fn light(image: &Arc<Image>, mapping: Equirectangular, rotation: f32) -> EnvironmentLight {
        let map = EnvironmentMap::Image { image: ImageId(0), mapping };
        let environment = Environment { map, color: Rgb::WHITE, intensity: 1.0, rotation };
        EnvironmentLight::new(&environment, Some(image), Partner::None, &EnvironmentTables::default())
    }

    fn random(i: u32, salt: u64) -> f32 {
        unit_f32(combine(u64::from(i), salt) as u32)
    }

    /// Light from all sides, and on surfaces that face all ways.
    fn normals() -> impl Iterator<Item = Option<Vec3>> {
        let some = (0..12).map(|i| Some(warp::uniform_sphere([random(i, 7), random(i, 8)]).into()));
        std::iter::once(None).chain(some)
    }

    /// Both sides of E[f/pdf] = ∫ f: with a sun of one pixel, black halves and both mappings; of an image of few cells and one of several in each
    /// region.
    #[test]
    fn sampled_and_uniform_integrals_agree() {
        let value = |(x, y): (u32, u32), sun: (u32, u32), rows: u32| {
            if (x, y) == sun { 500.0 } else { (x % 3) as f32 * f32::from(y < rows) }
        };
        let coarse = image(16, 8, |x, y| value((x, y), (5, 2), 5));
        let fine = image(150, 75, |x, y| value((x, y), (40, 30), 45));
        for (picture, mapping) in [
            (&coarse, Equirectangular::YUp),
            (&coarse, Equirectangular::Aris),
            (&fine, Equirectangular::YUp),
            (&fine, Equirectangular::Aris),
        ] {
            let light = light(picture, mapping, 0.7);
            for normal in normals() {
                let cosine = |wi: Vec3| normal.map_or(1.0, |n| n.dot(wi).max(0.0));
                let f = |wi: Vec3| {
                    f64::from(light.radiance(wi).r) * f64::from(wi.x + 1.5) * f64::from(cosine(wi))
                };
                // Even over the image, so that none of its pixels is missed.
                let (columns, rows) = (picture.width * 8, picture.height * 8);
                let uniform: f64 = (0..columns * rows)
                    .map(|i| {
                        let (u, v) = ((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5);
                        let theta = v / rows as f32 * PI;
                        let map = match &light.map {
                            Map::Image(map) => map,
                            Map::Constant => panic!("an image"),
                        };
                        let wi = map.direction(u / columns as f32, Real::sin(theta), Real::cos(theta));
                        f(wi) * f64::from(Real::sin(theta))
                    })
                    .sum::<f64>()
                    * 2.0
                    * std::f64::consts::PI
                    * std::f64::consts::PI
                    / f64::from(columns * rows);
                let n = 20_000;
                let sampled: f64 = (0..n)
                    .filter_map(|i| {
                        light.sample(normal, [random(i, 3), random(i, 4)], [random(i, 5), random(i, 6)])
                    })
                    .map(|(wi, _, pdf)| f(wi) / f64::from(pdf))
                    .sum::<f64>()
                    / f64::from(n);
                assert!(
                    (uniform - sampled).abs() < 0.03 * uniform,
                    "{mapping:?} {normal:?}: {uniform} {sampled}"
                );
            }
        }
    }

    #[test]
    fn total_is_the_integral_over_the_sphere() {
        let picture = image(64, 32, |x, y| (x % 5 + y) as f32);
        for mapping in [Equirectangular::YUp, Equirectangular::Aris] {
            let light = light(&picture, mapping, 0.3);
            let n = 100_000;
            let sum: f64 = (0..n)
                .map(|i| {
                    f64::from(light.radiance(warp::uniform_sphere([random(i, 1), random(i, 2)]).into()).r)
                })
                .sum();
            let total = sum * 4.0 * std::f64::consts::PI / f64::from(n);
            assert!((total - light.total_luminance()).abs() < 0.01 * total, "{mapping:?}");
        }
    }

    #[test]
    fn pdf_is_that_of_the_sample() {
        let picture = image(32, 16, |x, y| (x + y * y) as f32);
        for mapping in [Equirectangular::YUp, Equirectangular::Aris] {
            let light = light(&picture, mapping, -1.2);
            for normal in normals() {
                let mut off = 0;
                for i in 0..2000 {
                    let (wi, _, pdf) = light.sample(normal, [random(i, 3), random(i, 4)], [0.5; 2]).unwrap();
                    // Rounding may carry a direction over a cell's edge.
                    off += u32::from((light.pdf(normal, light.place(wi)) - pdf).abs() > 1e-3 * pdf);
                }
                assert!(off < 4, "{mapping:?} {normal:?}: {off}");
            }
        }
    }

    #[test]
    fn nothing_bright_is_impossible() {
        let picture = image(8, 4, |x, y| f32::from((x, y) == (0, 1)));
        let light = light(&picture, Equirectangular::YUp, 0.0);
        for i in 0..5000 {
            let wi: Vec3 = warp::uniform_sphere([random(i, 1), random(i, 2)]).into();
            for normal in normals() {
                let is_seen = light.radiance(wi).r > 0.0 && normal.is_none_or(|n| n.dot(wi) > 0.0);
                assert!(!is_seen || light.pdf(normal, light.place(wi)) > 0.0, "{wi} {normal:?}");
            }
        }
    }

    #[test]
    fn directions_and_rotation_follow_the_convention() {
        // A bright column at u = ½ + 1/16, that is towards +x turned a little to +z.
        let picture = image(8, 4, |x, _| f32::from(x == 4));
        let straight = light(&picture, Equirectangular::YUp, 0.0);
        let angle = TAU / 16.0;
        let lit = Vec3::new(Real::cos(angle), 0.0, Real::sin(angle));
        assert!((straight.radiance(lit).r - 1.0).abs() < 1e-5);
        // Counter-clockwise seen from above takes +z to +x.
        let turned = light(&picture, Equirectangular::YUp, PI / 2.0);
        let moved = Vec3::new(lit.z, 0.0, -lit.x);
        assert!((turned.radiance(moved).r - 1.0).abs() < 1e-5);
    }
}
