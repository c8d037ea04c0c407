//! `pipeline accept`.

use std::path::PathBuf;

use super::{Outcome, Talk, WELL, print};
use crate::{check, sweep};

/// Make the results of a sweep the references of later ones.
///
/// Prints, for each job, by how much the mean of its picture moves against the old reference. Name the jobs, or say --all.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  pipeline accept configs/roughness.toml --all\n  pipeline accept configs/roughness.toml roughness=0.30"
)]
pub(super) struct Arguments {
    /// The manifest, a TOML file with references in [compare].
    manifest: PathBuf,
    /// The jobs, as `pipeline sweep … --list` names them.
    #[arg(required_unless_present = "all")]
    jobs: Vec<String>,
    /// All jobs.
    #[arg(long, conflicts_with = "jobs")]
    all: bool,
    /// The folder of results, instead of the manifest's.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments, talk: Talk) -> Outcome {
    let mut sweep = sweep::open(&arguments.manifest)?;
    if let Some(folder) = &arguments.output {
        sweep.folder.clone_from(folder);
    }
    let accepted = check::accept(&sweep, &arguments.jobs)?;
    for reference in &accepted {
        let bias = reference.bias.map_or("new".to_owned(), |b| format!("{:+.3}%", 100.0 * b));
        print(&format!("{bias:>9}  {}\n", reference.name))?;
    }
    talk.say(&format!("{} references accepted", accepted.len()));
    Ok(WELL)
}
