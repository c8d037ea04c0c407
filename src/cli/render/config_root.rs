//! `pipeline render CONFIG_ROOT [KEY=VALUE…]`: what Aris' `render.py` would write.

use std::fs;
use std::path::{Path, PathBuf};

use super::{Arguments, check_folder};
use crate::cli::{Outcome, Talk, Usage, WELL, print};
use crate::imagefile;
use crate::import::ArisConfig;
use crate::output::tone;
use crate::raster::{Attribute, Raster};
use crate::scene::texture::Encoding;
use crate::settings::Integrator;

/// What `--cfg` prints of a composed configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Shown {
    /// The configuration as YAML.
    Config,
    /// Each value with the file and line, or the override, that it comes from.
    Origin,
}

/// The configuration that the arguments name, if they name one.
///
/// # Errors
/// [`Usage`] for arguments that go with configurations alone, or that a scene needs.
pub(super) fn composed(arguments: &Arguments) -> Result<Option<ArisConfig>, Box<dyn std::error::Error>> {
    let path = &arguments.scene;
    if ArisConfig::is_root(path) {
        let config = ArisConfig::compose(path, &arguments.overrides, arguments.reading.options().reach);
        return Ok(Some(config.map_err(Box::new)?));
    }
    let why_not = format!("{} is no config root, a folder with render.yaml", path.display());
    if let Some(first) = arguments.overrides.first() {
        let hint = "hint: --set PATH=VALUE changes a scene";
        return Err(Usage(format!("{why_not}, and takes no overrides such as `{first}`\n{hint}")).into());
    }
    if arguments.cfg.is_some() {
        return Err(Usage(format!("{why_not}: --cfg has nothing to show")).into());
    }
    if path.is_dir() {
        return Err(format!("{why_not}; other scenes are files").into());
    }
    if arguments.output.is_none() && arguments.pixel.is_none() {
        return Err(Usage("-o FILE is missing: the image to write, .exr or .png".to_owned()).into());
    }
    Ok(None)
}

/// Prints the configuration.
pub(super) fn show(config: &ArisConfig, shown: Shown) -> Outcome {
    print(&match shown {
        Shown::Config => config.to_yaml(),
        Shown::Origin => config.provenance(),
    })?;
    Ok(WELL)
}

/// What a run without `-o` leaves behind, and where.
#[derive(Debug)]
pub(super) struct Outputs {
    folder: PathBuf,
    config: String,
    save_exr: bool,
    encoding: Encoding,
}

impl Outputs {
    /// Makes the folder, so that no time is spent on an image that can't be kept.
    pub(super) fn prepare(
        config: &ArisConfig,
        save_exr: bool,
        integrator: Integrator,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let folder = config.output_folder();
        fs::create_dir_all(&folder).map_err(|cause| format!("{}: {cause}", folder.display()))?;
        check_folder(&folder.join("output.png"))?;
        // Aris writes albedo as it is.
        let is_raw = integrator == Integrator::DiffuseAlbedo;
        let encoding = if is_raw { Encoding::Linear } else { Encoding::Srgb };
        Ok(Self { folder, config: config.to_yaml(), save_exr, encoding })
    }

    /// Writes `output.png`, `config.yaml` and, where the configuration says so, `output.exr`.
    pub(super) fn write(&self, raster: &Raster, talk: Talk) -> Outcome {
        let at = |name: &str| self.folder.join(name);
        let layer = raster.picture();
        if let Some(rgb) = layer.rgb() {
            let codes = tone::truncated_to_8_bits(rgb, self.encoding);
            imagefile::write_png(&at("output.png"), layer.window.width, layer.window.height, &codes)?;
        }
        if self.save_exr {
            imagefile::write_exr(&at("output.exr"), raster)?;
        }
        imagefile::write_whole(&at("config.yaml"), self.config.as_bytes())?;
        talk.say(&format!("written to {}", shown(&self.folder)));
        Ok(WELL)
    }
}

fn shown(folder: &Path) -> String {
    format!("{}/", folder.display().to_string().trim_end_matches('/'))
}

/// Puts the configuration into the header: it tells more than the job's name.
pub(super) fn stamp_config(raster: &mut Raster, config: &ArisConfig) {
    for layer in &mut raster.layers {
        layer.attributes.push(("pipeline:config".to_owned(), Attribute::Text(config.to_yaml())));
    }
}
