//! How the first surfaces of a block see a second one, four of them side by side.

use glam::{BVec4A, Vec3, Vec4};

use super::Prepared;
use super::direct::transmittance;
use super::from_light::{FromLight, towards};
use super::surface::{Shading, Surface};
use crate::color::Rgb;
use crate::disney::FourBsdfs;
use crate::math::{Frame, Number, V3};

/// How many are side by side.
pub(super) const LANES: usize = 4;

/// Each lane by itself.
const LANE: [BVec4A; LANES] = [
    BVec4A::new(true, false, false, false),
    BVec4A::new(false, true, false, false),
    BVec4A::new(false, false, true, false),
    BVec4A::new(false, false, false, true),
];

const NOWHERE: V3<Vec4> = V3 { x: Vec4::ZERO, y: Vec4::ZERO, z: Vec4::ZERO };

/// First surfaces.
pub(super) struct Viewers<'a> {
    surfaces: [Option<(&'a Surface<'a>, Shading<'a>)>; LANES],
    are_there: BVec4A,
    bsdfs: FourBsdfs,
    point: V3<Vec4>,
    normal: V3<Vec4>,
    are_front: BVec4A,
    frame: Frames,
    /// The camera in the frame.
    wo: V3<Vec4>,
    /// |cos| of the geometric normal towards the camera.
    to_camera: Vec4,
    /// What is known of light paths to there ([`FromLight::ratio`]).
    ratio: Vec4,
}

/// How viewers see a second surface.
#[derive(Clone, Copy)]
pub(super) struct Views {
    /// Those that see it.
    pub(super) are_there: BVec4A,
    /// The viewer's f·|cos θ₁|·G.
    pub(super) f: Rgb<Vec4>,
    /// The density of the second surface's place, per area there.
    pub(super) density: Vec4,
    /// The viewer from there, in the world and in the frame in which it is seen.
    to_viewer: V3<Vec4>,
    frame: Frames,
    wo: V3<Vec4>,
    /// |cos| of the geometric normal towards the viewer.
    to_camera: Vec4,
    /// As the viewer's.
    ratio: Vec4,
}

/// A second surface that viewers are joined to.
pub(super) struct Second<'a> {
    surface: &'a Surface<'a>,
    shading: Shading<'a>,
    bsdfs: FourBsdfs,
}

/// How viewers see light that a second surface reflects.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Those that see any.
    pub(super) are_there: BVec4A,
    /// f·|cos θ₂|.
    pub(super) f: Rgb<Vec4>,
    /// The density of its direction.
    pub(super) pdf: Vec4,
    /// How light paths find it ([`FromLight::towards`]).
    pub(super) towards: Vec4,
}

/// Shading frames side by side.
#[derive(Clone, Copy)]
struct Frames {
    tangent: V3<Vec4>,
    bitangent: V3<Vec4>,
    normal: V3<Vec4>,
}

impl Frames {
    fn beside(four: [Frame; LANES]) -> Self {
        Self {
            tangent: V3::beside(four.map(|frame| frame.tangent)),
            bitangent: V3::beside(four.map(|frame| frame.bitangent)),
            normal: V3::beside(four.map(|frame| frame.normal)),
        }
    }

    #[inline(always)]
    fn splat(frame: &Frame) -> Self {
        Self {
            tangent: V3::splat(frame.tangent),
            bitangent: V3::splat(frame.bitangent),
            normal: V3::splat(frame.normal),
        }
    }

    #[inline(always)]
    fn select(mask: BVec4A, yes: &Self, no: &Self) -> Self {
        Self {
            tangent: V3::select(mask, yes.tangent, no.tangent),
            bitangent: V3::select(mask, yes.bitangent, no.bitangent),
            normal: V3::select(mask, yes.normal, no.normal),
        }
    }

    #[inline(always)]
    fn local_from_world(&self, w: V3<Vec4>) -> V3<Vec4> {
        V3::new(self.tangent.dot(w), self.bitangent.dot(w), self.normal.dot(w))
    }
}

impl<'a> Viewers<'a> {
    /// Of surfaces that are there and scatter light, with what is known of light paths to them.
    pub(super) fn new(surfaces: [Option<(&'a Surface<'a>, Shading<'a>, FromLight)>; LANES]) -> Self {
        let frame = |viewer: &Option<(_, Shading<'_>, _)>| {
            viewer.map_or(Frame::from_normal(Vec3::Z), |(_, shading, _)| shading.frame)
        };
        let vector = |of: fn(&Surface<'_>) -> Vec3| {
            V3::beside(surfaces.map(|viewer| viewer.map_or(Vec3::Z, |(surface, ..)| of(surface))))
        };
        let locals = surfaces.map(|viewer| viewer.map_or(Vec3::Z, |(_, shading, _)| shading.wo.into()));
        let ratio = surfaces.map(|viewer| viewer.map_or(0.0, |(_, _, from_light)| from_light.ratio()));
        let normal = vector(|surface| surface.normal());
        Self {
            surfaces: surfaces.map(|viewer| viewer.map(|(surface, shading, _)| (surface, shading))),
            are_there: BVec4A::from_array(surfaces.map(|viewer| viewer.is_some())),
            bsdfs: FourBsdfs::new(surfaces.map(|viewer| viewer.map(|(_, shading, _)| shading.bsdf))),
            point: vector(|surface| surface.point),
            normal,
            are_front: BVec4A::from_array(
                surfaces.map(|viewer| viewer.is_some_and(|(surface, ..)| surface.is_front)),
            ),
            frame: Frames::beside(surfaces.each_ref().map(frame)),
            wo: V3::beside(locals),
            to_camera: vector(|surface| surface.wo).dot(normal).abs(),
            ratio: Vec4::from_array(ratio),
        }
    }

    /// The surface in a lane, if it is there.
    #[inline]
    pub(super) fn surface(&self, lane: usize) -> Option<&'a Surface<'a>> {
        self.surfaces[lane].map(|(surface, _)| surface)
    }

    /// How they see a second surface, but for the lane `except`. Counts the shadow rays of each.
    #[inline(always)]
    pub(super) fn views(
        &self,
        scene: &Prepared,
        second: &Second<'_>,
        except: Option<usize>,
        rays: &mut [u64; LANES],
    ) -> Views {
        let there = second.surface;
        let way = V3::splat(there.point) - self.point;
        let distance_squared = way.length_squared();
        let wi = way * (Vec4::ONE / distance_squared.sqrt());
        let to_viewer = -wi;
        let (cos_first, cos_second) = (self.normal.dot(wi), V3::splat(there.normal()).dot(to_viewer));
        let mut are_there = self.are_there
            & !(cos_first.above(Vec4::ZERO) ^ self.are_front)
            & !(cos_second.above(Vec4::ZERO) ^ all(there.is_front));
        let local = self.frame.local_from_world(wi);
        are_there &= !goes_through(self.wo, local);
        if let Some(lane) = except {
            are_there &= !LANE[lane];
        }
        let by_one = |lane: usize| {
            let one = self.surfaces[lane].as_ref();
            one.map(|(surface, shading)| surface.reflected(shading, wi.lane(lane))).unwrap_or_default()
        };
        let (f, pdf) = reflected(&self.bsdfs, are_there, self.wo, local, by_one);
        let to_camera = cos_second.abs();
        let geometry = to_camera / distance_squared;
        let density = pdf * geometry;
        are_there &= is_lit(f) & usual(density);

        // See the viewers from there.
        let mut frame = Frames::splat(&second.shading.frame);
        let is_alike = !(to_viewer.dot(frame.normal).above(Vec4::ZERO) ^ all(there.is_seen_in_front()));
        let is_alike = is_alike & all(!second.shading.is_turned);
        let mut wo = frame.local_from_world(to_viewer);
        for lane in lanes(are_there & !is_alike) {
            match there.shading_from(scene, &second.shading, to_viewer.lane(lane)) {
                Some(shading) => {
                    frame = Frames::select(LANE[lane], &Frames::splat(&shading.frame), &frame);
                    wo = V3::select(LANE[lane], V3::splat(shading.wo.into()), wo);
                }
                None => are_there &= !LANE[lane],
            }
        }
        for lane in lanes(are_there) {
            if let Some((first, _)) = &self.surfaces[lane] {
                rays[lane] += 1;
                let wi = wi.lane(lane);
                if transmittance(scene, &first.reach(wi, there.leave(-wi).origin)).is_black() {
                    are_there &= !LANE[lane];
                }
            }
        }
        let ratio = self.ratio_towards(cos_first.abs(), pdf);
        Views { are_there, f: f * geometry, density, to_viewer, frame, wo, to_camera, ratio }
    }

    /// What is known of light paths to a second surface, in a direction of such a |cos| and density.
    #[inline(always)]
    fn ratio_towards(&self, cos_first: Vec4, pdf: Vec4) -> Vec4 {
        let ratio = towards(self.ratio, cos_first, self.to_camera, Vec4::ONE) / pdf;
        Vec4::select(self.ratio.above(Vec4::ZERO), ratio, Vec4::ZERO)
    }
}

impl Views {
    /// Nobody sees it.
    pub(super) const NONE: Self = Self {
        are_there: BVec4A::FALSE,
        f: Rgb::BLACK,
        density: Vec4::ZERO,
        to_viewer: NOWHERE,
        frame: Frames { tangent: NOWHERE, bitangent: NOWHERE, normal: NOWHERE },
        wo: NOWHERE,
        to_camera: Vec4::ONE,
        ratio: Vec4::ZERO,
    };

    /// Puts in the viewer in a lane from which the path came to the second surface itself: with the density `pdf` of its direction.
    #[inline(always)]
    pub(super) fn set_own(
        &mut self,
        viewers: &Viewers<'_>,
        lane: usize,
        second: &Second<'_>,
        (f, density): (Rgb, f32),
        pdf: f32,
    ) {
        let Some(first) = viewers.surface(lane) else { return };
        let wo = second.surface.wo;
        let own = LANE[lane];
        let put = |value: Vec4, among: Vec4| Vec4::select(own, value, among);
        let cos_first = Vec4::splat(first.geometric_cosine(wo));
        *self = Self {
            are_there: self.are_there | own,
            f: Rgb::select(own, Rgb::splat(f), self.f),
            density: put(Vec4::splat(density), self.density),
            to_viewer: V3::select(own, V3::splat(wo), self.to_viewer),
            frame: Frames::select(own, &Frames::splat(&second.shading.frame), &self.frame),
            wo: V3::select(own, V3::splat(second.shading.wo.into()), self.wo),
            to_camera: put(Vec4::splat(second.surface.geometric_cosine(wo)), self.to_camera),
            ratio: put(viewers.ratio_towards(cos_first, Vec4::splat(pdf)), self.ratio),
        };
    }
}

impl<'a> Second<'a> {
    #[inline]
    pub(super) fn new(surface: &'a Surface<'a>, shading: Shading<'a>) -> Self {
        Self { surface, shading, bsdfs: FourBsdfs::alike(shading.bsdf) }
    }

    /// How it is seen from the light in the direction `wi`, where light paths ask.
    #[inline]
    pub(super) fn seen_from_light(&self, scene: &Prepared, wi: Vec3) -> Option<Shading<'a>> {
        if scene.light_paths.is_ok() { self.surface.shading_from(scene, &self.shading, wi) } else { None }
    }

    /// How viewers see light from `wi`, where it is seen from there as `back` says; what one of them sees is known.
    #[inline(always)]
    pub(super) fn seen(
        &self,
        views: &Views,
        wi: Vec3,
        back: Option<&Shading<'_>>,
        known: Option<(usize, (Rgb, f32))>,
    ) -> Seen {
        let local = views.frame.local_from_world(V3::splat(wi));
        let is_straight = goes_through(views.wo, local) ^ all(self.surface.same_side(wi));
        let bsdf = self.shading.bsdf;
        let by_one = |lane: usize| {
            let wi: V3<f32> = local.lane(lane).into();
            let (f, pdf) = bsdf.eval_with_pdf(views.wo.lane(lane).into(), wi);
            (f * wi.z.abs(), pdf)
        };
        let (mut f, mut pdf) = reflected(&self.bsdfs, views.are_there & is_straight, views.wo, local, by_one);
        if let Some((lane, (f_known, pdf_known))) = known {
            f = Rgb::select(LANE[lane], Rgb::splat(f_known), f);
            pdf = Vec4::select(LANE[lane], Vec4::splat(pdf_known), pdf);
        }
        let are_there = views.are_there & is_lit(f);
        Seen { are_there, f, pdf, towards: self.towards(views, wi, back) }
    }

    /// How light paths from `wi` find the viewers.
    #[inline(always)]
    fn towards(&self, views: &Views, wi: Vec3, back: Option<&Shading<'_>>) -> Vec4 {
        let are_found = views.ratio.above(Vec4::ZERO);
        let Some(back) = back.filter(|_| are_found.any()) else { return Vec4::ZERO };
        let local = Frames::splat(&back.frame).local_from_world(views.to_viewer);
        let by_one = |lane: usize| back.bsdf.eval_with_pdf(back.wo, local.lane(lane).into());
        let wo = V3::splat(back.wo.into());
        let (_, pdf) = reflected(&self.bsdfs, views.are_there & are_found, wo, local, by_one);
        let to_light = Vec4::splat(self.surface.geometric_cosine(wi));
        let found = towards(views.ratio, to_light, views.to_camera, pdf);
        Vec4::select(are_found, found, Vec4::ZERO)
    }
}

/// The BSDFs times |cos θi|, and the densities, in the lanes `asked`; `by_one` tells both of a lane that [`FourBsdfs`] does not know.
#[inline(always)]
fn reflected(
    bsdfs: &FourBsdfs,
    asked: BVec4A,
    wo: V3<Vec4>,
    wi: V3<Vec4>,
    by_one: impl Fn(usize) -> (Rgb, f32),
) -> (Rgb<Vec4>, Vec4) {
    let asked_bits = asked.bitmask();
    let (mut f, mut pdf) = (Rgb::BLACK, Vec4::ZERO);
    if asked_bits & bsdfs.has() != 0 {
        let (f_all, pdf_all) = bsdfs.eval_with_pdf(wo, wi);
        f = Rgb::select(asked, f_all * wi.z.abs(), Rgb::BLACK);
        pdf = Vec4::select(asked, pdf_all, Vec4::ZERO);
    }
    for lane in bits(asked_bits & !bsdfs.has()) {
        let (f_one, pdf_one) = by_one(lane);
        f = Rgb::select(LANE[lane], Rgb::splat(f_one), f);
        pdf = Vec4::select(LANE[lane], Vec4::splat(pdf_one), pdf);
    }
    (f, pdf)
}

#[inline(always)]
fn all(answer: bool) -> BVec4A {
    BVec4A::splat(answer)
}

/// The lanes of a mask.
#[inline(always)]
fn lanes(mask: BVec4A) -> impl Iterator<Item = usize> {
    bits(mask.bitmask())
}

#[inline(always)]
fn bits(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

#[inline(always)]
fn goes_through(wo: V3<Vec4>, wi: V3<Vec4>) -> BVec4A {
    Vec4::ZERO.above(wi.z) ^ Vec4::ZERO.above(wo.z)
}

/// Any channel is not 0.
#[inline(always)]
fn is_lit(f: Rgb<Vec4>) -> BVec4A {
    f.r.cmpne(Vec4::ZERO) | f.g.cmpne(Vec4::ZERO) | f.b.cmpne(Vec4::ZERO)
}

/// Densities of which products and quotients are numbers. A path whose own is none stays its pixel's alone, and no pixel has a share by one.
#[inline(always)]
pub(super) fn usual<F: Number>(density: F) -> F::Mask {
    density.above(F::of(1e-20)) & F::of(1e20).above(density)
}
