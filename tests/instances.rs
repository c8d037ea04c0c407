//! Meshes that stand in several places: the picture is the same bits whether they are shared or copied, and sharing takes no memory for
//! each place.

mod common;

use std::sync::Arc;

use common::{cube, emitting, lambert, scene, set_sky, small, sphere, square};
use glam::{Affine3A, Quat, Vec2, Vec3};
use pipeline::accel::Kernel;
use pipeline::color::Rgb;
use pipeline::disney::{Model, Parameter};
use pipeline::render::{Control, Geometry, Prepared, Rendered, render};
use pipeline::scene::material::{NormalMap, Param, TextureChannel, TextureMap};
use pipeline::scene::texture::{Encoding, Pixels, TexelFilter, Texture, Wrap};
use pipeline::scene::{
    Camera, Image, ImageId, Instance, Material, MaterialId, Mesh, MeshId, Scene, TextureId,
};
use pipeline::settings::{RenderSettings, Use};

/// A ball with normals and texture coordinates.
fn smooth(rings: u32) -> Mesh {
    let mut ball = sphere(1.0, Vec3::ZERO, rings);
    ball.normals.clone_from(&ball.positions);
    ball.uvs = vec![ball.positions.iter().map(|p| Vec2::new(p.x + 0.3 * p.y, p.z)).collect()];
    ball
}

/// A matrix that turns, scales by axes and shears.
fn any(i: u16, at: Vec3) -> Affine3A {
    let i = f32::from(i);
    let scale = Vec3::new(0.25, 0.2 + 0.02 * i, 0.3);
    let turn = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.7 * i), at);
    let mut shear = Affine3A::IDENTITY;
    shear.matrix3.y_axis.x = 0.1 * i;
    turn * shear
}

/// Balls and boxes on a floor: smooth, glossy with a normal map, partly there, of glass, mirrored, one in another, and one that emits;
/// under a sky. Some of a mesh's instances have no way back to the mesh's space.
fn crowd() -> Scene {
    let camera = Camera::look_at(Vec3::new(0.0, 2.5, 5.0), Vec3::new(0.0, 0.4, 0.0), Vec3::Y, 0.7);
    let metal = Material { base_color: Param::Constant(Rgb::new(0.9, 0.7, 0.5)), ..Material::default() };
    let glass = Material { model: Model::Dielectric, ..Material::default() };
    // Powers of two, whose products are exact in any order.
    let mut veil = lambert(0.6);
    veil.opacity.alpha = Param::Constant(0.5);
    let parts = vec![
        (square(4.0, 0.0), lambert(0.5)),
        (smooth(12), lambert(0.7)),
        (cube(0.8), metal),
        (smooth(3), veil),
        (smooth(5), glass),
        (smooth(4), emitting(lambert(0.2), 6.0)),
    ];
    let mut world = scene(parts, camera);
    set_sky(&mut world, [2, 1], vec![0.5, 1.0]);
    *world.materials[2].item.scalar_mut(Parameter::Metallic) = Param::Constant(1.0);
    *world.materials[2].item.scalar_mut(Parameter::Roughness) = Param::Constant(0.4);
    let pixels = Pixels::F32(vec![0.6, 0.5, 0.9, 0.4, 0.6, 0.9]);
    let image = Image { name: "slopes".into(), width: 2, height: 1, channels: 3, pixels };
    world.images.push(Arc::new(image));
    world.textures.push(Texture {
        image: ImageId(1),
        encoding: Encoding::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Bilinear,
    });
    let map = TextureMap::new(TextureId(0), TextureChannel::R);
    world.materials[1].item.normal_map = Some(NormalMap { map, scale: 1.0 });
    world.instances.truncate(1);
    let mut place = |mesh: u32, material: u32, world_from_object: Affine3A| {
        let (mesh, material) = (MeshId(mesh), MaterialId(material));
        world.instances.push(Instance { name: "one".into(), mesh, material, world_from_object });
    };
    for i in 0..30u16 {
        let at = Vec3::new(
            f32::from(i % 6) * 0.8 - 2.0,
            0.3 + 0.05 * f32::from(i % 4),
            f32::from(i / 6) * 0.8 - 2.0,
        );
        let mirror = Affine3A::from_scale(Vec3::new(if i % 5 == 0 { -1.0 } else { 1.0 }, 1.0, 1.0));
        let mesh = 1 + u32::from(i % 5);
        place(mesh, mesh, any(i, at) * mirror);
    }
    // The same ball as a veil and as a wall, in one place.
    place(1, 3, any(3, Vec3::new(0.4, 0.9, 1.0)));
    place(1, 1, any(3, Vec3::new(0.4, 0.9, 1.0)));
    place(1, 1, Affine3A::from_scale_rotation_translation(Vec3::new(0.5, 0.0, 0.5), Quat::IDENTITY, Vec3::Y));
    world
}

fn picture(world: &Arc<Scene>, geometry: Geometry, settings: &RenderSettings) -> (Vec<u32>, Vec<String>) {
    let prepared = Prepared::new(Arc::clone(world), Arc::new(geometry), settings).expect("prepared");
    let Rendered { raster, counts, .. } = render(&prepared, &Control::default());
    assert_eq!(counts.bad_samples, 0);
    let channels = raster.layers.iter().flat_map(|layer| &layer.channels);
    let bits = channels.flat_map(|channel| channel.values.iter().map(|value| value.to_bits())).collect();
    (bits, prepared.skipped())
}

#[test]
fn a_picture_is_the_same_bits_of_shared_meshes_and_of_copies() {
    let world = Arc::new(crowd());
    for light_paths in [Use::Never, Use::Always] {
        let settings = RenderSettings { light_paths, ..small(64, 48, 8, 8) };
        let of = |sharing| Geometry::sharing(&*world, sharing).expect("geometry");
        let (copied, told) = picture(&world, of(Use::Never), &settings);
        assert!(!told.iter().any(|line| line.contains("copies of meshes")), "{told:?}");
        let (shared, told) = picture(&world, of(Use::Always), &settings);
        // The floor and all but the flattened ball.
        assert!(told.iter().any(|line| line.contains("33 instances of 6 meshes")), "{told:?}");
        assert!(shared == copied);
        let (portable, _) = picture(&world, of(Use::Always).with_kernel(Kernel::PORTABLE), &settings);
        assert!(portable == copied);
        let (auto, told) = picture(&world, of(Use::Auto), &settings);
        assert!(auto == copied && !told.iter().any(|line| line.contains("copies of meshes")), "{told:?}");
    }
}

#[test]
fn triangles_of_shared_meshes_are_where_copies_are() {
    let world = crowd();
    let [shared, copied] =
        [Use::Always, Use::Never].map(|sharing| Geometry::sharing(&world, sharing).unwrap());
    assert_eq!(shared.triangle_count(), copied.triangle_count());
    assert_eq!(shared.corners(), copied.corners());
    assert!(shared.tree().bytes() < copied.tree().bytes() / 2);
    assert_eq!(shared.rebuilt_tree().unwrap().bytes(), shared.tree().bytes());
}

/// Where positions are relative to the scene's own middle, nothing is shared.
#[test]
fn far_scenes_have_copies() {
    let mut world = crowd();
    for instance in &mut world.instances {
        instance.world_from_object.translation += glam::Vec3A::new(3e5, 0.0, 0.0);
    }
    world.cameras[0].item.world_from_camera.translation += glam::Vec3A::new(3e5, 0.0, 0.0);
    let [shared, copied] =
        [Use::Always, Use::Never].map(|sharing| Geometry::sharing(&world, sharing).unwrap());
    assert_ne!(shared.origin(), Vec3::ZERO);
    assert_eq!(shared.tree().bytes(), copied.tree().bytes());
    assert_eq!(shared.corners(), copied.corners());
}

/// Twenty million triangles, of which meshes hold seven thousand: the large mesh is shared, the small one has copies.
#[test]
fn only_what_takes_much_memory_is_shared() {
    let camera = Camera::look_at(Vec3::new(0.0, 2.5, 5.0), Vec3::ZERO, Vec3::Y, 0.7);
    let mut world = scene(vec![(smooth(42), lambert(0.5)), (cube(0.5), lambert(0.5))], camera);
    world.instances.clear();
    for i in 0..3000u16 {
        let at = Vec3::new(f32::from(i % 60) * 2.5 - 75.0, 0.0, -f32::from(i / 60) * 2.5);
        let mesh = MeshId(u32::from(i % 8 == 7));
        let world_from_object = Affine3A::from_rotation_translation(Quat::from_rotation_y(f32::from(i)), at);
        world.instances.push(Instance {
            name: "one".into(),
            mesh,
            material: MaterialId(0),
            world_from_object,
        });
    }
    let geometry = Geometry::build(&world).unwrap();
    assert_eq!(geometry.triangle_count(), 2625 * world.meshes[0].triangles.len() + 375 * 12);
    let bytes = geometry.tree().bytes();
    assert!(bytes < 5 << 20, "{bytes}");
    let world = Arc::new(world);
    let (_, told) = picture(&world, geometry, &small(16, 12, 2, 4));
    let line = told.iter().find(|line| line.contains("copies of meshes")).expect("it is told");
    assert!(line.contains("2625 instances of a mesh take 2 MB instead of 2622 MB"), "{line}");
}
