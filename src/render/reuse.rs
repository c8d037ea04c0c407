//! Paths that the pixels of a block share from their second surfaces on.
//!
//! A path x₀ (camera), x₁, x₂, … of one pixel is nearly as good for its neighbours: each joins their first surfaces x₁ to its x₂ (Bekaert,
//! Sbert and Halton 2002). So a pixel gets the light of all paths of its block for some shadow rays more, and its noise of indirect light falls
//! to little more than a block's share; neighbours' noise is alike then.
//!
//! It stays free of bias by multiple importance sampling, with the first surfaces of the block as given. Those that see x₂ from the same side
//! could each have sent a path there: with the densities pᵢ of BSDF sampling, times Gᵢ = |cos θ₂|/d², per area at x₂, pixel i counts of the path
//! that j sent there
//!
//! ```text
//! f(x₁ᵢ)·|cos θ₁|·Gᵢ · L(x₂ → x₁ᵢ) / Σₖ pₖ·Gₖ
//! ```
//!
//! which is the balance heuristic over the block. L is light sampled at x₂, and what the path found in the direction that it was sent to from
//! there. The BSDF at x₂ is asked for each viewer, and the density of that direction as well, so that the sum in its term is of pₖ·Gₖ·pₖ(x₂ →
//! x₃): no viewer's highlight is divided by another's small density. How light sampling, BSDF sampling and light paths are weighed against
//! each other is a function of each pixel's whole path, as it is without neighbours ([`super::from_light`]); the shares of the block sum to 1 in
//! each of the three ways. A viewer whose BSDF is black there, at x₁ or x₂, would have ended its own path: it has no share.

use glam::Vec3;
use smallvec::SmallVec;

use super::Prepared;
use super::direct::{Arriving, pdf_emission, transmittance};
use super::from_light::{FromLight, with_light};
use super::mis::{Heuristic, Rivals, Share, Strategies, power};
use super::path::{PathSample, Walk};
use super::surface::{Shading, Surface};
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::light::LightSample;

/// The pixels of a block: tiles are made of whole ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlockSize {
    /// Two columns of two.
    Four,
    /// Four columns of two: less noise still where neighbours see alike, for more rays.
    Eight,
}

/// The most pixels of a block.
pub(super) const MOST: usize = BlockSize::Eight.pixels() as usize;

impl BlockSize {
    /// All of them, in the order of their numbers.
    pub(super) const ALL: [Self; 2] = [Self::Four, Self::Eight];

    /// Columns and rows.
    pub(super) const fn sides(self) -> (u32, u32) {
        match self {
            Self::Four => (2, 2),
            Self::Eight => (4, 2),
        }
    }

    pub(super) const fn pixels(self) -> u32 {
        let (columns, rows) = self.sides();
        columns * rows
    }
}

/// The pixels of the block of so many columns and rows that one is in, row by row, where the picture ends before the column and row `end`.
pub(super) fn block_around(
    (x, y): (u32, u32),
    (width, height): (u32, u32),
    end: (u32, u32),
) -> impl Iterator<Item = (u32, u32)> {
    let from = |at: u32, side: u32, end: u32| (at - at % side)..(at - at % side + side).min(end);
    from(y, height, end.1).flat_map(move |y| from(x, width, end.0).map(move |x| (x, y)))
}

/// A surface that a path met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub(super) ray: Ray,
    pub(super) hit: Hit,
}

/// Light that was sampled at a second surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direct {
    wi: Vec3,
    /// After what is in between.
    radiance: Rgb,
    pdf: f32,
    /// What the path's own viewer sees reflected, and the density of sampling the direction.
    reflected: (Rgb, f32),
    /// The density of its own paths' start; 0 without light paths, and for lights without extent.
    emission: f32,
    /// How BSDF sampling shares it; none of lights without extent.
    heuristic: Option<Heuristic>,
}

/// The way on from a second surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Onward {
    wi: Vec3,
    /// As the light's.
    reflected: (Rgb, f32),
    /// The radiance of the light that it met first, how light sampling shares that, the density of sampling it at the surface, and that of
    /// its own paths' start.
    pub(super) met: Rgb,
    pub(super) heuristic: Heuristic,
    pub(super) pdf_light: f32,
    pub(super) emission: f32,
}

/// Light that was found farther on, and is weighed against light paths for each that joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Later {
    /// With its weight against the other way that camera paths find it.
    pub(super) radiance: Rgb,
    /// How many times as densely as both together light paths find it, but for what is before the way on.
    pub(super) light_paths: f32,
}

/// What others may use of a path.
#[derive(Clone, Debug, Default)]
pub(super) struct Trail {
    pub(super) is_kept: bool,
    pub(super) first: Option<Met>,
    /// The first surface's f·|cos θ|/pdf in the direction of the second one, and the density of sampling that; 0 where none may be shared.
    pub(super) weight: Rgb,
    pub(super) pdf: f32,
    pub(super) second: Option<Met>,
    pub(super) direct: Option<Direct>,
    pub(super) onward: Option<Onward>,
    pub(super) later: SmallVec<[Later; 4]>,
}

impl Trail {
    /// For a path that is its own.
    #[inline(always)]
    pub(super) fn unkept() -> Self {
        Self::default()
    }

    /// For a path of a block.
    #[inline(always)]
    pub(super) fn kept() -> Self {
        Self { is_kept: true, ..Self::default() }
    }

    /// The first surface sent the path on so that others may join.
    #[inline]
    pub(super) fn leads_on(&self) -> bool {
        self.first.is_some() && self.pdf > 0.0
    }
}

impl Direct {
    /// What arrives of a light sample, where the path's own viewer sees it reflected.
    #[inline]
    pub(super) fn new(
        scene: &Prepared,
        surface: &Surface<'_>,
        shading: &Shading<'_>,
        sample: &LightSample,
        rays: &mut u64,
    ) -> Option<Self> {
        let reflected = surface.reflected(shading, sample.wi);
        if reflected.0.is_black() {
            return None;
        }
        let arriving = Arriving::new(scene, surface, sample);
        if arriving.radiance.is_black() {
            return None;
        }
        *rays += 1;
        let radiance = arriving.radiance * arriving.passing(scene, surface.medium_towards(sample.wi, None));
        let heuristic = Heuristic::of(sample);
        let is_found = heuristic.is_some() && scene.light_paths.is_ok();
        let emission = if is_found { pdf_emission(scene, sample) } else { 0.0 };
        let (wi, pdf) = (sample.wi, sample.pdf);
        (!radiance.is_black()).then_some(Self { wi, radiance, pdf, reflected, emission, heuristic })
    }
}

impl Onward {
    /// For a direction that was sampled with the density `pdf`, and `weight` = f·|cos θ|/pdf.
    pub(super) fn new(wi: Vec3, weight: Rgb, pdf: f32) -> Self {
        let (met, heuristic) = (Rgb::BLACK, Heuristic::default());
        Self { wi, reflected: (weight * pdf, pdf), met, heuristic, pdf_light: 0.0, emission: 0.0 }
    }
}

/// A first surface.
struct Viewer<'a> {
    surface: &'a Surface<'a>,
    shading: Shading<'a>,
    from_light: FromLight,
}

/// How a viewer sees a second surface.
struct View<'a> {
    /// Whose it is.
    pixel: usize,
    /// From the second surface to the viewer.
    wo: Vec3,
    /// The viewer's f·|cos θ₁|·G.
    f: Rgb,
    /// The density of the second surface's place, per area there.
    density: f32,
    from_light: FromLight,
    shading: Shading<'a>,
}

/// How a viewer sees light that a second surface reflects.
struct Seen<'v, 'a> {
    view: &'v View<'a>,
    /// f·|cos θ₂|.
    f: Rgb,
    /// The density of its direction.
    pdf: f32,
    /// How light paths find it ([`FromLight::towards`]).
    towards: f32,
}

impl Walk {
    /// There is light that others may use.
    pub(super) fn is_lit_beyond(&self) -> bool {
        self.trail.direct.is_some() || self.lit_onward().is_some()
    }

    fn lit_onward(&self) -> Option<&Onward> {
        let is_dark = self.beyond().is_black() && self.trail.later.is_empty();
        self.trail.onward.as_ref().filter(|onward| !(is_dark && onward.met.is_black()))
    }
}

/// Gives what each path of a block found by itself and by joining the others, with its place in the block.
#[inline]
pub(super) fn gather(scene: &Prepared, block: &[Walk], found: impl FnMut((usize, &PathSample))) {
    // Few paths in arrays for many would be slow.
    match block.len() {
        0..=4 => gathered::<4>(scene, block).iter().take(block.len()).enumerate().for_each(found),
        _ => gathered::<MOST>(scene, block).iter().take(block.len()).enumerate().for_each(found),
    }
}

fn gathered<const PIXELS: usize>(scene: &Prepared, block: &[Walk]) -> [PathSample; PIXELS] {
    // Written where they stay: samples handed on would be copied several times, each waiting for the last.
    let mut samples = [PathSample::default(); PIXELS];
    for (sample, walk) in samples.iter_mut().zip(block) {
        *sample = walk.path();
    }
    if !block.iter().any(Walk::is_lit_beyond) {
        return samples;
    }
    let mut firsts: [Option<Surface<'_>>; PIXELS] = [const { None }; PIXELS];
    for (first, walk) in firsts.iter_mut().zip(block) {
        *first = walk.trail.first.as_ref().map(|met| Surface::new(scene, &met.ray, &met.hit));
    }
    let mut varying = [None; PIXELS];
    let mut viewers: [Option<Viewer<'_>>; PIXELS] = [const { None }; PIXELS];
    for ((viewer, walk), (first, varying)) in
        viewers.iter_mut().zip(block).zip(firsts.iter().zip(&mut varying))
    {
        if let (Some(surface), Some(met)) = (first, &walk.trail.first) {
            *viewer = surface.shading(scene, varying).map(|shading| {
                let mut from_light = FromLight::CAMERA;
                from_light.arrive(scene, &met.ray, surface);
                Viewer { surface, shading, from_light }
            });
        }
    }
    for (own, walk) in block.iter().enumerate() {
        join(scene, &viewers, own, walk, &mut samples);
    }
    samples
}

/// Joins the viewers to the second surface of `walk`, the path of the viewer `own`.
fn join<const PIXELS: usize>(
    scene: &Prepared,
    viewers: &[Option<Viewer<'_>>; PIXELS],
    own: usize,
    walk: &Walk,
    samples: &mut [PathSample; PIXELS],
) {
    let trail = &walk.trail;
    let (direct, onward) = (&trail.direct, walk.lit_onward());
    let Some(met) = trail.second.filter(|_| direct.is_some() || onward.is_some()) else { return };
    let second = Surface::new(scene, &met.ray, &met.hit);
    let mut varying = None;
    let Some(shading) = second.shading(scene, &mut varying) else { return };
    let Some(viewer) = &viewers[own] else { return };
    let own_view = viewer.own_view(scene, own, trail, &second, shading);
    let is_alone = !is_usual(own_view.density);
    let own_view = if is_alone { View { f: trail.weight, density: 1.0, ..own_view } } else { own_view };
    let mut views: [Option<View<'_>>; PIXELS] = [const { None }; PIXELS];
    if !is_alone {
        for (pixel, (view, viewer)) in views.iter_mut().zip(viewers).enumerate() {
            if let Some(viewer) = viewer
                && pixel != own
            {
                *view = viewer.view(scene, pixel, &second, &shading, &mut samples[pixel].rays);
            }
        }
    }
    views[own] = Some(own_view);
    let seen = |wi: Vec3, of_own: (Rgb, f32)| {
        // Light paths come to all viewers from the same side.
        let back = if scene.light_paths.is_ok() { second.shading_from(scene, &shading, wi) } else { None };
        let mut all: [Option<Seen<'_, '_>>; PIXELS] = [const { None }; PIXELS];
        for (seen, view) in all.iter_mut().zip(&views) {
            if let Some(view) = view {
                let reflected = if view.pixel == own { of_own } else { second.reflected(&view.shading, wi) };
                *seen = view.seen(&second, wi, reflected, back);
            }
        }
        all
    };
    let strategies = Strategies::of(scene);
    if let Some(direct) = direct {
        let seen = seen(direct.wi, direct.reflected);
        let density: f32 = seen.iter().flatten().map(|seen| seen.view.density).sum();
        for Seen { view, f, pdf, towards } in seen.into_iter().flatten() {
            let share = direct.heuristic.map_or(Share::ALL, |heuristic| {
                let light_paths = with_light(towards, || direct.emission) / direct.pdf;
                strategies.of_light(Rivals { camera: pdf / direct.pdf, light_paths, heuristic })
            });
            let scale = share.weight() / (density * direct.pdf);
            samples[view.pixel].radiance += view.f * f * direct.radiance * scale;
        }
    }
    if let Some(onward) = onward {
        let seen = seen(onward.wi, onward.reflected);
        let density: f32 = seen.iter().flatten().map(|seen| seen.view.density * seen.pdf).sum();
        for Seen { view, f, pdf, towards } in seen.into_iter().flatten().filter(|seen| seen.pdf > 0.0) {
            let way = towards / pdf;
            let (camera, heuristic) = (onward.pdf_light / pdf, onward.heuristic);
            let rivals = Rivals { camera, light_paths: with_light(way, || onward.emission), heuristic };
            let mut radiance = walk.beyond() + onward.met * strategies.of_bsdf(rivals).weight();
            for later in &trail.later {
                radiance += later.radiance * power(with_light(way, || later.light_paths));
            }
            samples[view.pixel].radiance += view.f * f * radiance / density;
        }
    }
}

/// A density of which products and quotients are numbers. A path whose own is none stays its pixel's alone, and no pixel has a share by one.
#[inline]
fn is_usual(density: f32) -> bool {
    (1e-20..1e20).contains(&density)
}

impl Viewer<'_> {
    /// How the path's own pixel sees its second surface.
    #[inline(always)]
    fn own_view<'s>(
        &self,
        scene: &Prepared,
        pixel: usize,
        trail: &Trail,
        second: &Surface<'_>,
        shading: Shading<'s>,
    ) -> View<'s> {
        let wo = second.wo;
        let distance_squared = second.point.distance_squared(self.surface.point);
        let density = trail.pdf * second.geometric_cosine(wo) / distance_squared;
        let from_light = self.towards(scene, -wo, trail.pdf);
        View { pixel, wo, f: trail.weight * density, density, from_light, shading }
    }

    /// How another path's second surface is seen, if it is.
    #[inline(always)]
    fn view<'s>(
        &self,
        scene: &Prepared,
        pixel: usize,
        second: &Surface<'_>,
        shading: &Shading<'s>,
        rays: &mut u64,
    ) -> Option<View<'s>> {
        let first = self.surface;
        let way = second.point - first.point;
        let distance_squared = way.length_squared();
        let wi = way / distance_squared.sqrt();
        if !(first.same_side(wi) && second.same_side(-wi)) {
            return None;
        }
        let (f, pdf) = first.reflected(&self.shading, wi);
        let geometry = second.geometric_cosine(wi) / distance_squared;
        let density = pdf * geometry;
        if f.is_black() || !is_usual(density) {
            return None;
        }
        let shading = second.shading_from(scene, shading, -wi)?;
        *rays += 1;
        if transmittance(scene, &first.reach(wi, second.leave(-wi).origin)).is_black() {
            return None;
        }
        let from_light = self.towards(scene, wi, pdf);
        Some(View { pixel, wo: -wi, f: f * geometry, density, from_light, shading })
    }

    /// What light paths know of the way to a second surface, sampled with the density `pdf`.
    #[inline(always)]
    fn towards(&self, scene: &Prepared, wi: Vec3, pdf: f32) -> FromLight {
        let mut from_light = self.from_light;
        from_light.scatter(from_light.towards(scene, self.surface, &self.shading, wi), pdf);
        from_light
    }
}

impl<'a> View<'a> {
    /// How it sees light from `wi`, if any is reflected; from there the second surface is seen as `back` says.
    #[inline(always)]
    fn seen(
        &self,
        second: &Surface<'_>,
        wi: Vec3,
        (f, pdf): (Rgb, f32),
        back: Option<Shading<'a>>,
    ) -> Option<Seen<'_, 'a>> {
        let towards = || self.from_light.towards_for(second, self.wo, wi, || back);
        (!f.is_black()).then(|| Seen { view: self, f, pdf, towards: towards() })
    }
}
