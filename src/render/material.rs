//! Materials as the tracer reads them: what is the same everywhere is worked out once.

use glam::Vec3;

use super::geometry::TrianglePoint;
use crate::color::Rgb;
use crate::disney::{Bsdf, Model, Parameter, Params};
use crate::math::Frame;
use crate::scene::material::{Material, NormalMap, Param, ShadingFrame, Sides, TextureMap};
use crate::scene::{AnisotropyMap, Scene, texture::Texel};

/// A material, prepared.
#[derive(Debug)]
pub(super) struct PreparedMaterial {
    bsdf: Scattering,
    emission: Emitting,
    opacity: Covering,
    normal_map: Option<NormalMap>,
    tangent: Tangent,
    pub(super) sides: Sides,
    /// Light may come through, straight or scattered.
    pub(super) transmits: bool,
    /// Light goes through: the inside is a place of its own.
    pub(super) is_interface: bool,
    /// What that place takes of light per metre, if it takes any.
    pub(super) absorption: Option<Rgb>,
    /// A clear sheet: shadow rays may pass.
    pub(super) lets_shadow_rays_pass: bool,
    /// Lobes are sampled equally often, however much they scatter.
    equal_lobes: bool,
}

#[derive(Debug)]
enum Scattering {
    Constant(Box<Bsdf>),
    Varying(Box<Material>),
}

#[derive(Debug)]
enum Emitting {
    Nothing,
    Constant(Rgb, Sides),
    Varying(Param<Rgb>, f32, Sides),
    /// What the camera alone sees.
    Unlit {
        color: Param<Rgb>,
        vertex_color: bool,
        sides: Sides,
    },
}

#[derive(Debug)]
enum Covering {
    Opaque,
    Varying { alpha: Param<f32>, cutoff: Option<f32>, vertex_alpha: bool, culled: bool },
}

/// Where the shading frame's x axis comes from.
#[derive(Debug)]
enum Tangent {
    /// Nothing depends on it.
    Any,
    Surface {
        uv_set: u32,
        rotation: f32,
        turned: Option<AnisotropyMap>,
    },
    Nori {
        rotation: f32,
    },
}

/// The BSDF of a material that is the same everywhere, `None` for one that varies.
pub fn constant_bsdf(material: &Material) -> Option<Bsdf> {
    match PreparedMaterial::new(material).bsdf {
        Scattering::Constant(bsdf) => Some(*bsdf),
        Scattering::Varying(_) => None,
    }
}

impl PreparedMaterial {
    pub(super) fn new(material: &Material) -> Self {
        let colors = [
            Some(&material.base_color),
            material.transmission_color.as_ref(),
            material.diff_trans_color.as_ref(),
        ];
        let varies = material.vertex_color
            || material.anisotropy.is_some()
            || colors.into_iter().flatten().any(|c| c.constant().is_none())
            || material.scalars.iter().any(|s| s.constant().is_none());
        Self::prepared(material, varies && material.model != Model::Mirror)
    }

    /// As if all of it varied: it is the same, but is worked out at each point.
    pub(super) fn varying(material: &Material) -> Self {
        let prepared = Self::prepared(material, true);
        match prepared.emission {
            Emitting::Constant(_, sides) => Self {
                emission: Emitting::Varying(
                    material.emission.color.clone(),
                    material.emission.strength,
                    sides,
                ),
                ..prepared
            },
            _ => prepared,
        }
    }

    /// The same, but lobes are sampled equally often.
    pub(super) fn with_equal_lobes(self) -> Self {
        let bsdf = match self.bsdf {
            Scattering::Constant(bsdf) => Scattering::Constant(Box::new(bsdf.with_equal_lobes())),
            varying => varying,
        };
        Self { bsdf, equal_lobes: true, ..self }
    }

    fn prepared(material: &Material, varies: bool) -> Self {
        let bsdf = if varies {
            Scattering::Varying(Box::new(material.clone()))
        } else {
            let base_color = material.base_color.constant().unwrap_or(Rgb::WHITE);
            let scalar = |p: Parameter| material.scalar(p).constant().unwrap_or(p.default());
            let color = |c: &Param<Rgb>| c.constant().unwrap_or(Rgb::WHITE);
            Scattering::Constant(Box::new(scatter(material, base_color, color, scalar)))
        };
        let emission = match (&material.emission.color, material.emits()) {
            (_, false) => Emitting::Nothing,
            (color, true) if material.emission.unlit => Emitting::Unlit {
                color: color.clone(),
                vertex_color: material.vertex_color,
                sides: material.emission.sides,
            },
            (Param::Constant(color), true) => {
                Emitting::Constant(*color * material.emission.strength, material.emission.sides)
            }
            (varying, true) => {
                Emitting::Varying(varying.clone(), material.emission.strength, material.emission.sides)
            }
        };
        Self {
            bsdf,
            emission,
            opacity: covering(material),
            normal_map: material.normal_map.clone(),
            tangent: tangent(material),
            sides: material.sides,
            transmits: material.transmits(),
            is_interface: material.is_interface(),
            absorption: Some(material.absorption).filter(|a| material.is_interface() && !a.is_black()),
            lets_shadow_rays_pass: is_clear_sheet(material),
            equal_lobes: false,
        }
    }

    /// The parameters are the same everywhere.
    pub(super) fn is_constant(&self) -> bool {
        matches!(self.bsdf, Scattering::Constant(_))
    }

    /// Its normals depend on the viewer.
    #[inline]
    pub(super) fn has_normal_map(&self) -> bool {
        self.normal_map.is_some()
    }

    /// Its shading frame follows the surface's tangents.
    pub(super) fn needs_tangents(&self) -> bool {
        self.has_normal_map() || matches!(self.tangent, Tangent::Surface { .. })
    }

    /// All of it is there.
    pub(super) fn covers_all(&self) -> bool {
        matches!(self.opacity, Covering::Opaque)
    }

    /// It blocks every shadow ray.
    pub(super) fn blocks_shadow_rays(&self) -> bool {
        self.covers_all() && !self.lets_shadow_rays_pass
    }

    /// The mean radiance of an emitting material and the sides that emit: for choosing lights.
    pub(super) fn mean_emission(&self, scene: &Scene) -> Option<(Rgb, Sides)> {
        match &self.emission {
            Emitting::Nothing | Emitting::Unlit { .. } => None,
            Emitting::Constant(radiance, sides) => Some((*radiance, *sides)),
            Emitting::Varying(Param::Constant(color), strength, sides) => Some((*color * *strength, *sides)),
            Emitting::Varying(Param::Texture { map, factor }, strength, sides) => {
                Some((scene.mean_texel(map).color * *factor * *strength, *sides))
            }
        }
    }

    /// The radiance that leaves the surface, towards the front or the back.
    #[inline]
    pub(super) fn emitted(&self, scene: &Scene, at: &TrianglePoint<'_>, towards_front: bool) -> Rgb {
        let leaves = |sides: Sides| towards_front || sides == Sides::Both;
        match &self.emission {
            Emitting::Nothing => Rgb::BLACK,
            Emitting::Constant(radiance, sides) if leaves(*sides) => *radiance,
            Emitting::Varying(color, strength, sides) if leaves(*sides) => {
                read_color(scene, color, at) * *strength
            }
            Emitting::Constant(..) | Emitting::Varying(..) | Emitting::Unlit { .. } => Rgb::BLACK,
        }
    }

    /// What the camera alone sees of the surface, from its front or back: KHR_materials_unlit.
    #[inline]
    pub(super) fn unlit(&self, scene: &Scene, at: &TrianglePoint<'_>, towards_front: bool) -> Rgb {
        match &self.emission {
            Emitting::Unlit { color, vertex_color, sides } if towards_front || *sides == Sides::Both => {
                let color = read_color(scene, color, at);
                if !vertex_color {
                    return color;
                }
                let c = at.color();
                color * Rgb::new(c.x, c.y, c.z)
            }
            _ => Rgb::BLACK,
        }
    }

    /// The fraction of the surface that is there for what comes along `direction`, in [0, 1].
    #[inline]
    pub(super) fn alpha(&self, scene: &Scene, at: &TrianglePoint<'_>, direction: Vec3) -> f32 {
        match &self.opacity {
            Covering::Opaque => 1.0,
            Covering::Varying { alpha, cutoff, vertex_alpha, culled } => {
                if *culled && at.geometric_normal().is_some_and(|n| n.dot(direction) > 0.0) {
                    return 0.0;
                }
                let mut value = read_scalar(scene, alpha, at);
                if *vertex_alpha {
                    value *= at.color().w;
                }
                match cutoff {
                    Some(cutoff) => f32::from(value >= *cutoff),
                    None => value.clamp(0.0, 1.0),
                }
            }
        }
    }

    /// The BSDF at a point; one that varies is worked out into `varying`, and one that is the same everywhere isn't copied.
    #[inline]
    pub(super) fn bsdf<'s>(
        &'s self,
        scene: &Scene,
        at: &TrianglePoint<'_>,
        varying: &'s mut Option<Bsdf>,
    ) -> &'s Bsdf {
        match &self.bsdf {
            Scattering::Constant(bsdf) => bsdf,
            Scattering::Varying(material) => {
                let bsdf = bsdf_at(material, scene, at);
                varying.insert(if self.equal_lobes { bsdf.with_equal_lobes() } else { bsdf })
            }
        }
    }

    /// The shading frame around `normal`, which may be turned to the viewer; `is_front` tells which side that is. A mapped normal is
    /// first passed to `correct`.
    #[inline]
    pub(super) fn frame(
        &self,
        scene: &Scene,
        at: &TrianglePoint<'_>,
        normal: Vec3,
        is_front: bool,
        correct: impl FnOnce(Vec3) -> Vec3,
    ) -> Frame {
        let normal = match &self.normal_map {
            None => normal,
            Some(map) => correct(self.mapped_normal(scene, map, at, normal, is_front)),
        };
        match self.tangent {
            Tangent::Any => Frame::from_normal(normal),
            Tangent::Nori { rotation } => Frame::nori(normal).rotated(rotation),
            Tangent::Surface { uv_set, rotation, ref turned } => {
                let Some((tangent, sign)) = at.tangent(uv_set) else {
                    return Frame::from_normal(normal).rotated(rotation);
                };
                let turn = turned.as_ref().map_or(0.0, |map| read_anisotropy(scene, map, at).1);
                // From the tangent towards the bitangent, on the surface: the same direction seen from behind or in a mirrored map.
                let around_normal = if is_front { sign } else { -sign };
                Frame::from_normal_and_tangent(normal, tangent).rotated(around_normal * (rotation + turn))
            }
        }
    }

    /// The normal of a tangent-space map (glTF 2.0, section 3.9.3), on the side of `normal`.
    fn mapped_normal(
        &self,
        scene: &Scene,
        map: &NormalMap,
        at: &TrianglePoint<'_>,
        normal: Vec3,
        is_front: bool,
    ) -> Vec3 {
        let Some((tangent, sign)) = at.tangent(map.map.uv_set) else { return normal };
        let side = if is_front { 1.0 } else { -1.0 };
        let front = normal * side;
        let frame = Frame::from_normal_and_tangent(front, tangent);
        let texel = read_texel(scene, &map.map, at).color;
        let (x, y, z) =
            ((2.0 * texel.r - 1.0) * map.scale, (2.0 * texel.g - 1.0) * map.scale, 2.0 * texel.b - 1.0);
        let mapped = frame.tangent * x + frame.bitangent * (y * sign) + front * z;
        mapped.try_normalize().map_or(normal, |n| n * side)
    }
}

/// The BSDF of a material that varies, at a point.
#[inline]
fn bsdf_at(material: &Material, scene: &Scene, at: &TrianglePoint<'_>) -> Bsdf {
    let mut base_color = read_color(scene, &material.base_color, at);
    if material.vertex_color {
        let c = at.color();
        base_color *= Rgb::new(c.x, c.y, c.z);
    }
    // Products of factors, textures and vertex colours may leave the range by their own rounding or by intent.
    let base_color = base_color.map(|v| v.clamp(0.0, 1.0));
    let color = |c: &Param<Rgb>| read_color(scene, c, at).map(|v| v.clamp(0.0, 1.0));
    let read = |p: Parameter| read_scalar(scene, material.scalar(p), at).clamp(p.min(), p.max());
    let Some(anisotropy) = &material.anisotropy else {
        return scatter(material, base_color, color, read);
    };
    let (strength, _) = read_anisotropy(scene, anisotropy, at);
    let disney = AnisotropyMap::disney(read(Parameter::Roughness), strength);
    scatter(material, base_color, color, |p| match p {
        Parameter::Roughness => disney.roughness,
        Parameter::Anisotropic => disney.anisotropic.min(p.max()),
        _ => read(p),
    })
}

fn scatter(
    material: &Material,
    base_color: Rgb,
    color: impl Fn(&Param<Rgb>) -> Rgb,
    scalar: impl Fn(Parameter) -> f32,
) -> Bsdf {
    match material.model {
        Model::Disney => {
            let mut params = Params {
                base_color,
                thin_walled: material.thin_walled,
                transmission_color: material.transmission_color.as_ref().map(&color),
                diff_trans_color: material.diff_trans_color.as_ref().map(&color),
                ..Params::default()
            };
            for p in Parameter::ALL {
                *params.get_mut(p) = scalar(p);
            }
            Bsdf::disney(&params, material.masking, material.diffuse)
        }
        Model::Diffuse => Bsdf::diffuse(base_color),
        Model::Mirror => Bsdf::mirror(),
        Model::Dielectric => Bsdf::dielectric(scalar(Parameter::Ior)),
    }
}

/// Whether light may go straight through: a thin sheet whose transmission is somewhere not spread by roughness. Burley's sheets of an index
/// below 0.35/0.65 spread nothing at any roughness.
fn is_clear_sheet(material: &Material) -> bool {
    let may = |p: Parameter, is: fn(f32) -> bool| material.scalar(p).constant().is_none_or(is);
    material.model == Model::Disney
        && material.thin_walled
        && may(Parameter::SpecTrans, |t| t > 0.0)
        && (may(Parameter::Roughness, |r| r == 0.0) || may(Parameter::Ior, |n| n < 0.54))
}

fn covering(material: &Material) -> Covering {
    let opacity = &material.opacity;
    let opaque = match opacity.alpha.constant() {
        Some(alpha) if !material.vertex_alpha => alpha >= opacity.cutoff.unwrap_or(1.0),
        _ => false,
    };
    if opaque && !material.culled {
        return Covering::Opaque;
    }
    Covering::Varying {
        alpha: opacity.alpha.clone(),
        cutoff: opacity.cutoff,
        vertex_alpha: material.vertex_alpha,
        culled: material.culled,
    }
}

fn tangent(material: &Material) -> Tangent {
    let by_gltf = material.anisotropy.as_ref().is_some_and(|a| a.strength > 0.0);
    let anisotropic = material.model == Model::Disney
        && (by_gltf || material.scalar(Parameter::Anisotropic).constant().is_none_or(|a| a > 0.0));
    if !anisotropic {
        return Tangent::Any;
    }
    match material.frame {
        ShadingFrame::Nori => Tangent::Nori { rotation: material.rotation },
        ShadingFrame::Surface => Tangent::Surface {
            uv_set: material.normal_map.as_ref().map_or(0, |m| m.map.uv_set),
            rotation: material.rotation,
            turned: material.anisotropy.clone().filter(|a| a.map.is_some()),
        },
    }
}

#[inline]
fn read_texel(scene: &Scene, map: &TextureMap, at: &TrianglePoint<'_>) -> Texel {
    let texture = &scene.textures[map.texture.0 as usize];
    texture.sample(&scene.images[texture.image.0 as usize], map.coordinates(at.uv(map.uv_set)))
}

/// glTF's anisotropic strength, and the angle from the tangent towards the bitangent.
#[inline]
fn read_anisotropy(scene: &Scene, anisotropy: &AnisotropyMap, at: &TrianglePoint<'_>) -> (f32, f32) {
    anisotropy.at(anisotropy.map.as_ref().map(|map| read_texel(scene, map, at)).as_ref())
}

#[inline]
fn read_color(scene: &Scene, param: &Param<Rgb>, at: &TrianglePoint<'_>) -> Rgb {
    match param {
        Param::Constant(value) => *value,
        Param::Texture { map, factor } => read_texel(scene, map, at).color * *factor,
    }
}

#[inline]
fn read_scalar(scene: &Scene, param: &Param<f32>, at: &TrianglePoint<'_>) -> f32 {
    match param {
        Param::Constant(value) => *value,
        Param::Texture { map, factor } => map.scalar(&read_texel(scene, map, at), *factor),
    }
}
