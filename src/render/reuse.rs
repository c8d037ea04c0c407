//! Paths that the pixels of a block share from their second surfaces on.
//!
//! A path x₀ (camera), x₁, x₂, … of one pixel is nearly as good for its neighbours: each joins their first surfaces x₁ to its x₂ (Bekaert,
//! Sbert and Halton 2002). So a pixel gets the light of all paths of its block for some shadow rays more, and its noise of indirect light falls
//! to little more than a block's share; neighbours' noise is alike then. Four first surfaces join side by side ([`super::viewers`]).
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

use glam::{BVec4A, Vec3, Vec4};
use smallvec::SmallVec;

use super::Prepared;
use super::direct::{Arriving, pdf_emission};
use super::from_light::{FromLight, with_light};
use super::mis::{Heuristic, Rivals, Share, Strategies, power};
use super::path::{PathSample, Walk};
use super::surface::{Shading, Surface};
use super::viewers::{LANES, Second, Seen, Viewers, Views, usual};
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::light::LightSample;
use crate::math::Number;

/// The pixels of a block: tiles are made of whole ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlockSize {
    /// Two columns of two.
    Four,
    /// Four columns of two: less noise still where neighbours see alike, for more rays.
    Eight,
    /// Four of four: the least noise.
    Sixteen,
}

/// The most pixels of a block.
pub(super) const MOST: usize = BlockSize::Sixteen.pixels() as usize;

impl BlockSize {
    /// All of them, in the order of their numbers.
    pub(super) const ALL: [Self; 3] = [Self::Four, Self::Eight, Self::Sixteen];

    /// Columns and rows.
    pub(super) const fn sides(self) -> (u32, u32) {
        match self {
            Self::Four => (2, 2),
            Self::Eight => (4, 2),
            Self::Sixteen => (4, 4),
        }
    }

    /// Its pixels cannot have numbers of samples of their own.
    pub(super) fn is_large(self) -> bool {
        self != Self::Four
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

/// What four pixels of a block found.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    radiance: Rgb<Vec4>,
    rays: [u64; LANES],
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
pub(super) fn gather(scene: &Prepared, block: &[Walk], mut found: impl FnMut((usize, &PathSample))) {
    if !block.iter().any(Walk::is_lit_beyond) {
        return block.iter().enumerate().for_each(|(pixel, walk)| found((pixel, &walk.path())));
    }
    match block.len() {
        0..=4 => joined::<1>(scene, block, found),
        5..=8 => joined::<2>(scene, block, found),
        _ => joined::<4>(scene, block, found),
    }
}

/// The same where there is something to join, in a block of so many times four.
fn joined<const FOURS: usize>(scene: &Prepared, block: &[Walk], mut found: impl FnMut((usize, &PathSample))) {
    let joined = radiances::<FOURS>(scene, block);
    for (pixel, walk) in block.iter().enumerate() {
        let (own, Found { radiance, rays }) = (walk.path(), joined[pixel / LANES]);
        let rays = own.rays + rays[pixel % LANES];
        found((pixel, &PathSample { radiance: radiance.lane(pixel % LANES), rays, ..own }));
    }
}

/// The radiance of all paths of a block, and the rays that joining them took.
#[inline(always)]
fn radiances<const FOURS: usize>(scene: &Prepared, block: &[Walk]) -> [Found; FOURS] {
    let mut found: [Found; FOURS] = std::array::from_fn(|four| {
        let own =
            |lane: usize| block.get(four * LANES + lane).map_or(Rgb::BLACK, |walk| walk.path().radiance);
        Found { radiance: Rgb::beside(std::array::from_fn(own)), rays: [0; LANES] }
    });
    let mut firsts: [[Option<Surface<'_>>; LANES]; FOURS] = [const { [const { None }; LANES] }; FOURS];
    let mut varying = [const { [const { None }; LANES] }; FOURS];
    for (walk, first) in block.iter().zip(firsts.as_flattened_mut()) {
        *first = walk.trail.first.as_ref().map(|met| Surface::new(scene, &met.ray, &met.hit));
    }
    let mut rest = block.iter().zip(firsts.as_flattened().iter().zip(varying.as_flattened_mut()));
    let mut viewer = || {
        let (walk, (surface, varying)) = rest.next()?;
        let (surface, met) = (surface.as_ref()?, walk.trail.first.as_ref()?);
        let shading = surface.shading(scene, varying)?;
        let mut from_light = FromLight::CAMERA;
        from_light.arrive(scene, &met.ray, surface);
        Some((surface, shading, from_light))
    };
    let viewers: [Viewers<'_>; FOURS] =
        std::array::from_fn(|_| Viewers::new(std::array::from_fn(|_| viewer())));
    for (own, walk) in block.iter().enumerate() {
        join(scene, &viewers, own, walk, &mut found);
    }
    found
}

/// Joins the viewers to the second surface of `walk`, the path of the viewer `own`.
#[inline(always)]
fn join<const FOURS: usize>(
    scene: &Prepared,
    viewers: &[Viewers<'_>; FOURS],
    own: usize,
    walk: &Walk,
    found: &mut [Found; FOURS],
) {
    let trail = &walk.trail;
    let (direct, onward) = (&trail.direct, walk.lit_onward());
    let Some(met) = trail.second.filter(|_| direct.is_some() || onward.is_some()) else { return };
    let surface = Surface::new(scene, &met.ray, &met.hit);
    let mut varying = None;
    let Some(shading) = surface.shading(scene, &mut varying) else { return };
    let (own_four, own_lane) = (own / LANES, own % LANES);
    let Some(first) = viewers[own_four].surface(own_lane) else { return };
    let second = Second::new(&surface, shading);
    let geometry = surface.geometric_cosine(surface.wo) / surface.point.distance_squared(first.point);
    let density = trail.pdf * geometry;
    let is_alone = !usual(density);
    let own_view = if is_alone { (trail.weight, 1.0) } else { (trail.weight * density, density) };
    let views: [Views; FOURS] = std::array::from_fn(|four| {
        let is_own = four == own_four;
        let except = is_own.then_some(own_lane);
        let mut views = match is_alone {
            true => Views::NONE,
            false => viewers[four].views(scene, &second, except, &mut found[four].rays),
        };
        if is_own {
            views.set_own(&viewers[four], own_lane, &second, own_view, trail.pdf);
        }
        views
    });
    let seen = |wi: Vec3, of_own: (Rgb, f32)| -> [Seen; FOURS] {
        let back = second.seen_from_light(scene, wi);
        std::array::from_fn(|four| {
            let known = (four == own_four).then_some((own_lane, of_own));
            second.seen(&views[four], wi, back.as_ref(), known)
        })
    };
    let strategies = Strategies::of(scene);
    if let Some(direct) = direct {
        let seen = seen(direct.wi, direct.reflected);
        let density = sum(views.iter().zip(&seen).map(|(views, seen)| (views.density, seen.are_there)));
        let (pdf, emission) = (Vec4::splat(direct.pdf), Vec4::splat(direct.emission));
        let scale = Vec4::ONE / Vec4::splat(density * direct.pdf);
        for ((views, seen), found) in views.iter().zip(&seen).zip(found.iter_mut()) {
            let share = direct.heuristic.map_or(Share::ALL, |heuristic| {
                let light_paths = with_light(seen.towards, || emission) / pdf;
                strategies.of_light(Rivals { camera: seen.pdf / pdf, light_paths, heuristic })
            });
            let radiance = Rgb::splat(direct.radiance) * (share.weight() * scale);
            found.add(views.f * seen.f * radiance, seen.are_there);
        }
    }
    if let Some(onward) = onward {
        let seen = seen(onward.wi, onward.reflected);
        let are_possible = |seen: &Seen| seen.are_there & seen.pdf.above(Vec4::ZERO);
        let densities =
            views.iter().zip(&seen).map(|(views, seen)| (views.density * seen.pdf, are_possible(seen)));
        let density = Vec4::splat(sum(densities));
        for ((views, seen), found) in views.iter().zip(&seen).zip(found.iter_mut()) {
            let way = seen.towards / seen.pdf;
            let rivals = Rivals {
                camera: Vec4::splat(onward.pdf_light) / seen.pdf,
                light_paths: with_light(way, || Vec4::splat(onward.emission)),
                heuristic: onward.heuristic,
            };
            let met = Rgb::splat(onward.met) * strategies.of_bsdf(rivals).weight();
            let mut radiance = Rgb::splat(walk.beyond()) + met;
            for later in &trail.later {
                let share = power(with_light(way, || Vec4::splat(later.light_paths)));
                radiance += Rgb::splat(later.radiance) * share;
            }
            found.add(views.f * seen.f * radiance / density, are_possible(seen));
        }
    }
}

impl Found {
    /// Adds radiance that some of them find.
    #[inline(always)]
    fn add(&mut self, radiance: Rgb<Vec4>, who: BVec4A) {
        self.radiance += Rgb::select(who, radiance, Rgb::BLACK);
    }
}

/// The sum over all lanes of what is there: one after the other, so that every machine rounds alike.
#[inline(always)]
fn sum(fours: impl Iterator<Item = (Vec4, BVec4A)>) -> f32 {
    let there = fours.map(|(four, are_there)| Vec4::select(are_there, four, Vec4::ZERO));
    there.flat_map(|four| four.to_array()).sum()
}
