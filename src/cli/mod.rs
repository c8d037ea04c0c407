//! The command line: one file a command. Arguments as typed become a checked configuration, one call does the work, and the
//! result is printed: data to stdout, talk to stderr.

mod accept;
mod bench;
mod completions;
mod convert;
mod diff;
mod inspect;
mod progress;
mod reading;
mod render;
mod schema;
mod sweep;

use std::error::Error;
use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::import::Reach;
use crate::sweep::SweepError;

/// Everything is well.
const WELL: u8 = 0;
/// Images differ.
const DIFFERENT: u8 = 1;
/// An error.
const FAILED: u8 = 2;
/// The arguments are wrong.
const USAGE: u8 = 64;

/// Arguments that do not go together, which only the files they name could tell.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Usage(String);

/// What a command ends with.
type Outcome = Result<u8, Box<dyn Error>>;

/// Scene conversion and batch rendering with a Disney path tracer.
#[derive(Debug, Parser)]
#[command(
    name = "pipeline",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  pipeline render scenes/shaderball.glb -o ball.exr\n  pipeline sweep configs/roughness.toml\n  pipeline diff a.exr b.exr\n\nExit codes: 0 well, 1 images differ, 2 an error, 64 wrong arguments."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Threads to work with; all processors where absent. Results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// No progress and no remarks, only results and errors.
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Arguments),
    Sweep(sweep::Arguments),
    Convert(convert::Arguments),
    Bench(bench::Arguments),
    Accept(accept::Arguments),
    Diff(diff::Arguments),
    Inspect(inspect::Arguments),
    Schema(schema::Arguments),
    Completions(completions::Arguments),
}

/// Runs the command line and tells how it ended.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let is_error = error.use_stderr();
            // Nothing is left to tell it to if this fails.
            let _ = error.print();
            return ExitCode::from(if is_error { USAGE } else { WELL });
        }
    };
    match run(&arguments) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            // Each of a manifest's errors has a heading of its own.
            let is_headed = matches!(error.downcast_ref(), Some(SweepError::Manifest(_)));
            tell(&if is_headed { error.to_string() } else { format!("error: {error}") });
            ExitCode::from(if error.is::<Usage>() { USAGE } else { FAILED })
        }
    }
}

fn run(arguments: &Arguments) -> Outcome {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    let talk = if arguments.quiet { Talk::Quiet } else { Talk::Normal };
    match &arguments.command {
        Command::Render(command) => render::run(command, talk),
        Command::Sweep(command) => sweep::run(command, talk),
        Command::Convert(command) => convert::run(command, talk),
        Command::Bench(command) => bench::run(command, talk),
        Command::Accept(command) => accept::run(command, talk),
        Command::Diff(command) => diff::run(command, talk),
        Command::Inspect(command) => inspect::run(command, talk),
        Command::Schema(command) => schema::run(command),
        Command::Completions(command) => completions::run(command),
    }
}

/// How far the names of files in a scene lead, for every command that reads scenes.
#[derive(Debug, clap::Args)]
struct Allowed {
    /// Let scenes and material libraries name files outside their own folder, as in ../textures/oak.png or by a link.
    #[arg(long)]
    allow_outside: bool,
}

impl Allowed {
    fn reach(&self) -> Reach {
        if self.allow_outside { Reach::Anywhere } else { Reach::Folder }
    }
}

/// How much is said on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Talk {
    Normal,
    Quiet,
}

impl Talk {
    /// Says something, unless nothing is to be said.
    fn say(self, text: &str) {
        if self == Self::Normal {
            tell(text);
        }
    }
}

/// A line to stderr. A closed stderr is no reason to stop.
fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text.trim_end());
}

/// Text to stdout. A reader that has gone away, as `head` does, ends the output and is no error.
fn print(text: &str) -> Result<(), std::io::Error> {
    print_bytes(text.as_bytes())
}

/// The same for what need not be UTF-8.
fn print_bytes(bytes: &[u8]) -> Result<(), std::io::Error> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// The width of the terminal that stdout is; none for a file or a pipe.
fn terminal_width() -> Option<u16> {
    terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| width.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn every_command_has_an_example() {
        use clap::CommandFactory;
        let program = Arguments::command();
        let parts = program.get_subcommands().flat_map(clap::Command::get_subcommands);
        for command in program.get_subcommands().chain(parts) {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains("Example"), "{}", command.get_name());
        }
    }
}
