//! `pipeline completions`.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Outcome, WELL, print};

/// Print the completions of a shell.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  pipeline completions bash > ~/.local/share/bash-completion/completions/pipeline"
)]
pub(super) struct Arguments {
    /// The shell.
    shell: Shell,
}

pub(super) fn run(arguments: &Arguments) -> Outcome {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "pipeline", &mut text);
    print(&String::from_utf8_lossy(&text))?;
    Ok(WELL)
}
