//! `pipeline render CONFIG_ROOT`: composition, integrators and outputs as Aris' `render.py` has them.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use pipeline::color::srgb_from_linear;
use pipeline::raster::{Attribute, Raster};

use crate::outside::outside;
use crate::support::{Desk, Run, repository};

const SCENES: [&str; 4] = ["cbox", "cbox_diffuse", "cbox_balls", "cbox_copper"];

fn own_root() -> PathBuf {
    repository("scenes/aris/config")
}

fn render(desk: &Desk, root: &Path, more: &[&str]) -> Run {
    desk.run(["render", root.to_str().unwrap()].iter().chain(more))
}

/// A root of one triangle over an `x` edge, seen by a camera with a focal length of 2 pixels, with every file that `more` adds.
fn small_root(desk: &Desk, more: &[(&str, &str)]) -> PathBuf {
    let camera =
        "camera: {name: perspective, config: {fov: 90, c2w: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}}\n";
    let scene = format!(
        "defaults:\n  - brdf: grey\n  - environment: none\n  - _self_\ngeometry: {{name: mesh, config: {{paths: [data/a.obj]}}}}\n\
         emitters: []\n{camera}width: 4\nheight: 4\n"
    );
    let render = "defaults:\n  - scene: one\n  - integrator: depths\n  - render_schema\n  - _self_\nscale: -1\nspp: 1\nsave_exr: false\n";
    let files = [
        ("data/a.obj", "v 0.1 -9 -1\nv 9 0 -1\nv 0.1 9 -1\nf 1 2 3\n"),
        ("config/render.yaml", render),
        ("config/scene/one.yaml", &scene),
        ("config/scene/brdf/grey.yaml", "- name: diffuse\n  config: {color: [0.5, 0.5, 0.5]}\n"),
        ("config/scene/brdf/two.yaml", "- name: mirror\n- name: mirror\n"),
        ("config/scene/environment/none.yaml", "name: none\n"),
        ("config/integrator/depths.yaml", "name: depths\nconfig: {}\n"),
        ("config/integrator/nerad.yaml", "name: nerad\nconfig: {steps: 9}\n"),
        ("config/integrator/albedo.yaml", "name: albedo\n"),
    ];
    for (name, content) in files.iter().chain(more) {
        let path = desk.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    desk.path("config")
}

fn red(raster: &Raster) -> Vec<f32> {
    raster.picture().rgb().unwrap()[0].to_vec()
}

#[test]
fn a_run_writes_what_render_py_writes() {
    let desk = Desk::new("");
    let tiny = ["scene=cbox_copper", "integrator=path_mis", "spp=4", "scale=0.03"];
    let run = render(&desk, &own_root(), &tiny).ends_with(0);
    let folder = "outputs/scene=cbox_copper,integrator=path_mis,spp=4,scale=0.03";
    run.tells(&format!("written to {folder}/")).tells("24 × 18, 4 samples");
    assert_eq!(desk.names(folder), ["config.yaml", "output.png"]);
    let config = String::from_utf8(desk.bytes(&format!("{folder}/config.yaml"))).unwrap();
    assert!(config.starts_with("scene:\n  geometry:\n    name: mesh\n"), "{config}");
    assert!(config.ends_with("spp: 4\nscale: 0.03\nsave_exr: false\n"), "{config}");

    let more = ["save_exr=true", "hydra.run.dir=here"];
    render(&desk, &own_root(), &[&tiny[..], &more].concat()).ends_with(0);
    assert_eq!(desk.names("here"), ["config.yaml", "output.exr", "output.png"]);
    // The PNG is the EXR clipped, encoded and truncated.
    let (exr, png) = (desk.raster("here/output.exr"), desk.raster("here/output.png"));
    for (linear, shown) in exr.picture().rgb().unwrap().iter().zip(png.picture().rgb().unwrap()) {
        let code = |v: f32| {
            let encoded = srgb_from_linear(v.clamp(0.0, 1.0));
            (encoded * 255.0) as i32
        };
        assert!(
            linear
                .iter()
                .zip(shown)
                .all(|(&l, &s)| (code(l) - (s * 255.0).round() as i32).abs() <= i32::from(l < 1.0))
        );
    }
    let Some(Attribute::Text(told)) = exr.picture().attribute("pipeline:config") else { panic!() };
    assert!(told.contains("spp: 4\n"));

    // With -o the usual output, and nothing else.
    render(&desk, &own_root(), &[&tiny[..], &["-o", "a.exr"]].concat()).ends_with(0);
    assert_eq!(red(&desk.raster("a.exr")), red(&exr));
    assert_eq!(desk.names("outputs").len(), 1);
}

/// The focal length is 2 pixels: x is (i - 2)/2 at one metre, and the triangle begins at 0.1.
#[test]
fn one_sample_goes_through_the_integer_coordinate_and_more_lie_around_it() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[]);
    render(&desk, &root, &["-o", "a.exr"]).ends_with(0);
    assert_eq!(red(&desk.raster("a.exr"))[8..12], [0.0, 0.0, 0.0, 1.0]);
    // Of the pixel around x = 0, from -¼ to ¼, the triangle covers 0.15/0.5.
    render(&desk, &root, &["spp=4096", "-o", "b.exr"]).ends_with(0);
    let row = red(&desk.raster("b.exr"));
    assert!((row[10] - 0.3).abs() < 0.01 && row[9] == 0.0 && row[11] == 1.0, "{row:?}");
    // Of 4 pixels 0.8 are 3.2: the size is truncated.
    render(&desk, &root, &["scale=0.8"]).ends_with(0).tells("3 × 3, 1 samples");
    render(&desk, &root, &["scale=0.2"])
        .ends_with(2)
        .tells("the override `scale=0.2`: scale is 0.2, but must be");
}

#[test]
fn albedo_is_written_without_a_curve() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[]);
    render(&desk, &root, &["integrator=albedo", "hydra.run.dir=out"]).ends_with(0);
    let png = desk.raster("out/output.png");
    assert_eq!(
        red(&png)[8..12].iter().map(|v| (v * 255.0).round() as u8).collect::<Vec<_>>(),
        [0, 0, 0, 127]
    );
}

#[test]
fn the_composed_configuration_and_its_origins_are_shown() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[]);
    let run = render(&desk, &root, &["+scene.camera.config.aperture=0.3", "scene.camera.name=thin", "--cfg"]);
    run.ends_with(0).says("    name: thin\n").says("      aperture: 0.3\n");
    let run = render(&desk, &root, &["scene.width=8", "--cfg=origin"]).ends_with(0);
    run.says("scene.width = 8  # the override `scene.width=8`\n")
        .says("scene.height = 4  # config/scene/one.yaml:")
        .says("scene.brdf.0.config.color = [0.5, 0.5, 0.5]  # config/scene/brdf/grey.yaml:2:");
    assert_eq!(desk.names("."), ["config", "data", "sweep.toml"]);
}

#[test]
fn the_thin_camera_is_chosen_by_overrides() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[]);
    let thin = ["scene.camera.name=thin", "spp=64", "-o", "a.exr"];
    let lens = ["+scene.camera.config.aperture=0.9", "+scene.camera.config.focal_distance=5"];
    render(&desk, &root, &thin).ends_with(2).tells("camera \"thin\" needs the key \"aperture\"");
    render(&desk, &root, &[&thin[..], &lens].concat()).ends_with(0);
    assert!(red(&desk.raster("a.exr"))[9] > 0.0, "out of focus, the edge reaches the next pixel");
}

#[test]
fn what_is_wrong_is_told_with_file_and_key_or_the_override() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[("config/bad.yaml", "defaults:\n  - gone\n")]);
    let bad_list = small_root(&desk, &[]).join("scene/list.yaml");
    std::fs::write(bad_list, "defaults:\n  - one\n  - override brdf: gray\nwidth: 4\n").unwrap();
    for (overrides, expected) in [
        (&["scene=oen"][..], "the override `scene=oen`: cannot read"),
        (&["scene=oen"], "hint: did you mean \"one\"?"),
        (
            &["scene.widht=3"],
            "the override `scene.widht=3`: there is no key \"widht\"; hint: did you mean \"width\"?",
        ),
        (&["+scene.width=3"], "scene.width is there already"),
        (&["scene/brfd=two"], "there is no group scene/brfd"),
        (&["scene/brdf=two"], "config/scene/brdf/two.yaml:1:1: brdf: 2 entries, but there are 1 meshes"),
        (&["integrator/brdf=two"], "there is no group integrator/brdf"),
        (&["spp=0"], "the override `spp=0`: spp is 0, but must be a whole number in [1, 16777216]"),
        (&["spp=many"], "the override `spp=many`: spp must be a whole number, but is text"),
        (&["spp=1,2"], "it is a sweep of several values"),
        (&["spp"], "it has no `=`"),
        (
            &["integrator=nerad"],
            "config/integrator/nerad.yaml:1:1: the integrator \"nerad\" is not read; hint: it trains",
        ),
        (&["scene.brdf.0.name=learned_diffuse"], "brdf[0] \"learned_diffuse\" is not read"),
        (&["integrator.name=paths"], "the integrator \"paths\" is not read; hint: did you mean \"path\"?"),
        (
            &["+integrator.config.depth=3"],
            "the override `+integrator.config.depth=3`: integrator \"depths\" has no key \"depth\"",
        ),
        (&["scene.geometry.config.paths=[data/b.obj]"], "`: geometry.config.paths[0]: cannot read"),
        (&["scene.geometry.config.paths=[../b.obj]"], "leads out of the scene's folder"),
        (&["scene.width=${scene.hight}"], "scene.width: ${scene.hight} names nothing"),
        (&["scene=list"], "config/scene/list.yaml:3:"),
        (&["scene=list", "scene/brdf=grey"], ""),
        (&["hydra.job.name=x"], "it is about how Hydra itself runs"),
    ] {
        let code = if expected.is_empty() { 0 } else { 2 };
        let run = render(&desk, &root, &[overrides, &["-o", "a.exr"]].concat()).ends_with(code);
        run.tells(expected).tells_not("panicked");
    }
    assert!(!desk.names(".").contains(&"outputs".to_owned()));
}

#[test]
fn overrides_go_with_config_roots_alone() {
    let desk = Desk::new("");
    let scene = repository("scenes/spheres.glb");
    render(&desk, &scene, &["spp=4", "-o", "a.exr"])
        .ends_with(64)
        .tells("takes no overrides such as `spp=4`");
    render(&desk, &scene, &["--cfg"]).ends_with(64).tells("--cfg has nothing to show");
    render(&desk, &scene, &[]).ends_with(64).tells("-o FILE is missing");
    render(&desk, &repository("scenes"), &["-o", "a.exr"]).ends_with(2).tells("no config root");
}

/// How a configuration is written makes no difference to which job it is; what it says does.
#[test]
fn the_key_follows_the_composed_scene() {
    let desk = Desk::new("");
    let root = small_root(&desk, &[]);
    let key = |overrides: &[&str]| {
        render(&desk, &root, &[overrides, &["-o", "a.exr"]].concat()).ends_with(0);
        match desk.raster("a.exr").picture().attribute("pipeline:key") {
            Some(Attribute::Text(key)) => key.clone(),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(key(&[]), key(&["scene.width=4", "++block_size=9"]));
    let keys: BTreeSet<String> = [
        &[][..],
        &["scene.brdf.0.config.color=[0.5,0.5,0.6]"],
        &["integrator=albedo"],
        &["spp=2"],
        &["scene.camera.config.fov=80"],
    ]
    .map(key)
    .into();
    assert_eq!(keys.len(), 5);
}

#[test]
fn a_dark_scene_stays_dark() {
    let desk = Desk::new("");
    let path = ("config/integrator/path.yaml", "name: path\nconfig: {max_path_length: 4}\n");
    let root = small_root(&desk, &[path]);
    render(&desk, &root, &["integrator=path", "-o", "a.exr"])
        .ends_with(0)
        .tells("no light: the picture will be black");
    assert!(red(&desk.raster("a.exr")).iter().all(|&v| v == 0.0));
}

/// Every scene with every integrator, in the repository's root and in the corpus: rendered, or refused for what isn't there.
#[test]
fn every_scene_renders_with_every_integrator() {
    let desk = Desk::new("");
    let mut roots = vec![own_root()];
    roots.extend(outside("PIPELINE_CORPUS").map(|corpus| corpus.join("aris/config")));
    for root in &roots {
        for scene in options(&root.join("scene")) {
            for integrator in options(&root.join("integrator")) {
                let overrides = [format!("scene={scene}"), format!("integrator={integrator}")];
                let tiny = ["spp=2", "scale=0.02", "-o", "a.exr"];
                let arguments: Vec<&str> = overrides.iter().map(String::as_str).chain(tiny).collect();
                let run = render(&desk, root, &arguments);
                let what = format!("{scene} {integrator}: {}", run.stderr);
                if run.code != 0 {
                    let is_told = run.stderr.contains("geometry.config.paths[0]: cannot read")
                        || (scene == "cbox_base" && run.stderr.contains("the scene needs the key \"brdf\""));
                    assert!(run.code == 2 && is_told, "{what}");
                    continue;
                }
                assert!(!run.stderr.contains("were dropped"), "{what}");
                let raster = desk.raster("a.exr");
                let finite = raster
                    .picture()
                    .rgb()
                    .unwrap()
                    .iter()
                    .all(|c| c.iter().all(|v| v.is_finite() && *v >= 0.0));
                assert!(finite, "{what}");
            }
        }
    }
}

/// The names of a group's options.
fn options(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut names: Vec<String> = entries
        .filter_map(|e| {
            e.unwrap().file_name().into_string().unwrap().strip_suffix(".yaml").map(str::to_owned)
        })
        .collect();
    names.sort();
    names
}

/// Composes each list of overrides with Hydra, and tells how that compares with what the program printed: as JSON lines of
/// `same`, or of what differs.
const ORACLE: &str = r#"
import json, sys
from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from omegaconf import OmegaConf
ConfigStore.instance().store(name="render_schema", node={})
cases = json.load(sys.stdin)
with initialize_config_dir(config_dir=sys.argv[1], version_base=None):
    for overrides, ours in cases:
        try:
            theirs = compose("render", overrides=overrides)
        except Exception as error:
            print("same" if ours is None else f"{overrides}: Hydra refuses: {error}".replace("\n", " "))
            continue
        if ours is None:
            print(f"{overrides}: refused")
            continue
        ours, theirs = OmegaConf.to_container(OmegaConf.create(ours)), OmegaConf.to_container(theirs)
        # JSON tells 1 from 1.0, and keeps the order of keys.
        a, b = json.dumps(ours), json.dumps(theirs)
        print("same" if a == b else f"{overrides}:\n  {a}\n  {b}")
"#;

/// The program's composition against the real Hydra's, for every scene, integrator and kind of override.
#[test]
fn composition_is_hydra_s() {
    let Some(python) = outside("PIPELINE_HYDRA_PYTHON") else { return };
    let desk = Desk::new("");
    let mut roots = vec![(own_root(), SCENES.to_vec())];
    if let Some(corpus) = outside("PIPELINE_CORPUS") {
        let scenes =
            vec!["ajax", "ajax_simple", "bunny", "cbox", "cbox_base", "cbox_diffuse", "lego", "veach"];
        roots.push((corpus.join("aris/config"), scenes));
    }
    let odd = odd_root(&desk);
    roots.push((odd, vec!["one", "odd", "more"]));
    let of_odd = [
        "scene=odd scene/brdf=grey",
        "scene=odd scene.width=7",
        "scene=more scene/extra=e",
        "scene=more ~scene/extra",
        "scene=more scene/deep/group=[x,y]",
        "scene=more scene.deep.group.numbers.0=2",
        "scene=more scene.integrator=null",
        "integrator=[depths,albedo]",
        "+scene/extra=e",
        "+scene/extra=gone",
        "scene/extra=e",
    ];
    let other = [
        "scene=cbox scene/brdf=cbox_diffuse scene.width=400 spp=50 scale=0.5",
        "scene=cbox scene.camera.name=thin +scene.camera.config.aperture=0.3 ++scene.camera.config.focal_distance=5.0",
        "scene=cbox ~scene/environment",
        "scene=cbox ~scene/environment=none +scene/environment=none",
        "scene=cbox ~scene.emitters scene.brdf.3={name:mirror,config:null}",
        "scene=cbox scene.brdf.0.config.color=[1,.5,1e-1] scene.emitters.0.config.i_primitive=4",
        "scene=cbox scene.brdf.0.config.colour=[1,1,1]",
        "scene=cbox scene={width:3,height:${scene.width}}",
        "scene=cbox scene={widht:3}",
        "scene=cbox scene=cbox_diffuse",
        "scene=cbox_base scene/brdf=cbox",
        "scene=cbox_base +scene/brdf=cbox",
        "scene=cbox +scene/brdf=cbox_diffuse",
        "scene=cbox ++scene/brdf=cbox_diffuse",
        "scene=[cbox_base,cbox_diffuse]",
        "scene=[cbox,cbox_diffuse]",
        "scene=gone",
        "scene=null",
        "+scene=cbox",
        "integrator.config=null",
        "+a.b.c=1 ++a.b.d=[x,{y:z}] a.b.c=2 ~a.b.d",
        "spp=1,2",
        "spp=inf save_exr=TRUE scale=-.5",
        "spp='a b' scale=\"it's\" save_exr=",
        "hydra.run.dir=x",
        "spp.x=1",
        "+spp.x=1",
        "nothing=1",
        "scene@x=cbox",
    ];
    for (root, scenes) in roots {
        let mut cases: Vec<Vec<String>> = vec![Vec::new()];
        for scene in scenes {
            for integrator in options(&root.join("integrator")) {
                cases.push(vec![format!("scene={scene}"), format!("integrator={integrator}")]);
            }
        }
        let more: &[&str] = if root.starts_with(desk.path("config")) { &of_odd } else { &other };
        cases.extend(more.iter().map(|line| split(line)));
        let composed: Vec<(&Vec<String>, Option<String>)> = cases
            .iter()
            .map(|overrides| {
                let arguments: Vec<&str> = overrides.iter().map(String::as_str).chain(["--cfg"]).collect();
                let run = render(&desk, &root, &arguments);
                (overrides, (run.code == 0).then_some(run.stdout))
            })
            .collect();
        let answer = ask(&python, &root, &serde_json::to_string(&composed).unwrap());
        let wrong: Vec<&str> = answer.lines().filter(|line| *line != "same").collect();
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert_eq!(answer.lines().count(), cases.len());
    }
}

/// A root that uses more of Hydra than Aris' own.
fn odd_root(desk: &Desk) -> PathBuf {
    let odd = "defaults:\n  - _self_\n  - one\n  - override brdf: two\nwidth: 5\nnew: {a: 1}\n";
    let more = "defaults:\n  - /integrator: albedo\n  - optional brdf: gone\n  - optional nothing\n  - deep/group: x\n  - extra: null\n";
    let x = "numbers: [1e3, 0x10, .5, -1., '64', 2020-01-01, 1.5e-7, true, ~, '']\ntext: {a: x, b: \"y z\"}\nempty:\n";
    small_root(
        desk,
        &[
            ("config/scene/odd.yaml", odd),
            ("config/scene/more.yaml", more),
            ("config/scene/deep/group/x.yaml", x),
            ("config/scene/deep/group/y.yaml", "# @package _group_\ntext: {b: q}\nempty: {c: ${..text.a}}\n"),
            ("config/scene/extra/e.yaml", ""),
        ],
    )
}

/// Words as a shell would take them: spaces within quotes stay.
fn split(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.chars() {
        match (c, quote) {
            (' ', None) => words.push(String::new()),
            _ => {
                quote = match (c, quote) {
                    ('\'' | '"', None) => Some(c),
                    (c, Some(q)) if c == q => None,
                    (_, quote) => quote,
                };
                words.last_mut().unwrap().push(c);
            }
        }
    }
    words
}

fn ask(python: &Path, root: &Path, cases: &str) -> String {
    let mut child = Command::new(python)
        .args(["-c", ORACLE])
        .arg(root.canonicalize().unwrap())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    child.stdin.take().unwrap().write_all(cases.as_bytes()).expect("Python reads");
    let output = child.wait_with_output().expect("Python ends");
    assert!(output.status.success());
    String::from_utf8(output.stdout).expect("Python writes UTF-8")
}
