//! A sweep that is killed goes on where it was.

use std::collections::BTreeMap;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{Desk, PROGRAM, Seen, leftovers, repository};

const JOBS: usize = 8;

/// Eight jobs of one scene.
fn desk(spp: u32) -> Desk {
    let scene = repository("scenes/spheres.glb");
    let steps = format!("range = {{ from = 0.1, to = 0.8, steps = {JOBS} }}\n");
    Desk::new(&format!(
        "scene = '{}'\n[[axis]]\npath = \"material.metallic.roughness\"\n{steps}\
         [render]\nwidth = 64\nheight = 48\nspp = {spp}\n",
        scene.display()
    ))
}

/// Starts a sweep, kills it as soon as a record is there, and tells which jobs were done then.
fn killed(desk: &Desk) -> BTreeMap<String, Seen> {
    let mut child = Command::new(PROGRAM)
        .args(["sweep", "sweep.toml", "--threads", "1", "--together", "2"])
        .current_dir(desk.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let is_record = |name: &String| name.ends_with(".json");
    while !desk.names("results").iter().any(is_record) {
        assert!(start.elapsed() < Duration::from_secs(120), "no record comes");
        assert!(child.try_wait().unwrap().is_none(), "the sweep ended without a record");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // An image without a record is not done.
    let mut seen = desk.seen();
    let done: Vec<String> = seen.keys().filter(|n| is_record(n)).cloned().collect();
    seen.retain(|name, _| done.contains(&name.replace(".exr", ".json")));
    seen
}

#[test]
fn a_killed_sweep_goes_on_without_rendering_again_what_was_done() {
    // On a machine that stops this test for a while the sweep may be over before it is killed.
    let found = [16, 64, 256].into_iter().find_map(|spp| {
        let desk = desk(spp);
        let before = killed(&desk);
        (before.len() < 2 * JOBS).then_some((spp, desk, before))
    });
    let (spp, stopped, before) = found.expect("a sweep that is killed before its end");
    assert!(before.len() >= 2 && !stopped.names("results").contains(&"index.html".to_owned()));
    // What a run leaves that is killed while it writes.
    std::fs::write(stopped.path("results/.writing-Ab3xYz.tmp"), "half an image").unwrap();

    let done = before.len() / 2;
    let count = format!("{JOBS} jobs: {} rendered, {done} reused\n", JOBS - done);
    stopped.sweep(&[]).ends_with(0).says(&count);
    let after = stopped.seen();
    for (name, seen) in &before {
        assert!(after.get(name) == Some(seen), "{name} was written again");
    }
    assert_eq!(leftovers(&stopped.names("results")), Vec::<&String>::new());

    let whole = desk(spp);
    whole.sweep(&[]).ends_with(0);
    assert!(stopped.image_bytes() == whole.image_bytes());
    assert!(stopped.bytes("results/sheet.exr") == whole.bytes("results/sheet.exr"));
    assert_eq!(stopped.names("results"), whole.names("results"));
}
