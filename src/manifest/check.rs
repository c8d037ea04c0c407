//! A manifest against a scene, before anything renders.

use std::path::Path;
use std::sync::Arc;

use super::edit::{BoxedError, EditError, EnvironmentField, Half, Target, apply, apply_all};
use super::error::{Diagnostic, ManifestError, ManifestErrors};
use super::model::{Located, Manifest};
use crate::record::{Override, Value};
use crate::scene::texture::Pixels;
use crate::scene::{Image, Material, Scene};
use crate::settings::RenderSettings;

/// Whether every path of the manifest is in the scene that was loaded from `scene_path`, and every value suits it. Fields
/// that only make sense together, those of the camera and a spot's angles, are tried with the first and with the last value of
/// each axis. Image files must exist; they are not read.
///
/// # Errors
/// Everything that does not suit, each at its place.
pub fn check(manifest: &Manifest, scene: &Scene<Material>, scene_path: &Path) -> Result<(), ManifestErrors> {
    // Without instances poses are found without looking at every vertex, and no value depends on them.
    let mut scratch = Scene { instances: Vec::new(), meshes: Vec::new(), ..scene.clone() };
    let mut checker = Checker { manifest, scene_path, errors: Vec::new() };
    for setting in manifest.fixed() {
        checker.check(&mut scratch, &setting.path, &setting.value);
    }
    for axis in &manifest.axes {
        for (place, path) in axis.paths().iter().enumerate() {
            for point in &axis.points {
                let Some(value) = point.values.get(place) else { continue };
                let value = Located::new(value.clone(), point.span.clone());
                // A name that is missing is missing for every value.
                if checker.check(&mut scratch, path, &value) == Finding::WrongPath {
                    break;
                }
            }
        }
    }
    if checker.errors.is_empty() {
        checker.check_together(scene);
    }
    if checker.errors.is_empty() {
        Ok(())
    } else {
        Err(ManifestErrors::new(manifest.source.clone(), checker.errors))
    }
}

/// What came of one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Finding {
    Fine,
    WrongPath,
    WrongValue,
}

struct Checker<'a> {
    manifest: &'a Manifest,
    scene_path: &'a Path,
    errors: Vec<Diagnostic>,
}

impl Checker<'_> {
    /// One path with one value, alone.
    fn check(
        &mut self,
        scratch: &mut Scene<Material>,
        path: &Located<String>,
        value: &Located<Value>,
    ) -> Finding {
        match (Target::parse(&path.value), &value.value) {
            // The caller chose the scene by it, and how it is read.
            (Ok(Target::Scene | Target::Import(_) | Target::Convert(_)), _) => return Finding::Fine,
            // A fixed spot angle alone may exceed the other, a lens or pose field alone contradict the camera: judged together.
            (Ok(Target::Camera(field)), _) if field != super::edit::CameraField::Name => {
                return Finding::Fine;
            }
            (Ok(Target::Light(_, super::edit::LightField::Inner | super::edit::LightField::Outer)), _) => {
                return self.check_name_alone(scratch, path, value);
            }
            (Ok(Target::Environment(EnvironmentField::Image)), Value::Text(file)) => {
                let file = self.manifest.folder().join(file);
                if !file.is_file() {
                    let missing = Diagnostic::new(ManifestError::MissingFile { file }, value.span.clone());
                    self.errors.push(missing);
                    return Finding::WrongValue;
                }
                return Finding::Fine;
            }
            _ => {}
        }
        let mut settings = RenderSettings::default();
        match apply(scratch, &mut settings, &path.value, &value.value, &mut no_image) {
            Ok(()) => Finding::Fine,
            Err(error) => self.note(error, &path.span, &value.span),
        }
    }

    /// A spot's angle, without comparing it with the other.
    fn check_name_alone(
        &mut self,
        scratch: &mut Scene<Material>,
        path: &Located<String>,
        value: &Located<Value>,
    ) -> Finding {
        let lights = scratch.lights.clone();
        let mut settings = RenderSettings::default();
        let result = apply(scratch, &mut settings, &path.value, &value.value, &mut no_image);
        scratch.lights = lights;
        match result {
            Err(error @ EditError::UnknownName { .. }) => self.note(error, &path.span, &value.span),
            _ => Finding::Fine,
        }
    }

    /// All fixed values with the first and with the last of each axis: fields that only together make sense.
    fn check_together(&mut self, scene: &Scene<Material>) {
        let mut combinations = vec![self.combination(|_| 0), self.combination(|points| points - 1)];
        combinations.dedup();
        for overrides in combinations {
            let mut scratch = scene.clone();
            let mut settings = self.manifest.render.clone();
            let Err(error) = apply_all(&mut scratch, &mut settings, &overrides, &mut no_image) else {
                continue;
            };
            let span = match &error {
                EditError::UnknownName { kind: "camera", .. } => self.manifest.render_camera.clone(),
                EditError::Conflict { second, .. } => self.span_of(&format!("camera.{second}")),
                EditError::NotApplicable { path, .. } => self.span_of(path),
                _ => None,
            };
            let span = span.or_else(|| self.span_starting("camera."));
            let error = ManifestError::InScene { scene: self.scene_path.to_owned(), error };
            self.errors.push(Diagnostic { error, span, other: None });
            break;
        }
    }

    /// The overrides of one job, images left out: they have been looked for.
    fn combination(&self, index: impl Fn(usize) -> usize) -> Vec<Override> {
        let fixed = self.manifest.fixed().map(|s| (s.path.value.as_str(), s.value.value.clone()));
        let axes = self.manifest.axes.iter().filter(|a| !a.points.is_empty()).flat_map(|axis| {
            let point = &axis.points[index(axis.points.len())];
            axis.paths().iter().map(|p| p.value.as_str()).zip(point.values.iter().cloned())
        });
        fixed
            .chain(axes)
            .filter(|(path, _)| !matches!(*path, "scene" | "environment.image"))
            .map(|(path, value)| Override { path: path.to_owned(), value })
            .collect()
    }

    fn paths(&self) -> impl Iterator<Item = &Located<String>> {
        self.manifest.fixed().map(|s| &s.path).chain(self.manifest.axes.iter().flat_map(|a| a.paths()))
    }

    fn span_of(&self, path: &str) -> Option<std::ops::Range<usize>> {
        self.paths().find(|p| p.value == path).map(|p| p.span.clone())
    }

    fn span_starting(&self, prefix: &str) -> Option<std::ops::Range<usize>> {
        self.paths().find(|p| p.value.starts_with(prefix)).map(|p| p.span.clone())
    }

    fn note(
        &mut self,
        error: EditError,
        path: &std::ops::Range<usize>,
        value: &std::ops::Range<usize>,
    ) -> Finding {
        let half = error.half();
        let error = ManifestError::InScene { scene: self.scene_path.to_owned(), error };
        let (span, finding) = match half {
            Half::Path => (path, Finding::WrongPath),
            Half::Value => (value, Finding::WrongValue),
        };
        self.errors.push(Diagnostic::new(error, span.clone()));
        finding
    }
}

/// Stands for every image: what is in them does not matter here.
fn no_image(file: &Path) -> Result<Arc<Image>, BoxedError> {
    let name = file.display().to_string();
    Ok(Arc::new(Image { name, width: 1, height: 1, channels: 3, pixels: Pixels::F32(vec![1.0; 3]) }))
}
