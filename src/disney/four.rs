//! Four surfaces side by side: what they reflect, for less than one after the other.

use glam::{BVec4A, Vec4};

use super::bsdf::{Bsdf, Kind};
use super::diffuse::Diffuse;
use super::mixture::Mixture;
use super::specular::Specular;
use super::{clearcoat::Clearcoat, sheen::Sheen};
use crate::color::Rgb;
use crate::math::warp::cosine_hemisphere_pdf;
use crate::math::{Number, V3};

/// The BSDFs of four surfaces in the lanes of one.
///
/// It has those that reflect in front and nowhere else, without a mirror, and of the Disney model's variants the first one's: others are to be
/// asked one by one.
#[derive(Clone, Copy, Debug)]
pub struct FourBsdfs {
    disney: Option<Mixture<Vec4>>,
    /// Lambert's base colours, and the lanes that have them.
    lambert: Option<(Rgb<Vec4>, BVec4A)>,
    has: u32,
}

const ALL: u32 = 0b1111;

impl FourBsdfs {
    /// Of those that are there.
    pub fn new(bsdfs: [Option<&Bsdf>; 4]) -> Self {
        let kinds = bsdfs.map(|bsdf| bsdf.map(|bsdf| &bsdf.kind));
        let opaque = kinds.map(|kind| match kind {
            Some(Kind::Disney(mixture)) if mixture.is_opaque() => Some(mixture),
            _ => None,
        });
        let first = opaque.iter().flatten().next().copied();
        let diffuse = opaque.iter().flatten().find_map(|mixture| mixture.diffuse.as_ref());
        let is_alike = |mixture: &&Mixture<f32>| {
            let has_masking = first.is_some_and(|first| first.specular.masking == mixture.specular.masking);
            let own = mixture.diffuse.as_ref();
            has_masking && own.zip(diffuse).is_none_or(|(own, first)| own.model == first.model)
        };
        let disney = opaque.map(|mixture| mixture.filter(is_alike));
        let lambert = kinds.map(|kind| match kind {
            Some(Kind::Lambert { base_color }) => Some(*base_color),
            _ => None,
        });
        let are_lambert = lambert.map(|color| color.is_some());
        let has = (0..4).filter(|&i| disney[i].is_some() || are_lambert[i]).map(|i| 1 << i).sum();
        let colors = || Rgb::beside(lambert.map(Option::unwrap_or_default));
        Self {
            disney: first.map(|first| Mixture::beside(disney.map(|mixture| mixture.unwrap_or(first)))),
            lambert: are_lambert.contains(&true).then(|| (colors(), BVec4A::from_array(are_lambert))),
            has,
        }
    }

    /// The same in all lanes.
    #[inline]
    pub fn alike(bsdf: &Bsdf) -> Self {
        match &bsdf.kind {
            Kind::Disney(mixture) if mixture.is_opaque() => {
                Self { disney: Some(Mixture::beside([mixture; 4])), lambert: None, has: ALL }
            }
            Kind::Lambert { base_color } => {
                Self { disney: None, lambert: Some((Rgb::splat(*base_color), BVec4A::TRUE)), has: ALL }
            }
            Kind::Disney(_) | Kind::Mirror | Kind::Dielectric(_) => {
                Self { disney: None, lambert: None, has: 0 }
            }
        }
    }

    /// The lanes that it has, the first one's bit the lowest.
    #[inline]
    pub fn has(&self) -> u32 {
        self.has
    }

    /// [`Bsdf::eval_with_pdf`] in each lane that it has.
    #[inline(always)]
    pub fn eval_with_pdf(&self, wo: V3<Vec4>, wi: V3<Vec4>) -> (Rgb<Vec4>, Vec4) {
        let (mut f, mut pdf) =
            self.disney.as_ref().map_or((Rgb::BLACK, Vec4::ZERO), |disney| disney.opaque(wo, wi));
        if let Some((color, are_lambert)) = self.lambert {
            let is_seen = wo.z.above(Vec4::ZERO) & wi.z.above(Vec4::ZERO);
            let lambert = Rgb::select(is_seen, color * Vec4::FRAC_1_PI, Rgb::BLACK);
            let pdf_lambert = Vec4::select(is_seen, cosine_hemisphere_pdf(wi.z), Vec4::ZERO);
            f = Rgb::select(are_lambert, lambert, f);
            pdf = Vec4::select(are_lambert, pdf_lambert, pdf);
        }
        (f, pdf)
    }
}

impl Mixture<f32> {
    /// It transmits nothing and mirrors nothing, and its lobes are sampled by what they scatter.
    fn is_opaque(&self) -> bool {
        let is_closed = self.transmission.is_none() && self.diffuse_transmission.is_none();
        is_closed && !self.specular.is_delta && !self.equal_lobes
    }

    /// Four alike side by side. A lobe that some have is nothing in the others.
    #[inline(always)]
    fn beside(four: [&Self; 4]) -> Mixture<Vec4> {
        Mixture {
            base_color: Rgb::beside(four.map(|m| m.base_color)),
            diffuse: any_of(four.map(|m| m.diffuse.as_ref()), Diffuse::none)
                .map(|d| Diffuse::beside(d.each_ref())),
            sheen: any_of(four.map(|m| m.sheen.as_ref()), Sheen::none).map(|s| Sheen::beside(s.each_ref())),
            specular: Specular::beside(four.map(|m| &m.specular)),
            clearcoat: any_of(four.map(|m| m.clearcoat.as_ref()), Clearcoat::none)
                .map(|c| Clearcoat::beside(c.each_ref())),
            transmission: None,
            diffuse_transmission: None,
            thin_walled: false,
            equal_lobes: false,
        }
    }
}

/// The lobes of four, if any has it, where others have `none` of that.
#[inline(always)]
fn any_of<L: Copy>(lobes: [Option<&L>; 4], none: fn(&L) -> L) -> Option<[L; 4]> {
    let some = lobes.iter().flatten().next().copied()?;
    Some(lobes.map(|lobe| lobe.copied().unwrap_or_else(|| none(some))))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::disney::stress::Random;

    /// Bit for bit what each finds by itself, whoever is beside it; and what is not known is said to be so.
    #[test]
    fn four_find_what_each_finds() {
        let mut random = Random::new(1);
        let (mut lit, mut known) = (0, 0);
        for round in 0..50_000 {
            let materials: [_; 4] = std::array::from_fn(|_| random.material());
            let are_alike = round % 4 == 0;
            let bsdfs =
                materials.map(|material| if are_alike { materials[0].bsdf() } else { material.bsdf() });
            let there =
                bsdfs.each_ref().map(|bsdf| (are_alike || !random.bits().is_multiple_of(8)).then_some(bsdf));
            let four = if are_alike { FourBsdfs::alike(&bsdfs[0]) } else { FourBsdfs::new(there) };
            let wo: [V3<f32>; 4] = std::array::from_fn(|_| random.view());
            let wi: [V3<f32>; 4] = std::array::from_fn(|_| random.view());
            let beside = |four: [V3<f32>; 4]| V3::beside(four.map(Vec3::from));
            let (f, pdf) = four.eval_with_pdf(beside(wo), beside(wi));
            for lane in (0..4).filter(|lane| four.has() & (1 << lane) != 0) {
                let expected = bsdfs[lane].eval_with_pdf(wo[lane], wi[lane]);
                let material = if are_alike { &materials[0] } else { &materials[lane] };
                assert_eq!((f.lane(lane), pdf[lane]), expected, "{material:?} {:?} {:?}", wo[lane], wi[lane]);
                lit += u32::from(!expected.0.is_black());
                known += 1;
            }
            for (lane, own) in there.iter().enumerate().filter(|(lane, _)| four.has() & (1 << lane) == 0) {
                let Some(Kind::Disney(mixture)) = own.map(|bsdf| &bsdf.kind) else { continue };
                let first = there
                    .iter()
                    .take(lane)
                    .flatten()
                    .any(|b| matches!(&b.kind, Kind::Disney(m) if m.is_opaque()));
                assert!(!mixture.is_opaque() || first, "an opaque one is left out that nothing is before");
            }
        }
        assert!(lit > 10_000 && known > 40_000, "{lit} {known}");
    }
}
