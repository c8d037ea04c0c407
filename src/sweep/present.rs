//! The results of a sweep for the eye: contact sheet and page.

use std::path::{Path, PathBuf};

use super::{Sweep, SweepError};
use crate::imagefile;
use crate::job;
use crate::manifest::Located;
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
    // Those of this run, else of another shard or an earlier run; what is there of another job of this name is not shown.
    let known: Vec<Option<JobRecord>> = sweep
        .jobs
        .iter()
        .map(|job| {
            let own = records.iter().find(|r| r.job.name == job.name);
            own.cloned().or_else(|| job::recorded(job, folder))
        })
        .collect();
    let reused = reused + known.iter().flatten().count() - records.len();
    let mut entries = Vec::with_capacity(sweep.jobs.len());
    for (job, record) in sweep.jobs.iter().zip(&known) {
        let cell = match record {
            Some(record) => Cell::of(record, picture(&job::image_path(folder, &job.name), spec.cell_width)?),
            None => Cell::Missing,
        };
        entries.push(Entry { job, cell });
    }
    let title = spec.title.clone().unwrap_or_else(|| sweep.manifest.name.clone());
    let subtitle = subtitle(sweep);
    // An axis may be called by its name or by one of its paths; jobs know it by one of them.
    let axis = |named: &Option<Located<String>>| {
        named.as_ref().map(|n| sweep.manifest.axis_id(&n.value).unwrap_or_else(|| n.value.clone()))
    };
    let plan = Plan {
        title: title.clone(),
        subtitle: subtitle.clone(),
        columns: axis(&spec.columns),
        rows: axis(&spec.rows),
        cell_width: spec.cell_width,
    };
    let sheet = arrange(entries, &plan)?;

    let mut files = Vec::new();
    let mut sheets = Vec::new();
    for (index, page) in sheet.pages.iter().enumerate() {
        let stem =
            if sheet.pages.len() == 1 { "sheet".to_owned() } else { format!("sheet-{:03}", index + 1) };
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

    let record_files: Vec<String> = known.iter().flatten().map(|r| format!("{}.json", r.job.name)).collect();
    let jobs: Vec<PageJob<'_>> = known
        .iter()
        .flatten()
        .zip(&record_files)
        .map(|(record, file)| PageJob { record, record_file: Some(file), folder: "" })
        .collect();
    let text = html(&PageInput { title: &title, subtitle: &subtitle, sheets: &files, jobs: &jobs, reused })?;
    let page = folder.join("index.html");
    imagefile::write_whole(&page, text.as_bytes())?;
    Ok(Presentation { sheets, page })
}

/// The picture of an image file, as wide as a cell, if there is one. Only that is kept in memory.
fn picture(path: &Path, cell_width: Option<u32>) -> Result<Option<Picture<'static>>, SweepError> {
    let Ok(raster) = imagefile::read(path) else { return Ok(None) };
    let picture = Picture::of(raster.picture())?;
    Ok(Some(picture.shrunk(cell_width.unwrap_or(u32::MAX)).into_owned()))
}

fn subtitle(sweep: &Sweep) -> String {
    let settings = &sweep.manifest.render;
    let scenes: Vec<&str> = sweep.manifest.scenes.iter().map(|s| s.value.as_str()).collect();
    let scene = Path::new(scenes.first().copied().unwrap_or_default());
    let scene = scene.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let more = if scenes.len() > 1 { " and others" } else { "" };
    format!("{scene}{more} · {} · seed {}", settings.samples_described(), settings.seed)
}
