//! What tests need from outside the project.

use std::io::Write;
use std::path::PathBuf;

/// The file or folder that the environment variable `name` holds. Without it the test that asks is left out, and says so where no
/// test runner hides it; `tests/run`, which installs the tools, makes that an error for them.
pub(crate) fn outside(name: &str) -> Option<PathBuf> {
    let found = std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    if found.is_none() {
        let is_tool =
            matches!(name, "PIPELINE_IDIFF" | "PIPELINE_GLTF_VALIDATOR") || name.ends_with("_PYTHON");
        assert!(!(is_tool && std::env::var_os("PIPELINE_REQUIRE_TOOLS").is_some()), "{name} must be set");
        let test = std::thread::current().name().unwrap_or("a test").to_owned();
        writeln!(std::io::stderr(), "skipped: {test}: {name} is not set").expect("stderr");
    }
    found
}
