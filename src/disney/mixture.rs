//! The whole Disney model: the lobes together.

use super::bsdf::{BsdfSample, Lobe, scattered};
use super::clearcoat::Clearcoat;
use super::dielectric::{delta, refracted};
use super::diffuse::Diffuse;
use super::fresnel::{DielectricSplit, Edge, dielectric_split};
use super::pair::Pair;
use super::parameter::{DiffuseModel, Masking, Params};
use super::probabilities::{Choice, Probabilities};
use super::sheen::Sheen;
use super::specular::{Schlick, Specular};
use super::transmission::{DiffuseTransmission, Passage, Refraction, Transmission};
use crate::color::Rgb;
use crate::math::warp::{cosine_hemisphere, uniform_hemisphere, uniform_hemisphere_pdf};
use crate::math::{Number, Real, V3};

/// A Disney material at one point: its lobes with all that doesn't depend on directions precomputed; absent lobes are `None`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture<F> {
    pub(super) base_color: Rgb<F>,
    pub(super) diffuse: Option<Diffuse<F>>,
    pub(super) sheen: Option<Sheen<F>>,
    pub(super) specular: Specular<F>,
    pub(super) clearcoat: Option<Clearcoat<F>>,
    pub(super) transmission: Option<Transmission<F>>,
    pub(super) diffuse_transmission: Option<DiffuseTransmission<F>>,
    pub(super) thin_walled: bool,
    /// Lobes are sampled equally often, however much they scatter.
    pub(super) equal_lobes: bool,
}

impl<F: Number> Mixture<F> {
    /// [`Self::eval_with_pdf`] of a mixture that transmits nothing and mirrors nothing.
    #[inline(always)]
    pub(super) fn opaque(&self, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        let (pair, is_there) = Pair::masked(wo, wi);
        let chance = self.estimates_of_reflection(wo, &DielectricSplit::OPAQUE).normalized();
        let (shape, pdf) = self.specular.shape_with_pdf(&pair);
        let specular = self.specular.fresnel(pair.edge, &DielectricSplit::OPAQUE) * shape;
        let (f, pdf) = self.with_other_reflection((specular, chance.specular * pdf), &chance, &pair);
        let there = |value: F| F::select(is_there, value, F::ZERO);
        (f.map(there), there(pdf))
    }

    /// Adds the lobes that reflect in front to the specular one's.
    #[inline(always)]
    fn with_other_reflection(
        &self,
        (mut f, mut pdf): (Rgb<F>, F),
        chance: &Probabilities<F>,
        pair: &Pair<F>,
    ) -> (Rgb<F>, F) {
        if let Some(diffuse) = &self.diffuse {
            f += diffuse.eval(pair);
            pdf += chance.uniform * uniform_hemisphere_pdf::<F>();
        }
        if let Some(sheen) = &self.sheen {
            f += sheen.eval(pair);
        }
        pdf += chance.cosine * pair.wi.z * F::FRAC_1_PI;
        if let Some(coat) = &self.clearcoat {
            let (f_coat, pdf_coat) = coat.eval_with_pdf(pair);
            f += Rgb::grey(f_coat);
            pdf += chance.clearcoat * pdf_coat;
        }
        (f, pdf)
    }
}

impl<F: Real> Mixture<F> {
    pub(super) fn new(params: &Params<F>, masking: Masking, diffuse: DiffuseModel) -> Self {
        let tint = tint(params.base_color);
        Self {
            base_color: params.base_color,
            diffuse: Diffuse::new(params, Schlick::complement(params, tint), diffuse),
            sheen: Sheen::new(params, tint),
            specular: Specular::new(params, tint, masking),
            clearcoat: Clearcoat::new(params),
            transmission: Transmission::new(params),
            diffuse_transmission: DiffuseTransmission::new(params),
            thin_walled: params.thin_walled,
            equal_lobes: false,
        }
    }

    /// The BSDF without its delta lobes, and the density of [`Self::sample`] per unit solid angle.
    #[inline]
    pub(super) fn eval_with_pdf(&self, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        self.eval_with_pdf_given(&self.probabilities(wo), wo, wi)
    }

    #[inline]
    fn eval_with_pdf_given(&self, chance: &Probabilities<F>, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        if let Some(pair) = Pair::new(wo, wi) {
            return self.reflected_in_front(chance, &pair);
        }
        match (wo.z < F::ZERO, wi.z < F::ZERO) {
            (true, true) => self.reflected_inside(chance, wo, wi),
            (false, true) | (true, false) if wo.z != F::ZERO && wi.z != F::ZERO => {
                self.transmitted(chance, wo, wi)
            }
            _ => (Rgb::BLACK, F::ZERO),
        }
    }

    #[inline]
    fn reflected_in_front(&self, chance: &Probabilities<F>, pair: &Pair<F>) -> (Rgb<F>, F) {
        let specular = self.specular_in_front(chance.specular, pair);
        self.with_other_reflection(specular, chance, pair)
    }

    #[inline]
    fn specular_in_front(&self, chance: F, pair: &Pair<F>) -> (Rgb<F>, F) {
        if self.specular.is_delta {
            return (Rgb::BLACK, F::ZERO);
        }
        let (shape, pdf) = self.specular.shape_with_pdf(pair);
        match &self.transmission {
            None => (self.specular.fresnel(pair.edge, &DielectricSplit::OPAQUE) * shape, chance * pdf),
            Some(through) => {
                let split = dielectric_split(pair.cos_d, through.ior);
                let fresnel = self.specular.fresnel(pair.edge, &split);
                let [reflected, _] = through.shares(fresnel.mean(), &split);
                (fresnel * shape, chance * pdf * reflected)
            }
        }
    }

    fn reflected_inside(&self, chance: &Probabilities<F>, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        let nothing = (Rgb::BLACK, F::ZERO);
        let Some(through) =
            self.transmission.as_ref().filter(|_| !self.thin_walled && !self.specular.is_delta)
        else {
            return nothing;
        };
        let Some(pair) = Pair::new(wo.mirrored_z(), wi.mirrored_z()) else { return nothing };
        let split = dielectric_split(pair.cos_d, through.eta(wo));
        let reflected = self.specular.interface * split.reflectance;
        let (shape, pdf) = self.specular.shape_with_pdf(&pair);
        let [share, _] = through.shares(reflected, &split);
        (Rgb::grey(reflected * shape), chance.specular * pdf * share)
    }

    fn transmitted(&self, chance: &Probabilities<F>, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        let from_inside = wo.z < F::ZERO;
        if from_inside && self.thin_walled {
            return (Rgb::BLACK, F::ZERO);
        }
        let (mut f, mut pdf) = self.specular_transmission(chance, wo, wi).unwrap_or((Rgb::BLACK, F::ZERO));
        if let Some(diffuse) = &self.diffuse_transmission {
            f += diffuse.value;
            pdf += chance.diffuse_transmission * wi.z.abs() * F::FRAC_1_PI;
        }
        (f, pdf)
    }

    fn specular_transmission(&self, chance: &Probabilities<F>, wo: V3<F>, wi: V3<F>) -> Option<(Rgb<F>, F)> {
        let through = self.transmission.as_ref()?;
        match &through.passage {
            Passage::Rough => {
                let (side, eta) = (Side::of(wo), through.eta(wo));
                let wo = side.upright(wo);
                let refraction = Refraction::new(wo, side.upright(wi), eta)?;
                let split = refraction.split();
                let specular = &self.specular;
                let (shape, pdf) =
                    refraction.shape_with_pdf(&specular.distribution, specular.masking_alpha, |m| {
                        specular.visible(wo, m)
                    });
                let [_, share] =
                    through.shares(self.reflected_by_facet(refraction.cos_o, side, &split), &split);
                Some((through.tint * (split.transmittance * shape), chance.specular * pdf * share))
            }
            Passage::ThinRough(distribution, alpha) => {
                let pair = Pair::new(wo, wi.mirrored_z())?;
                let (shape, pdf) = Transmission::thin_with_pdf(distribution, *alpha, &pair);
                let passing = dielectric_split(pair.cos_d, through.ior).transmittance;
                Some((through.tint * (passing * shape), chance.transmission * pdf))
            }
            Passage::Smooth | Passage::ThinSmooth => None,
        }
    }

    /// The part of light, the mean over channels, that a facet reflects.
    #[inline]
    fn reflected_by_facet(&self, cos_o: F, side: Side, split: &DielectricSplit<F>) -> F {
        match side {
            Side::Outside => self.specular.fresnel(Edge::at(cos_o), split).mean(),
            Side::Inside => self.specular.interface * split.reflectance,
        }
    }

    /// A direction by one of the samplers, chosen by `u_lobe`. `None` if it comes out on the wrong side of the horizon.
    #[inline]
    pub(super) fn sample(&self, wo: V3<F>, u_lobe: F, u: [F; 2]) -> Option<BsdfSample<F>> {
        if !(wo.z > F::ZERO || (wo.z < F::ZERO && self.has_inside())) {
            return None;
        }
        let chance = self.probabilities(wo);
        let (choice, u_choice) = chance.choose(u_lobe);
        let (wi, lobe, eta) = match choice {
            Choice::Cosine => (cosine_hemisphere(u), Lobe::Diffuse, F::ONE),
            Choice::Uniform => (uniform_hemisphere(u), Lobe::Diffuse, F::ONE),
            Choice::Clearcoat => (self.clearcoat.as_ref()?.sample(wo, u), Lobe::Clearcoat, F::ONE),
            Choice::DiffuseTransmission => {
                let up = cosine_hemisphere(u);
                (V3::new(up.x, up.y, up.z.copysign(-wo.z)), Lobe::DiffuseTransmission, F::ONE)
            }
            Choice::Transmission => {
                let through = self.transmission.as_ref()?;
                match &through.passage {
                    Passage::ThinRough(distribution, _) => {
                        (Transmission::sample_thin(distribution, wo, u), Lobe::Transmission, F::ONE)
                    }
                    _ => return self.sample_smooth_transmission(through, chance.transmission, wo),
                }
            }
            Choice::Specular if self.specular.is_delta => return self.sample_mirror(chance.specular, wo),
            Choice::Specular => self.sample_facet(wo, u_choice, u),
        };
        let goes_through = (wi.z < F::ZERO) != (wo.z < F::ZERO);
        if goes_through != lobe.is_transmission() || wi.z == F::ZERO {
            return None;
        }
        let (f, pdf) = self.eval_with_pdf_given(&chance, wo, wi);
        scattered(BsdfSample { f, wi, pdf, lobe, eta })
    }

    /// Reflection or refraction at a facet that is visible from `wo`; may end on the wrong side of the surface.
    #[inline]
    fn sample_facet(&self, wo: V3<F>, u_choice: F, u: [F; 2]) -> (V3<F>, Lobe, F) {
        let side = Side::of(wo);
        let upright = side.upright(wo);
        let normal = self.specular.sample_normal(upright, u);
        if let Some(through) = self.transmission.as_ref().filter(|t| matches!(t.passage, Passage::Rough)) {
            let eta = through.eta(wo);
            let cos_o = upright.dot(normal);
            let split = dielectric_split(cos_o, eta);
            let [reflected, transmitted] =
                through.shares(self.reflected_by_facet(cos_o, side, &split), &split);
            if transmitted > F::ZERO && u_choice >= reflected {
                let wi = normal * (cos_o / eta - split.cos_t) - upright * (F::ONE / eta);
                return (side.upright(wi.normalize()), Lobe::Transmission, eta);
            }
        }
        (side.upright(V3::reflect(upright, normal)), Lobe::Specular, F::ONE)
    }

    fn sample_mirror(&self, chance: F, wo: V3<F>) -> Option<BsdfSample<F>> {
        let through = self.transmission.as_ref()?;
        let side = Side::of(wo);
        let split = dielectric_split(wo.z.abs(), through.eta(wo));
        let upright = side.upright(wo);
        let factor = match side {
            Side::Outside => self.specular.mirrored(wo, &split),
            Side::Inside => {
                Rgb::grey(self.specular.interface * split.reflectance * self.specular.unmasked(upright).sqr())
            }
        };
        delta(V3::new(-wo.x, -wo.y, wo.z), factor, chance, Lobe::DielectricReflection, F::ONE)
    }

    fn sample_smooth_transmission(
        &self,
        through: &Transmission<F>,
        chance: F,
        wo: V3<F>,
    ) -> Option<BsdfSample<F>> {
        if self.thin_walled {
            let lobe = Lobe::StraightTransmission;
            return delta(-wo, self.straight_transmittance(wo)?, chance, lobe, F::ONE);
        }
        let eta = through.eta(wo);
        let split = dielectric_split(wo.z.abs(), eta);
        let wi = refracted(wo, split.cos_t, eta);
        let unmasked = self.unmasked_passage(wo, &split);
        let factor = through.tint * (split.transmittance / eta.sqr() * unmasked);
        delta(wi, factor, chance, Lobe::DielectricTransmission, eta)
    }

    /// The part of a smooth interface that G lets be seen from both ends of a path through it.
    #[inline]
    pub(super) fn unmasked_passage(&self, wo: V3<F>, split: &DielectricSplit<F>) -> F {
        let above = |w: V3<F>| V3::new(w.x, w.y, w.z.abs());
        let eta = self.transmission.as_ref().map_or(F::ONE, |through| through.eta(wo));
        let wi = refracted(wo, split.cos_t, eta);
        self.specular.unmasked(above(wo)) * self.specular.unmasked(above(wi))
    }

    /// What a clear sheet lets pass straight, none where light is bent, spread or blocked.
    #[inline]
    pub(super) fn straight_transmittance(&self, wo: V3<F>) -> Option<Rgb<F>> {
        let through = self.transmission.as_ref()?;
        matches!(through.passage, Passage::ThinSmooth)
            .then(|| through.tint * dielectric_split(wo.z.abs(), through.ior).transmittance)
    }

    /// Light from inside is scattered too.
    #[inline]
    fn has_inside(&self) -> bool {
        !self.thin_walled && (self.transmission.is_some() || self.diffuse_transmission.is_some())
    }

    /// Nothing but delta lobes.
    pub(super) fn is_delta(&self) -> bool {
        let smooth =
            |through: &Transmission<F>| matches!(through.passage, Passage::Smooth | Passage::ThinSmooth);
        self.specular.is_delta
            && self.transmission.as_ref().is_some_and(smooth)
            && self.diffuse.is_none()
            && self.sheen.is_none()
            && self.clearcoat.is_none()
            && self.diffuse_transmission.is_none()
    }

    /// The lobes that are there.
    pub(super) fn lobes(&self) -> Vec<Lobe> {
        let highlight = if self.specular.is_delta { Lobe::DielectricReflection } else { Lobe::Specular };
        let through = self.transmission.as_ref().map(|t| match t.passage {
            Passage::Rough | Passage::ThinRough(..) => Lobe::Transmission,
            Passage::Smooth => Lobe::DielectricTransmission,
            Passage::ThinSmooth => Lobe::StraightTransmission,
        });
        let there = [
            self.diffuse.as_ref().map(|_| Lobe::Diffuse),
            self.sheen.as_ref().map(|_| Lobe::Sheen),
            Some(highlight),
            self.clearcoat.as_ref().map(|_| Lobe::Clearcoat),
            through,
            self.diffuse_transmission.as_ref().map(|_| Lobe::DiffuseTransmission),
        ];
        there.into_iter().flatten().collect()
    }

    /// One lobe's part of the BSDF.
    pub(super) fn eval_lobe(&self, lobe: Lobe, wo: V3<F>, wi: V3<F>) -> Rgb<F> {
        let front = Pair::new(wo, wi);
        let (inside, opposite) = (wo.z < F::ZERO && wi.z < F::ZERO, wo.z * wi.z < F::ZERO);
        let unweighted = Probabilities::default();
        let part = match lobe {
            Lobe::Diffuse => self.diffuse.as_ref().zip(front).map(|(diffuse, pair)| diffuse.eval(&pair)),
            Lobe::Sheen => self.sheen.as_ref().zip(front).map(|(sheen, pair)| sheen.eval(&pair)),
            Lobe::Specular if inside => Some(self.reflected_inside(&unweighted, wo, wi).0),
            Lobe::Specular => front.map(|pair| self.specular_in_front(F::ZERO, &pair).0),
            Lobe::Clearcoat => {
                self.clearcoat.as_ref().zip(front).map(|(coat, pair)| Rgb::grey(coat.eval_with_pdf(&pair).0))
            }
            Lobe::Transmission if opposite && (wo.z > F::ZERO || self.has_inside()) => {
                self.specular_transmission(&unweighted, wo, wi).map(|(f, _)| f)
            }
            Lobe::DiffuseTransmission if opposite && (wo.z > F::ZERO || self.has_inside()) => {
                self.diffuse_transmission.as_ref().map(|d| d.value)
            }
            _ => None,
        };
        part.unwrap_or(Rgb::BLACK)
    }
}

/// The side of the surface that a direction is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Outside,
    Inside,
}

impl Side {
    #[inline]
    fn of<F: Real>(w: V3<F>) -> Self {
        if w.z < F::ZERO { Self::Inside } else { Self::Outside }
    }

    /// `w`, mirrored by the surface if this is the inside: what is inside comes to lie above, and the other way round.
    #[inline]
    fn upright<F: Real>(self, w: V3<F>) -> V3<F> {
        match self {
            Self::Outside => w,
            Self::Inside => w.mirrored_z(),
        }
    }
}

/// The base colour's hue: the colour over its approximate luminance 0.3 R + 0.6 G + 0.1 B, white for black (disney.brdf).
fn tint<F: Real>(color: Rgb<F>) -> Rgb<F> {
    // A luminance that is denormal has lost bits, or all of them. The factor is a power of two.
    let dim = color.max_channel() < F::of(1e-30);
    let color = if dim { color * F::of((1u64 << 60) as f64) } else { color };
    let luminance = F::of(0.3) * color.r + F::of(0.6) * color.g + F::of(0.1) * color.b;
    if luminance > F::ZERO { color / luminance } else { Rgb::WHITE }
}
