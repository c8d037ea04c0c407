//! Wavefront MTL: the statements of a material as they are written.

use glam::Vec2;

use crate::color::Rgb;
use crate::scene::material::TextureChannel;
use crate::scene::{TextureId, texture::Wrap};

/// A material. A statement that the library doesn't hold is absent; one that could not be read was warned about.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlMaterial {
    /// The library, for messages; empty for a material that stands in for a missing one.
    pub library: String,
    /// The line of its `newmtl`.
    pub line: u32,
    /// `Ka`, ambient reflectance.
    pub ka: Option<Rgb>,
    /// `Kd`, linear diffuse reflectance.
    pub kd: Option<Rgb>,
    /// `Ks`, linear specular reflectance.
    pub ks: Option<Rgb>,
    /// `Ke`, emitted radiance.
    pub ke: Option<Rgb>,
    /// `Tf`, the transmission filter: what passes.
    pub tf: Option<Rgb>,
    /// `Ns`, the specular exponent.
    pub ns: Option<f32>,
    /// `Ni`, the refractive index.
    pub ni: Option<f32>,
    /// `d`, dissolve: 1 is opaque.
    pub d: Option<f32>,
    /// `Tr`, transparency: 0 is opaque.
    pub tr: Option<f32>,
    /// `illum`, the illumination model, 0 to 10.
    pub illum: Option<u32>,
    /// `Pr`, roughness.
    pub pr: Option<f32>,
    /// `Pm`, metallic.
    pub pm: Option<f32>,
    /// `Ps`, sheen.
    pub ps: Option<f32>,
    /// `Pc`, clearcoat.
    pub pc: Option<f32>,
    /// `Pcr`, clearcoat roughness.
    pub pcr: Option<f32>,
    /// `aniso`, anisotropy.
    pub aniso: Option<f32>,
    /// `anisor`, its rotation in turns.
    pub anisor: Option<f32>,
    /// The maps, at most one a slot, in the order of the file.
    pub maps: Vec<(MtlSlot, MtlMap)>,
    /// Whether the colours of the mesh's vertices are the material.
    pub vertex_color: bool,
}

/// What a map is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MtlSlot {
    /// `map_Ka`.
    Ka,
    /// `map_Kd`.
    Kd,
    /// `map_Ks`.
    Ks,
    /// `map_Ke`.
    Ke,
    /// `map_Ns`.
    Ns,
    /// `map_d`.
    D,
    /// `map_Pr`.
    Pr,
    /// `map_Pm`.
    Pm,
    /// `map_Ps`.
    Ps,
    /// `map_Pc`.
    Pc,
    /// `map_Pcr`.
    Pcr,
    /// `norm`, a tangent-space normal map.
    Norm,
    /// `bump` or `map_Bump`, a height map.
    Bump,
    /// `disp`.
    Disp,
    /// `decal`.
    Decal,
    /// `refl`.
    Refl,
}

/// A texture map with its options.
#[derive(Clone, Debug, PartialEq)]
pub struct MtlMap {
    /// The file as the library names it.
    pub file: String,
    /// The line it stands on.
    pub line: u32,
    /// The texture; none if its file is missing or unreadable (which was warned about), or the slot is not read.
    pub texture: Option<TextureId>,
    /// `-o`, added to the texture coordinates (v upwards) after scaling.
    pub offset: Vec2,
    /// `-s`, multiplies the texture coordinates.
    pub scale: Vec2,
    /// `-bm`, the bump multiplier.
    pub bump_multiplier: f32,
    /// `-clamp`.
    pub wrap: Wrap,
    /// `-imfchan`: what a scalar reads; none leaves it to the slot.
    pub channel: Option<TextureChannel>,
    /// Whether the image holds alpha.
    pub has_alpha: bool,
    /// Of a bump map: whether the image is one of normals, as many exporters write.
    pub holds_normals: bool,
}

impl MtlMap {
    /// A map of `file` without options.
    pub fn new(file: impl Into<String>, line: u32) -> Self {
        Self {
            file: file.into(),
            line,
            texture: None,
            offset: Vec2::ZERO,
            scale: Vec2::ONE,
            bump_multiplier: 1.0,
            wrap: Wrap::Repeat,
            channel: None,
            has_alpha: false,
            holds_normals: false,
        }
    }
}

impl MtlSlot {
    /// All slots.
    pub const ALL: [Self; 16] = [
        Self::Ka,
        Self::Kd,
        Self::Ks,
        Self::Ke,
        Self::Ns,
        Self::D,
        Self::Pr,
        Self::Pm,
        Self::Ps,
        Self::Pc,
        Self::Pcr,
        Self::Norm,
        Self::Bump,
        Self::Disp,
        Self::Decal,
        Self::Refl,
    ];

    /// The statement in a library.
    pub const fn statement(self) -> &'static str {
        match self {
            Self::Ka => "map_Ka",
            Self::Kd => "map_Kd",
            Self::Ks => "map_Ks",
            Self::Ke => "map_Ke",
            Self::Ns => "map_Ns",
            Self::D => "map_d",
            Self::Pr => "map_Pr",
            Self::Pm => "map_Pm",
            Self::Ps => "map_Ps",
            Self::Pc => "map_Pc",
            Self::Pcr => "map_Pcr",
            Self::Norm => "norm",
            Self::Bump => "map_Bump",
            Self::Disp => "disp",
            Self::Decal => "decal",
            Self::Refl => "refl",
        }
    }

    /// The slot of a statement, whose case is ignored.
    pub fn from_statement(statement: &str) -> Option<Self> {
        if statement.eq_ignore_ascii_case("bump") {
            return Some(Self::Bump);
        }
        Self::ALL.into_iter().find(|slot| slot.statement().eq_ignore_ascii_case(statement))
    }

    /// Whether the conversion reads it; maps of other slots are not loaded.
    pub const fn is_read(self) -> bool {
        !matches!(self, Self::Ka | Self::Disp | Self::Decal | Self::Refl)
    }
}

impl MtlMaterial {
    /// The map of a slot.
    pub fn map(&self, slot: MtlSlot) -> Option<&MtlMap> {
        self.maps.iter().find(|(s, _)| *s == slot).map(|(_, map)| map)
    }

    /// Whether one of the physically based statements (`Pr`, `Pm`, `aniso` …, or a map of one) is there: they override `Ns` and
    /// `illum`.
    pub fn is_physically_based(&self) -> bool {
        let scalars = [self.pr, self.pm, self.ps, self.pc, self.pcr, self.aniso, self.anisor];
        let maps = [MtlSlot::Pr, MtlSlot::Pm, MtlSlot::Ps, MtlSlot::Pc, MtlSlot::Pcr];
        scalars.iter().any(Option::is_some) || maps.iter().any(|&slot| self.map(slot).is_some())
    }
}
