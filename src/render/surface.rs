//! A point where a path meets a surface: position, normals, shading frame and BSDF.

use glam::Vec3;

use super::Prepared;
use super::geometry::TrianglePoint;
use super::mapped_normal::keep_reflection_above;
use super::material::PreparedMaterial;
use super::medium::Medium;
use super::offset::Departure;
use crate::accel::{Hit, Ray};
use crate::color::Rgb;
use crate::disney::Bsdf;
use crate::light::{Gloss, Receiver};
use crate::math::{Frame, V3};
use crate::scene::material::Sides;

/// A hit with what is known before shading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface<'a> {
    pub(super) at: TrianglePoint<'a>,
    pub(super) material: &'a PreparedMaterial,
    pub(super) triangle: u32,
    pub(super) point: Vec3,
    departure: Departure,
    /// The geometric normal of the front side.
    normal: Vec3,
    /// Unit direction to where the path came from.
    pub(super) wo: Vec3,
    pub(super) is_front: bool,
}

/// The local frame of a surface with its BSDF.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shading<'s> {
    pub(super) frame: Frame,
    pub(super) bsdf: &'s Bsdf,
    /// The viewer in the frame.
    pub(super) wo: V3<f32>,
    /// The frame is not the one that others see the point in: it was turned to this viewer.
    pub(super) is_turned: bool,
}

impl<'a> Surface<'a> {
    /// What `ray` (of unit direction) hit.
    #[inline(always)]
    pub(super) fn new(scene: &'a Prepared, ray: &Ray, hit: &Hit) -> Self {
        let at = scene.geometry.at(hit);
        let departure = at.departure(&scene.geometry, ray, hit);
        let (point, normal) = (departure.point, departure.normal);
        let wo = -ray.direction;
        let material = scene.material_of(hit.triangle);
        Self {
            at,
            material,
            triangle: hit.triangle,
            point,
            departure,
            normal,
            wo,
            is_front: wo.dot(normal) >= 0.0,
        }
    }

    /// The same place as it is seen from the unit direction `wo`.
    #[inline]
    pub(super) fn seen_from(&self, wo: Vec3) -> Self {
        Self { wo, is_front: self.is_before(wo), ..*self }
    }

    /// The geometric normal of the front side.
    #[inline]
    pub(super) fn normal(&self) -> Vec3 {
        self.normal
    }

    /// |cos| between a unit direction and the geometric normal.
    #[inline]
    pub(super) fn geometric_cosine(&self, w: Vec3) -> f32 {
        w.dot(self.normal).abs()
    }

    /// Where it is in the world: `point` is relative to the geometry's origin.
    #[inline]
    pub(super) fn in_world(&self, scene: &Prepared) -> Vec3 {
        self.point + scene.geometry.origin()
    }

    /// The radiance that leaves towards the viewer.
    #[inline]
    pub(super) fn emitted(&self, scene: &Prepared) -> Rgb {
        self.material.emitted(&scene.scene, &self.at, self.is_front)
    }

    /// What the camera alone sees of it, maybe in mirrors and through glass.
    #[inline]
    pub(super) fn unlit(&self, scene: &Prepared) -> Rgb {
        self.material.unlit(&scene.scene, &self.at, self.is_front)
    }

    /// Frame and BSDF; none where the surface scatters nothing towards the viewer. A BSDF that varies is kept in `varying`.
    #[inline]
    pub(super) fn shading<'s>(
        &'s self,
        scene: &Prepared,
        varying: &'s mut Option<Bsdf>,
    ) -> Option<Shading<'s>> {
        let (frame, is_turned) = self.frame(scene)?;
        let wo = frame.local_from_world(self.wo);
        Some(Shading { frame, bsdf: self.material.bsdf(&scene.scene, &self.at, varying), wo, is_turned })
    }

    /// The shading frame, and whether it was turned to this viewer.
    ///
    /// The shading normal is turned to the viewer's geometric side, except for interfaces, whose inside is a place of its own.
    /// Where it still looks away from the viewer, at silhouettes of smooth meshes, one-sided materials are black, as in Aris;
    /// others fall back to the geometric normal.
    #[inline]
    fn frame(&self, scene: &Prepared) -> Option<(Frame, bool)> {
        let one_sided = self.material.sides == Sides::Front;
        let is_interface = self.material.is_interface;
        if one_sided && !self.is_front && !is_interface {
            return None;
        }
        let side = if self.is_front || is_interface { 1.0 } else { -1.0 };
        let frame = self.frame_around(scene, self.at.shading_normal(self.normal) * side);
        if self.shows(frame.normal, self.wo, self.is_front) {
            return Some((frame, self.material.has_normal_map()));
        }
        let is_black = one_sided && !is_interface;
        (!is_black).then(|| (Frame::from_normal(self.normal * side), true))
    }

    /// A viewer in the direction `w`, before the geometric front or not, sees the side that a shading normal says it sees.
    #[inline]
    fn shows(&self, normal: Vec3, w: Vec3, is_front: bool) -> bool {
        (w.dot(normal) > 0.0) == (is_front || !self.material.is_interface)
    }

    /// The viewer's shading normal points to its side: not inside an interface.
    #[inline]
    pub(super) fn is_seen_in_front(&self) -> bool {
        self.is_front || !self.material.is_interface
    }

    #[inline]
    fn is_before(&self, w: Vec3) -> bool {
        w.dot(self.normal) >= 0.0
    }

    /// How this place, seen as `shading` says, is seen from the direction `w`: in the same frame, unless frames depend on the viewer. None
    /// where it scatters nothing to there.
    #[inline]
    pub(super) fn shading_from<'s>(
        &self,
        scene: &Prepared,
        shading: &Shading<'s>,
        w: Vec3,
    ) -> Option<Shading<'s>> {
        let is_front = self.is_before(w);
        let is_same_side = is_front == self.is_front || self.material.is_interface;
        let is_same = !shading.is_turned && is_same_side && self.shows(shading.frame.normal, w, is_front);
        let (frame, is_turned) =
            if is_same { (shading.frame, false) } else { self.seen_from(w).frame(scene)? };
        Some(Shading { frame, bsdf: shading.bsdf, wo: frame.local_from_world(w), is_turned })
    }

    /// The shading normal on the front, of two-sided materials on the viewer's side.
    pub(super) fn front_normal(&self, scene: &Prepared) -> Vec3 {
        let one_sided = self.material.sides == Sides::Front;
        let normal = self.at.shading_normal(self.normal);
        match (self.is_front || self.material.is_interface, one_sided) {
            (true, _) => self.frame_around(scene, normal).normal,
            (false, true) => normal,
            (false, false) => self.frame_around(scene, -normal).normal,
        }
    }

    fn frame_around(&self, scene: &Prepared, normal: Vec3) -> Frame {
        let is_front = self.is_front || self.material.is_interface;
        self.material.frame(&scene.scene, &self.at, normal, is_front, |mapped| {
            // An interface's normal points outside, also where the viewer is inside.
            let side = if self.is_front == is_front { 1.0 } else { -1.0 };
            let towards_viewer = if self.is_front { self.normal } else { -self.normal };
            keep_reflection_above(mapped * side, towards_viewer, self.wo) * side
        })
    }

    /// The place as lights see it.
    #[inline]
    pub(super) fn receiver(&self) -> Receiver {
        let normal = if self.is_front { self.normal } else { -self.normal };
        let sides = if self.material.transmits { Sides::Both } else { Sides::Front };
        Receiver { point: self.point, normal, sides, gloss: None }
    }

    /// The same for the first surface that scatters a path, where what it mirrors to the viewer of `shading` counts in the choice of a light.
    #[inline]
    pub(super) fn receiver_for(&self, scene: &Prepared, shading: &Shading<'_>) -> Receiver {
        if !(scene.lights.has_choice() && scene.techniques.lights_by_gloss) {
            return self.receiver();
        }
        let highlight = shading.bsdf.highlight(shading.wo);
        let gloss = highlight
            .map(|(alpha_squared, part)| Gloss::new(self.wo, shading.frame.normal, alpha_squared, part));
        Receiver { gloss, ..self.receiver() }
    }

    /// Whether `wi` leaves on the viewer's side of the geometric surface.
    #[inline]
    pub(super) fn same_side(&self, wi: Vec3) -> bool {
        (wi.dot(self.normal) > 0.0) == self.is_front
    }

    /// The BSDF times |cos θi| for light from the unit direction `wi`, and the density of sampling it: both 0 where the shading normal has it on
    /// another side than the geometric one. `shading` is that of this viewer.
    #[inline]
    pub(super) fn reflected(&self, shading: &Shading<'_>, wi: Vec3) -> (Rgb, f32) {
        let local = shading.frame.local_from_world(wi);
        let goes_through = (local.z < 0.0) != (shading.wo.z < 0.0);
        if self.same_side(wi) == goes_through {
            return (Rgb::BLACK, 0.0);
        }
        let (f, pdf) = shading.bsdf.eval_with_pdf(shading.wo, local);
        (f * local.z.abs(), pdf)
    }

    /// The medium that `wi` leaves into, for a path that came through `arrived`: interfaces have one behind them and clear space in front.
    #[inline]
    pub(super) fn medium_towards(&self, wi: Vec3, arrived: Medium) -> Medium {
        match self.material.is_interface {
            false => arrived,
            true if wi.dot(self.normal) > 0.0 => None,
            true => self.material.absorption,
        }
    }

    /// The medium that the path came through, which was in `assumed` by what it knew: the back of an interface tells better.
    #[inline]
    pub(super) fn medium_before(&self, assumed: Medium) -> Medium {
        if self.material.is_interface && !self.is_front { self.material.absorption } else { assumed }
    }

    /// A ray from here that can't meet its own surface again, nor what lies in the same plane.
    #[inline]
    pub(super) fn leave(&self, direction: Vec3) -> Ray {
        self.departure.ray(direction)
    }

    /// The ray to a point of a light, ending just before it.
    #[inline]
    pub(super) fn reach(&self, wi: Vec3, target: Vec3) -> Ray {
        self.departure.reach(wi, target)
    }
}
