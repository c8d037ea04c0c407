//! Arguments, help, and what is printed for other programs.

use crate::support::run;

#[test]
fn wrong_arguments_are_64() {
    let wrong: [&[&str]; 12] = [
        &[],
        &["rendr"],
        &["sweep"],
        &["sweep", "a.toml", "--shard", "3/2"],
        &["sweep", "a.toml", "--list", "--dry-run"],
        &["render", "a.glb"],
        &["render", "a.glb", "--sample", "2"],
        &["render", "a.glb", "-o", "a.exr", "--spp", "0"],
        &["render", "a.glb", "-o", "a.exr", "--set", "camera.fov"],
        &["render", "a.glb", "-o", "a.exr", "--spp", "many"],
        &["accept", "a.toml"],
        &["diff", "a.exr", "b.exr", "--threads", "0"],
    ];
    for arguments in wrong {
        let told = run(arguments).ends_with(64);
        assert!(told.stdout.is_empty() && !told.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn help_of_every_command_has_an_example_and_ends_well() {
    let help = run(["--help"])
        .ends_with(0)
        .says("Exit codes: 0 well, 1 images differ, 2 an error, 64 wrong arguments");
    for command in ["render", "sweep", "accept", "diff", "schema", "completions"] {
        assert!(help.stdout.contains(&format!("\n  {command} ")), "{command}");
        run([command, "--help"]).ends_with(0).says("Example").says(&format!("pipeline {command} "));
    }
    run(["--version"]).ends_with(0).says(env!("CARGO_PKG_VERSION"));
}

#[test]
fn the_manifest_s_schema_is_json_and_knows_the_tables() {
    let schema: serde_json::Value =
        serde_json::from_str(&run(["schema", "manifest"]).ends_with(0).stdout).unwrap();
    let properties = schema["properties"].as_object().expect("an object's schema");
    for key in ["scene", "axis", "set", "render", "camera", "environment", "sheet", "compare", "exclude"] {
        assert!(properties.contains_key(key), "{key}");
    }
    let record: serde_json::Value =
        serde_json::from_str(&run(["schema", "record"]).ends_with(0).stdout).unwrap();
    assert!(record["properties"]["verdict"].is_object());
}

#[test]
fn completions_of_each_shell_know_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let script = run(["completions", shell]).ends_with(0).stdout;
        for word in ["sweep", "render", "fail-fast"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    run(["completions", "dos"]).ends_with(64);
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::{Command, Stdio};
    let mut child = Command::new(crate::support::PROGRAM)
        .args(["completions", "zsh"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}
