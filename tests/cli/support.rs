//! Running the program, and a folder with a manifest to run it in.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use pipeline::imagefile;
use pipeline::raster::Raster;
use pipeline::record::{JobRecord, Outcome};

/// No single run takes so long, on however busy a machine.
const LIMIT: Duration = Duration::from_secs(300);

/// The path of the program.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_pipeline");

/// A file or folder of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// What a run of the program came to.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    /// Asserts the exit code; the message shows all that was said.
    #[track_caller]
    pub(crate) fn ends_with(self, code: i32) -> Self {
        assert_eq!(self.code, code, "exit code\nstdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }

    #[track_caller]
    pub(crate) fn says(self, text: &str) -> Self {
        assert!(
            self.stdout.contains(text),
            "no {text:?} in stdout: {}\nstderr: {}",
            self.stdout,
            self.stderr
        );
        self
    }

    #[track_caller]
    pub(crate) fn tells(self, text: &str) -> Self {
        assert!(
            self.stderr.contains(text),
            "no {text:?} in stderr: {}\nstdout: {}",
            self.stderr,
            self.stdout
        );
        self
    }

    #[track_caller]
    pub(crate) fn tells_not(self, text: &str) -> Self {
        assert!(!self.stderr.contains(text), "{text:?} in stderr: {}", self.stderr);
        self
    }
}

/// Runs the program in `folder`.
pub(crate) fn run_in<A: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = A>) -> Run {
    let output = assert_cmd::Command::new(PROGRAM)
        .current_dir(folder)
        .args(args)
        .timeout(LIMIT)
        .output()
        .expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program writes UTF-8");
    let code = output.status.code().expect("the program is not killed");
    Run { code, stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// Runs the program where it does not matter.
pub(crate) fn run<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> Run {
    run_in(&std::env::temp_dir(), args)
}

/// The address space that a run may take above its input's: 200 MB, and what the program takes anyway.
const MEMORY: usize = 320 << 20;

/// Runs `pipeline`, which may ask for `MEMORY` and as much again as `explained`, and ends when asked for more.
pub(crate) fn confined(desk: &Desk, explained: usize, arguments: &[&str]) -> Run {
    let limit = (MEMORY + explained) >> 10;
    // glibc sets 64 MiB of addresses aside for each thread unless it is told otherwise.
    let script = format!("ulimit -v {limit} && MALLOC_ARENA_MAX=1 exec \"$0\" \"$@\"");
    let mut shell = assert_cmd::Command::new("sh");
    shell.current_dir(desk.path("")).args(["-c", &script, PROGRAM, "--threads", "2"]).args(arguments);
    let output = shell.timeout(std::time::Duration::from_secs(120)).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    let code = output.status.code().unwrap_or_else(|| panic!("{arguments:?} was killed: {stderr}"));
    assert!(!stderr.contains("panicked"), "{stderr}");
    Run { code, stdout, stderr }
}

/// What is known about a file that must not be touched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) bytes: Vec<u8>,
    pub(crate) modified: SystemTime,
}

/// A folder with `sweep.toml`, whose results go to `results` and references to `references`.
pub(crate) struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    /// With a manifest of these lines, after its name and output.
    pub(crate) fn new(manifest: &str) -> Self {
        let desk = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        desk.rewrite(manifest);
        desk
    }

    /// With three jobs of one small scene, and what `more` adds.
    pub(crate) fn with_three_jobs(more: &str) -> Self {
        Self::new(&three_jobs("[0.1, 0.5, 0.9]", more))
    }

    pub(crate) fn rewrite(&self, manifest: &str) {
        let text = format!("name = \"small\"\noutput = \"results\"\n{manifest}");
        std::fs::write(self.path("sweep.toml"), text).expect("the manifest is written");
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs the program in this folder.
    pub(crate) fn run<A: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = A>) -> Run {
        run_in(self.folder.path(), args)
    }

    /// `pipeline sweep sweep.toml` and more arguments.
    pub(crate) fn sweep(&self, more: &[&str]) -> Run {
        self.run(["sweep", "sweep.toml"].iter().chain(more))
    }

    /// The file names of a folder in here, in order; none if it isn't there.
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path(folder)) else { return Vec::new() };
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().into_string().expect("a UTF-8 name")).collect();
        names.sort();
        names
    }

    /// The names of the jobs' images in `results`.
    pub(crate) fn images(&self) -> Vec<String> {
        images(&self.names("results"))
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn raster(&self, name: &str) -> Raster {
        read(&self.path(name))
    }

    pub(crate) fn record(&self, job: &str) -> JobRecord {
        let bytes = self.bytes(&format!("results/{job}.json"));
        serde_json::from_slice(&bytes).unwrap_or_else(|e| panic!("{job}: {e}"))
    }

    /// Every image and record of `results`.
    pub(crate) fn seen(&self) -> BTreeMap<String, Seen> {
        let names = self.names("results").into_iter().filter(|n| is_image(n) || n.ends_with(".json"));
        names
            .map(|name| {
                let file = format!("results/{name}");
                let modified = self.path(&file).metadata().unwrap().modified().unwrap();
                let seen = Seen { bytes: self.bytes(&file), modified };
                (name, seen)
            })
            .collect()
    }

    /// The bytes of every image of `results`.
    pub(crate) fn image_bytes(&self) -> BTreeMap<String, Vec<u8>> {
        self.images().into_iter().map(|n| (n.clone(), self.bytes(&format!("results/{n}")))).collect()
    }
}

/// A manifest of three jobs at 24 × 18 pixels of 4 samples: roughness `values` of a metal.
pub(crate) fn three_jobs(values: &str, more: &str) -> String {
    let scene = repository("scenes/spheres.glb");
    format!(
        "scene = '{}'\n[[axis]]\npath = \"material.metallic.roughness\"\nvalues = {values}\n{SMALL}{more}",
        scene.display()
    )
}

/// The smallest picture that shows something.
pub(crate) const SMALL: &str = "[render]\nwidth = 24\nheight = 18\nspp = 4\n";

/// An OBJ without camera and light, which asks for `square.mtl`.
pub(crate) const SQUARE: &str =
    "mtllib square.mtl\nusemtl paint\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

/// The arguments for the smallest picture.
pub(crate) const SMALL_ARGUMENTS: [&str; 6] = ["--width", "24", "--height", "18", "--spp", "4"];

pub(crate) fn read(path: &Path) -> Raster {
    imagefile::read(path).unwrap_or_else(|e| panic!("{e}"))
}

/// The images of jobs among these files.
pub(crate) fn images(names: &[String]) -> Vec<String> {
    names.iter().filter(|n| is_image(n)).cloned().collect()
}

fn is_image(name: &str) -> bool {
    name.ends_with(".exr") && name != "sheet.exr"
}

/// Names of the files that a writer has not finished.
pub(crate) fn leftovers(names: &[String]) -> Vec<&String> {
    names.iter().filter(|n| n.starts_with('.') || n.ends_with(".tmp")).collect()
}

/// The error of a job that failed.
#[track_caller]
pub(crate) fn error_of(record: &JobRecord) -> &str {
    match &record.outcome {
        Outcome::Failed { error } => error,
        Outcome::Done => panic!("{} did not fail", record.job.name),
    }
}

/// Whether every channel of every part has the same bits, whatever the headers say.
pub(crate) fn same_pixels(a: &Raster, b: &Raster) -> bool {
    let planes = |raster: &Raster| -> Vec<(String, String, Vec<u32>)> {
        let channels = raster.layers.iter().flat_map(|l| l.channels.iter().map(move |c| (l, c)));
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect();
        channels.map(|(l, c)| (l.name.clone(), c.name.clone(), bits(&c.values))).collect()
    };
    a.display == b.display && planes(a) == planes(b)
}
