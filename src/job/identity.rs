//! Which job is the same job.

use std::path::Path;

use blake3::{Hash, Hasher};
use serde::Serialize;

use super::JobError;
use crate::convert::ConvertOptions;
use crate::import::{FileDigest, ImportOptions};
use crate::record::{Job, Override, Value};
use crate::settings::RenderSettings;

/// The program that renders: the part of identity that all jobs of a run share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Build {
    /// Hash of the running executable.
    pub executable: Hash,
    /// The crate's version.
    pub version: &'static str,
    /// The processor features that the code was compiled for: results are the same bits within a level. What [`crate::accel`]
    /// chooses by the running processor finds the same bits everywhere, so that it doesn't count.
    pub feature_level: &'static str,
}

impl Build {
    /// The build that is running.
    ///
    /// # Errors
    /// If the executable can't be read.
    pub fn current() -> Result<Self, JobError> {
        let failed = |path: &Path, cause| JobError::File { path: path.to_owned(), cause };
        let path =
            std::env::current_exe().map_err(|cause| failed(Path::new("the running executable"), cause))?;
        let bytes = std::fs::read(&path).map_err(|cause| failed(&path, cause))?;
        Ok(Self {
            executable: blake3::hash(&bytes),
            version: env!("CARGO_PKG_VERSION"),
            feature_level: feature_level(),
        })
    }
}

const fn feature_level() -> &'static str {
    if cfg!(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")) {
        "x86-64-v3"
    } else if cfg!(target_arch = "x86_64") {
        "x86-64"
    } else if cfg!(target_arch = "aarch64") {
        "aarch64"
    } else {
        "other"
    }
}

/// Everything about a job that can change a bit of its image. The name, the place on the axes and the folder are not in it.
#[derive(Serialize)]
struct Content<'a> {
    /// Raised when the same input means another image.
    format: u32,
    feature_level: &'a str,
    files: Vec<(&'a str, String)>,
    import: &'a ImportOptions,
    convert: &'a ConvertOptions,
    overrides: Vec<Override>,
    settings: &'a RenderSettings,
}

/// A job's identity and key, as hexadecimal text.
pub(super) fn identify(
    job: &Job,
    files: &[&FileDigest],
    options: (&ImportOptions, &ConvertOptions),
    settings: &RenderSettings,
    build: &Build,
) -> (String, String) {
    let content = Content {
        format: 1,
        feature_level: build.feature_level,
        files: files.iter().map(|f| (f.name.as_str(), f.digest.to_hex().to_string())).collect(),
        import: options.0,
        convert: options.1,
        // How the scene is read is in the options, whoever chose it.
        overrides: job.overrides.iter().filter(|o| !is_of_reading(o)).map(without_path).collect(),
        settings,
    };
    let text = serde_json::to_vec(&content).expect("plain data has a JSON form");
    let key = blake3::hash(&text);
    let mut identity = Hasher::new();
    identity.update(key.as_bytes());
    identity.update(build.executable.as_bytes());
    (identity.finalize().to_hex().to_string(), key.to_hex().to_string())
}

fn is_of_reading(given: &Override) -> bool {
    ["import.", "convert."].iter().any(|root| given.path.starts_with(root))
}

/// An override that names a file, without the name: how a path is written says nothing about the image, and its content is among
/// the files.
fn without_path(given: &Override) -> Override {
    if given.path == "environment.image" {
        Override { path: given.path.clone(), value: Value::Text(String::new()) }
    } else {
        given.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(roughness: f64) -> Job {
        Job {
            name: "a".into(),
            scene: "s.glb".into(),
            overrides: vec![Override {
                path: "material.m.roughness".into(),
                value: Value::Number(roughness),
            }],
            settings: RenderSettings::default(),
            coordinates: Vec::new(),
        }
    }

    #[test]
    fn identity_follows_content_and_build_and_the_key_content_alone() {
        let build = |tag: &[u8]| Build { executable: blake3::hash(tag), version: "0", feature_level: "x" };
        let file = |content: &[u8]| FileDigest { name: "s.glb".into(), digest: blake3::hash(content) };
        let id = |job: &Job, content: &[u8], tag: &[u8]| {
            identify(
                job,
                &[&file(content)],
                (&ImportOptions::default(), &ConvertOptions::default()),
                &job.settings,
                &build(tag),
            )
        };
        let (identity, key) = id(&job(0.5), b"scene", b"one");
        let mut renamed = job(0.5);
        renamed.name = "b".into();
        assert_eq!(id(&renamed, b"scene", b"one"), (identity.clone(), key.clone()));
        let (other_build, same_key) = id(&job(0.5), b"scene", b"two");
        assert!(other_build != identity && same_key == key);
        for (other, other_key) in [id(&job(0.6), b"scene", b"one"), id(&job(0.5), b"changed", b"one")] {
            assert!(other != identity && other_key != key);
        }
        let options = |time| ImportOptions { time, ..ImportOptions::default() };
        let posed = |time| {
            let converted = ConvertOptions::default();
            identify(
                &job(0.5),
                &[&file(b"scene")],
                (&options(time), &converted),
                &job(0.5).settings,
                &build(b"one"),
            )
            .1
        };
        assert!(posed(None) == key && posed(Some(0.0)) != key && posed(Some(0.5)) != posed(Some(0.0)));
        let mut seeded = job(0.5);
        seeded.settings.seed = 7;
        assert_ne!(id(&seeded, b"scene", b"one").1, key);
    }
}
