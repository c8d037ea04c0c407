use std::path::Path;

use super::read::entries;
use super::*;
use crate::color::Rgb;
use crate::convert::{ConvertOptions, to_disney};
use crate::disney::{Model, Parameter};
use crate::import::{ImportOptions, Reach, import};
use crate::scene::material::{Curve, Param, TextureChannel, TextureMap};
use crate::scene::{AnisotropyMap, Material, Named, Scene, TextureId};

fn library(text: &str) -> Result<Scene<Material>, LibraryError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metals.yaml");
    std::fs::write(&path, text).unwrap();
    Library::read(&path, Reach::Folder)?.expect("a library").into_scene()
}

fn message(text: &str) -> (String, Option<String>) {
    let error = library(text).unwrap_err();
    let text = error.to_string();
    let start = text.find("metals.yaml").unwrap_or(0);
    (text[start..].to_owned(), error.hint())
}

#[test]
fn names_map_to_materials_in_either_spelling_and_shape() {
    let scene = library(
        "gold: {model: disney, base_color: [1.0, 0.77, 0.34], specularTint: 0.5}\nglass:\n  name: dielectric\n  config: \
         {ext_ior: 1.25, int_ior: 1.5}\n",
    )
    .unwrap();
    let materials = &scene.materials;
    assert_eq!(materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["gold", "glass"]);
    assert_eq!(materials[0].item.scalar(Parameter::SpecularTint).constant(), Some(0.5));
    assert_eq!(materials[1].item.model, Model::Dielectric);
    let ior = materials[1].item.scalar(Parameter::Ior).constant().unwrap();
    assert!((ior - 1.2).abs() < 1e-6);
    let single = library("color: [0.1, 0.2, 0.3]\nroughness: 0.9\n").unwrap();
    assert_eq!((single.materials.len(), single.materials[0].name.as_str()), (1, "metals"));
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let (unknown, hint) = message("gold:\n  rougness: 0.3\n");
    assert_eq!(unknown, "metals.yaml:2:3: a material has no field `rougness`");
    assert!(hint.unwrap().contains("`roughness`"));
    assert_eq!(
        message("gold:\n  roughness: 3\n").0,
        "metals.yaml:2:14: `roughness` is 3, but must be a number in [0, 1]"
    );
    assert!(message("gold: 3\nsilver: {}").0.contains("metals.yaml:1:7: a map of fields"));
    assert!(message("[1, 2]").0.contains("a map from names"));
    assert!(message("{").0.contains("metals.yaml:1:"));
    assert!(message("gold: {roughness: {file: ../a.png}}").0.contains("leads out of"));
    assert!(message("gold: {roughness: {file: a.png}}").0.contains("a.png"));
    assert!(message("gold: {roughness: {fil: a.png}}").0.contains("a texture has no `fil`; it has file,"));
    assert!(message("gold: {thin_walled: {file: a.png}}").0.contains("not a texture"));
    assert!(message("gold: {sides: {file: a.png}}").0.contains("a word is expected"));
}

#[test]
fn an_aris_scene_is_no_library() {
    assert!(entries("cbox.yaml", b"defaults:\n  - cbox_base\n").unwrap().is_none());
}

#[test]
fn written_materials_come_back_whatever_they_are_called() {
    let names = ["camera", "geometry", "brdf", "emitters", "defaults", "config", "file", "name"];
    for some in names.map(|name| vec![name]).into_iter().chain([names.to_vec()]) {
        let mut scene = Scene::empty();
        scene.materials = some.iter().map(|name| Named::new(*name, Material::default())).collect();
        let read = library(&write(&scene, "x.glb").text).unwrap();
        assert_eq!(read.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), some);
    }
}

#[test]
fn a_material_that_the_scene_lacks_is_told_with_the_nearest() {
    let mut scene = Scene::empty();
    scene.materials.push(Named::new("ball", Material::default()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.yaml");
    std::fs::write(&path, "bal: {roughness: 0.1}").unwrap();
    let error = Library::read(&path, Reach::Folder).unwrap().unwrap().lay_over(&mut scene).unwrap_err();
    assert!(error.to_string().ends_with("m.yaml:1:1: the scene has no material `bal`"), "{error}");
    assert!(error.hint().unwrap().contains("`ball`"));
}

#[test]
fn what_an_entry_does_not_say_stays() {
    let mut scene = Scene::empty();
    let mut material =
        Material { base_color: Param::Constant(Rgb::new(0.1, 0.2, 0.3)), ..Material::default() };
    *material.scalar_mut(Parameter::Metallic) = Param::Constant(1.0);
    scene.materials.push(Named::new("ball", material.clone()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.yaml");
    std::fs::write(&path, "ball: {roughness: 0.125}").unwrap();
    Library::read(&path, Reach::Folder).unwrap().unwrap().lay_over(&mut scene).unwrap();
    *material.scalar_mut(Parameter::Roughness) = Param::Constant(0.125);
    assert_eq!(scene.materials[0].item, material);
}

#[test]
fn what_only_conversions_make_comes_back_too() {
    let mut scene = to_disney(
        import(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spheres.glb"), &ImportOptions::default())
            .unwrap()
            .scene,
        &ConvertOptions::default(),
    )
    .scene;
    assert!(!scene.textures.is_empty());
    let map = |channel| TextureMap::new(TextureId(0), channel);
    let material = &mut scene.materials[0].item;
    material.anisotropy = Some(AnisotropyMap { map: Some(map(TextureChannel::R)), strength: 0.7 });
    let coat = TextureMap { curve: Curve::GlossOfRoughness, ..map(TextureChannel::Y) };
    *material.scalar_mut(Parameter::ClearcoatGloss) = Param::Texture { map: coat, factor: 0.3 };
    material.emission.color = Param::Constant(Rgb::grey(0.2));
    (material.emission.unlit, material.culled) = (true, true);
    let folder = tempfile::tempdir().unwrap();
    let written = write(&scene, "x.glb");
    written.textures.save(folder.path()).unwrap();
    let path = folder.path().join(FILE_NAME);
    std::fs::write(&path, &written.text).unwrap();
    let mut laid_over = scene.clone();
    laid_over.materials[0].item = Material::default();
    Library::read(&path, Reach::default()).unwrap().unwrap().lay_over(&mut laid_over).unwrap();
    assert_eq!(flat(&scene, &scene.materials[0].item), flat(&laid_over, &laid_over.materials[0].item));
}

/// Materials of all scenes of the project, textures and all: writing and laying over changes nothing.
#[test]
fn written_libraries_come_back_to_the_same_materials() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for file in ["spheres.glb", "shaderball.glb", "cornell.obj", "aris/config/scene/cbox_balls.yaml"] {
        let imported = import(&scenes.join(file), &ImportOptions::default()).unwrap();
        let scene = to_disney(imported.scene, &ConvertOptions::default()).scene;
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("textures")).unwrap();
        let written = write(&scene, file);
        written.textures.save(folder.path()).unwrap();
        let path = folder.path().join(FILE_NAME);
        std::fs::write(&path, &written.text).unwrap();
        let mut laid_over = scene.clone();
        Library::read(&path, Reach::Folder).unwrap().unwrap().lay_over(&mut laid_over).unwrap();
        for (before, after) in scene.materials.iter().zip(&laid_over.materials) {
            assert_eq!(flat(&scene, &before.item), flat(&laid_over, &after.item), "{file}: {}", before.name);
        }
    }
}

/// A material as text, its textures by what they hold.
fn flat(scene: &Scene<Material>, material: &Material) -> String {
    let mut text = format!("{material:?}");
    for (i, texture) in scene.textures.iter().enumerate().rev() {
        let image = &scene.images[texture.image.0 as usize];
        let content = blake3::hash(format!("{:?}", image.pixels).as_bytes());
        let Texture { encoding, wrap, filter, .. } = texture;
        let shown = format!("{encoding:?} {wrap:?} {filter:?} {} {} {content}", image.width, image.channels);
        text = text.replace(&format!("TextureId({i})"), &shown);
    }
    text
}

use crate::scene::texture::Texture;
