//! An Aris config root: `config/` with render.yaml, scene and integrator, and the meshes as OBJ.
//!
//! Materials are constants there: a texture becomes its mean. What can't be said is in the notes.

use std::fmt::Write;

use super::ExportError;
use super::names::{Identifiers, file_stem};
use super::rounding::reads_back_as;
use crate::color::Rgb;
use crate::convert::{Note, Quality};
use crate::disney::{BASE_COLOR, DiffuseModel, Masking, Model, Parameter};
use crate::math::Real;
use crate::scene::camera::{Aperture, FovAxis, Lens, Projection};
use crate::scene::environment::EnvironmentMap;
use crate::scene::material::{Material, Param, Sides};
use crate::scene::{Camera, Instance, Named, Scene, framing};

/// The files of a config root, with their paths in it, and what it can't say.
#[derive(Debug)]
pub(super) struct Root {
    pub(super) files: Vec<(String, String)>,
    pub(super) notes: Vec<Note>,
}

/// The file that is rendered.
pub(super) const MAIN: &str = "config/render.yaml";

/// `scene` as a config root whose one scene is called `name`.
///
/// # Errors
/// If the camera has no counterpart.
pub(super) fn root(scene: &Scene<Material>, name: &str) -> Result<Root, ExportError> {
    let mut names = Identifiers::default();
    let id = names.of(name);
    let mut writer = RootWriter { scene, files: Vec::new(), notes: Vec::new() };
    let paths: Vec<String> = scene
        .instances
        .iter()
        .map(|instance| {
            let path = format!("data/meshes/{id}/{}.obj", names.of(&file_stem(&instance.name)));
            writer.files.push((path.clone(), obj(scene, instance)));
            path
        })
        .collect();
    let text = writer.scene_file(&paths)?;
    writer.files.push((format!("config/scene/{id}.yaml"), text));
    writer.files.push(("config/integrator/path_mis.yaml".into(), INTEGRATOR.into()));
    let main = format!(
        "defaults:\n  - scene: {id}\n  - integrator: path_mis\n  - _self_\n\nspp: 64\nscale: -1\nsave_exr: true\n"
    );
    writer.files.push((MAIN.into(), main));
    Ok(Root { files: writer.files, notes: writer.notes })
}

const INTEGRATOR: &str = "name: path\nconfig:\n  max_path_length: 17\n  cont_prob: 0.95\n  mis: true\n  enable_emitter_sample: true\n";

struct RootWriter<'a> {
    scene: &'a Scene<Material>,
    files: Vec<(String, String)>,
    notes: Vec<Note>,
}

impl RootWriter<'_> {
    fn note(&mut self, material: &str, field: &str, quality: Quality, reason: &str) {
        let (material, field, reason) = (material.to_owned(), field.to_owned(), reason.to_owned());
        self.notes.push(Note { material, field, quality, reason });
    }

    fn scene_file(&mut self, paths: &[String]) -> Result<String, ExportError> {
        let mut text = String::from("geometry:\n  name: mesh\n  config:\n    paths:\n");
        for path in paths {
            text += &format!("      - {path}\n");
        }
        text += "brdf:\n";
        for instance in &self.scene.instances {
            text += &self.brdf(&self.scene.materials[instance.material.0 as usize]);
        }
        text += &self.emitters();
        text += &self.environment();
        let framed;
        let camera = match self.scene.cameras.first() {
            Some(camera) => &camera.item,
            None => {
                framed = framing::frame(self.scene);
                &framed
            }
        };
        text += &self.camera(camera)?;
        self.tell_materials();
        Ok(text)
    }

    fn brdf(&self, named: &Named<Material>) -> String {
        let flat = self.scene.with_mean_anisotropy(&named.item);
        let m = &flat;
        let color = rgb(self.mean_color(&m.base_color));
        match m.model {
            Model::Mirror => "  - name: mirror\n    config: {}\n".into(),
            Model::Diffuse => format!("  - name: diffuse\n    config:\n      color: {color}\n"),
            Model::Dielectric => {
                let ior = self.mean(m.scalar(Parameter::Ior));
                format!("  - name: dielectric\n    config:\n      ext_ior: 1\n      int_ior: {ior}\n")
            }
            Model::Disney => {
                let mut text = format!("  - name: disney\n    config:\n      color: {color}\n");
                for p in Parameter::BURLEY_2012 {
                    // Coats above 1 are conversions' alone.
                    let most = if p == Parameter::Clearcoat { 1.0 } else { p.max() };
                    let value = self.mean(m.scalar(p)).min(most);
                    text += &format!("      {}: {value}\n", crate::library::aris_key(p));
                }
                text
            }
        }
    }

    fn emitters(&mut self) -> String {
        let mut text = String::new();
        for (i, instance) in self.scene.instances.iter().enumerate() {
            let m = &self.scene.materials[instance.material.0 as usize].item;
            if m.emits() {
                let radiance = rgb(self.mean_color(&m.emission.color) * m.emission.strength);
                text += &format!(
                    "  - name: area\n    config:\n      radiance: {radiance}\n      i_primitive: {i}\n"
                );
            }
        }
        if !self.scene.lights.is_empty() {
            self.note("", "lights", Quality::Dropped, "Aris has no punctual lights");
        }
        if text.is_empty() { text } else { format!("emitters:\n{text}") }
    }

    fn environment(&mut self) -> String {
        let constant = match &self.scene.environment {
            None => None,
            Some(e) if matches!(e.map, EnvironmentMap::Constant) => Some(e.color * e.intensity),
            Some(_) => {
                self.note("", "environment", Quality::Dropped, "images are not written");
                None
            }
        };
        match constant {
            None => "environment:\n  name: none\n  config: {}\n".into(),
            Some(color) => {
                format!("environment:\n  name: constant\n  config:\n    color: {}\n", rgb(color))
            }
        }
    }

    fn camera(&mut self, camera: &Camera) -> Result<String, ExportError> {
        let (width, height) = camera.size.unwrap_or_else(|| {
            let aspect = camera.aspect.unwrap_or(4.0 / 3.0);
            ((480.0 * aspect).round().clamp(1.0, 65_536.0) as u32, 480)
        });
        let fov = match camera.projection {
            Projection::Perspective { fov, axis: FovAxis::X } => fov,
            Projection::Perspective { fov, axis: FovAxis::Y } => {
                let half = 0.5 * fov;
                let tan = Real::sin(half) / Real::cos(half) * width as f32 / height as f32;
                2.0 * Real::atan2(tan, 1.0)
            }
            Projection::Orthographic { .. } => {
                return Err(ExportError::Camera { why: "Aris has no orthographic camera" });
            }
        };
        if camera.pixel_offset != glam::Vec2::splat(-0.5) {
            let reason = "Aris' pixels lie around whole coordinates: the picture moves by half a pixel";
            self.note("", "camera", Quality::Approximated, reason);
        }
        let (name, lens) = match camera.lens {
            None => ("perspective", String::new()),
            Some(lens) => {
                if lens.shape == Aperture::Disk {
                    self.note("", "lens", Quality::Approximated, "a square of the disk's area");
                }
                let (aperture, distance) = (half_side(lens), lens.focal_distance);
                ("thin", format!("    aperture: {aperture}\n    focal_distance: {distance}\n"))
            }
        };
        let m = &camera.world_from_camera;
        let [x, y, z, t] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation];
        let row = |i: usize| format!("      - [{}, {}, {}, {}]\n", x[i], y[i], z[i], t[i]);
        let c2w: String = (0..3).map(row).collect();
        let fov = degrees(fov);
        Ok(format!(
            "camera:\n  name: {name}\n  config:\n    fov: {fov}\n{lens}    c2w:\n{c2w}width: {width}\nheight: {height}\n"
        ))
    }

    /// What the BRDFs of a config root can't say of each material.
    fn tell_materials(&mut self) {
        for Named { name, item: m } in &self.scene.materials {
            let disney = m.model == Model::Disney;
            let textured = |p: &Param<f32>| p.constant().is_none();
            if m.base_color.constant().is_none() {
                self.note(name, BASE_COLOR, Quality::Approximated, "the texture's mean");
            }
            for p in Parameter::BURLEY_2012.into_iter().filter(|&p| disney && textured(m.scalar(p))) {
                self.note(name, p.name(), Quality::Approximated, "the texture's mean");
            }
            if m.emits() && m.emission.color.constant().is_none() {
                self.note(name, "emission", Quality::Approximated, "the texture's mean");
            }
            let approximated = [
                (
                    "masking",
                    disney && m.masking != Masking::Remapped,
                    "Aris' disney remaps the roughness in G",
                ),
                (
                    "diffuse",
                    disney && m.diffuse != DiffuseModel::Burley,
                    "Aris' disney has Burley's diffuse term",
                ),
                (
                    "clearcoat",
                    disney && m.scalar(Parameter::Clearcoat).constant().is_none_or(|c| c > 1.0),
                    "ends at 1",
                ),
                ("anisotropy", m.anisotropy.is_some(), "its mean, along the tangent"),
                ("sides", m.sides == Sides::Both && m.model != Model::Dielectric, "black from behind"),
                ("emission", m.emits() && m.emission.sides == Sides::Both, "the front alone shines"),
            ];
            for (field, _, reason) in approximated.into_iter().filter(|(_, is, _)| *is) {
                self.note(name, field, Quality::Approximated, reason);
            }
            let differs = |p: Parameter| disney && m.scalar(p).constant() != Some(p.default());
            let dropped = [
                ("opacity", m.opacity != Default::default()),
                ("normal_map", m.normal_map.is_some()),
                ("rotation", m.rotation != 0.0),
                ("vertex_color", m.vertex_color),
                ("absorption", m.absorption != Rgb::BLACK),
                ("spec_trans", differs(Parameter::SpecTrans)),
                ("diff_trans", differs(Parameter::DiffTrans)),
                ("f90", differs(Parameter::F90)),
            ];
            for (field, _) in dropped.into_iter().filter(|(_, is)| *is) {
                self.note(name, field, Quality::Dropped, "Aris has no such parameter");
            }
        }
    }

    fn mean(&self, param: &Param<f32>) -> f32 {
        self.scene.mean_scalar(param)
    }

    fn mean_color(&self, param: &Param<Rgb>) -> Rgb {
        match param {
            Param::Constant(color) => *color,
            Param::Texture { map, factor } => self.scene.mean_texel(map).color * *factor,
        }
    }
}

/// Half the side of the square that has the lens' area.
fn half_side(lens: Lens) -> f32 {
    match lens.shape {
        Aperture::Disk => lens.radius * std::f32::consts::PI.sqrt() / 2.0,
        Aperture::Square => lens.radius,
    }
}

/// An instance's triangles in the world, with normals and texture coordinates.
fn obj(scene: &Scene<Material>, instance: &Instance) -> String {
    let mesh = &scene.meshes[instance.mesh.0 as usize];
    let to_world = instance.world_from_object;
    let turns = to_world.matrix3 != glam::Mat3A::IDENTITY;
    let normals_to_world = glam::Mat3::from(to_world.matrix3).inverse().transpose();
    let mut text = String::new();
    // Writing to a string can't fail.
    for &p in &mesh.positions {
        let p = to_world.transform_point3(p);
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    // Downwards here, upwards there.
    let uvs = mesh.uvs.first().map_or(&[][..], Vec::as_slice);
    for uv in uvs {
        let _ = writeln!(text, "vt {} {}", uv.x, 1.0 - uv.y);
    }
    for &n in &mesh.normals {
        // Not normalised again where nothing turns them: that would move the last bit.
        let n = if turns { (normals_to_world * n).try_normalize().unwrap_or(n) } else { n };
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
    }
    let corner = |c: u32| match (uvs.is_empty(), mesh.normals.is_empty()) {
        (true, true) => format!("{}", c + 1),
        (false, true) => format!("{0}/{0}", c + 1),
        (true, false) => format!("{0}//{0}", c + 1),
        (false, false) => format!("{0}/{0}/{0}", c + 1),
    };
    let mirrors = to_world.matrix3.determinant() < 0.0;
    for &[a, b, c] in &mesh.triangles {
        let [b, c] = if mirrors { [c, b] } else { [b, c] };
        let _ = writeln!(text, "f {} {} {}", corner(a), corner(b), corner(c));
    }
    text
}

/// The degrees that are nearest to `radians`, and where there are such, those that read back to the same bits.
fn degrees(radians: f32) -> f32 {
    reads_back_as(radians, radians.to_degrees(), f32::to_radians)
}

fn rgb(c: Rgb) -> String {
    format!("[{}, {}, {}]", c.r, c.g, c.b)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::convert::{ConvertOptions, to_disney};
    use crate::import::{ImportOptions, import};

    fn room() -> Scene<Material> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.obj");
        let imported = import(&file, &ImportOptions::default()).unwrap();
        to_disney(imported.scene, &ConvertOptions::default()).scene
    }

    #[test]
    fn a_lens_keeps_its_area() {
        let half_side = |shape| half_side(Lens { radius: 0.3, focal_distance: 5.0, shape });
        assert_eq!(half_side(Aperture::Square), 0.3);
        let side = 2.0 * half_side(Aperture::Disk);
        assert!((side * side / (std::f32::consts::PI * 0.09) - 1.0).abs() < 1e-6);
        let mut scene = room();
        let mut camera = framing::frame(&scene);
        camera.lens = Some(Lens { radius: 2.0, focal_distance: 5.0, shape: Aperture::Disk });
        scene.cameras = vec![Named::new("camera", camera)];
        let files = root(&scene, "room").unwrap().files;
        assert!(files.iter().any(|(_, text)| text.contains("aperture: 1.772453")));
    }

    #[test]
    fn meshes_have_files_of_their_own_on_every_file_system() {
        let mut scene = room();
        let long = "x".repeat(300);
        for (instance, name) in scene.instances.iter_mut().zip([&long, "Ball", "ball"]) {
            instance.name = name.into();
        }
        let files = root(&scene, "room").unwrap().files;
        let meshes: Vec<&str> = files.iter().take(3).map(|(path, _)| path.as_str()).collect();
        let expected = [&long[..100], "ball", "ball_2"].map(|name| format!("data/meshes/room/{name}.obj"));
        assert_eq!(meshes, expected);
    }
}
