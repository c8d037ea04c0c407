//! What can't be rendered takes nothing else down.

use pipeline::imagefile;
use pipeline::record::Outcome;

use crate::support::{Desk, SMALL, error_of, images, leftovers, repository};

/// A folder with a missing scene, a broken one and a good one, in this order.
fn mixed() -> Desk {
    let good = repository("scenes/spheres.glb");
    let desk =
        Desk::new(&format!("scene = [\"missing.glb\", \"broken.glb\", '{}']\n{SMALL}", good.display()));
    let mut bytes = std::fs::read(&good).unwrap();
    bytes.truncate(bytes.len() / 2);
    std::fs::write(desk.path("broken.glb"), bytes).unwrap();
    desk
}

#[test]
fn a_missing_and_a_broken_scene_fail_alone() {
    let desk = mixed();
    let run = desk.sweep(&[]).ends_with(2).says("3 jobs: 1 rendered, 0 reused, 2 FAILED\n");
    for (job, file) in [("scene=missing", "missing.glb"), ("scene=broken", "broken.glb")] {
        assert!(error_of(&desk.record(job)).contains(file));
        let line = run.stdout.lines().find(|l| l.starts_with(&format!("{job}: FAILED: ")));
        assert!(line.is_some_and(|l| l.contains(file)), "{}", run.stdout);
        assert!(run.stderr.contains(&format!("{job}: FAILED: ")), "{}", run.stderr);
    }
    assert_eq!(desk.images(), ["scene=spheres.exr"]);
    assert_eq!(desk.record("scene=spheres").outcome, Outcome::Done);
    for name in ["sheet.png", "sheet.exr", "index.html"] {
        assert!(desk.path("results").join(name).is_file(), "{name}");
    }
}

#[test]
fn what_failed_is_tried_again_and_what_was_done_is_not() {
    let desk = mixed();
    desk.sweep(&[]).ends_with(2);
    let good = repository("scenes/spheres.glb");
    std::fs::copy(&good, desk.path("missing.glb")).unwrap();
    desk.sweep(&[]).ends_with(2).says("3 jobs: 1 rendered, 1 reused, 1 FAILED\n");
    std::fs::copy(&good, desk.path("broken.glb")).unwrap();
    desk.sweep(&[]).ends_with(0).says("3 jobs: 1 rendered, 2 reused\n");
    assert_eq!(desk.record("scene=broken").attempt, 3);
}

#[test]
fn fail_fast_stops_after_the_first_failure() {
    let desk = mixed();
    desk.sweep(&["--fail-fast"]).ends_with(2).says("1 job: 0 rendered, 0 reused, 1 FAILED\n");
    assert!(desk.images().is_empty());
}

#[test]
fn a_value_that_fails_its_job_leaves_the_others() {
    let scene = repository("scenes/spheres.glb");
    let desk = Desk::new(&format!(
        "scene = '{}'\n[[axis]]\npath = \"environment.image\"\nvalues = [\"broken.png\", \"good.png\"]\n{SMALL}",
        scene.display()
    ));
    imagefile::write_png(&desk.path("good.png"), 4, 2, &[200; 24]).unwrap();
    let mut bytes = desk.bytes("good.png");
    bytes.truncate(40);
    std::fs::write(desk.path("broken.png"), bytes).unwrap();
    desk.sweep(&[]).ends_with(2).says("2 jobs: 1 rendered, 0 reused, 1 FAILED\n").says("broken.png");
    assert_eq!(desk.images().len(), 1);
    let record = desk.record("image=broken");
    let error = error_of(&record);
    assert!(error.contains("broken.png as `environment.image`: "), "{error}");
    assert!(error.contains("is damaged"), "it tells why: {error}");
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let desk = Desk::with_three_jobs("");
    std::fs::write(desk.path("results"), "a file").unwrap();
    desk.sweep(&[]).ends_with(2).tells("error: cannot use the folder ").tells("results");
    desk.sweep(&["-o", "sweep.toml/sub"]).ends_with(2).tells("sweep.toml/sub");
}

/// An output that can't be replaced, as in a folder that lost its permissions: the job fails and the others don't.
#[test]
fn an_image_that_cannot_be_written_fails_its_job_alone() {
    let desk = Desk::with_three_jobs("");
    std::fs::create_dir_all(desk.path("results/roughness=0.50.exr/inside")).unwrap();
    desk.sweep(&[]).ends_with(2).says("3 jobs: 2 rendered, 0 reused, 1 FAILED\n").says("roughness=0.50.exr");
    assert!(error_of(&desk.record("roughness=0.50")).contains("roughness=0.50.exr"));
    std::fs::remove_dir_all(desk.path("results/roughness=0.50.exr")).unwrap();
    desk.sweep(&[]).ends_with(0).says("3 jobs: 1 rendered, 2 reused\n");
}

/// A file system in memory, while this lives.
#[cfg(target_os = "linux")]
struct Disk {
    folder: std::path::PathBuf,
}

#[cfg(target_os = "linux")]
impl Disk {
    /// Of that size, where mounting is allowed.
    fn mount(folder: std::path::PathBuf, size: &str) -> Option<Self> {
        std::fs::create_dir(&folder).unwrap();
        let disk = Self { folder };
        disk.mounted(&format!("size={size}")).then_some(disk)
    }

    fn mounted(&self, options: &str) -> bool {
        let mut mount = std::process::Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(&self.folder);
        mount.output().is_ok_and(|output| output.status.success())
    }
}

#[cfg(target_os = "linux")]
impl Drop for Disk {
    fn drop(&mut self) {
        // Where nothing was mounted there is nothing to take away.
        let _ = std::process::Command::new("umount").arg(&self.folder).output();
    }
}

/// Needs the right to mount.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_the_sweep_goes_on_when_there_is_room() {
    let desk = Desk::with_three_jobs("");
    let Some(disk) = Disk::mount(desk.path("disk"), "24k") else {
        use std::io::Write;
        writeln!(std::io::stderr(), "skipped: a full disk: no small file system can be mounted here")
            .unwrap();
        return;
    };
    let scene = repository("scenes/spheres.glb");
    let large = ["--width", "160", "--height", "120", "--spp", "1"];
    let render = ["render", scene.to_str().unwrap(), "-o", "disk/a.exr"];
    let run = desk.run(render.iter().chain(&large)).ends_with(2);
    run.tells("disk/a.exr").tells("No space left on device").tells_not(".writing-");
    assert!(desk.names("disk").is_empty(), "neither the image nor a part of it");

    let run = desk.sweep(&["-o", "disk"]).ends_with(2).tells("No space left on device").tells_not("panicked");
    let names = desk.names("disk");
    assert!(leftovers(&names).is_empty(), "{names:?}");
    let done = images(&names).len();
    assert!(done < 3 && !names.contains(&"sheet.png".to_owned()), "{names:?} {run:?}");

    assert!(disk.mounted("remount,size=4m"));
    desk.sweep(&["-o", "disk"]).ends_with(0).says(&format!("3 jobs: {} rendered, {done} reused", 3 - done));
    let roomy = Desk::with_three_jobs("");
    roomy.sweep(&[]).ends_with(0);
    for (name, bytes) in roomy.image_bytes() {
        assert!(desk.bytes(&format!("disk/{name}")) == bytes, "{name}");
    }
}
