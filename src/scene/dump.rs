//! A scene as stable text, for golden files: a change in a mapping shows as a readable difference without a render.
//!
//! Floats are written with the fewest digits that read back to the same bits. Materials show what differs from the default.

use std::fmt::{self, Write};

use glam::{Affine2, Affine3A, Vec3};

use super::camera::{Aperture, FovAxis, Projection};
use super::environment::{EnvironmentMap, Equirectangular};
use super::light::LightKind;
use super::material::{Curve, Param, Sides, TextureMap};
use super::source::SourceMaterial;
use super::texture::{Pixels, Wrap};
use super::{Camera, Light, Material, Mesh, Scene};
use crate::color::Rgb;
use crate::disney::Parameter;

impl Scene<Material> {
    /// The scene as stable text.
    pub fn dump(&self) -> String {
        dump_scene(self, dump_material)
    }
}

impl Scene<SourceMaterial> {
    /// The scene as stable text, its materials in their dialect's terms.
    pub fn dump(&self) -> String {
        dump_scene(self, |out, source| {
            let text = match source {
                SourceMaterial::Gltf(m) => format!("{m:#?}"),
                SourceMaterial::Mtl(m) => format!("{m:#?}"),
                SourceMaterial::Aris(m) => format!("{m:#?}"),
            };
            text.lines().try_for_each(|line| writeln!(out, "    {line}"))
        })
    }
}

fn dump_scene<M>(scene: &Scene<M>, dump_material: impl Fn(&mut String, &M) -> fmt::Result) -> String {
    let mut out = String::new();
    // Writing to a string can't fail.
    let written = write_scene(&mut out, scene, dump_material);
    debug_assert!(written.is_ok());
    out
}

fn write_scene<M>(
    out: &mut String,
    scene: &Scene<M>,
    dump_material: impl Fn(&mut String, &M) -> fmt::Result,
) -> fmt::Result {
    writeln!(out, "meshes: {}", scene.meshes.len())?;
    for (i, mesh) in scene.meshes.iter().enumerate() {
        dump_mesh(out, i, mesh)?;
    }
    writeln!(out, "instances: {}", scene.instances.len())?;
    for (i, instance) in scene.instances.iter().enumerate() {
        let name = scene.materials.get(instance.material.0 as usize).map_or("?", |m| &m.name);
        writeln!(out, "  {i} {:?}: mesh {}, material {name:?}", instance.name, instance.mesh.0)?;
        writeln!(out, "    {}", transform(&instance.world_from_object))?;
    }
    writeln!(out, "materials: {}", scene.materials.len())?;
    for (i, material) in scene.materials.iter().enumerate() {
        writeln!(out, "  {i} {:?}", material.name)?;
        dump_material(out, &material.item)?;
    }
    writeln!(out, "textures: {}", scene.textures.len())?;
    for (i, t) in scene.textures.iter().enumerate() {
        let (encoding, [u, v], filter) = (t.encoding.name(), t.wrap.map(Wrap::name), t.filter.name());
        writeln!(out, "  {i}: image {}, {encoding}, {u} {v}, {filter}", t.image.0)?;
    }
    writeln!(out, "images: {}", scene.images.len())?;
    for (i, image) in scene.images.iter().enumerate() {
        let depth = match image.pixels {
            Pixels::U8(_) => "8 bits",
            Pixels::U16(_) => "16 bits",
            Pixels::F32(_) => "floats",
            Pixels::Undecoded => {
                writeln!(out, "  {i} {:?}: not decoded", image.name)?;
                continue;
            }
        };
        let (w, h, channels) = (image.width, image.height, image.channels);
        writeln!(out, "  {i} {:?}: {w} x {h}, channels: {channels} of {depth}", image.name)?;
    }
    writeln!(out, "cameras: {}", scene.cameras.len())?;
    for (i, camera) in scene.cameras.iter().enumerate() {
        writeln!(out, "  {i} {:?}", camera.name)?;
        dump_camera(out, &camera.item)?;
    }
    writeln!(out, "lights: {}", scene.lights.len())?;
    for (i, light) in scene.lights.iter().enumerate() {
        writeln!(out, "  {i} {:?}: {}", light.name, light_text(&light.item))?;
    }
    match &scene.environment {
        None => writeln!(out, "environment: none"),
        Some(e) => {
            let map = match e.map {
                EnvironmentMap::Constant => "constant".to_owned(),
                EnvironmentMap::Image { image, mapping: Equirectangular::YUp } => {
                    format!("image {}", image.0)
                }
                EnvironmentMap::Image { image, mapping: Equirectangular::Aris } => {
                    format!("image {} (as Aris)", image.0)
                }
            };
            let (color, intensity, rotation) = (rgb(e.color), e.intensity, e.rotation);
            writeln!(out, "environment: {map}, color {color}, intensity {intensity}, rotation {rotation}")
        }
    }
}

fn dump_mesh(out: &mut String, i: usize, mesh: &Mesh) -> fmt::Result {
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    write!(out, "  {i} {:?}: {vertices} vertices, {triangles} triangles", mesh.name)?;
    for (what, there) in [
        ("normals", !mesh.normals.is_empty()),
        ("tangents", !mesh.tangents.is_empty()),
        ("colors", !mesh.colors.is_empty()),
    ] {
        write!(out, "{}", if there { format!(", {what}") } else { String::new() })?;
    }
    writeln!(out, ", uv sets: {}", mesh.uvs.len())?;
    if let Some(&first) = mesh.positions.first() {
        let fold = |f: fn(Vec3, Vec3) -> Vec3| mesh.positions.iter().fold(first, |a, &p| f(a, p));
        let (low, high) = (vec3(fold(Vec3::min)), vec3(fold(Vec3::max)));
        writeln!(out, "    from {low} to {high}, area {}", area(mesh))?;
    }
    Ok(())
}

/// The sum of the triangles' areas: it tells a wrong index from a right one, which counts and bounds don't.
fn area(mesh: &Mesh) -> f32 {
    let position = |i: u32| mesh.positions.get(i as usize).copied().unwrap_or(Vec3::NAN).as_dvec3();
    let of = |&[a, b, c]: &[u32; 3]| {
        let (a, b, c) = (position(a), position(b), position(c));
        0.5 * (b - a).cross(c - a).length()
    };
    mesh.triangles.iter().map(of).sum::<f64>() as f32
}

fn dump_material(out: &mut String, m: &Material) -> fmt::Result {
    let default = Material::default();
    let mut lines: Vec<(&str, String)> = Vec::new();
    let mut line = |name, differs: bool, text: &dyn Fn() -> String| {
        if differs {
            lines.push((name, text()));
        }
    };
    line("model", m.model != default.model, &|| m.model.name().into());
    line("base_color", m.base_color != default.base_color, &|| param(&m.base_color, rgb, Reading::Color));
    for p in Parameter::ALL {
        let value = m.scalar(p);
        let text = || param(value, |v| v.to_string(), Reading::Scalar);
        line(p.name(), value != default.scalar(p), &text);
    }
    line("masking", m.masking != default.masking, &|| m.masking.name().into());
    line("diffuse", m.diffuse != default.diffuse, &|| m.diffuse.name().into());
    for (name, color) in
        [("transmission_color", &m.transmission_color), ("diff_trans_color", &m.diff_trans_color)]
    {
        if let Some(color) = color {
            line(name, true, &|| param(color, rgb, Reading::Color));
        }
    }
    line("thin_walled", m.thin_walled, &|| "true".into());
    line("absorption", m.absorption != default.absorption, &|| rgb(m.absorption));
    line("emission", m.emission != default.emission, &|| {
        let color = param(&m.emission.color, rgb, Reading::Color);
        let unlit = if m.emission.unlit { ", unlit" } else { "" };
        format!("{color}, strength {}, {}{unlit}", m.emission.strength, sides(m.emission.sides))
    });
    line("opacity", m.opacity != default.opacity, &|| {
        let cutoff = m.opacity.cutoff.map_or(String::new(), |c| format!(", cutoff {c}"));
        format!("{}{cutoff}", param(&m.opacity.alpha, |v| v.to_string(), Reading::Scalar))
    });
    if let Some(n) = &m.normal_map {
        line("normal_map", true, &|| format!("{}, scale {}", map(&n.map, Reading::Color), n.scale));
    }
    if let Some(a) = &m.anisotropy {
        let map = a.map.as_ref().map_or(String::new(), |m| format!("{}, ", map(m, Reading::Color)));
        line("anisotropy", true, &|| format!("{map}strength {}", a.strength));
    }
    line("frame", m.frame != default.frame, &|| m.frame.name().into());
    line("rotation", m.rotation != default.rotation, &|| m.rotation.to_string());
    line("sides", m.sides != default.sides, &|| sides(m.sides).into());
    line("culled", m.culled, &|| "true".into());
    line("vertex_color", m.vertex_color != default.vertex_color, &|| m.vertex_color.to_string());
    line("vertex_alpha", m.vertex_alpha != default.vertex_alpha, &|| m.vertex_alpha.to_string());
    lines.into_iter().try_for_each(|(name, text)| writeln!(out, "    {name}: {text}"))
}

/// Whether a parameter reads a texture's colour or one channel.
#[derive(Clone, Copy)]
enum Reading {
    Color,
    Scalar,
}

fn param<T: Copy>(param: &Param<T>, text: impl Fn(T) -> String, reading: Reading) -> String {
    match param {
        Param::Constant(value) => text(*value),
        Param::Texture { map: m, factor } => format!("{} x {}", text(*factor), map(m, reading)),
    }
}

fn map(map: &TextureMap, reading: Reading) -> String {
    let channel = match reading {
        Reading::Color => String::new(),
        Reading::Scalar => format!(".{}", map.channel.name()),
    };
    let mut text = format!("texture {}{channel}", map.texture.0);
    if map.curve != Curve::Linear {
        text.push_str(&format!(", {}", map.curve.name()));
    }
    if map.uv_set != 0 {
        text.push_str(&format!(", uv set {}", map.uv_set));
    }
    let t = &map.texture_from_uv;
    if *t != Affine2::IDENTITY {
        let [a, b, c, d, x, y] = t.to_cols_array();
        text.push_str(&format!(", uv by [({a}, {b}), ({c}, {d}), ({x}, {y})]"));
    }
    text
}

fn dump_camera(out: &mut String, c: &Camera) -> fmt::Result {
    writeln!(out, "    {}", transform(&c.world_from_camera))?;
    let projection = match c.projection {
        Projection::Perspective { fov, axis: FovAxis::X } => format!("perspective, fov_x {fov}"),
        Projection::Perspective { fov, axis: FovAxis::Y } => format!("perspective, fov_y {fov}"),
        Projection::Orthographic { half_height } => format!("orthographic, half height {half_height}"),
    };
    write!(out, "    {projection}")?;
    if let Some(lens) = c.lens {
        let shape = match lens.shape {
            Aperture::Disk => "disk",
            Aperture::Square => "square",
        };
        write!(out, ", {shape} lens of {} sharp at {}", lens.radius, lens.focal_distance)?;
    }
    if c.pixel_offset != glam::Vec2::ZERO {
        write!(out, ", pixel offset ({}, {})", c.pixel_offset.x, c.pixel_offset.y)?;
    }
    if let Some((width, height)) = c.size {
        write!(out, ", {width} x {height}")?;
    }
    if let Some(aspect) = c.aspect {
        write!(out, ", aspect {aspect}")?;
    }
    writeln!(out)
}

fn light_text(light: &Light) -> String {
    let range = |range: Option<f32>| range.map_or(String::new(), |r| format!(", range {r}"));
    let kind = match light.kind {
        LightKind::Point { position, range: r } => format!("point at {}{}", vec3(position), range(r)),
        LightKind::Spot { position, direction, inner, outer, range: r } => {
            let (position, direction) = (vec3(position), vec3(direction));
            format!("spot at {position} to {direction}, {inner} to {outer}{}", range(r))
        }
        LightKind::Directional { direction } => format!("directional to {}", vec3(direction)),
    };
    format!("{kind}, color {}, intensity {}", rgb(light.color), light.intensity)
}

fn sides(sides: Sides) -> &'static str {
    match sides {
        Sides::Front => "front",
        Sides::Both => "both sides",
    }
}

fn rgb(c: Rgb) -> String {
    format!("({}, {}, {})", c.r, c.g, c.b)
}

/// -0 is written as 0: which of the two comes out of a rotation means nothing.
fn vec3(v: Vec3) -> String {
    let [x, y, z] = v.to_array().map(|c| c + 0.0);
    format!("({x}, {y}, {z})")
}

fn transform(t: &Affine3A) -> String {
    let columns = [t.matrix3.x_axis, t.matrix3.y_axis, t.matrix3.z_axis].map(|c| vec3(c.into()));
    let [x, y, z] = columns;
    format!("x {x} y {y} z {z} at {}", vec3(t.translation.into()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::material::TextureChannel;
    use crate::scene::{Instance, MaterialId, MeshId, Named, TextureId};

    #[test]
    fn a_material_shows_what_differs_from_the_default() {
        let mut scene = Scene::<Material>::empty();
        let mut material = Material { rotation: 0.5, ..Material::default() };
        *material.scalar_mut(Parameter::Metallic) = Param::Texture {
            map: TextureMap { uv_set: 1, ..TextureMap::new(TextureId(2), TextureChannel::B) },
            factor: 0.1,
        };
        scene.materials.push(Named::new("plain", Material::default()));
        scene.materials.push(Named::new("metal", material));
        let expected = "materials: 2\n  0 \"plain\"\n  1 \"metal\"\n    metallic: 0.1 x texture 2.b, uv set 1\n    \
                        rotation: 0.5\ntextures: 0\n";
        assert!(scene.dump().contains(expected), "{}", scene.dump());
    }

    #[test]
    fn a_wrong_index_changes_the_dump() {
        let mut scene = Scene::<Material>::empty();
        scene.materials.push(Named::new("m", Material::default()));
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::splat(0.25)];
        let mesh = |corner| Mesh {
            name: "t".into(),
            positions: positions.clone(),
            triangles: vec![[0, 1, corner]],
            ..Mesh::default()
        };
        scene.instances.push(Instance {
            name: "n".into(),
            mesh: MeshId(0),
            material: MaterialId(0),
            world_from_object: Affine3A::IDENTITY,
        });
        let mut dump = |corner| {
            scene.meshes = vec![Arc::new(mesh(corner))];
            scene.dump()
        };
        assert!(dump(2).contains("from (0, 0, 0) to (1, 1, 0.25), area 0.5\n"), "{}", dump(2));
        assert_ne!(dump(2), dump(3));
    }
}
