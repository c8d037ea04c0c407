//! Edits of a small scene.

use std::sync::Arc;

use glam::{Affine3A, Vec3};

use super::*;
use crate::disney::{Masking, Model, Parameter};
use crate::scene::camera::{FovAxis, Projection};
use crate::scene::environment::{EnvironmentMap, Equirectangular};
use crate::scene::material::{Param, TextureChannel, TextureMap};
use crate::scene::texture::Pixels;
use crate::scene::{Camera, Instance, MaterialId, Mesh, MeshId, TextureId};

fn scene() -> Scene<Material> {
    let mesh =
        Mesh { positions: vec![Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.0, 1.0)], ..Default::default() };
    let light = |kind| Light { kind, color: Rgb::WHITE, intensity: 1.0 };
    Scene {
        meshes: vec![Arc::new(mesh)],
        instances: vec![Instance {
            name: "cube".into(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        }],
        materials: ["ball", "floor", "Metal.001"].map(|n| Named::new(n, Material::default())).into(),
        cameras: vec![
            Named::new("main", Camera::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 0.7)),
            Named::new("top", Camera::look_at(Vec3::new(0.0, 9.0, 0.1), Vec3::ZERO, Vec3::Y, 0.7)),
        ],
        lights: vec![
            Named::new("sun", light(LightKind::Directional { direction: -Vec3::Y })),
            Named::new("bulb", light(LightKind::Point { position: Vec3::Y, range: None })),
            Named::new(
                "torch",
                light(LightKind::Spot {
                    position: Vec3::Y,
                    direction: -Vec3::Y,
                    inner: 0.1,
                    outer: 0.2,
                    range: None,
                }),
            ),
        ],
        ..Scene::empty()
    }
}

fn number(n: f64) -> Value {
    Value::Number(n)
}
fn text(t: &str) -> Value {
    Value::Text(t.into())
}
fn list(items: &[f64]) -> Value {
    Value::List(items.iter().map(|n| Value::Number(*n)).collect())
}

/// Applies to a fresh scene, with a 2 × 1 image for every file.
fn edited(edits: &[(&str, Value)]) -> Result<(Scene<Material>, RenderSettings), EditError> {
    let mut scene = scene();
    let mut settings = RenderSettings::default();
    let overrides: Vec<_> =
        edits.iter().map(|(path, value)| Override { path: (*path).into(), value: value.clone() }).collect();
    let mut load = |file: &Path| -> Result<Arc<Image>, BoxedError> {
        if file == Path::new("missing.hdr") {
            return Err("no such file".into());
        }
        let pixels = Pixels::F32(vec![1.0, -2.0, 3.0, 4.0, 5.0, 6.0]);
        Ok(Arc::new(Image { name: file.display().to_string(), width: 2, height: 1, channels: 3, pixels }))
    };
    apply_all(&mut scene, &mut settings, &overrides, &mut load)?;
    Ok((scene, settings))
}

fn camera(edits: &[(&str, Value)]) -> Camera {
    edited(edits).unwrap().0.cameras[0].item.clone()
}

fn position(camera: &Camera) -> Vec3 {
    camera.world_from_camera.translation.into()
}

fn looks_at(camera: &Camera, target: Vec3) -> bool {
    let forward = -Vec3::from(camera.world_from_camera.matrix3.z_axis);
    (target - position(camera)).normalize().dot(forward) > 0.99999
}

#[test]
fn a_constant_takes_the_place_of_a_texture() {
    let mut scene = scene();
    let map = TextureMap::new(TextureId(0), TextureChannel::G);
    *scene.materials[0].item.scalar_mut(Parameter::Roughness) = Param::Texture { map, factor: 1.0 };
    let mut none = |_: &Path| -> Result<Arc<Image>, BoxedError> { Err("unused".into()) };
    let mut settings = RenderSettings::default();
    apply(&mut scene, &mut settings, "material.ball.roughness", &number(0.3), &mut none).unwrap();
    assert_eq!(scene.materials[0].item.scalar(Parameter::Roughness), &Param::Constant(0.3));
}

#[test]
fn materials_change_by_name_and_by_pattern() {
    let (scene, _) = edited(&[
        ("material.*.model", text("diffuse")),
        ("material.Metal.001.metallic", number(1.0)),
        ("material.ball.base_color", text("#ffffff")),
        ("material.ball.masking", text("remapped")),
        ("material.ball.rotation", number(90.0)),
        ("material.ball.cutoff", number(0.5)),
    ])
    .unwrap();
    assert!(scene.materials.iter().all(|m| m.item.model == Model::Diffuse));
    assert_eq!(scene.materials[2].item.scalar(Parameter::Metallic).constant(), Some(1.0));
    let ball = &scene.materials[0].item;
    assert_eq!(ball.base_color.constant(), Some(Rgb::WHITE));
    assert_eq!((ball.masking, ball.opacity.cutoff), (Masking::Remapped, Some(0.5)));
    assert!((ball.rotation - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
}

#[test]
fn a_name_the_scene_lacks_is_told_with_the_nearest_and_all_others() {
    let error = edited(&[("material.bal.roughness", number(0.5))]).unwrap_err();
    assert_eq!(error.to_string(), "the scene has no material `bal`");
    assert_eq!(
        error.hint().unwrap(),
        "did you mean `ball`? it has the materials `ball`, `floor`, `Metal.001`"
    );
    let error = edited(&[("camera.name", text("mian"))]).unwrap_err();
    assert!(error.hint().unwrap().contains("`main`, `top`"), "{:?}", error.hint());
    assert_eq!(error.half(), Half::Value);
    assert!(matches!(edited(&[("light.x*.intensity", number(1.0))]), Err(EditError::UnknownName { .. })));
}

#[test]
fn values_out_of_range_or_of_another_type_say_what_is_taken() {
    let message = |path: &str, value: Value| check_value(path, &value).unwrap_err().to_string();
    assert_eq!(
        message("material.ball.roughness", number(1.5)),
        "`material.ball.roughness` is 1.5, but must be a number in [0, 1]"
    );
    assert_eq!(
        message("material.ball.base_color", list(&[0.1, 2.0, 0.1])),
        "`material.ball.base_color` is [0.1, 2, 0.1], but must be a colour [r, g, b] in [0, 1] or \"#rrggbb\""
    );
    for (path, value) in [
        ("material.a.roughness", number(f64::NAN)),
        ("material.a.roughness", text("rough")),
        ("material.a.model", text("glass")),
        ("material.a.base_color", list(&[0.1, 0.1])),
        ("material.a.emission_strength", number(-1.0)),
        ("material.a.ior", number(0.0)),
        ("camera.fov", number(180.0)),
        ("camera.orbit", list(&[0.0, 91.0])),
        ("camera.c2w", list(&[1.0, 0.0, 0.0, 0.0])),
        ("camera.up", list(&[0.0, 0.0, 0.0])),
        ("light.a.intensity", number(f64::INFINITY)),
        ("environment.kind", text("sky")),
        ("render.spp", number(0.5)),
        ("render.spp", number(0.0)),
        ("render.width", number(1e9)),
        ("render.filter", text("gauss")),
        ("render.integrator", text("normal")),
        ("render.integrator", text("point")),
        ("render.nee", number(0.0)),
    ] {
        assert!(matches!(check_value(path, &value), Err(EditError::Value { .. })), "{path} {value}");
    }
}

#[test]
fn every_integrator_that_is_told_to_be_one_is_one() {
    let Target::Render(field) = Target::parse("render.integrator").unwrap() else { panic!() };
    let names: Vec<&str> = field.expects().split('"').skip(1).step_by(2).collect();
    assert_eq!(names.len(), 8);
    for name in names {
        let mut settings = RenderSettings::default();
        set_render(&mut settings, "render.integrator", &text(name)).unwrap();
        assert_eq!(settings.integrator.name(), name);
        // As manifests and records write it.
        assert_eq!(serde_json::to_value(settings.integrator).unwrap(), name);
    }
    // Settings that are as usual are left out: keys of jobs do not change with every new one.
    let usual = serde_json::to_string(&RenderSettings::default()).unwrap();
    assert!(!usual.contains("integrator") && !usual.contains("mis"), "{usual}");
}

#[test]
fn position_alone_keeps_the_target_and_order_does_not_matter() {
    let moved = camera(&[("camera.position", list(&[3.0, 2.0, 1.0]))]);
    assert_eq!(position(&moved), Vec3::new(3.0, 2.0, 1.0));
    assert!(looks_at(&moved, Vec3::ZERO));
    let (a, b) = (("camera.position", list(&[3.0, 2.0, 1.0])), ("camera.target", list(&[0.0, 1.0, 0.0])));
    let both = camera(&[a.clone(), b.clone()]);
    assert_eq!(both, camera(&[b, a]));
    assert!(looks_at(&both, Vec3::Y));
}

#[test]
fn an_orbit_goes_counter_clockwise_around_the_target() {
    let at = |azimuth: f64, elevation: f64| {
        let camera = camera(&[("camera.orbit", list(&[azimuth, elevation]))]);
        assert!(looks_at(&camera, Vec3::ZERO));
        position(&camera)
    };
    assert!(at(0.0, 0.0).distance(Vec3::Z * 5.0) < 1e-5);
    assert!(at(90.0, 0.0).distance(Vec3::X * 5.0) < 1e-5);
    assert!(at(0.0, 90.0).distance(Vec3::Y * 5.0) < 1e-5);
    let near = camera(&[("camera.distance", number(2.0)), ("camera.orbit", list(&[180.0, 0.0]))]);
    assert!(position(&near).distance(Vec3::Z * -2.0) < 1e-5);
    let nearer = camera(&[("camera.distance", number(2.0))]);
    assert!(position(&nearer).distance(Vec3::Z * 2.0) < 1e-5);
}

#[test]
fn a_mirroring_camera_goes_on_mirroring_and_c2w_may_mirror() {
    let rows = Value::List(vec![
        list(&[-1.0, 0.0, 0.0, 1.0]),
        list(&[0.0, 1.0, 0.0, 2.0]),
        list(&[0.0, 0.0, 1.0, 3.0]),
    ]);
    let mirrored = camera(&[("camera.c2w", rows.clone())]);
    assert_eq!(position(&mirrored), Vec3::new(1.0, 2.0, 3.0));
    assert!(mirrored.world_from_camera.matrix3.determinant() < 0.0);
    let mut scene = scene();
    scene.cameras[0].item = mirrored;
    let mut none = |_: &Path| -> Result<Arc<Image>, BoxedError> { Err("unused".into()) };
    let at = list(&[0.0, 0.0, 4.0]);
    apply(&mut scene, &mut RenderSettings::default(), "camera.position", &at, &mut none).unwrap();
    assert!(scene.cameras[0].item.world_from_camera.matrix3.determinant() < 0.0);
    let conflict = edited(&[("camera.c2w", rows), ("camera.target", list(&[0.0, 0.0, 0.0]))]);
    assert!(matches!(conflict, Err(EditError::Conflict { .. })));
}

#[test]
fn lens_fov_and_roll() {
    let c = camera(&[
        ("camera.fov_x", number(90.0)),
        ("camera.lens_radius", number(0.1)),
        ("camera.roll", number(90.0)),
        ("camera.pixel_offset", list(&[-0.5, 0.5])),
    ]);
    let Projection::Perspective { fov, axis } = c.projection else { panic!("{c:?}") };
    assert_eq!((fov, axis), (std::f32::consts::FRAC_PI_2, FovAxis::X));
    assert!((c.lens.unwrap().focal_distance - 5.0).abs() < 1e-5, "the target is sharp: {:?}", c.lens);
    let right = Vec3::from(c.world_from_camera.matrix3.x_axis);
    assert!(right.distance(Vec3::Y) < 1e-6, "{right}");
    assert_eq!(c.pixel_offset, glam::Vec2::new(-0.5, 0.5));
    assert!(matches!(
        edited(&[("camera.focal_distance", number(2.0))]),
        Err(EditError::NotApplicable { .. })
    ));
    assert!(matches!(
        edited(&[("camera.fov", number(30.0)), ("camera.fov_x", number(30.0))]),
        Err(EditError::Conflict { .. })
    ));
}

#[test]
fn degenerate_poses_are_refused() {
    let same = edited(&[("camera.position", list(&[1.0, 1.0, 1.0])), ("camera.target", list(&[1.0; 3]))]);
    assert!(matches!(same, Err(EditError::NoViewDirection { .. })));
    let far = edited(&[("camera.position", list(&[3e38, 3e38, 3e38]))]);
    assert!(matches!(far, Err(EditError::NoViewDirection { .. })));
}

#[test]
fn the_named_camera_is_the_one_that_changes() {
    let (scene, settings) = edited(&[("camera.fov", number(20.0)), ("camera.name", text("top"))]).unwrap();
    assert_eq!(settings.camera.as_deref(), Some("top"));
    assert_eq!(scene.cameras[0].item, self::scene().cameras[0].item);
    assert_ne!(scene.cameras[1].item, self::scene().cameras[1].item);
}

#[test]
fn a_position_makes_a_camera_where_there_is_none() {
    let mut bare = scene();
    bare.cameras.clear();
    let mut none = |_: &Path| -> Result<Arc<Image>, BoxedError> { Err("unused".into()) };
    let mut settings = RenderSettings::default();
    let failed = apply(&mut bare, &mut settings, "camera.fov", &number(30.0), &mut none);
    assert!(matches!(failed, Err(EditError::NoCamera)));
    apply(&mut bare, &mut settings, "camera.position", &list(&[0.0, 0.0, 3.0]), &mut none).unwrap();
    assert!(looks_at(&bare.cameras[0].item, Vec3::ZERO));
}

#[test]
fn lights_have_the_fields_of_their_kind() {
    let (scene, _) = edited(&[
        ("light.*.intensity", number(3.0)),
        ("light.*.position", list(&[1.0, 2.0, 3.0])),
        ("light.torch.inner", number(30.0)),
        ("light.torch.outer", number(45.0)),
    ])
    .unwrap();
    assert!(scene.lights.iter().all(|l| l.item.intensity == 3.0));
    assert!(matches!(scene.lights[1].item.kind, LightKind::Point { position, .. } if position.z == 3.0));
    let refused = edited(&[("light.sun.position", list(&[0.0; 3]))]).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "`light.sun.position` cannot be set: a directional light has no position"
    );
    let inverted = edited(&[("light.torch.inner", number(30.0))]);
    assert!(matches!(inverted, Err(EditError::NotApplicable { .. })), "the outer angle is 0.2 rad");
}

#[test]
fn an_environment_is_made_where_there_is_none() {
    let (scene, _) = edited(&[("environment.intensity", number(2.0))]).unwrap();
    let environment = scene.environment.unwrap();
    assert_eq!((environment.map, environment.intensity), (EnvironmentMap::Constant, 2.0));
    let (scene, _) =
        edited(&[("environment.rotation", number(180.0)), ("environment.image", text("sky.hdr"))]).unwrap();
    let environment = scene.environment.unwrap();
    let EnvironmentMap::Image { image, mapping } = environment.map else { panic!("{environment:?}") };
    assert_eq!(mapping, Equirectangular::YUp);
    assert!((environment.rotation - std::f32::consts::PI).abs() < 1e-6);
    let pixels = &scene.images[image.0 as usize].pixels;
    assert_eq!(*pixels, Pixels::F32(vec![1.0, 0.0, 3.0, 4.0, 5.0, 6.0]), "negative radiance becomes 0");
    let error = edited(&[("environment.image", text("missing.hdr"))]).unwrap_err();
    assert_eq!(error.to_string(), "cannot use missing.hdr as `environment.image`: no such file");
    let (scene, _) =
        edited(&[("environment.image", text("sky.hdr")), ("environment.kind", text("none"))]).unwrap();
    assert!(scene.environment.is_none());
}

/// Sets the environment's image to these pixels, 2 × 1.
fn with_sky(scene: &mut Scene<Material>, channels: u8, pixels: Pixels) -> Result<(), EditError> {
    let mut load = move |_: &Path| -> Result<Arc<Image>, BoxedError> {
        Ok(Arc::new(Image { name: "sky".into(), width: 2, height: 1, channels, pixels: pixels.clone() }))
    };
    apply(scene, &mut RenderSettings::default(), "environment.image", &text("sky"), &mut load)
}

#[test]
fn eight_bit_skies_are_decoded_and_unsound_ones_refused() {
    let mut lit = scene();
    with_sky(&mut lit, 1, Pixels::U8(vec![255, 188])).unwrap();
    let Pixels::F32(values) = &lit.images[0].pixels else { panic!("{:?}", lit.images[0]) };
    assert_eq!((lit.images[0].channels, values.len(), values[0]), (3, 6, 1.0));
    assert!((values[3] - 0.502_9).abs() < 1e-3, "{values:?}");
    let refused = with_sky(&mut scene(), 3, Pixels::F32(vec![f32::NAN; 6]));
    assert!(matches!(refused, Err(EditError::ImageNotFinite { .. })));
    let refused = with_sky(&mut scene(), 3, Pixels::F32(vec![1.0; 5]));
    assert!(matches!(refused, Err(EditError::ImageSize { found: 5, expected: 6, .. })));
}

#[test]
fn another_image_keeps_the_mapping_of_the_first() {
    let mut aris = scene();
    with_sky(&mut aris, 1, Pixels::F32(vec![1.0; 2])).unwrap();
    let image = crate::scene::ImageId(0);
    aris.environment.as_mut().unwrap().map = EnvironmentMap::Image { image, mapping: Equirectangular::Aris };
    with_sky(&mut aris, 1, Pixels::F32(vec![2.0; 2])).unwrap();
    let map = &aris.environment.as_ref().unwrap().map;
    let second = crate::scene::ImageId(1);
    assert_eq!(*map, EnvironmentMap::Image { image: second, mapping: Equirectangular::Aris });
}

#[test]
fn a_z_up_scene_is_orbited_about_z() {
    let mut scene = scene();
    scene.cameras[0].item = Camera::look_at(Vec3::new(0.0, -4.0, 1.0), Vec3::Z, Vec3::Z, 0.7);
    let mut none = |_: &Path| -> Result<Arc<Image>, BoxedError> { Err("unused".into()) };
    let mut settings = RenderSettings::default();
    for (azimuth, expected) in [(0.0, Vec3::new(0.0, -4.0, 1.0)), (90.0, Vec3::new(4.0, 0.0, 1.0))] {
        let overrides = [
            Override { path: "camera.orbit".into(), value: list(&[azimuth, 0.0]) },
            Override { path: "camera.target".into(), value: list(&[0.0, 0.0, 1.0]) },
        ];
        apply_all(&mut scene, &mut settings, &overrides, &mut none).unwrap();
        let at = position(&scene.cameras[0].item);
        assert!(at.distance(expected) < 1e-5, "{at}");
        assert!(looks_at(&scene.cameras[0].item, Vec3::Z));
    }
}
