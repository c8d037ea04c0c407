//! Makes every file of `scenes/`, the same bytes each time.
//!
//! ```text
//! cargo run --release --example make_scenes              # write into scenes/
//! cargo run --release --example make_scenes -- --check   # compare with scenes/, exit 1 where a byte differs
//! cargo run --release --example make_scenes -- --out DIR # write or check elsewhere
//! ```

mod aris_root;
mod ball;
mod cornell;
mod field;
mod glb;
mod mesh;
mod nets;
mod revolve;
mod shell;
mod spheres;
mod statue;
mod studio;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glb::GlbError;
use mesh::MeshError;

/// A file to be written: its path below the output folder, and its bytes.
pub(crate) struct Made {
    /// Path with forward slashes.
    pub(crate) path: &'static str,
    /// The whole content.
    pub(crate) bytes: Vec<u8>,
    /// One line of statistics for the log.
    pub(crate) about: String,
}

/// Why the scenes could not be made.
#[derive(Debug, thiserror::Error)]
enum MakeError {
    #[error("unknown argument \"{0}\"; expected --check or --out DIR")]
    Argument(String),
    #[error("--out needs a folder")]
    NoFolder,
    #[error("{path}: {source}")]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Glb(#[from] GlbError),
}

/// What to do with the generated files.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    Write,
    Check,
}

fn main() -> ExitCode {
    match run() {
        Ok(code) => code,
        Err(error) => {
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<ExitCode, MakeError> {
    let (mode, folder) = arguments()?;
    let mut different = 0u32;
    for make in [cornell::make, aris_root::make, spheres::make, ball::make, statue::make] {
        for made in make()? {
            let path = folder.join(made.path);
            let verdict = match mode {
                Mode::Write => write(&path, &made.bytes).map(|()| "written")?,
                Mode::Check if std::fs::read(&path).is_ok_and(|bytes| bytes == made.bytes) => "same",
                Mode::Check => {
                    different += 1;
                    "DIFFERENT"
                }
            };
            let size = made.bytes.len();
            let _ = writeln!(io::stderr(), "{verdict:9} {:44} {size:8} bytes  {}", made.path, made.about);
        }
    }
    Ok(if different == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn arguments() -> Result<(Mode, PathBuf), MakeError> {
    let mut mode = Mode::Write;
    let mut folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--check" => mode = Mode::Check,
            "--out" => folder = arguments.next().ok_or(MakeError::NoFolder)?.into(),
            _ => return Err(MakeError::Argument(argument)),
        }
    }
    Ok((mode, folder))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), MakeError> {
    let failed = |source| MakeError::Io { path: path.to_path_buf(), source };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(path, bytes).map_err(failed)
}
