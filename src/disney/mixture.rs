//! The whole Disney model: the lobes together, and how often each is sampled.

use super::bsdf::{BsdfSample, Lobe, scattered};
use super::clearcoat::Clearcoat;
use super::dielectric::{delta, refracted};
use super::diffuse::Diffuse;
use super::fresnel::{DielectricSplit, dielectric_split, schlick_weight};
use super::pair::Pair;
use super::parameter::{DiffuseModel, Masking, Params};
use super::sheen::Sheen;
use super::specular::{Schlick, Specular};
use super::transmission::{DiffuseTransmission, Passage, Refraction, Transmission};
use crate::color::Rgb;
use crate::math::warp::{cosine_hemisphere, uniform_hemisphere, uniform_hemisphere_pdf};
use crate::math::{Real, V3};

/// A Disney material at one point: its lobes with all that doesn't depend on directions precomputed; absent lobes are `None`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mixture<F> {
    pub(super) base_color: Rgb<F>,
    diffuse: Option<Diffuse<F>>,
    sheen: Option<Sheen<F>>,
    specular: Specular<F>,
    clearcoat: Option<Clearcoat<F>>,
    transmission: Option<Transmission<F>>,
    diffuse_transmission: Option<DiffuseTransmission<F>>,
    thin_walled: bool,
}

/// How often each sampler is chosen; they sum to 1, or are all 0 where nothing is scattered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Probabilities<F> {
    /// Diffuse and sheen, by the cosine.
    cosine: F,
    /// Diffuse, uniform over the hemisphere.
    uniform: F,
    clearcoat: F,
    /// Specular; with a rough interface, both what its facets reflect and what they refract.
    specular: F,
    /// Transmission that has a sampler of its own.
    transmission: F,
    diffuse_transmission: F,
}

/// The sampler that makes a direction.
#[derive(Clone, Copy, Debug)]
enum Choice {
    Cosine,
    Uniform,
    Clearcoat,
    Transmission,
    DiffuseTransmission,
    Specular,
}

impl<F: Real> Probabilities<F> {
    fn normalized(self) -> Self {
        let all = self.cosine + self.uniform + self.specular + self.clearcoat;
        let sum = all + (self.transmission + self.diffuse_transmission);
        if sum <= F::ZERO {
            return Self::default();
        }
        let scale = F::ONE / sum;
        Self {
            cosine: self.cosine * scale,
            uniform: self.uniform * scale,
            clearcoat: self.clearcoat * scale,
            specular: self.specular * scale,
            transmission: self.transmission * scale,
            diffuse_transmission: self.diffuse_transmission * scale,
        }
    }

    /// The sampler that `u` in [0, 1) stands for, and what is left of `u` as a number in [0, 1) for a choice within it.
    #[inline]
    fn choose(&self, u: F) -> (Choice, F) {
        let mut rest = u;
        for (choice, chance) in [
            (Choice::Cosine, self.cosine),
            (Choice::Uniform, self.uniform),
            (Choice::Clearcoat, self.clearcoat),
            (Choice::Transmission, self.transmission),
            (Choice::DiffuseTransmission, self.diffuse_transmission),
        ] {
            let beyond = rest - chance;
            if beyond < F::ZERO {
                return (choice, rest / chance);
            }
            rest = beyond;
        }
        (Choice::Specular, rest / self.specular)
    }
}

impl<F: Real> Mixture<F> {
    pub(super) fn new(params: &Params<F>, masking: Masking, diffuse: DiffuseModel) -> Self {
        let tint = tint(params.base_color);
        Self {
            base_color: params.base_color,
            diffuse: Diffuse::new(params, Schlick::of_base(params, tint), diffuse),
            sheen: Sheen::new(params, tint),
            specular: Specular::new(params, tint, masking),
            clearcoat: Clearcoat::new(params),
            transmission: Transmission::new(params),
            diffuse_transmission: DiffuseTransmission::new(params),
            thin_walled: params.thin_walled,
        }
    }

    /// Proportional to an estimate of what each lobe scatters towards `wo`: the mean over channels of its albedo. The only source of
    /// lobe probabilities. In front, a lobe that is there never has probability 0.
    #[inline]
    fn probabilities(&self, wo: V3<F>) -> Probabilities<F> {
        if wo.z < F::ZERO {
            return self.probabilities_inside(wo);
        }
        let (mut cosine, uniform) = self.diffuse.as_ref().map_or((F::ZERO, F::ZERO), |d| d.albedos(wo));
        if let Some(sheen) = &self.sheen {
            cosine += sheen.albedo(wo);
        }
        let clearcoat = self.clearcoat.as_ref().map_or(F::ZERO, |coat| coat.albedo(wo));
        let mut transmission = F::ZERO;
        let mut split = DielectricSplit::OPAQUE;
        let mut refracted = F::ZERO;
        if let Some(through) = &self.transmission {
            split = dielectric_split(wo.z, through.ior);
            match through.passage {
                Passage::Rough => refracted = through.mean * split.transmittance,
                Passage::Smooth => {
                    transmission = through.mean * split.transmittance * self.specular.unmasked(wo).sqr();
                }
                Passage::ThinSmooth => transmission = through.mean * split.transmittance,
                Passage::ThinRough(..) => {
                    let typical = dielectric_split(through.typical_cosine(wo), through.ior);
                    transmission = through.mean * typical.transmittance;
                }
            }
        }
        let specular = self.specular.albedo(wo, &split) + refracted;
        let diffuse_transmission = self.diffuse_transmission.as_ref().map_or(F::ZERO, |d| d.albedo);
        Probabilities { cosine, uniform, clearcoat, specular, transmission, diffuse_transmission }
            .normalized()
    }

    /// From inside there is nothing but the dielectric and diffuse transmission.
    fn probabilities_inside(&self, wo: V3<F>) -> Probabilities<F> {
        let mut chance = Probabilities::default();
        if let Some(through) = &self.transmission {
            let split = dielectric_split(wo.z.abs(), through.eta(wo));
            let reflected = self.specular.interface * split.reflectance;
            match through.passage {
                Passage::Rough => chance.specular = reflected + through.mean * split.transmittance,
                Passage::Smooth => {
                    // Beside a smooth passage the reflection may still be rough, where the indices match: never 0 then.
                    chance.specular =
                        if self.specular.is_delta { reflected } else { reflected + F::of(1e-6) };
                    chance.transmission = through.mean * split.transmittance;
                }
                Passage::ThinRough(..) | Passage::ThinSmooth => {}
            }
        }
        if let Some(diffuse) = self.diffuse_transmission.as_ref().filter(|_| !self.thin_walled) {
            chance.diffuse_transmission = diffuse.albedo;
        }
        chance.normalized()
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
        let (mut f, mut pdf) = self.specular_in_front(chance.specular, pair);
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

    #[inline]
    fn specular_in_front(&self, chance: F, pair: &Pair<F>) -> (Rgb<F>, F) {
        if self.specular.is_delta {
            return (Rgb::BLACK, F::ZERO);
        }
        let (shape, pdf) = self.specular.shape_with_pdf(pair);
        match &self.transmission {
            None => (self.specular.fresnel(pair.schlick, &DielectricSplit::OPAQUE) * shape, chance * pdf),
            Some(through) => {
                let split = dielectric_split(pair.cos_d, through.ior);
                let fresnel = self.specular.fresnel(pair.schlick, &split);
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
            Side::Outside => self.specular.fresnel(schlick_weight(cos_o), split).mean(),
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
        let above = |w: V3<F>| V3::new(w.x, w.y, w.z.abs());
        let unmasked = self.specular.unmasked(above(wo)) * self.specular.unmasked(above(wi));
        let factor = through.tint * (split.transmittance / eta.sqr() * unmasked);
        delta(wi, factor, chance, Lobe::DielectricTransmission, eta)
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
    let luminance = F::of(0.3) * color.r + F::of(0.6) * color.g + F::of(0.1) * color.b;
    if luminance > F::ZERO { color / luminance } else { Rgb::WHITE }
}
