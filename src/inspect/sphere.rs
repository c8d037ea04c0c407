//! The lit sphere: a material on a ball that lies on a chequered floor in a studio.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Affine2, Affine3A, Vec2, Vec3, Vec4};

use crate::color::Rgb;
use crate::math::Real;
use crate::render::{Control, Geometry, Prepared, RenderError, render};
use crate::report::chart::Picture;
use crate::scene::material::{Param, TextureChannel, TextureMap};
use crate::scene::texture::{Encoding, Pixels, TexelFilter, Wrap};
use crate::scene::{
    Camera, Image, ImageId, Instance, Material, MaterialId, Mesh, MeshId, Named, Scene, Texture, TextureId,
    studio,
};
use crate::settings::{Display, RenderSettings};
use crate::{output::tone, raster::Raster};

/// Segments around the ball; half as many from pole to pole.
const SEGMENTS: u32 = 192;
/// Half the side of the floor in metres; the ball's radius is 1.
const FLOOR: f32 = 60.0;
/// The reflectances of the floor's squares, each a metre wide.
const SQUARES: [u8; 2] = [150, 95];
/// The exposure of the pictures, in stops.
const EXPOSURE: f32 = 0.2;

/// Renders a ball of `material` as a square picture of `size` pixels.
///
/// # Errors
/// If the settings are out of range or `control` asks to stop.
pub(super) fn lit_sphere(
    material: &Material,
    size: u32,
    spp: u32,
    control: &Control,
) -> Result<Picture, RenderError> {
    let scene = Arc::new(scene(material));
    let geometry = Arc::new(Geometry::build(&scene)?);
    let settings = RenderSettings { width: Some(size), height: Some(size), spp, ..RenderSettings::default() };
    let prepared = Prepared::new(scene, geometry, &settings)?;
    let Raster { layers, .. } = render(&prepared, control).raster;
    let display = Display { exposure: EXPOSURE, ..Display::default() };
    let rgb = layers[0].rgb().map(|planes| tone::to_srgb8(planes, &display)).unwrap_or_default();
    Ok(Picture { width: size, height: size, rgb })
}

fn scene(material: &Material) -> Scene<Material> {
    let mut scene = Scene::empty();
    scene.meshes = vec![Arc::new(ball()), Arc::new(floor())];
    scene.images.push(Arc::new(Image {
        name: "squares".to_owned(),
        width: 2,
        height: 2,
        channels: 1,
        pixels: Pixels::U8(vec![SQUARES[0], SQUARES[1], SQUARES[1], SQUARES[0]]),
    }));
    scene.textures.push(Texture {
        image: ImageId(0),
        encoding: Encoding::Srgb,
        wrap: [Wrap::Repeat; 2],
        filter: TexelFilter::Nearest,
    });
    // One repetition of the image is two squares wide.
    let map = TextureMap {
        texture_from_uv: Affine2::from_scale(Vec2::splat(FLOOR)),
        ..TextureMap::new(TextureId(0), TextureChannel::R)
    };
    let squares = Material {
        model: crate::disney::Model::Diffuse,
        base_color: Param::Texture { map, factor: Rgb::WHITE },
        ..Material::default()
    };
    scene.materials = vec![Named::new("material", material.clone()), Named::new("floor", squares)];
    for id in 0..2 {
        scene.instances.push(Instance {
            name: scene.materials[id as usize].name.clone(),
            mesh: MeshId(id),
            material: MaterialId(id),
            world_from_object: Affine3A::IDENTITY,
        });
    }
    let camera =
        Camera::look_at(Vec3::new(0.0, 1.9, 6.6), Vec3::new(0.0, 0.97, 0.0), Vec3::Y, 20.0 * PI / 180.0);
    scene.cameras.push(Named::new("camera", camera));
    studio::add_studio_lighting(&mut scene);
    scene
}

/// A ball of radius 1 on the floor, with smooth normals, and tangents eastwards.
fn ball() -> Mesh {
    let mut mesh = Mesh { name: "ball".to_owned(), uvs: vec![Vec::new()], ..Mesh::default() };
    let rings = SEGMENTS / 2;
    for ring in 0..=rings {
        let v = ring as f32 / rings as f32;
        for segment in 0..=SEGMENTS {
            let u = segment as f32 / SEGMENTS as f32;
            let (theta, phi) = (PI * v, TAU * u);
            let (sin, cos) = (Real::sin(phi), Real::cos(phi));
            let normal = Vec3::new(Real::sin(theta) * sin, Real::cos(theta), Real::sin(theta) * cos);
            mesh.positions.push(normal + Vec3::Y);
            mesh.normals.push(normal.normalize_or(Vec3::Y));
            mesh.tangents.push(Vec4::new(cos, 0.0, -sin, 1.0));
            mesh.uvs[0].push(Vec2::new(u, v));
        }
    }
    let row = SEGMENTS + 1;
    for ring in 0..rings {
        for segment in 0..SEGMENTS {
            let a = ring * row + segment;
            // The first and the last ring of quadrilaterals are triangles.
            if ring > 0 {
                mesh.triangles.push([a, a + row + 1, a + 1]);
            }
            if ring + 1 < rings {
                mesh.triangles.push([a, a + row, a + row + 1]);
            }
        }
    }
    mesh
}

fn floor() -> Mesh {
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
    Mesh {
        name: "floor".to_owned(),
        positions: corners.map(|[x, z]| Vec3::new(x * FLOOR, 0.0, z * FLOOR)).to_vec(),
        normals: vec![Vec3::Y; 4],
        uvs: vec![corners.map(|[x, z]| Vec2::new(0.5 * (1.0 + x), 0.5 * (1.0 + z))).to_vec()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_is_round_closed_and_faces_outwards() {
        let ball = ball();
        for triangle in &ball.triangles {
            let [a, b, c] = triangle.map(|i| ball.positions[i as usize]);
            let normal = (b - a).cross(c - a);
            assert!(normal.length() > 0.0 && normal.dot(a - Vec3::Y) > 0.0, "{triangle:?}");
        }
        for i in 0..ball.positions.len() {
            let (normal, tangent) = (ball.normals[i], ball.tangents[i].truncate());
            assert!((normal.length() - 1.0).abs() < 1e-6 && normal.dot(tangent).abs() < 1e-6);
        }
    }

    #[test]
    fn the_material_is_seen_in_the_middle() {
        let centre = |color: Rgb| {
            let material = Material { base_color: Param::Constant(color), ..Material::default() };
            let picture = lit_sphere(&material, 16, 8, &Control::default()).unwrap();
            let at = 3 * (8 * 16 + 8);
            [picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]]
        };
        let red = centre(Rgb::new(0.8, 0.05, 0.05));
        assert!(red[0] > 2 * red[1], "{red:?}");
        let dark = centre(Rgb::BLACK);
        assert!(dark[0] < red[0], "{dark:?}");
    }
}
