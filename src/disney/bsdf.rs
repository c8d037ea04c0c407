//! The BSDF as the integrator sees it.

use super::dielectric::{Dielectric, sample_mirror};
use super::mixture::Mixture;
use super::parameter::{DiffuseModel, Masking, Params};
use crate::color::Rgb;
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Real, V3};

/// The part of a BSDF that a sampled direction was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lobe {
    /// Diffuse reflection with subsurface; directions are sampled for it and the sheen together.
    Diffuse,
    /// The grazing component for cloth; its directions count as [`Self::Diffuse`].
    Sheen,
    /// The base layer's highlight.
    Specular,
    /// The coat's highlight.
    Clearcoat,
    /// Transmission by a rough interface or sheet.
    Transmission,
    /// Light that passes diffusely.
    DiffuseTransmission,
    /// A perfect mirror.
    Mirror,
    /// Reflection by a smooth dielectric.
    DielectricReflection,
    /// Refraction by a smooth dielectric.
    DielectricTransmission,
    /// Through a clear thin sheet, not bent: shadow rays pass it too.
    StraightTransmission,
}

impl Lobe {
    /// The name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Sheen => "sheen",
            Self::Specular => "specular",
            Self::Clearcoat => "clearcoat",
            Self::Transmission => "transmission",
            Self::DiffuseTransmission => "diffuse transmission",
            Self::Mirror => "mirror",
            Self::DielectricReflection => "delta reflection",
            Self::DielectricTransmission => "delta transmission",
            Self::StraightTransmission => "straight transmission",
        }
    }

    /// The lobe holds single directions: its pdf is a discrete probability, and no other sampler can find them.
    #[inline]
    pub const fn is_delta(self) -> bool {
        matches!(
            self,
            Self::Mirror
                | Self::DielectricReflection
                | Self::DielectricTransmission
                | Self::StraightTransmission
        )
    }

    /// Light leaves on the other side than the viewer's.
    #[inline]
    pub const fn is_transmission(self) -> bool {
        matches!(
            self,
            Self::Transmission
                | Self::DiffuseTransmission
                | Self::DielectricTransmission
                | Self::StraightTransmission
        )
    }
}

/// A sampled direction to the light.
///
/// `f`·|cos θi|/`pdf` is the weight that the path's throughput is multiplied with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample<F = f32> {
    /// The BSDF without the cosine, of all lobes together. For a delta lobe: the factor of Dirac's delta, over |cos θi|.
    pub f: Rgb<F>,
    /// To the light, unit length.
    pub wi: V3<F>,
    /// Per unit solid angle, of all lobes together; a discrete probability for a delta lobe. Above 0.
    pub pdf: F,
    /// The lobe that the direction was made for.
    pub lobe: Lobe,
    /// The refractive index on `wi`'s side over the one on `wo`'s; 1 for reflection, and where light isn't bent.
    pub eta: F,
}

/// The sample of a lobe that isn't a delta, `None` where no direction was found: its density is 0 then.
#[inline]
pub(super) fn scattered<F: Real>(sample: BsdfSample<F>) -> Option<BsdfSample<F>> {
    (sample.pdf > F::ZERO && sample.pdf.is_finite()).then_some(sample)
}

/// How a surface scatters light at one point, in the local frame whose z is the shading normal.
///
/// Directions are unit vectors that point away from the surface. z < 0 is the inside of an interface or the far side of a thin sheet.
/// What doesn't transmit is black from behind, and so is a thin sheet: a two-sided material turns the frame first.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<F = f32> {
    pub(super) kind: Kind<F>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Kind<F> {
    Disney(Mixture<F>),
    Lambert { base_color: Rgb<F> },
    Mirror,
    Dielectric(Dielectric<F>),
}

impl<F: Real> Bsdf<F> {
    /// All of Burley 2012, with the transmission of Burley 2015. Parameters are taken to be in range; [`super::Parameter::check`] tells.
    pub fn disney(params: &Params<F>, masking: Masking, diffuse: DiffuseModel) -> Self {
        Self { kind: Kind::Disney(Mixture::new(params, masking, diffuse)) }
    }

    /// Lambert's base_color/π.
    pub fn diffuse(base_color: Rgb<F>) -> Self {
        Self { kind: Kind::Lambert { base_color } }
    }

    /// A perfect mirror of reflectance 1.
    pub fn mirror() -> Self {
        Self { kind: Kind::Mirror }
    }

    /// A smooth interface between clear media; `ior` > 0 is the refractive index inside (z < 0) over outside.
    pub fn dielectric(ior: F) -> Self {
        Self { kind: Kind::Dielectric(Dielectric { ior }) }
    }

    /// The same, but [`Self::sample`] chooses each lobe that is there equally often: for measuring what choosing them by their albedo is
    /// worth.
    #[must_use]
    pub fn with_equal_lobes(mut self) -> Self {
        if let Kind::Disney(mixture) = &mut self.kind {
            mixture.equal_lobes = true;
        }
        self
    }

    /// The square of the alpha of the highlight towards `wo`, and its part of what is reflected there, about; none where there is none,
    /// from behind, or where light passes.
    #[inline]
    pub fn highlight(&self, wo: V3<F>) -> Option<(F, F)> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.highlight(wo),
            Kind::Lambert { .. } | Kind::Mirror | Kind::Dielectric(_) => None,
        }
    }

    /// The BSDF without the cosine and without its delta lobes.
    #[inline]
    pub fn eval(&self, wo: V3<F>, wi: V3<F>) -> Rgb<F> {
        self.eval_with_pdf(wo, wi).0
    }

    /// The density of [`Self::sample`] per unit solid angle of `wi`, without its delta lobes.
    ///
    /// Its integral is 1 less the probability of delta lobes and of samples that come out on the wrong side of the horizon, for which
    /// `sample` returns `None`.
    #[inline]
    pub fn pdf(&self, wo: V3<F>, wi: V3<F>) -> F {
        self.eval_with_pdf(wo, wi).1
    }

    /// The values of [`Self::eval`] and [`Self::pdf`], for less than the two.
    #[inline]
    pub fn eval_with_pdf(&self, wo: V3<F>, wi: V3<F>) -> (Rgb<F>, F) {
        match &self.kind {
            Kind::Disney(mixture) => mixture.eval_with_pdf(wo, wi),
            Kind::Lambert { base_color } if wo.z > F::ZERO && wi.z > F::ZERO => {
                (*base_color * F::FRAC_1_PI, cosine_hemisphere_pdf(wi.z))
            }
            Kind::Lambert { .. } | Kind::Mirror | Kind::Dielectric(_) => (Rgb::BLACK, F::ZERO),
        }
    }

    /// A direction to the light for a path that comes along `wo`, from numbers in [0, 1): `u_lobe` chooses the lobe and `u` the
    /// direction within it.
    ///
    /// `None` where the path ends: nothing is scattered to `wo`'s side, or the direction came out on the wrong one.
    #[inline]
    pub fn sample(&self, wo: V3<F>, u_lobe: F, u: [F; 2]) -> Option<BsdfSample<F>> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.sample(wo, u_lobe, u),
            Kind::Lambert { base_color } if wo.z > F::ZERO => {
                let wi = cosine_hemisphere(u);
                let (f, pdf) = (*base_color * F::FRAC_1_PI, cosine_hemisphere_pdf(wi.z));
                scattered(BsdfSample { f, wi, pdf, lobe: Lobe::Diffuse, eta: F::ONE })
            }
            Kind::Lambert { .. } => None,
            Kind::Mirror => sample_mirror(wo),
            Kind::Dielectric(dielectric) => dielectric.sample(wo, u_lobe),
        }
    }

    /// The lobes that are there, for looking into a material.
    pub fn lobes(&self) -> Vec<Lobe> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.lobes(),
            Kind::Lambert { .. } => vec![Lobe::Diffuse],
            Kind::Mirror => vec![Lobe::Mirror],
            Kind::Dielectric(_) => vec![Lobe::DielectricReflection, Lobe::DielectricTransmission],
        }
    }

    /// One lobe's part of [`Self::eval`], black for delta lobes and lobes that aren't there; the parts sum to the whole.
    pub fn eval_lobe(&self, lobe: Lobe, wo: V3<F>, wi: V3<F>) -> Rgb<F> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.eval_lobe(lobe, wo, wi),
            Kind::Lambert { .. } if lobe == Lobe::Diffuse => self.eval(wo, wi),
            Kind::Lambert { .. } | Kind::Mirror | Kind::Dielectric(_) => Rgb::BLACK,
        }
    }

    /// The largest channel that a sample's weight f·|cos θi|/pdf may have, rounding aside, if `lobe` was sampled from `wo`: a function
    /// of the angle, derived in `bound` and tested by [`super::stress`].
    pub fn weight_bound(&self, wo: V3<F>, lobe: Lobe) -> F {
        match &self.kind {
            Kind::Disney(mixture) => mixture.weight_bound(wo, lobe),
            Kind::Lambert { base_color } => base_color.max_channel(),
            Kind::Dielectric(dielectric) if lobe.is_transmission() => F::ONE / dielectric.eta(wo).sqr(),
            Kind::Mirror | Kind::Dielectric(_) => F::ONE,
        }
    }

    /// Nothing but delta lobes: next-event estimation can't find light here.
    #[inline]
    pub fn is_delta(&self) -> bool {
        match &self.kind {
            Kind::Disney(mixture) => mixture.is_delta(),
            Kind::Lambert { .. } => false,
            Kind::Mirror | Kind::Dielectric(_) => true,
        }
    }

    /// What a clear thin sheet lets pass of light that goes straight through, seen from `wo`; none for any other surface.
    #[inline]
    pub fn straight_transmittance(&self, wo: V3<F>) -> Option<Rgb<F>> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.straight_transmittance(wo),
            Kind::Lambert { .. } | Kind::Mirror | Kind::Dielectric(_) => None,
        }
    }

    /// What an albedo layer shows: the base colour, or white for mirror and dielectric.
    #[inline]
    pub fn albedo(&self) -> Rgb<F> {
        match &self.kind {
            Kind::Disney(mixture) => mixture.base_color,
            Kind::Lambert { base_color } => *base_color,
            Kind::Mirror | Kind::Dielectric(_) => Rgb::WHITE,
        }
    }
}
