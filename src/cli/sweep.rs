//! `pipeline sweep`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

use super::progress::Progress;
use super::{Allowed, DIFFERENT, FAILED, Outcome, Talk, WELL, print, terminal_width};
use crate::record::{Job, JobRecord, Outcome as JobOutcome, Verdict};
use crate::render::Control;
use crate::report::{TableOptions, verdict_table};
use crate::sweep::{self, Observer, Options, Shard, Sweep, SweepError};

/// Render all jobs of a manifest, compare them with their references, and make a contact sheet.
///
/// Results go to outputs/NAME: an EXR and a JSON record for each job, sheet.png, sheet.exr and index.html. Jobs that are done
/// are not rendered again; a sweep that was stopped goes on where it was.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline sweep configs/roughness.toml\n  pipeline sweep configs/roughness.toml --list\n  pipeline sweep configs/roughness.toml --shard 1/2 -o /results"
)]
pub(super) struct Arguments {
    /// The manifest, a TOML file.
    manifest: PathBuf,
    /// The folder of results, instead of the manifest's.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Print the jobs' names, one a line, and do nothing.
    #[arg(long, conflicts_with = "dry_run")]
    list: bool,
    /// Print each job with all that it sets, check the manifest against its scenes, and render nothing.
    #[arg(long)]
    dry_run: bool,
    /// Render again what is already there.
    #[arg(long)]
    force: bool,
    /// Stop after the first job that fails.
    #[arg(long)]
    fail_fast: bool,
    /// Render at most so many jobs at once, which differ in materials alone: what their paths have in common is traced once. 1 renders
    /// them one by one, to the same bits. Where absent, as many as memory holds and some minutes suffice for, at most 16.
    #[arg(long, value_name = "JOBS")]
    together: Option<NonZeroUsize>,
    #[command(flatten)]
    allowed: Allowed,
    /// Only part I of N of the jobs; all machines split them alike.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    shard: Option<Shard>,
    /// OpenImageIO's idiff, to confirm comparisons with; the one on PATH where absent.
    #[arg(long, value_name = "PROGRAM")]
    idiff: Option<PathBuf>,
}

fn parse_shard(text: &str) -> Result<Shard, String> {
    let wrong = || format!("{text:?} is not I/N with 1 ≤ I ≤ N, such as 1/4");
    let (index, count) = text.split_once('/').ok_or_else(wrong)?;
    let shard =
        Shard { index: index.parse().map_err(|_| wrong())?, count: count.parse().map_err(|_| wrong())? };
    if (1..=shard.count).contains(&shard.index) { Ok(shard) } else { Err(wrong()) }
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    let mut sweep = sweep::open(&arguments.manifest)?;
    if arguments.allowed.allow_outside {
        sweep.reach = arguments.allowed.reach();
    }
    let wanted = arguments.shard.map(|shard| shard.names(&sweep.jobs));
    let is_wanted = |job: &&Job| wanted.as_ref().is_none_or(|names| names.contains(job.name.as_str()));
    if arguments.list {
        let names: String =
            sweep.jobs.iter().filter(is_wanted).map(|job| format!("{}\n", job.name)).collect();
        print(&names)?;
        return Ok(WELL);
    }
    if arguments.dry_run {
        let jobs: Vec<&Job> = sweep.jobs.iter().filter(is_wanted).collect();
        print(&described(&sweep, &jobs))?;
        let unreadable = sweep::check(&sweep)?;
        unreadable.iter().for_each(|error| super::tell(&format!("error: {error}")));
        return Ok(if unreadable.is_empty() { WELL } else { FAILED });
    }
    let count = sweep.jobs.iter().filter(is_wanted).count();
    talk.say(&format!("{}: {count} {}", sweep.manifest.name, if count == 1 { "job" } else { "jobs" }));
    let options = Options {
        folder: arguments.output.clone(),
        force: arguments.force,
        fail_fast: arguments.fail_fast,
        shard: arguments.shard,
        together: arguments.together,
        idiff: arguments.idiff.clone(),
    };
    let mut watcher = Watcher { progress: Progress::new(count, talk), talk, said: Vec::new() };
    let result = sweep::run(&sweep, &options, &mut watcher)?;
    drop(watcher);

    let records: Vec<&JobRecord> = result.records.iter().collect();
    let width = terminal_width();
    print(&verdict_table(&records, &TableOptions { width, reused: result.reused }))?;
    match &result.presentation {
        Ok(presentation) => {
            for sheet in &presentation.sheets {
                talk.say(&format!("sheet: {}", sheet.display()));
            }
            talk.say(&format!("page:  {}", presentation.page.display()));
        }
        // Without a job in this shard there is nothing to show.
        Err(SweepError::Sheet(crate::report::SheetError::Empty)) => {}
        Err(error) => {
            super::tell(&format!("error: the sheet could not be made: {error}"));
            return Ok(FAILED);
        }
    }
    Ok(result.records.iter().map(exit_code).max().unwrap_or(WELL))
}

/// An error beats a difference.
fn exit_code(record: &JobRecord) -> u8 {
    match (&record.outcome, &record.verdict) {
        (JobOutcome::Failed { .. }, _) | (_, Verdict::Error { .. } | Verdict::MissingReference { .. }) => {
            FAILED
        }
        (JobOutcome::Done, verdict) if verdict.passes() => WELL,
        (JobOutcome::Done, _) => DIFFERENT,
    }
}

fn described(sweep: &Sweep, jobs: &[&Job]) -> String {
    let mut text = String::new();
    for job in jobs {
        let settings = &job.settings;
        text += &format!("{}\n  scene = {}\n", job.name, job.scene.display());
        for o in &job.overrides {
            text += &format!("  {} = {}\n", o.path, o.value);
        }
        text += &format!(
            "  {}, seed = {}, max_depth = {}\n",
            settings.samples_described(),
            settings.seed,
            settings.max_depth
        );
    }
    text + &format!("{} jobs into {}\n", jobs.len(), sweep.folder.display())
}

struct Watcher {
    progress: Progress,
    talk: Talk,
    said: Vec<crate::record::Warning>,
}

impl Observer for Watcher {
    fn started(&mut self, jobs: &[&Job], control: &Arc<Control>) {
        let names: Vec<&str> = jobs.iter().map(|job| job.name.as_str()).collect();
        self.progress.follow(&names, control);
    }

    fn finished(&mut self, record: &JobRecord, reused: bool) {
        self.progress.finish_job(reused);
        if let JobOutcome::Failed { error } = &record.outcome {
            self.progress.say(self.talk, &format!("{}: FAILED: {error}", record.job.name));
        }
        // A scene's warnings come with each of its jobs; once is enough.
        for warning in &record.warnings {
            if !self.said.contains(warning) {
                self.progress.say(self.talk, &format!("warning: {warning}"));
                self.said.push(warning.clone());
            }
        }
    }

    fn left_out(&mut self, _: &Job) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_one_of_some() {
        assert_eq!(parse_shard("2/3"), Ok(Shard { index: 2, count: 3 }));
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2"] {
            assert!(parse_shard(wrong).is_err(), "{wrong}");
        }
    }
}
