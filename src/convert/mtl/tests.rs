//! The table of MTL statements, row by row.

use std::f32::consts::TAU;

use super::*;
use crate::convert::PhongRoughness;
use crate::scene::TextureId;
use crate::scene::material::Curve;

fn converted(source: &MtlMaterial) -> (Material, Vec<Note>, Vec<Warning>) {
    let (mut notes, mut warnings) = (Vec::new(), Vec::new());
    let material = convert("m", source, &ConvertOptions::default(), &mut notes, &mut warnings);
    (material, notes, warnings)
}

fn quality(notes: &[Note], field: &str) -> Option<Quality> {
    notes.iter().find(|n| n.field == field).map(|n| n.quality)
}

fn constant(material: &Material, parameter: Parameter) -> f32 {
    material.scalar(parameter).constant().unwrap()
}

/// A slot with the texture `id`.
fn loaded(slot: MtlSlot, id: u32) -> (MtlSlot, MtlMap) {
    let mut map = MtlMap::new("a.png", 3);
    map.texture = Some(TextureId(id));
    (slot, map)
}

#[test]
fn plain_colours_are_lambert_exactly() {
    let color = Rgb::new(0.6, 0.1, 0.1);
    let kd = Some(color);
    for source in [
        MtlMaterial { kd, ..Default::default() },
        MtlMaterial {
            kd,
            illum: Some(1),
            ks: Some(Rgb::WHITE),
            ns: Some(10.0),
            ni: Some(1.5),
            ..Default::default()
        },
        MtlMaterial { kd, illum: Some(2), ..Default::default() },
        MtlMaterial {
            kd,
            illum: Some(2),
            ks: Some(Rgb::BLACK),
            ns: Some(10.0),
            ni: Some(1.5),
            maps: vec![loaded(MtlSlot::Ns, 1)],
            ..Default::default()
        },
    ] {
        let (material, notes, warnings) = converted(&source);
        assert_eq!(material.model, Model::Diffuse);
        assert_eq!(material.base_color, Param::Constant(color));
        assert_eq!(material.sides, Sides::Both);
        assert!(notes.iter().all(|n| n.quality == Quality::Exact), "{notes:?}");
        assert!(warnings.is_empty());
    }
}

#[test]
fn a_black_ks_leaves_a_highlight_to_its_map_and_to_ni() {
    let black = MtlMaterial { ks: Some(Rgb::BLACK), ns: Some(10.0), ..Default::default() };
    let mapped = MtlMaterial { maps: vec![loaded(MtlSlot::Ks, 1)], ..black.clone() };
    assert_eq!(converted(&mapped).0.model, Model::Disney);
    let (material, notes, _) = converted(&MtlMaterial { illum: Some(5), ni: Some(1.5), ..black });
    assert_eq!(material.model, Model::Disney);
    assert!((constant(&material, Parameter::Specular) - 0.5).abs() < 1e-6);
    assert_eq!(quality(&notes, "Ks"), Some(Quality::Dropped), "Ni is there in its place");
}

#[test]
fn clamped_maps_tell_what_is_beyond_them() {
    let (slot, mut map) = loaded(MtlSlot::Kd, 1);
    map.wrap = Wrap::Clamp;
    let (_, notes, _) = converted(&MtlMaterial { maps: vec![(slot, map)], ..Default::default() });
    assert_eq!(quality(&notes, "map_Kd -clamp"), Some(Quality::Approximated));
}

#[test]
fn phong_becomes_specular_and_roughness() {
    let source = MtlMaterial {
        kd: Some(Rgb::new(0.8, 0.4, 0.2)),
        ks: Some(Rgb::new(0.4, 0.5, 0.6)),
        ns: Some(250.0),
        ni: Some(1.5),
        illum: Some(2),
        ..Default::default()
    };
    let (material, notes, _) = converted(&source);
    assert_eq!(material.model, Model::Disney);
    assert!((constant(&material, Parameter::Specular) - 0.5).abs() < 1e-6);
    // (2/252)^(1/4)
    assert!((constant(&material, Parameter::Roughness) - 0.298_478_1).abs() < 1e-5);
    assert_eq!(constant(&material, Parameter::SpecularTint), 0.0, "the other hue");
    assert_eq!(quality(&notes, "Kd"), Some(Quality::Carried));
    assert_eq!(quality(&notes, "Ns"), Some(Quality::Approximated));
    assert_eq!(quality(&notes, "Ni"), Some(Quality::Dropped));
    let same_hue = MtlMaterial { ks: Some(Rgb::new(0.4, 0.2, 0.1)), ..source.clone() };
    assert!((constant(&converted(&same_hue).0, Parameter::SpecularTint) - 1.0).abs() < 1e-5);
    let (material, ..) = converted(&MtlMaterial { illum: Some(5), ni: Some(1.8), ..source });
    assert!((constant(&material, Parameter::Specular) - 1.020_408).abs() < 1e-5, "(0.8/2.8)²/0.08");
}

#[test]
fn physically_based_statements_override() {
    let source = MtlMaterial {
        illum: Some(1),
        ns: Some(10.0),
        pr: Some(0.3),
        pm: Some(1.0),
        pc: Some(0.5),
        pcr: Some(0.2),
        ps: Some(2.0),
        aniso: Some(0.4),
        anisor: Some(0.25),
        ..Default::default()
    };
    let (material, notes, warnings) = converted(&source);
    assert_eq!(material.model, Model::Disney);
    let value = |p| constant(&material, p);
    assert_eq!((value(Parameter::Roughness), value(Parameter::Metallic)), (0.3, 1.0));
    assert_eq!((value(Parameter::Clearcoat), value(Parameter::Sheen)), (0.5, 1.0));
    assert!((value(Parameter::ClearcoatGloss) - 0.06 / 0.099).abs() < 1e-5);
    assert!((material.rotation - TAU / 4.0).abs() < 1e-6);
    assert_eq!(quality(&notes, "Ns"), Some(Quality::Dropped));
    assert_eq!(warnings.len(), 1, "Ps is out of range: {warnings:?}");
}

#[test]
fn dissolve_wins_over_transparency() {
    let alpha = |d, tr| converted(&MtlMaterial { d, tr, ..Default::default() }).0.opacity.alpha;
    assert_eq!(alpha(Some(0.5), Some(0.9)), Param::Constant(0.5));
    assert_eq!(alpha(None, Some(0.25)), Param::Constant(0.75));
    assert_eq!(alpha(None, None), Param::Constant(1.0));
}

#[test]
fn smooth_glass_is_a_dielectric_and_rough_or_tinted_glass_an_interface() {
    let glass = MtlMaterial {
        illum: Some(7),
        ni: Some(1.45),
        tf: Some(Rgb::WHITE),
        d: Some(0.2),
        ..Default::default()
    };
    let (material, notes, _) = converted(&glass);
    assert_eq!(material.model, Model::Dielectric);
    assert_eq!(material.scalar(Parameter::Ior).constant(), Some(1.45));
    assert_eq!(material.opacity.alpha, Param::Constant(1.0));
    assert_eq!(quality(&notes, "illum"), Some(Quality::Approximated));
    let (material, notes, _) = converted(&MtlMaterial { pr: Some(0.4), ..glass.clone() });
    assert_eq!((material.model, material.is_interface()), (Model::Disney, true));
    assert_eq!((constant(&material, Parameter::Roughness), constant(&material, Parameter::Ior)), (0.4, 1.45));
    assert_eq!(quality(&notes, "Tf"), Some(Quality::Approximated));
    let tf = Rgb::new(0.9, 0.5, 0.1);
    let (material, ..) = converted(&MtlMaterial { tf: Some(tf), ..glass.clone() });
    assert_eq!(
        (constant(&material, Parameter::SpecTrans), constant(&material, Parameter::Roughness)),
        (1.0, 0.0)
    );
    assert_eq!(material.transmission_color, Some(Param::Constant(tf)));
    let (material, ..) = converted(&MtlMaterial { illum: Some(4), tf: None, ..glass });
    assert_eq!(material.model, Model::Disney, "illum 4 alone is plain transparency");
}

#[test]
fn maps_multiply_and_their_options_act_on_v_upwards() {
    let mut map = MtlMap::new("a.png", 3);
    map.texture = Some(TextureId(0));
    (map.scale, map.offset) = (Vec2::new(2.0, 4.0), Vec2::new(0.5, 0.25));
    map.bump_multiplier = 0.2;
    let missing = MtlMap::new("b.png", 4);
    let source = MtlMaterial {
        kd: Some(Rgb::grey(0.5)),
        maps: vec![(MtlSlot::Kd, map.clone()), (MtlSlot::D, missing), (MtlSlot::Bump, map)],
        ..Default::default()
    };
    let (material, notes, _) = converted(&source);
    let Param::Texture { map, factor } = &material.base_color else { panic!("{material:?}") };
    assert_eq!(*factor, Rgb::grey(0.5));
    // The bottom left corner, (0, 0) upwards, is (0, 1) downwards.
    let uv = map.coordinates(Vec2::new(0.0, 1.0));
    assert!((uv - Vec2::new(0.5, 1.0 - 0.25)).length() < 1e-6, "{uv}");
    assert_eq!(quality(&notes, "map_d"), Some(Quality::Dropped));
    assert_eq!(quality(&notes, "map_Bump"), Some(Quality::Approximated));
    let normals = material.normal_map.expect("slopes");
    assert_eq!((normals.map.texture, normals.scale), (TextureId(0), 0.2));
}

#[test]
fn maps_of_highlights_and_coats_vary_their_parameters() {
    let source = MtlMaterial {
        ks: Some(Rgb::grey(0.5)),
        ns: Some(100.0),
        maps: vec![loaded(MtlSlot::Ks, 1), loaded(MtlSlot::Ns, 2)],
        ..Default::default()
    };
    let read = |id, channel, curve, factor| {
        let map = TextureMap { curve, ..TextureMap::new(TextureId(id), channel) };
        Param::Texture { map, factor }
    };
    let (material, notes, _) = converted(&source);
    assert_eq!(*material.scalar(Parameter::Specular), read(1, TextureChannel::Y, Curve::Linear, 0.5));
    let exponent = read(2, TextureChannel::Y, Curve::RoughnessOfExponent, 100.0);
    assert_eq!(*material.scalar(Parameter::Roughness), exponent);
    assert_eq!(quality(&notes, "map_Ks"), Some(Quality::Approximated));
    // As Blender reads them: the map is the roughness.
    let blender = ConvertOptions { phong: PhongRoughness::Blender, ..Default::default() };
    let mut notes = Vec::new();
    let material = convert("m", &source, &blender, &mut notes, &mut Vec::new());
    assert_eq!(*material.scalar(Parameter::Roughness), read(2, TextureChannel::Y, Curve::Linear, 1.0));
    assert_eq!(quality(&notes, "Ns"), Some(Quality::Dropped));
    let plain = MtlMaterial { maps: Vec::new(), ns: Some(250.0), ..source };
    let material = convert("m", &plain, &blender, &mut Vec::new(), &mut Vec::new());
    assert_eq!(constant(&material, Parameter::Roughness), 0.5);

    let coat = MtlMaterial {
        pc: Some(0.5),
        maps: vec![loaded(MtlSlot::Pc, 3), loaded(MtlSlot::Pcr, 4)],
        ..Default::default()
    };
    let (material, ..) = converted(&coat);
    assert_eq!(*material.scalar(Parameter::Clearcoat), read(3, TextureChannel::Y, Curve::Linear, 1.0));
    let gloss = read(4, TextureChannel::Y, Curve::GlossOfRoughness, 1.0);
    assert_eq!(*material.scalar(Parameter::ClearcoatGloss), gloss);
}

#[test]
fn light_leaves_both_sides() {
    let (material, notes, _) = converted(&MtlMaterial { ke: Some(Rgb::grey(40.0)), ..Default::default() });
    assert!(material.emits());
    assert_eq!(material.emission.sides, Sides::Both);
    assert_eq!(quality(&notes, "Ke"), Some(Quality::Exact));
}
