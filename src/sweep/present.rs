//! The results of a sweep for the eye: contact sheet and page.

use std::path::{Path, PathBuf};

use super::{Sweep, SweepError};
use crate::imagefile;
use crate::job;
use crate::raster::Layer;
use crate::record::JobRecord;
use crate::report::{
    Cell, Entry, PageInput, PageJob, Picture, Plan, SheetFile, arrange, draw_linear, draw_png, html,
};

/// What was written for the eye.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Presentation {
    /// The sheet's pages as PNG.
    pub sheets: Vec<PathBuf>,
    /// The page with the table and the sheets.
    pub page: PathBuf,
}

/// Draws the sheet of all of the sweep's jobs, those of other shards and runs included as far as they are there, and the page.
pub(super) fn present(
    sweep: &Sweep,
    records: &[JobRecord],
    reused: usize,
    folder: &Path,
) -> Result<Presentation, SweepError> {
    let spec = &sweep.manifest.sheet;
    let pictures: Vec<Option<Layer>> = sweep.jobs.iter().map(|j| picture(&job::image_path(folder, &j.name))).collect();
    let mut entries = Vec::with_capacity(sweep.jobs.len());
    for (job, layer) in sweep.jobs.iter().zip(&pictures) {
        let record = records.iter().find(|r| r.job.name == job.name);
        let shown = layer.as_ref().map(|l| Picture::of(l)).transpose()?;
        let cell = match (record, shown) {
            (Some(record), shown) => Cell::of(record, shown),
            (None, Some(picture)) => Cell::Picture { picture, mark: None },
            (None, None) => Cell::Missing,
        };
        entries.push(Entry { job, cell });
    }
    let title = spec.title.clone().unwrap_or_else(|| sweep.manifest.name.clone());
    let subtitle = subtitle(sweep);
    let plan = Plan {
        title: title.clone(),
        subtitle: subtitle.clone(),
        columns: spec.columns.as_ref().map(|c| c.value.clone()),
        rows: spec.rows.as_ref().map(|r| r.value.clone()),
        cell_width: spec.cell_width,
    };
    let sheet = arrange(entries, &plan)?;

    let mut files = Vec::new();
    let mut sheets = Vec::new();
    for (index, page) in sheet.pages.iter().enumerate() {
        let stem = if sheet.pages.len() == 1 { "sheet".to_owned() } else { format!("sheet-{:03}", index + 1) };
        let png = folder.join(format!("{stem}.png"));
        let (width, height, rgb) = draw_png(&sheet, index, &spec.display)?;
        imagefile::write_png(&png, width, height, &rgb)?;
        imagefile::write_exr(&folder.join(format!("{stem}.exr")), &draw_linear(&sheet, index)?)?;
        files.push(SheetFile {
            title: page.title.clone(),
            png: format!("{stem}.png"),
            exr: Some(format!("{stem}.exr")),
        });
        sheets.push(png);
    }

    let record_files: Vec<String> = records.iter().map(|r| format!("{}.json", r.job.name)).collect();
    let jobs: Vec<PageJob<'_>> = records
        .iter()
        .zip(&record_files)
        .map(|(record, file)| PageJob { record, record_file: Some(file), folder: "" })
        .collect();
    let text = html(&PageInput { title: &title, subtitle: &subtitle, sheets: &files, jobs: &jobs, reused })?;
    let page = folder.join("index.html");
    imagefile::write_whole(&page, text.as_bytes())?;
    Ok(Presentation { sheets, page })
}

/// The picture of an image file, if there is one.
fn picture(path: &Path) -> Option<Layer> {
    let raster = imagefile::read(path).ok()?;
    let mut layer = raster.layers.into_iter().next()?;
    layer.channels.retain(|c| matches!(c.name.as_str(), "R" | "G" | "B"));
    Some(layer)
}

fn subtitle(sweep: &Sweep) -> String {
    let settings = &sweep.manifest.render;
    let scenes: Vec<&str> = sweep.manifest.scenes.iter().map(|s| s.value.as_str()).collect();
    let scene = Path::new(scenes.first().copied().unwrap_or_default());
    let scene = scene.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let more = if scenes.len() > 1 { " and others" } else { "" };
    format!("{scene}{more} · {} samples · seed {}", settings.spp, settings.seed)
}
