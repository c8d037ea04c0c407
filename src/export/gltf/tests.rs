//! What glTF says comes back to the same Disney material; what it can't say is told.

use std::sync::Arc;

use super::material;
use super::texture::Textures;
use crate::color::Rgb;
use crate::convert::{ConvertOptions, Note, Quality, to_disney};
use crate::disney::{DiffuseModel, Masking, Model, Parameter};
use crate::scene::material::{Material, NormalMap, Param, Sides, TextureChannel, TextureMap};
use crate::scene::source::{
    AlphaMode, GltfAnisotropy, GltfClearcoat, GltfDiffuseTransmission, GltfMaterial, GltfSheen, GltfSpecular,
    GltfTransmission, GltfVolume, SourceMaterial,
};
use crate::scene::texture::{Encoding, Image, Pixels, TexelFilter, Texture, Wrap};
use crate::scene::{ImageId, Named, Scene, TextureId};

/// Two textures of the same image, linear and sRGB, and one without alpha.
fn empty() -> Scene<Material> {
    let mut scene = Scene::empty();
    for (image, encoding) in [(0, Encoding::Linear), (0, Encoding::Srgb), (1, Encoding::Linear)] {
        let (wrap, filter) = ([Wrap::Mirror, Wrap::Clamp], TexelFilter::Bilinear);
        scene.textures.push(Texture { image: ImageId(image), encoding, wrap, filter });
    }
    for channels in [4u8, 3] {
        let values = (0..4 * channels).map(|i| 10 + 9 * i).collect();
        let image = Image { name: "noise".into(), width: 2, height: 2, channels, pixels: Pixels::U8(values) };
        scene.images.push(Arc::new(image));
    }
    scene
}

const LINEAR: u32 = 0;
const SRGB: u32 = 1;

fn map(texture: u32) -> TextureMap {
    TextureMap::new(TextureId(texture), TextureChannel::R)
}

fn read(name: &str, source: GltfMaterial) -> Material {
    let mut scene = Scene::empty();
    scene.materials.push(Named::new(name, SourceMaterial::Gltf(source)));
    to_disney(scene, &ConvertOptions::default()).scene.materials.swap_remove(0).item
}

/// `material` in glTF's terms, with what is told.
fn write(material: &Material) -> (GltfMaterial, Vec<Note>) {
    let scene = empty();
    let (mut textures, mut notes) = (Textures::new(&scene), Vec::new());
    let named = Named::new("m", material.clone());
    let out = material::convert(&scene, &named, 1.0, &mut textures, &mut notes);
    (out, notes)
}

fn quality(notes: &[Note], field: &str) -> Quality {
    let found = notes.iter().filter(|n| n.field == field).map(|n| n.quality).max();
    found.unwrap_or_else(|| panic!("nothing is told of {field}: {notes:#?}"))
}

/// glTF materials with everything that is read of glTF.
fn sources() -> Vec<(&'static str, GltfMaterial)> {
    let base = || GltfMaterial {
        base_color_factor: Rgb::new(0.8, 0.4, 0.2),
        metallic_factor: 0.0,
        roughness_factor: 0.35,
        double_sided: true,
        ..GltfMaterial::default()
    };
    let specular =
        |factor, texture, color, color_texture| Some(GltfSpecular { factor, texture, color, color_texture });
    let glass = Some(GltfTransmission { factor: 1.0, texture: None });
    let coat = |factor, texture, roughness| {
        Some(GltfClearcoat { factor, texture, roughness, roughness_texture: None })
    };
    let sheen = |color, color_texture| Some(GltfSheen { color, color_texture, roughness: 1.0 });
    vec![
        ("plain", base()),
        ("default", GltfMaterial { double_sided: true, ..GltfMaterial::default() }),
        (
            "metallic-roughness",
            GltfMaterial { metallic_roughness_texture: Some(map(LINEAR)), metallic_factor: 0.7, ..base() },
        ),
        (
            "mask",
            GltfMaterial {
                base_color_texture: Some(map(SRGB)),
                alpha_factor: 0.9,
                alpha_mode: AlphaMode::Mask { cutoff: 0.3 },
                ..base()
            },
        ),
        (
            "blend",
            GltfMaterial { alpha_factor: 0.25, alpha_mode: AlphaMode::Blend, vertex_color: true, ..base() },
        ),
        (
            "emission",
            GltfMaterial {
                emissive_factor: Rgb::new(1.0, 0.5, 0.1),
                emissive_strength: 7.3,
                emissive_texture: Some(map(SRGB)),
                ..base()
            },
        ),
        ("lamp", GltfMaterial { emissive_factor: Rgb::WHITE, double_sided: false, ..base() }),
        (
            "normal",
            GltfMaterial {
                normal_texture: Some(TextureMap { uv_set: 1, ..map(LINEAR) }),
                normal_scale: 0.4,
                ..base()
            },
        ),
        ("ior", GltfMaterial { ior: Some(1.33), ..base() }),
        ("ior of 1", GltfMaterial { ior: Some(1.0), ..base() }),
        ("specular", GltfMaterial { specular: specular(0.25, None, Rgb::WHITE, None), ..base() }),
        ("no specular", GltfMaterial { specular: specular(0.0, None, Rgb::WHITE, None), ..base() }),
        (
            "specular strength",
            GltfMaterial { specular: specular(0.5, Some(map(LINEAR)), Rgb::grey(0.8), None), ..base() },
        ),
        (
            "specular colour",
            GltfMaterial {
                specular: specular(1.0, None, Rgb::grey(1.5), Some(map(SRGB))),
                ior: Some(1.8),
                ..base()
            },
        ),
        (
            "specular tint",
            GltfMaterial { specular: specular(1.0, None, Rgb::new(1.2, 0.8, 0.6), None), ..base() },
        ),
        ("coat", GltfMaterial { clearcoat: coat(0.6, Some(map(LINEAR)), 0.12), ..base() }),
        ("rough coat", GltfMaterial { clearcoat: coat(1.0, None, 0.9), ..base() }),
        ("sheen", GltfMaterial { sheen: sheen(Rgb::grey(0.3), Some(map(SRGB))), ..base() }),
        ("tinted sheen", GltfMaterial { sheen: sheen(Rgb::new(0.8, 0.4, 0.2), None), ..base() }),
        (
            "anisotropy",
            GltfMaterial {
                anisotropy: Some(GltfAnisotropy { strength: 0.6, rotation: 0.5, texture: None }),
                ..base()
            },
        ),
        (
            "sheet",
            GltfMaterial {
                transmission: Some(GltfTransmission { factor: 0.75, texture: Some(map(LINEAR)) }),
                ior: Some(1.33),
                ..base()
            },
        ),
        (
            "glass",
            GltfMaterial {
                transmission: glass,
                volume: Some(GltfVolume {
                    thickness: 0.1,
                    attenuation_color: Rgb::new(0.5, 0.9, 1.0),
                    attenuation_distance: 0.25,
                }),
                double_sided: false,
                ..base()
            },
        ),
        (
            "leaf",
            GltfMaterial {
                diffuse_transmission: Some(GltfDiffuseTransmission {
                    factor: 0.4,
                    texture: None,
                    color: Rgb::new(0.2, 0.9, 0.1),
                    color_texture: None,
                }),
                ..base()
            },
        ),
        (
            "unlit",
            GltfMaterial {
                unlit: true,
                base_color_texture: Some(map(SRGB)),
                alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
                ..base()
            },
        ),
    ]
}

/// All that `read` makes of glTF becomes glTF that `read` makes the same of. Where a formula can't be inverted in floats, scalars are off by
/// rounding.
#[test]
fn every_gltf_material_comes_back() {
    let rounded = ["specular tint", "tinted sheen", "anisotropy"];
    for (name, source) in sources() {
        let before = read("m", source);
        let (out, notes) = write(&before);
        let after = read("m", out.clone());
        if !rounded.contains(&name) {
            assert_eq!(before, after, "{name}: {out:#?}");
            continue;
        }
        for p in Parameter::ALL {
            let (a, b) = (before.scalar(p).constant().unwrap(), after.scalar(p).constant().unwrap());
            assert!((a - b).abs() <= 1e-6, "{name} {p:?}: {a} {b}");
        }
        assert_eq!(Material { scalars: before.scalars.clone(), ..after }, before, "{name}");
        assert!(notes.iter().all(|n| n.quality != Quality::Dropped), "{name}: {notes:#?}");
    }
}

#[test]
fn textures_elsewhere_than_gltf_reads_them_are_moved_there() {
    let scalar =
        |texture, channel| Param::Texture { map: TextureMap { channel, ..map(texture) }, factor: 0.5 };
    let mut material = Material { masking: Masking::Matched, ..Material::default() };
    *material.scalar_mut(Parameter::Roughness) = scalar(LINEAR, TextureChannel::R);
    *material.scalar_mut(Parameter::Metallic) = scalar(2, TextureChannel::G);
    material.opacity.alpha = scalar(2, TextureChannel::B);
    let (out, notes) = write(&material);
    assert_eq!((out.roughness_factor, out.metallic_factor, out.alpha_factor), (0.5, 0.5, 0.5));
    assert_eq!(out.metallic_roughness_texture.unwrap().texture, TextureId(4), "made after the base colour's");
    assert_eq!(quality(&notes, "metallic and roughness texture"), Quality::Exact);
    // Its 8 bits are linear, as alpha is.
    assert_eq!(quality(&notes, "base_color texture"), Quality::Exact);
    // A texture that lies elsewhere can't share the slot.
    let turned = TextureMap { texture_from_uv: glam::Affine2::from_scale(glam::Vec2::splat(2.0)), ..map(2) };
    *material.scalar_mut(Parameter::Metallic) = Param::Texture { map: turned, factor: 0.5 };
    let (out, notes) = write(&material);
    assert_eq!(quality(&notes, "metallic"), Quality::Approximated);
    assert!(out.metallic_factor > 0.05 && out.metallic_factor < 0.5, "the mean: {}", out.metallic_factor);
}

#[test]
fn other_models_become_what_is_nearest() {
    let of = |model| Material { model, masking: Masking::Matched, ..Material::default() };
    let (mirror, notes) = write(&of(Model::Mirror));
    assert_eq!(
        (mirror.metallic_factor, mirror.roughness_factor, mirror.base_color_factor),
        (1.0, 0.0, Rgb::WHITE)
    );
    assert_eq!(quality(&notes, "mirror"), Quality::Approximated);
    let mut glass = of(Model::Dielectric);
    *glass.scalar_mut(Parameter::Ior) = Param::Constant(1.7);
    let (glass, notes) = write(&glass);
    assert!(!notes.iter().any(|n| n.reason.contains("0e0")), "what isn't off isn't told: {notes:?}");
    assert_eq!((glass.ior, glass.transmission.unwrap().factor, glass.double_sided), (Some(1.7), 1.0, false));
    assert!(glass.volume.unwrap().thickness > 0.0 && glass.base_color_factor == Rgb::WHITE);
    let (paper, notes) = write(&of(Model::Diffuse));
    assert_eq!(paper.specular.unwrap().factor, 0.0);
    assert_eq!(quality(&notes, "base_color"), Quality::Carried);
}

#[test]
fn what_gltf_can_not_say_is_told() {
    let mut material = Material { sides: Sides::Front, masking: Masking::Remapped, ..Material::default() };
    let mut set = |p, v| *material.scalar_mut(p) = Param::Constant(v);
    set(Parameter::Subsurface, 0.5);
    set(Parameter::SpecTrans, 0.5);
    set(Parameter::Ior, 0.8);
    set(Parameter::F90, 0.0);
    set(Parameter::Anisotropic, 0.9);
    set(Parameter::Roughness, 1.0);
    let (_, notes) = write(&material);
    assert_eq!(quality(&notes, "subsurface"), Quality::Dropped);
    for field in ["masking", "transmission_color", "ior", "specular", "anisotropic"] {
        assert_eq!(quality(&notes, field), Quality::Approximated, "{field}");
    }
    let (_, one_sided) = write(&Material { sides: Sides::Front, ..Material::default() });
    assert_eq!(quality(&one_sided, "sides"), Quality::Approximated);
    let reason = &notes.iter().find(|n| n.field == "ior").unwrap().reason;
    assert_eq!(reason, "0.8 here, 1 when it is read back");
    let diffuse = |diffuse| quality(&write(&Material { diffuse, ..Material::default() }).1, "base_color");
    assert_eq!(diffuse(DiffuseModel::LambertFresnel), Quality::Exact);
    assert_eq!(diffuse(DiffuseModel::Burley), Quality::Carried);
}

#[test]
fn normal_maps_of_another_encoding_are_made_anew() {
    let normal_map = Some(NormalMap { map: map(SRGB), scale: 1.0 });
    let (out, notes) = write(&Material { normal_map, ..Material::default() });
    assert_eq!(out.normal_texture.unwrap().texture, TextureId(3));
    assert_eq!(quality(&notes, "normal_map texture"), Quality::Approximated);
}

#[test]
fn light_beyond_one_goes_into_the_strength() {
    let mut material = Material::default();
    material.emission.color = Param::Constant(Rgb::new(40.0, 3.3, 0.1));
    let (out, _) = write(&material);
    assert_eq!(out.emissive_strength, 64.0);
    assert_eq!(out.emissive_factor * 64.0, Rgb::new(40.0, 3.3, 0.1));
    assert!(!out.double_sided);
}
