//! The house's rules: which module may use which, how long files are, and where unsafe code may stand.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Every module of the crate with its floor, in tenths: a module uses only floors below its own. `color` lies on the ground floor
/// but above `math`, whose float type it is generic over; `settings` are part of a record and name a model of `disney`.
const FLOORS: [(&str, u32); 29] = [
    ("cli", 80),
    ("bench", 70),
    ("check", 70),
    ("inspect", 70),
    ("sweep", 60),
    ("job", 50),
    ("report", 50),
    ("export", 50),
    ("render", 40),
    ("compare", 40),
    ("output", 40),
    ("library", 40),
    ("named", 0),
    ("import", 30),
    ("convert", 30),
    ("manifest", 30),
    ("accel", 30),
    ("light", 30),
    ("record", 20),
    ("settings", 15),
    ("scene", 20),
    ("imagefile", 20),
    ("disney", 10),
    ("raster", 10),
    ("math", 0),
    ("color", 5),
    ("main", 90),
    ("lib", 100),
    ("pipeline", 80),
];

fn sources() -> Vec<PathBuf> {
    fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()) {
            if entry.is_dir() {
                collect(&entry, files);
            } else if entry.extension().is_some_and(|e| e == "rs") {
                files.push(entry);
            }
        }
    }
    let mut files = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut files);
    files.sort();
    files
}

fn module_of(path: &Path) -> String {
    let inside = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).expect("inside src");
    let first = inside.components().next().expect("a name").as_os_str().to_string_lossy();
    first.trim_end_matches(".rs").to_owned()
}

/// The modules that `crate::NAME` paths in the code name, one or several in braces; comments and strings of documentation don't
/// count.
fn used_modules(code: &str) -> Vec<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut used = Vec::new();
    for line in code.lines().filter(|l| !l.trim_start().starts_with("//")) {
        for (at, _) in line.match_indices("crate::") {
            // `$crate` and `my_crate` are other words.
            if line[..at].ends_with(|c: char| is_name(c) || c == '$') {
                continue;
            }
            let rest = &line[at + "crate::".len()..];
            let names: Vec<&str> = match rest.strip_prefix('{') {
                Some(list) => list.split(['}', ';']).next().unwrap_or("").split(',').map(str::trim).collect(),
                None => vec![rest],
            };
            let first = |name: &str| name.chars().take_while(|c| is_name(*c)).collect::<String>();
            used.extend(names.into_iter().map(first).filter(|n| !n.is_empty()));
        }
    }
    used
}

#[test]
fn every_module_uses_only_floors_below_its_own() {
    let floors: BTreeMap<&str, u32> = FLOORS.into_iter().collect();
    let mut wrong = Vec::new();
    for path in sources() {
        let module = module_of(&path);
        let floor = *floors.get(module.as_str()).unwrap_or_else(|| panic!("{module} has no floor"));
        let code = fs::read_to_string(&path).expect("readable");
        for used in used_modules(&code) {
            if used == module || module == "lib" {
                continue;
            }
            match floors.get(used.as_str()) {
                Some(&below) if below < floor => {}
                Some(&other) => {
                    wrong.push(format!("{}: floor {floor} uses {used} of floor {other}", path.display()))
                }
                None => wrong.push(format!("{}: crate::{used} is not a module with a floor", path.display())),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_file_reaches_over_its_neighbour_or_grows_beyond_a_room() {
    let mut wrong = Vec::new();
    for path in sources() {
        let code = fs::read_to_string(&path).expect("readable");
        if code.contains("super::super") {
            wrong.push(format!("{}: super::super", path.display()));
        }
        let lines = code.lines().count();
        if lines > 600 {
            wrong.push(format!("{}: {lines} lines want two rooms", path.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The one file that may hold unsafe code.
const UNSAFE: &str = "accel/avx2.rs";

#[test]
fn unsafe_code_stands_in_one_file_and_says_why_it_is_sound() {
    for path in sources() {
        let code = fs::read_to_string(&path).expect("readable");
        let unsafe_lines: Vec<usize> = unsafe_lines(&code);
        if path.ends_with(UNSAFE) {
            let lines: Vec<&str> = code.lines().collect();
            let unexplained: Vec<usize> = unsafe_lines
                .iter()
                .copied()
                .filter(|&n| !lines[n - 1].trim_start().starts_with("// SAFETY: "))
                .collect();
            assert!(unsafe_lines.len() > 5 && unexplained.is_empty(), "{}: {unexplained:?}", path.display());
            continue;
        }
        assert_eq!(unsafe_lines, [0; 0], "{}", path.display());
        assert!(!code.contains("allow(unsafe_code)"), "{}", path.display());
    }
}

/// Where code, not a comment, is unsafe; the first line is 0.
fn unsafe_lines(code: &str) -> Vec<usize> {
    let lines = code.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//"));
    lines.filter(|(_, l)| l.contains("unsafe ")).map(|(n, _)| n).collect()
}

/// The scanner itself must see what it is meant to see.
#[test]
fn the_scan_finds_paths_in_all_their_forms() {
    let code = "use crate::render::Geometry;\nfn f(x: crate::light::Lights) {}\nuse crate::{cli, sweep::run};\n// crate::x\n";
    assert_eq!(used_modules(code), ["render", "light", "cli", "sweep"]);
    assert_eq!(unsafe_lines("// unsafe {\nlet x = unsafe { f() };\n#![allow(unsafe_code)]"), [1]);
}
