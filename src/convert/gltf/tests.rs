//! glTF materials and what becomes of them.

use super::*;
use crate::scene::TextureId;
use crate::scene::source::{GltfDiffuseTransmission, GltfTransmission};

fn run(source: &GltfMaterial) -> (Material, Vec<Note>) {
    let (mut notes, mut warnings) = (Vec::new(), Vec::new());
    let material = convert("m", source, &ConvertOptions::default(), &mut notes, &mut warnings);
    (material, notes)
}

fn scalar(material: &Material, parameter: Parameter) -> f32 {
    material.scalar(parameter).constant().unwrap()
}

fn quality(notes: &[Note], field: &str) -> Quality {
    notes.iter().find(|n| n.field == field).unwrap().quality
}

#[test]
fn the_core_maps_one_to_one() {
    let map = TextureMap::new(TextureId(3), TextureChannel::R);
    let source = GltfMaterial {
        base_color_factor: Rgb::new(0.1, 0.2, 0.3),
        metallic_factor: 0.25,
        roughness_factor: 0.75,
        metallic_roughness_texture: Some(map.clone()),
        ..GltfMaterial::default()
    };
    let (material, notes) = run(&source);
    assert_eq!(material.base_color, Param::Constant(Rgb::new(0.1, 0.2, 0.3)));
    let read = |channel, factor| Param::Texture { map: TextureMap { channel, ..map.clone() }, factor };
    assert_eq!(*material.scalar(Parameter::Metallic), read(TextureChannel::B, 0.25));
    assert_eq!(*material.scalar(Parameter::Roughness), read(TextureChannel::G, 0.75));
    assert_eq!(scalar(&material, Parameter::Specular), 0.5, "F0 is 0.04");
    assert_eq!(scalar(&material, Parameter::SheenTint), 0.0);
    assert_eq!(quality(&notes, "baseColorFactor"), Quality::Carried);
    let mut notes = Vec::new();
    let options = ConvertOptions { diffuse: Some(DiffuseModel::LambertFresnel), ..Default::default() };
    convert("m", &source, &options, &mut notes, &mut Vec::new());
    assert_eq!(quality(&notes, "baseColorFactor"), Quality::Exact);
}

#[test]
fn alpha_modes_become_coverage() {
    let with = |alpha_mode| {
        let source = GltfMaterial { alpha_mode, alpha_factor: 0.25, ..GltfMaterial::default() };
        run(&source).0.opacity
    };
    assert_eq!(with(AlphaMode::Opaque), Opacity::default());
    let alpha = Param::Constant(0.25);
    assert_eq!(with(AlphaMode::Blend), Opacity { alpha: alpha.clone(), cutoff: None });
    assert_eq!(with(AlphaMode::Mask { cutoff: 0.5 }), Opacity { alpha, cutoff: Some(0.5) });
}

#[test]
fn emission_leaves_both_sides_only_if_double_sided() {
    let source =
        GltfMaterial { emissive_factor: Rgb::grey(0.5), emissive_strength: 4.0, ..GltfMaterial::default() };
    let emission = run(&source).0.emission;
    let expected =
        Emission { color: Param::Constant(Rgb::grey(0.5)), strength: 4.0, sides: Sides::Front, unlit: false };
    assert_eq!(emission, expected);
    let both = run(&GltfMaterial { double_sided: true, ..source }).0;
    assert_eq!((both.emission.sides, both.sides), (Sides::Both, Sides::Both));
}

#[test]
fn ior_becomes_specular() {
    let specular = |ior| {
        let (material, notes) = run(&GltfMaterial { ior: Some(ior), ..GltfMaterial::default() });
        (scalar(&material, Parameter::Specular), quality(&notes, "KHR_materials_ior"))
    };
    assert!((specular(1.79).0 - 1.0).abs() < 3e-3);
    assert!((specular(2.42).0 - 2.155).abs() < 1e-3, "diamond");
    assert_eq!(specular(1.0), (0.0, Quality::Carried));
    assert_eq!(specular(0.0), (12.5, Quality::Approximated));
}

#[test]
fn a_specular_colour_of_the_bases_hue_is_kept() {
    let base = Rgb::new(0.8, 0.4, 0.2);
    let source = |color| GltfMaterial {
        base_color_factor: base,
        specular: Some(GltfSpecular { factor: 0.5, texture: None, color, color_texture: None }),
        ..GltfMaterial::default()
    };
    let (material, notes) = run(&source(base));
    assert!((scalar(&material, Parameter::SpecularTint) - 1.0).abs() < 1e-6);
    let f0 = 0.04 * 0.5 * disney_luminance(base.cast()) as f32;
    assert!((scalar(&material, Parameter::Specular) - f0 / 0.08).abs() < 1e-6);
    let note = notes.iter().find(|n| n.field == "KHR_materials_specular").unwrap();
    assert!(note.reason.contains("hue: exact"), "{}", note.reason);
    let (material, notes) = run(&source(Rgb::new(0.2, 0.4, 0.8)));
    assert_eq!(scalar(&material, Parameter::SpecularTint), 0.0, "the opposite hue");
    let note = notes.iter().find(|n| n.field == "KHR_materials_specular").unwrap();
    assert!(note.reason.contains("off by"), "{}", note.reason);
}

#[test]
fn specular_and_sheen_textures_multiply_what_they_scale() {
    let map = |id| Some(TextureMap::new(TextureId(id), TextureChannel::R));
    let source = |texture, color_texture| GltfMaterial {
        specular: Some(GltfSpecular { factor: 0.5, texture, color: Rgb::WHITE, color_texture }),
        sheen: Some(GltfSheen { color: Rgb::WHITE, color_texture: map(9), roughness: 0.3 }),
        ..GltfMaterial::default()
    };
    let read = |id, channel, factor| Param::Texture { map: TextureMap::new(TextureId(id), channel), factor };
    let (material, notes) = run(&source(map(3), map(4)));
    assert_eq!(*material.scalar(Parameter::Specular), read(3, TextureChannel::A, 0.25));
    assert_eq!(*material.scalar(Parameter::F90), read(3, TextureChannel::A, 0.5));
    assert_eq!(*material.scalar(Parameter::Sheen), read(9, TextureChannel::Y, 1.0));
    assert_eq!(quality(&notes, "KHR_materials_specular.specularColorTexture"), Quality::Dropped);
    let (material, notes) = run(&source(None, map(4)));
    assert_eq!(*material.scalar(Parameter::Specular), read(4, TextureChannel::Y, 0.25));
    assert_eq!(scalar(&material, Parameter::F90), 0.5);
    assert_eq!(quality(&notes, "KHR_materials_specular.specularColorTexture"), Quality::Approximated);
}

#[test]
fn a_coat_of_factor_1_is_four_times_disneys() {
    let coat = |roughness| GltfClearcoat { factor: 1.0, texture: None, roughness, roughness_texture: None };
    let with =
        |roughness| run(&GltfMaterial { clearcoat: Some(coat(roughness)), ..GltfMaterial::default() }).0;
    assert_eq!(scalar(&with(0.0), Parameter::Clearcoat), 4.0);
    assert_eq!(scalar(&with(0.0), Parameter::ClearcoatGloss), 1.0);
    assert_eq!(scalar(&with(1.0), Parameter::ClearcoatGloss), 0.0);
    let gloss = scalar(&with(0.2), Parameter::ClearcoatGloss);
    assert!((0.1 * (1.0 - gloss) + 0.001 * gloss - 0.04).abs() < 1e-6, "alpha is roughness²");
}

#[test]
fn anisotropy_gives_gltfs_two_alphas() {
    for (roughness, strength) in [(0.8f32, 0.5f32), (0.5, 0.6), (1.0, 1.0), (0.7, 0.0)] {
        let anisotropy = Some(GltfAnisotropy { strength, rotation: 0.3, texture: None });
        let source = GltfMaterial { roughness_factor: roughness, anisotropy, ..GltfMaterial::default() };
        let (material, notes) = run(&source);
        // The parametrisation of disney.brdf.
        let aspect = (1.0 - 0.9 * scalar(&material, Parameter::Anisotropic)).sqrt();
        let r2 = Number::sqr(scalar(&material, Parameter::Roughness));
        let a = roughness * roughness;
        let t = a + (1.0 - a) * strength * strength;
        assert!((r2 / aspect - t).abs() < 1e-5, "along the tangent");
        assert!((r2 * aspect - a).abs() < 1e-5, "along the bitangent");
        assert_eq!(material.rotation, 0.3);
        assert_eq!(quality(&notes, "KHR_materials_anisotropy"), Quality::Exact);
    }
    let anisotropy = Some(GltfAnisotropy { strength: 1.0, rotation: 0.0, texture: None });
    let (material, notes) =
        run(&GltfMaterial { roughness_factor: 0.0, anisotropy, ..GltfMaterial::default() });
    assert_eq!(scalar(&material, Parameter::Anisotropic), 1.0);
    assert_eq!(quality(&notes, "KHR_materials_anisotropy"), Quality::Approximated);
}

#[test]
fn textures_of_coat_roughness_and_anisotropy_are_worked_out_at_each_point() {
    let map = |id| TextureMap::new(TextureId(id), TextureChannel::R);
    let source = GltfMaterial {
        roughness_factor: 0.5,
        clearcoat: Some(GltfClearcoat {
            factor: 0.5,
            texture: Some(map(1)),
            roughness: 0.6,
            roughness_texture: Some(map(2)),
        }),
        anisotropy: Some(GltfAnisotropy { strength: 0.7, rotation: 0.1, texture: Some(map(3)) }),
        ..GltfMaterial::default()
    };
    let (material, notes) = run(&source);
    let gloss = TextureMap { channel: TextureChannel::G, curve: Curve::GlossOfRoughness, ..map(2) };
    assert_eq!(*material.scalar(Parameter::ClearcoatGloss), Param::Texture { map: gloss, factor: 0.6 });
    assert_eq!(material.anisotropy, Some(AnisotropyMap { map: Some(map(3)), strength: 0.7 }));
    assert_eq!(scalar(&material, Parameter::Roughness), 0.5, "glTF's own");
    assert_eq!(quality(&notes, "KHR_materials_anisotropy.anisotropyTexture"), Quality::Exact);
    // A textured roughness alone makes the terms vary.
    let rough = GltfMaterial { metallic_roughness_texture: Some(map(4)), ..source };
    let anisotropy = Some(GltfAnisotropy { strength: 0.7, rotation: 0.1, texture: None });
    let (material, _) = run(&GltfMaterial { anisotropy, ..rough });
    assert_eq!(material.anisotropy, Some(AnisotropyMap { map: None, strength: 0.7 }));
}

#[test]
fn options_choose_the_coat_the_sheen_and_the_backs() {
    let source = GltfMaterial {
        clearcoat: Some(GltfClearcoat {
            factor: 0.5,
            texture: None,
            roughness: 0.0,
            roughness_texture: None,
        }),
        sheen: Some(GltfSheen { color: Rgb::grey(0.2), color_texture: None, roughness: 0.3 }),
        ..GltfMaterial::default()
    };
    let with = |options: ConvertOptions, double_sided| {
        let source = GltfMaterial { double_sided, ..source.clone() };
        convert("m", &source, &options, &mut Vec::new(), &mut Vec::new())
    };
    let default = ConvertOptions::default;
    let published = with(ConvertOptions { clearcoat: ClearcoatScale::Published, ..default() }, false);
    assert_eq!(scalar(&published, Parameter::Clearcoat), 0.5);
    assert!(!published.culled);
    let scaled = with(ConvertOptions { sheen_scale: 3.0, ..default() }, false);
    assert!((scalar(&scaled, Parameter::Sheen) - 0.6).abs() < 1e-6);
    let brightest = with(ConvertOptions { sheen_scale: 30.0, ..default() }, false);
    assert_eq!(scalar(&brightest, Parameter::Sheen), 1.0);
    let cull = ConvertOptions { cull: true, ..default() };
    assert!(with(cull.clone(), false).culled && !with(cull, true).culled);
}

#[test]
fn what_is_not_read_is_dropped_aloud() {
    let source = GltfMaterial {
        unread: vec!["KHR_materials_iridescence".into()],
        unlit: true,
        ..GltfMaterial::default()
    };
    let (material, notes) = run(&source);
    assert_eq!(quality(&notes, "KHR_materials_iridescence"), Quality::Dropped);
    assert_eq!(material.model, Model::Diffuse);
    assert_eq!(material.emission.color, Param::Constant(Rgb::WHITE));
}

#[test]
fn transmission_is_a_sheet_without_a_volume_and_a_solid_with_one() {
    let source = GltfMaterial {
        base_color_factor: Rgb::new(0.2, 0.4, 0.6),
        transmission: Some(GltfTransmission { factor: 0.75, texture: None }),
        ior: Some(1.33),
        ..GltfMaterial::default()
    };
    let (sheet, notes) = run(&source);
    assert_eq!((scalar(&sheet, Parameter::SpecTrans), sheet.thin_walled), (0.75, true));
    assert_eq!((scalar(&sheet, Parameter::Ior), sheet.transmission_color.clone()), (1.33, None));
    assert_eq!(quality(&notes, "KHR_materials_transmission"), Quality::Approximated);
    assert!(sheet.transmits() && !sheet.is_interface());
    let volume =
        GltfVolume { thickness: 0.1, attenuation_color: Rgb::new(0.5, 0.0, 1.0), attenuation_distance: 0.25 };
    let (solid, notes) = run(&GltfMaterial { volume: Some(volume), ..source });
    assert!(!solid.thin_walled && solid.is_interface());
    assert_eq!(solid.transmission_color, Some(Param::Constant(Rgb::new(0.2, 0.4, 0.6))));
    assert!((solid.absorption.r - 4.0 * std::f32::consts::LN_2).abs() < 1e-6);
    assert!(solid.absorption.g > 50.0 && solid.absorption.b == 0.0, "{:?}", solid.absorption);
    assert_eq!(quality(&notes, "KHR_materials_transmission"), Quality::Exact);
    assert_eq!(quality(&notes, "KHR_materials_volume"), Quality::Approximated, "a colour of 0");
}

#[test]
fn diffuse_transmission_keeps_its_own_colour() {
    let diffuse = GltfDiffuseTransmission {
        factor: 0.5,
        texture: None,
        color: Rgb::new(1.0, 0.5, 0.0),
        color_texture: None,
    };
    let (leaf, _) = run(&GltfMaterial { diffuse_transmission: Some(diffuse), ..GltfMaterial::default() });
    assert_eq!((scalar(&leaf, Parameter::DiffTrans), leaf.thin_walled), (1.0, true));
    assert_eq!(leaf.diff_trans_color, Some(Param::Constant(Rgb::new(1.0, 0.5, 0.0))));
}

#[test]
fn the_specular_factor_dims_grazing_angles_too() {
    let specular = Some(GltfSpecular { factor: 0.25, texture: None, color: Rgb::WHITE, color_texture: None });
    let (material, _) = run(&GltfMaterial { specular, ..GltfMaterial::default() });
    assert_eq!(scalar(&material, Parameter::F90), 0.25);
    assert!((scalar(&material, Parameter::Specular) - 0.125).abs() < 1e-7);
}
