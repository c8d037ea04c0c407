//! `pipeline schema`.

use super::{Outcome, WELL, print};
use crate::manifest;
use crate::record::JobRecord;

/// Print the JSON Schema of a file format, for editors and other programs.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  pipeline schema manifest > manifest.schema.json")]
pub(super) struct Arguments {
    /// The format.
    format: Format,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// A sweep's TOML manifest.
    Manifest,
    /// A job's JSON record.
    Record,
}

pub(super) fn run(arguments: &Arguments) -> Outcome {
    let schema = match arguments.format {
        Format::Manifest => manifest::json_schema(),
        Format::Record => serde_json::to_value(schemars::schema_for!(JobRecord))?,
    };
    print(&format!("{}\n", serde_json::to_string_pretty(&schema)?))?;
    Ok(WELL)
}
