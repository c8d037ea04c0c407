//! The real `idiff`: found, run with a time limit, and held against ours.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::imagefile;
use crate::record::CrossCheck;

use super::CompareError;
use super::idiff::{IdiffVerdict, Options, Parts, Thresholds, Verbosity, idiff};

/// How long `idiff` may take unless told otherwise.
pub const TIME_LIMIT: Duration = Duration::from_secs(120);

/// The most that is kept of what it says on each stream, in bytes.
const MAX_OUTPUT: u64 = 1 << 20;

/// What the real `idiff` said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExternalRun {
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
    /// Its exit code; none if a signal ended it.
    pub exit_code: Option<i32>,
}

impl ExternalRun {
    /// The verdict that the exit code and the last line agree on.
    ///
    /// # Errors
    /// If it ended with an error, or they don't agree: a usage error too has the exit code of a warning.
    pub fn verdict(&self) -> Result<IdiffVerdict, CompareError> {
        let last = self.stdout.lines().last().unwrap_or_default();
        [IdiffVerdict::Pass, IdiffVerdict::Warning, IdiffVerdict::Failure]
            .into_iter()
            .find(|v| Some(v.exit_code()) == self.exit_code && v.to_string() == last)
            .ok_or_else(|| CompareError::IdiffFailed {
                code: self.exit_code,
                said: format!("{}{}", self.stdout, self.stderr).trim().to_owned(),
            })
    }
}

/// Finds the real `idiff`: the one asked for, else what the environment's `PIPELINE_IDIFF` names, else the first on `PATH`;
/// nothing if it isn't installed.
///
/// # Errors
/// If the one that is asked for or that `PIPELINE_IDIFF` names is not there.
pub fn find_idiff(asked: Option<&Path>) -> Result<Option<PathBuf>, CompareError> {
    let named = std::env::var_os("PIPELINE_IDIFF").filter(|v| !v.is_empty()).map(PathBuf::from);
    if let Some(path) = asked.map(Path::to_path_buf).or(named) {
        return if path.is_file() { Ok(Some(path)) } else { Err(CompareError::IdiffMissing { path }) };
    }
    let program = format!("idiff{}", std::env::consts::EXE_SUFFIX);
    let folders = std::env::var_os("PATH").unwrap_or_default();
    Ok(std::env::split_paths(&folders).map(|folder| folder.join(&program)).find(|path| path.is_file()))
}

/// Runs the real `idiff` on two files.
///
/// # Errors
/// If it cannot be started, or takes longer than `limit`.
pub fn run_idiff(
    program: &Path,
    a: &Path,
    b: &Path,
    thresholds: &Thresholds,
    options: Options,
    limit: Duration,
) -> Result<ExternalRun, CompareError> {
    let fail = |cause| CompareError::IdiffRun { path: program.into(), cause };
    thresholds.check()?;
    let mut command = Command::new(program);
    command.args(arguments(thresholds, options)).arg(a).arg(b);
    command.env("LC_ALL", "C").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(fail)?;
    // Read beside it: a full pipe would stop it.
    let stdout = child.stdout.take().map(|pipe| thread::spawn(move || read(pipe)));
    let stderr = child.stderr.take().map(|pipe| thread::spawn(move || read(pipe)));
    let status = wait(&mut child, limit).map_err(fail)?;
    let Some(status) = status else {
        return Err(CompareError::IdiffTimeout { path: program.into(), limit });
    };
    let text = |reader: Option<thread::JoinHandle<String>>| {
        reader.and_then(|reader| reader.join().ok()).unwrap_or_default()
    };
    Ok(ExternalRun { stdout: text(stdout), stderr: text(stderr), exit_code: status.code() })
}

/// The options that differ from `idiff`'s defaults.
fn arguments(thresholds: &Thresholds, options: Options) -> Vec<String> {
    let mut arguments = Vec::new();
    match options.verbosity {
        Verbosity::Quiet => arguments.push("-q".to_owned()),
        Verbosity::Normal => {}
        Verbosity::Verbose => arguments.push("-v".to_owned()),
    }
    if options.parts == Parts::All {
        arguments.push("-a".to_owned());
    }
    for ((name, value), (_, default)) in thresholds.floats().into_iter().zip(Thresholds::default().floats()) {
        if value != default {
            arguments.extend([format!("-{name}"), value.to_string()]);
        }
    }
    if thresholds.allowfailures > 0 {
        arguments.extend(["-allowfailures".to_owned(), thresholds.allowfailures.to_string()]);
    }
    arguments
}

/// Waits for the end; nothing if it took too long and was killed.
fn wait(child: &mut Child, limit: Duration) -> std::io::Result<Option<std::process::ExitStatus>> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if start.elapsed() >= limit {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(Duration::from_millis(2));
    }
}

/// What a pipe brings, up to [`MAX_OUTPUT`]; the rest is read and dropped.
fn read(mut pipe: impl Read) -> String {
    let mut kept = Vec::new();
    let result = pipe.by_ref().take(MAX_OUTPUT).read_to_end(&mut kept);
    if result.is_ok() {
        let _ = std::io::copy(&mut pipe, &mut std::io::sink());
    }
    String::from_utf8_lossy(&kept).into_owned()
}

/// Runs the real `idiff` and ours on the same files; both must come to the same verdict. Without a `program` nothing is run
/// and the result says so.
///
/// # Errors
/// [`CompareError::Disagree`] if the verdicts differ; else as [`run_idiff`], [`ExternalRun::verdict`] and [`idiff`].
pub fn cross_check(
    program: Option<&Path>,
    a: &Path,
    b: &Path,
    thresholds: &Thresholds,
    options: Options,
) -> Result<CrossCheck, CompareError> {
    let Some(program) = program else { return Ok(CrossCheck::NotInstalled) };
    // A quiet idiff says no verdict on stdout.
    let options = Options { verbosity: Verbosity::Normal, ..options };
    let names = [a, b].map(|path| path.display().to_string());
    let (raster_a, raster_b) = (imagefile::read(a)?, imagefile::read(b)?);
    let builtin = idiff([&names[0], &names[1]], &raster_a, &raster_b, thresholds, options)?.verdict;
    let external = run_idiff(program, a, b, thresholds, options, TIME_LIMIT)?.verdict()?;
    if builtin == external {
        Ok(CrossCheck::Agrees)
    } else {
        Err(CompareError::Disagree { a: a.into(), b: b.into(), builtin, external })
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::imagefile::write_exr;
    use crate::raster::{Layer, Raster, Window};

    /// A program that stands in for `idiff`.
    fn script(folder: &Path, content: &str) -> PathBuf {
        use std::os::unix::fs::PermissionsExt;
        let path = folder.join("idiff");
        std::fs::write(&path, format!("#!/bin/sh\n{content}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    /// Tries again while another test's new process still holds the script open for writing.
    fn patiently<T>(run: impl Fn() -> Result<T, CompareError>) -> Result<T, CompareError> {
        loop {
            match run() {
                Err(CompareError::IdiffRun { cause, .. })
                    if cause.kind() == std::io::ErrorKind::ExecutableFileBusy => {}
                done => return done,
            }
        }
    }

    fn image(path: &Path, value: f32) {
        let layer = Layer::new("", Window::sized(1, 1)).with("Y", vec![value]);
        write_exr(path, &Raster::single(layer)).unwrap();
    }

    #[test]
    fn a_disagreement_is_an_error_that_says_both_verdicts() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
        image(&a, 0.25);
        image(&b, 0.5);
        let check = |content: &str| {
            let program = script(folder.path(), content);
            patiently(|| cross_check(Some(&program), &a, &b, &Thresholds::default(), Options::default()))
        };
        assert_eq!(check("echo FAILURE; exit 2").unwrap(), CrossCheck::Agrees);
        let error = check("echo PASS; exit 0").unwrap_err().to_string();
        assert!(error.contains("built in FAILURE, idiff PASS"), "{error}");
        assert!(matches!(check("echo usage; exit 1"), Err(CompareError::IdiffFailed { code: Some(1), .. })));
        let none = cross_check(None, &a, &b, &Thresholds::default(), Options::default());
        assert_eq!(none.unwrap(), CrossCheck::NotInstalled);
    }

    #[test]
    fn a_program_that_hangs_is_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let program = script(folder.path(), "exec sleep 60");
        let limit = Duration::from_millis(50);
        let path = Path::new("x.exr");
        let run =
            patiently(|| run_idiff(&program, path, path, &Thresholds::default(), Options::default(), limit));
        assert!(matches!(run, Err(CompareError::IdiffTimeout { .. })), "{run:?}");
    }

    #[test]
    fn one_that_is_asked_for_must_be_there() {
        let missing = Path::new("no/such/idiff");
        assert!(matches!(find_idiff(Some(missing)), Err(CompareError::IdiffMissing { .. })));
    }

    #[test]
    fn only_what_differs_from_the_defaults_is_passed_on() {
        assert!(arguments(&Thresholds::default(), Options::default()).is_empty());
        let thresholds = Thresholds { fail: 0.004, allowfailures: 3, ..Thresholds::default() };
        let options = Options { parts: Parts::All, verbosity: Verbosity::Verbose };
        let expected = ["-v", "-a", "-fail", "0.004", "-allowfailures", "3"];
        assert_eq!(arguments(&thresholds, options), expected);
    }
}
