//! A sweep as one HTML page: the sheets, a table of the jobs, and what each record knows. It needs no script and nothing from
//! elsewhere; pictures and files are links relative to the page.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, UndefinedBehavior};
use serde::Serialize;

use super::sheet::{Level, Mark};
use super::table::{Summary, errors, figure, reason, seconds, word};
use crate::record::{CrossCheck, JobRecord, Outcome};
use crate::settings::Integrator;

static TEMPLATE: &str = include_str!("page.html");

/// What the page shows.
#[derive(Clone, Debug)]
pub struct PageInput<'a> {
    /// The sweep's name.
    pub title: &'a str,
    /// A line under it; may be empty.
    pub subtitle: &'a str,
    /// The contact sheet's pages.
    pub sheets: &'a [SheetFile],
    /// The jobs, in order.
    pub jobs: &'a [PageJob<'a>],
    /// How many of the jobs were taken from an earlier run.
    pub reused: usize,
}

/// A written page of the contact sheet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SheetFile {
    /// The page's title; may be empty.
    pub title: String,
    /// The PNG, relative to the HTML page, with `/` between folders.
    pub png: String,
    /// The EXR in linear light, if one was written.
    pub exr: Option<String>,
}

/// A job of the page.
#[derive(Clone, Copy, Debug)]
pub struct PageJob<'a> {
    /// What is known about it. Its outputs are linked.
    pub record: &'a JobRecord,
    /// The record's own file, relative to the HTML page.
    pub record_file: Option<&'a str>,
    /// The folder of the job's outputs, relative to the HTML page; empty where they are side by side.
    pub folder: &'a str,
}

/// The page's template could not be filled in.
#[derive(Debug, thiserror::Error)]
#[error("the page of the sweep {title:?} could not be made: {cause}")]
pub struct PageError {
    title: String,
    cause: minijinja::Error,
}

/// The page as HTML. Every text is escaped.
///
/// # Errors
/// If the template cannot be filled in.
pub fn html(input: &PageInput<'_>) -> Result<String, PageError> {
    let fill = || {
        let mut environment = Environment::empty();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?);
        environment.render_named_str("page.html", TEMPLATE, Serde(PageView::of(input)))
    };
    fill().map_err(|cause| PageError { title: input.title.to_owned(), cause })
}

/// What the template sees.
#[derive(Debug, Serialize)]
struct PageView<'a> {
    title: &'a str,
    subtitle: &'a str,
    summary: String,
    sheets: Vec<SheetView<'a>>,
    jobs: Vec<JobView<'a>>,
}

#[derive(Debug, Serialize)]
struct SheetView<'a> {
    title: &'a str,
    png: String,
    exr: Option<String>,
}

#[derive(Debug, Serialize)]
struct JobView<'a> {
    name: &'a str,
    word: &'static str,
    /// The style's class.
    level: &'static str,
    reason: Option<&'a str>,
    max_error: String,
    mean_error: String,
    size: String,
    spp: u32,
    seconds: String,
    warnings: Option<usize>,
    files: Vec<FileView<'a>>,
    facts: Vec<Fact>,
}

#[derive(Debug, Serialize)]
struct FileView<'a> {
    name: &'a str,
    href: String,
}

#[derive(Debug, Serialize)]
struct Fact {
    name: &'static str,
    value: String,
}

impl<'a> PageView<'a> {
    fn of(input: &PageInput<'a>) -> Self {
        let records: Vec<&JobRecord> = input.jobs.iter().map(|job| job.record).collect();
        Self {
            title: input.title,
            subtitle: input.subtitle,
            summary: Summary::of(&records, input.reused).to_string(),
            sheets: input
                .sheets
                .iter()
                .map(|s| SheetView { title: &s.title, png: href(&s.png), exr: s.exr.as_deref().map(href) })
                .collect(),
            jobs: input.jobs.iter().map(JobView::of).collect(),
        }
    }
}

impl<'a> JobView<'a> {
    fn of(job: &PageJob<'a>) -> Self {
        let record = job.record;
        let differences = errors(&record.verdict).filter(|_| record.outcome == Outcome::Done);
        let difference = |i: usize| differences.map(|e| figure(e[i])).unwrap_or_default();
        let outputs = record.outputs.keys().map(|name| {
            let path = if job.folder.is_empty() { name.clone() } else { format!("{}/{name}", job.folder) };
            FileView { name, href: href(&path) }
        });
        let own = job.record_file.map(|path| FileView { name: "record", href: href(path) });
        Self {
            name: &record.job.name,
            word: word(record),
            level: level(record),
            reason: reason(record),
            max_error: difference(0),
            mean_error: difference(1),
            size: format!("{} × {}", record.size[0], record.size[1]),
            spp: record.job.settings.spp,
            seconds: format!("{:.1}", seconds(record)),
            warnings: Some(record.warnings.len()).filter(|&n| n > 0),
            files: outputs.chain(own).collect(),
            facts: facts(record),
        }
    }
}

fn level(record: &JobRecord) -> &'static str {
    let mark = match record.outcome {
        Outcome::Failed { .. } => Some(Level::Bad),
        Outcome::Done => Mark::of(&record.verdict).map(|mark| mark.level),
    };
    match mark {
        Some(Level::Bad) => "bad",
        Some(Level::Doubt) => "doubt",
        None => "good",
    }
}

/// All that a record knows and the table's columns don't show.
fn facts(record: &JobRecord) -> Vec<Fact> {
    let (job, settings, t) = (&record.job, &record.job.settings, &record.timings);
    let mut facts = Vec::new();
    let mut fact = |name, value: String| facts.push(Fact { name, value });
    fact("scene", job.scene.display().to_string());
    for c in &job.coordinates {
        fact("axis", format!("{} = {}", c.axis, c.label));
    }
    for o in &job.overrides {
        fact("set", format!("{} = {}", o.path, o.value));
    }
    fact(
        "settings",
        format!(
            "{}, spp {}, replicates {}, seed {}, max depth {}, filter {:?}{}{}",
            Integrator::described(settings),
            settings.spp,
            settings.replicates,
            settings.seed,
            settings.max_depth,
            settings.filter,
            settings.filter_radius.map(|r| format!(" of radius {r}")).unwrap_or_default(),
            settings.camera.as_ref().map(|c| format!(", camera {c:?}")).unwrap_or_default(),
        ),
    );
    fact("seconds", format!("prepare {:.2}, render {:.2}, output {:.2}", t.prepare, t.render, t.output));
    let counts = &record.counts;
    fact("counts", format!("{} paths, {} rays, {} triangles", counts.paths, counts.rays, counts.triangles));
    if counts.bad_samples > 0 {
        fact("dropped samples", counts.bad_samples.to_string());
    }
    for warning in &record.warnings {
        fact("warning", warning.to_string());
    }
    if !record.skipped.is_empty() {
        fact("skipped", record.skipped.join(", "));
    }
    fact("idiff", cross_check(record).to_owned());
    fact("identity", record.identity.clone());
    fact("key", record.key.clone());
    fact("host", format!("{}, attempt {}", record.host, record.attempt));
    facts
}

fn cross_check(record: &JobRecord) -> &'static str {
    match record.cross_check {
        CrossCheck::NotRun => "not run",
        CrossCheck::NotInstalled => "not installed",
        CrossCheck::Agrees => "agrees",
    }
}

/// A relative path as a link: whatever could be read as a scheme, a query or a fragment is percent-encoded (RFC 3986, 3.3).
fn href(path: &str) -> String {
    let mut link = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z'
            | b'a'..=b'z'
            | b'0'..=b'9'
            | b'-'
            | b'.'
            | b'_'
            | b'~'
            | b'/'
            | b'='
            | b','
            | b'+' => {
                link.push(char::from(byte));
            }
            _ => link.push_str(&format!("%{byte:02X}")),
        }
    }
    link
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Verdict;
    use crate::report::samples::record;

    fn page(records: &[JobRecord]) -> String {
        let jobs: Vec<PageJob<'_>> =
            records.iter().map(|r| PageJob { record: r, record_file: Some("a.json"), folder: "" }).collect();
        let sheets =
            [SheetFile { title: String::new(), png: "sheet.png".into(), exr: Some("sheet.exr".into()) }];
        html(&PageInput { title: "roughness", subtitle: "ball", sheets: &sheets, jobs: &jobs, reused: 0 })
            .unwrap()
    }

    #[test]
    fn the_page_shows_sheet_jobs_and_files() {
        let page = page(&[
            record("roughness=0.0", Outcome::Done, Verdict::Same),
            record("roughness=0.5", Outcome::Failed { error: "no disk".to_owned() }, Verdict::NotCompared),
        ]);
        for part in [
            "<img src=\"sheet.png\"",
            "href=\"sheet.exr\"",
            "<summary>roughness=0.0</summary>",
            "href=\"roughness=0.0.exr\"",
            "href=\"a.json\"",
            "<td class=\"bad\">FAILED<p class=\"reason\">no disk</p>",
            "<dd>material.ball.metallic = 1</dd>",
            "no normals; made from the faces",
            "2 jobs: 1 rendered, 0 reused, 1 FAILED, 1 same",
        ] {
            assert!(page.contains(part), "no {part} in:\n{page}");
        }
    }

    #[test]
    fn nothing_is_fetched_from_elsewhere_and_nothing_is_run() {
        let page = page(&[record("a", Outcome::Done, Verdict::Same)]);
        for foreign in ["http:", "https:", "//", "<script", "url(", "@import"] {
            assert!(!page.contains(foreign), "{foreign}");
        }
    }

    #[test]
    fn every_text_is_escaped_and_links_stay_beside_the_page() {
        let evil = "<script>alert('\"&</script>";
        let mut bad = record(evil, Outcome::Failed { error: evil.to_owned() }, Verdict::NotCompared);
        bad.host = evil.to_owned();
        bad.warnings[0].message = evil.to_owned();
        bad.job.coordinates[0].label = evil.to_owned();
        bad.outputs = [("javascript:alert(1)#?.exr".to_owned(), String::new())].into();
        let page = page(&[bad]);
        assert!(!page.contains("<script"), "{page}");
        assert!(page.contains("&lt;script&gt;"));
        assert!(page.contains("href=\"javascript%3Aalert%281%29%23%3F.exr\""), "{page}");
    }
}
