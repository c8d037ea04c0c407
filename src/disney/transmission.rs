//! Light that goes through: by a dielectric interface, rough or smooth, by a thin sheet, and diffusely.

use super::fresnel::{DielectricSplit, split_given_both_cosines};
use super::microfacet::{Alpha, Gtr2, alpha_from_roughness, smith};
use super::pair::Pair;
use super::parameter::Params;
use crate::color::Rgb;
use crate::math::{Real, V3};

/// An interface whose index is nearer to 1 than this bends light by less than the least alpha spreads a highlight: it is taken for
/// smooth, since the half vector of Walter 2007 vanishes with the difference.
const INDEX_MATCHED: f64 = 1e-3;

/// Specular transmission, spec_trans·(1 - metallic) of the base (Burley 2015, sections 4.1 and 4.2).
#[derive(Clone, Copy, Debug)]
pub(super) struct Transmission<F> {
    /// The refractive index inside over outside.
    pub(super) ior: F,
    /// spec_trans·(1 - metallic) times the colour of what one crossing lets pass.
    pub(super) tint: Rgb<F>,
    /// The mean of its channels: for sampling.
    pub(super) mean: F,
    pub(super) passage: Passage<F>,
}

/// How light passes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Passage<F> {
    /// Refracted by the facets that also reflect it.
    Rough,
    /// Refracted as by a plane: a delta lobe.
    Smooth,
    /// Straight through a sheet that refracts twice, spread by a roughness that depends on the index.
    ThinRough(Gtr2<F>, Alpha<F>),
    /// Straight through: a delta lobe that shadow rays see through.
    ThinSmooth,
}

/// Two directions on either side of an interface with the facet that refracts one into the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refraction<F> {
    wo: V3<F>,
    wi: V3<F>,
    eta: F,
    /// wo + eta·wi on `wo`'s side: along the facet's normal.
    h: V3<F>,
    h2: F,
    /// The cosine of wo with the facet's normal.
    pub(super) cos_o: F,
    cos_i: F,
}

impl<F: Real> Refraction<F> {
    /// `wo.z` > 0 > `wi.z`, and `eta` the index of `wi`'s side over that of `wo`'s. `None` where no facet does it.
    #[inline]
    pub(super) fn new(wo: V3<F>, wi: V3<F>, eta: F) -> Option<Self> {
        let h = wo + wi * eta;
        let h = if h.z < F::ZERO { -h } else { h };
        let h2 = h.length_squared();
        let length = h2.sqrt();
        let (cos_o, cos_i) = (wo.dot(h) / length, -wi.dot(h) / length);
        let refracts = h.z > F::ZERO && cos_o > F::ZERO && cos_i > F::ZERO && h2.is_finite();
        refracts.then_some(Self { wo, wi, eta, h, h2, cos_o, cos_i })
    }

    /// How the facet splits light.
    #[inline]
    pub(super) fn split(&self) -> DielectricSplit<F> {
        split_given_both_cosines(self.cos_o, self.cos_i, self.eta)
    }

    /// The BSDF without its Fresnel term, and the density of directions refracted by normals visible from `wo`, per unit solid angle of
    /// `wi` (Walter et al. 2007, eq. 21 and 17, for radiance that arrives along `wi`; |wo + eta·wi|² is the square in their
    /// denominator). `masking` is G's alpha and `visible` the smith term of D's own at `wo`.
    #[inline]
    pub(super) fn shape_with_pdf(
        &self,
        distribution: &Gtr2<F>,
        masking: Alpha<F>,
        visible: impl FnOnce(F) -> F,
    ) -> (F, F) {
        let d = distribution.density_at(self.h, self.h2);
        let masking_o = smith(self.wo, masking);
        let masking_i = smith(V3::new(self.wi.x, self.wi.y, -self.wi.z), masking);
        let common = d * (self.cos_o * self.cos_i / self.h2);
        let shape = F::of(4.0) * masking_o * masking_i * common;
        (shape, F::of(2.0) * visible(masking_o) * common * self.eta.sqr())
    }
}

impl<F: Real> Transmission<F> {
    /// `None` where nothing is transmitted.
    pub(super) fn new(params: &Params<F>) -> Option<Self> {
        let weight = params.interface_part();
        if weight == F::ZERO {
            return None;
        }
        let passing = params.transmission_color.unwrap_or_else(|| match params.thin_walled {
            true => params.base_color,
            false => params.base_color.map(F::sqrt),
        });
        let tint = passing * weight;
        Some(Self { ior: params.ior, tint, mean: tint.mean(), passage: Passage::new(params) })
    }

    /// The index on the far side over that of the side that `wo` is on.
    #[inline]
    pub(super) fn eta(&self, wo: V3<F>) -> F {
        if wo.z > F::ZERO { self.ior } else { F::ONE / self.ior }
    }

    /// What the facets of a rough interface reflect and transmit of the light they split, as shares of both; `reflected` is the part of
    /// all light that they reflect. Elsewhere all that the specular sampler makes is reflected.
    #[inline]
    pub(super) fn shares(&self, reflected: F, split: &DielectricSplit<F>) -> [F; 2] {
        let transmitted = self.mean * split.transmittance;
        let sum = reflected + transmitted;
        match self.passage {
            Passage::Rough if sum > F::ZERO => [reflected / sum, transmitted / sum],
            _ => [F::ONE, F::ZERO],
        }
    }

    /// Through a rough sheet: the BSDF without Fresnel term, and the density of [`Self::sample_thin`]'s directions. `pair` holds wo and
    /// the mirror image of wi.
    #[inline]
    pub(super) fn thin_with_pdf(distribution: &Gtr2<F>, alpha: Alpha<F>, pair: &Pair<F>) -> (F, F) {
        let d = distribution.density(pair);
        let masking_o = smith(pair.wo, alpha);
        (masking_o * smith(pair.wi, alpha) * d, F::of(0.5) * d * masking_o)
    }

    /// `wo` mirrored at a visible normal of the sheet and then by the sheet itself; may lie above.
    #[inline]
    pub(super) fn sample_thin(distribution: &Gtr2<F>, wo: V3<F>, u: [F; 2]) -> V3<F> {
        let wi = V3::reflect(wo, distribution.sample_visible(wo, u).normalize());
        V3::new(wi.x, wi.y, -wi.z)
    }

    /// A cosine for which a facet's transmittance stands for the sheet's: at grazing views only facets that lean to the viewer are seen.
    #[inline]
    pub(super) fn typical_cosine(&self, wo: V3<F>) -> F {
        match &self.passage {
            Passage::ThinRough(_, alpha) => wo.z.lerp(F::ONE, F::of(0.5) * (alpha.x * alpha.y).sqrt()),
            Passage::Rough | Passage::Smooth | Passage::ThinSmooth => wo.z.abs(),
        }
    }
}

impl<F: Real> Passage<F> {
    fn new(params: &Params<F>) -> Self {
        let Params { roughness, ior, .. } = *params;
        if params.thin_walled {
            // Burley 2015, section 4.2: the sheet spreads less than its surface reflects.
            let spread = (F::of(0.65) * ior - F::of(0.35)).max(F::ZERO) * roughness;
            if spread == F::ZERO {
                return Self::ThinSmooth;
            }
            let alpha = alpha_from_roughness(spread.min(F::ONE), params.anisotropic);
            return Self::ThinRough(Gtr2::new(alpha), alpha);
        }
        let matched = (ior - F::ONE).abs() < F::of(INDEX_MATCHED);
        if roughness == F::ZERO || matched { Self::Smooth } else { Self::Rough }
    }
}

/// Light that passes the surface diffusely, the part diff_trans/2 of the base's diffuse light.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiffuseTransmission<F> {
    /// The BSDF: colour·weight/π.
    pub(super) value: Rgb<F>,
    /// The transmitted part of light.
    pub(super) albedo: F,
}

impl<F: Real> DiffuseTransmission<F> {
    /// `None` where nothing is transmitted.
    pub(super) fn new(params: &Params<F>) -> Option<Self> {
        let weight = F::of(0.5) * params.diff_trans * params.diffuse_part();
        let color = params.diff_trans_color.unwrap_or(params.base_color) * weight;
        (!color.is_black()).then(|| Self { value: color * F::FRAC_1_PI, albedo: color.mean() })
    }
}
