//! Files, names and edits to the materials that are looked at.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::{Edit, InspectError, Subject};
use crate::convert::{ConvertOptions, to_disney};
use crate::disney::{DiffuseModel, Masking, Model};
use crate::import::{ImportOptions, Reach, import};
use crate::library::Library;
use crate::manifest::edit::set_material;
use crate::manifest::nearest::nearest;
use crate::record::{Value, Warning};
use crate::scene::{Material, Named, Scene};

/// The most materials that are looked at side by side.
pub const MOST: usize = 8;

/// A file, and one of its materials or all.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// A scene or a material library.
    pub file: PathBuf,
    /// The material.
    pub name: Option<String>,
}

impl Target {
    /// Reads `FILE` or `FILE#NAME`. A file whose own name holds a `#` is found as it is.
    pub fn parse(text: &str) -> Self {
        match text.split_once('#') {
            Some((file, name)) if !name.is_empty() && !Path::new(text).exists() => {
                Self { file: file.into(), name: Some(name.to_owned()) }
            }
            _ => Self { file: text.into(), name: None },
        }
    }
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// At most [`MOST`] materials with names of their own.
    pub subjects: Vec<Subject>,
    /// The names of further ones.
    pub left_out: Vec<String>,
    /// What was noticed while importing.
    pub warnings: Vec<Warning>,
}

/// The targets' materials, or the default one if there are no targets; each with `edits`, in every combination of their values, and
/// with other model variants if they are given. The names in the files lead as far as `reach` says.
///
/// # Errors
/// If a file can't be read, or lacks a material, or an edit doesn't suit one.
pub fn gather(
    targets: &[Target],
    edits: &[Edit],
    reach: Reach,
    masking: Option<Masking>,
    diffuse: Option<DiffuseModel>,
) -> Result<Gathered, InspectError> {
    let mut warnings = Vec::new();
    let mut sources: Vec<(Scene<Material>, Vec<Named<Material>>, String)> = Vec::new();
    for target in targets {
        let (scene, materials) = load(target, reach, &mut warnings)?;
        let stem = target.file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        sources.push((scene, materials, stem));
    }
    if targets.is_empty() {
        let default = Named::new("default", Material::default());
        sources.push((Scene::empty(), vec![default], String::new()));
    }
    let variants = combinations(edits);
    let is_one = targets.is_empty() || sources.iter().all(|(_, _, stem)| *stem == sources[0].2);
    let (mut subjects, mut left_out) = (Vec::new(), Vec::new());
    let mut taken = HashSet::new();
    for (scene, materials, stem) in &sources {
        for material in materials {
            for (label, variant) in &variants {
                let file = if is_one { String::new() } else { format!("{stem} ") };
                let name = match (targets.is_empty(), label.is_empty()) {
                    (true, false) => label.clone(),
                    (_, true) => format!("{file}{}", material.name),
                    (_, false) => format!("{file}{} {label}", material.name),
                };
                let name = unique(name, &mut taken);
                if subjects.len() == MOST {
                    left_out.push(name);
                    continue;
                }
                let mut edited = Named::new(name, material.item.clone());
                if edited.item.model == Model::Disney {
                    edited.item.masking = masking.unwrap_or(edited.item.masking);
                    edited.item.diffuse = diffuse.unwrap_or(edited.item.diffuse);
                }
                for (edit, value) in variant {
                    set_material(&mut edited.item, edit.field, value).map_err(InspectError::Edit)?;
                }
                subjects.push(Subject::new(scene, &edited)?);
            }
        }
    }
    Ok(Gathered { subjects, left_out, warnings })
}

/// The scene of a file with the materials that are asked for.
fn load(
    target: &Target,
    reach: Reach,
    warnings: &mut Vec<Warning>,
) -> Result<(Scene<Material>, Vec<Named<Material>>), InspectError> {
    let file = &target.file;
    let is_yaml =
        file.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"));
    let of_library = if is_yaml { Library::read(file, reach)? } else { None };
    let (scene, materials) = match of_library {
        Some(library) => {
            let scene = library.into_scene()?;
            let materials = scene.materials.clone();
            (scene, materials)
        }
        None => {
            let imported = import(file, &ImportOptions { reach, ..ImportOptions::default() })?;
            let converted = to_disney(imported.scene, &ConvertOptions::default());
            warnings.extend(imported.warnings.into_iter().chain(converted.warnings));
            let materials = converted.scene.materials.clone();
            (converted.scene, materials)
        }
    };
    let Some(name) = &target.name else {
        return match materials.is_empty() {
            true => Err(InspectError::NoMaterials { file: file.clone() }),
            false => Ok((scene, materials)),
        };
    };
    match materials.iter().find(|m| m.name == *name) {
        Some(material) => Ok((scene, vec![material.clone()])),
        None => Err(InspectError::UnknownMaterial {
            file: file.clone(),
            name: name.chars().take(80).collect(),
            nearest: nearest(name, materials.iter().map(|m| m.name.as_str())).map(str::to_owned),
            known: materials.into_iter().map(|m| m.name).collect(),
        }),
    }
}

/// One value for each edit.
type Variant<'a> = Vec<(&'a Edit, &'a Value)>;

/// Every combination of the edits' values, each with a label of those that vary; no edits make one combination.
fn combinations(edits: &[Edit]) -> Vec<(String, Variant<'_>)> {
    let mut all: Vec<(String, Variant<'_>)> = vec![(String::new(), Vec::new())];
    for edit in edits {
        let longer = all.iter().flat_map(|(label, chosen)| {
            edit.values.iter().map(move |value| {
                let mut label = label.clone();
                if edit.values.len() > 1 {
                    let space = if label.is_empty() { "" } else { " " };
                    label = format!("{label}{space}{}={value}", edit.field.name());
                }
                (label, chosen.iter().copied().chain([(edit, value)]).collect())
            })
        });
        // One more than are shown, of each material, tells that some are left out; far more would only take memory.
        all = longer.take(64 * MOST).collect();
    }
    all
}

/// `name`, with a number behind if it is taken.
fn unique(name: String, taken: &mut HashSet<String>) -> String {
    let mut candidate = name.clone();
    let mut count = 1;
    while !taken.insert(candidate.clone()) {
        count += 1;
        candidate = format!("{name} ({count})");
    }
    candidate
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disney::Parameter;

    fn edits(texts: &[&str]) -> Vec<Edit> {
        texts.iter().map(|t| Edit::parse(t).unwrap()).collect()
    }

    #[test]
    fn without_a_target_the_default_material_is_looked_at() {
        let gathered = gather(&[], &edits(&["roughness=0.25"]), Reach::Folder, None, None).unwrap();
        let [subject] = &gathered.subjects[..] else { panic!("{gathered:?}") };
        assert_eq!((subject.name.as_str(), subject.scalar(Parameter::Roughness)), ("default", 0.25));
    }

    #[test]
    fn lists_of_values_make_every_combination_up_to_a_limit() {
        let both = edits(&["roughness=0.1,0.5", "metallic=0,0.5,1", "sheen=1"]);
        let gathered = gather(&[], &both, Reach::Folder, Some(Masking::Remapped), None).unwrap();
        let names: Vec<&str> = gathered.subjects.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names.len(), 6);
        assert_eq!(names[1], "roughness=0.1 metallic=0.5");
        assert!(gathered.subjects.iter().all(|s| s.scalar(Parameter::Sheen) == 1.0));
        assert!(gathered.subjects.iter().all(|s| s.material.masking == Masking::Remapped));
        let many =
            gather(&[], &edits(&["roughness=0,.1,.2,.3,.4,.5,.6,.7,.8,.9"]), Reach::Folder, None, None)
                .unwrap();
        assert_eq!((many.subjects.len(), many.left_out.len()), (MOST, 2));
    }

    #[test]
    fn a_target_is_a_file_and_a_name() {
        let target =
            |file: &str, name: Option<&str>| Target { file: file.into(), name: name.map(str::to_owned) };
        assert_eq!(Target::parse("a.glb#ball"), target("a.glb", Some("ball")));
        assert_eq!(Target::parse("a.glb#Metal #2"), target("a.glb", Some("Metal #2")));
        assert_eq!(Target::parse("a.glb"), target("a.glb", None));
        let missing = gather(&[target("none.yaml", None)], &[], Reach::Folder, None, None).unwrap_err();
        assert!(missing.to_string().contains("none.yaml"));
    }
}
