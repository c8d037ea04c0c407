//! Whole manifests: parsed, expanded, checked; the page of errors.

mod hostile;

use std::path::{Path, PathBuf};

use super::*;
use crate::disney::Parameter;
use crate::record::{Job, Override, Value};
use crate::scene::{Camera, Material, Named, Scene};

const ROUGHNESS: &str = include_str!("../../../configs/roughness.toml");
const BY_METAL: &str = include_str!("../../../configs/roughness_by_metal.toml");
const STATUE: &str = include_str!("../../../configs/statue.toml");
const BALLS: &str = include_str!("../../../configs/pink_and_green_balls.toml");
const COPPER: &str = include_str!("../../../configs/two_copper_spheres.toml");

fn parse(text: &str) -> Result<Manifest, ManifestErrors> {
    Manifest::parse(text, Path::new("configs/test.toml"))
}

fn sound(text: &str) -> Manifest {
    parse(text).unwrap_or_else(|e| panic!("{e}"))
}

/// The messages of everything that is wrong, with line and column.
fn wrong(text: &str) -> Vec<String> {
    let errors = parse(text).expect_err("should be refused");
    messages(&errors)
}

fn messages(errors: &ManifestErrors) -> Vec<String> {
    let place = |d: &Diagnostic| errors.position(d).map(|(l, c)| format!("{l}:{c}: ")).unwrap_or_default();
    errors.diagnostics.iter().map(|d| format!("{}{}", place(d), d.error)).collect()
}

/// The jobs for one scene file for each entry of `scene`.
fn jobs(text: &str) -> Vec<Job> {
    let manifest = sound(text);
    expand(&manifest, &found(&manifest)).unwrap_or_else(|e| panic!("{e}"))
}

fn found(manifest: &Manifest) -> Vec<PathBuf> {
    manifest.scene_patterns().into_iter().filter_map(|p| p.path).collect()
}

fn not_expanded(text: &str) -> Vec<String> {
    let manifest = sound(text);
    messages(&expand(&manifest, &found(&manifest)).expect_err("should be refused"))
}

fn names(jobs: &[Job]) -> Vec<&str> {
    jobs.iter().map(|j| j.name.as_str()).collect()
}

/// A manifest with one scene and these lines.
fn with(lines: &str) -> String {
    format!("scene = \"a.glb\"\n{lines}")
}

fn scene() -> Scene<Material> {
    Scene {
        materials: ["ball", "floor"].map(|n| Named::new(n, Material::default())).into(),
        cameras: vec![Named::new(
            "main",
            Camera::look_at(glam::Vec3::Z, glam::Vec3::ZERO, glam::Vec3::Y, 0.7),
        )],
        ..Scene::empty()
    }
}

fn not_in_scene(text: &str) -> Vec<String> {
    messages(&check(&sound(text), &scene(), Path::new("scenes/ball.glb")).expect_err("should be refused"))
}

#[test]
fn the_roughness_sweep_is_eleven_jobs_named_by_value() {
    let manifest = sound(ROUGHNESS);
    let jobs = expand(&manifest, &found(&manifest)).unwrap();
    let expected: Vec<String> = (0..=10).map(|i| format!("roughness={}.{}0", i / 10, i % 10)).collect();
    assert_eq!(names(&jobs), expected);
    let job = &jobs[3];
    assert_eq!(job.scene, Path::new("configs/../scenes/shaderball.glb"));
    let set = |path: &str, n| Override { path: path.into(), value: Value::Number(n) };
    assert_eq!(job.overrides, [set("material.ball.metallic", 1.0), set("material.ball.roughness", 0.3)]);
    assert_eq!((job.settings.width, job.settings.height, job.settings.spp), (Some(208), Some(156), 64));
    let c = &job.coordinates[0];
    assert_eq!((c.axis.as_str(), c.index, c.label.as_str()), ("material.ball.roughness", 3, "0.30"));
    let compare = manifest.compare.as_ref().unwrap();
    assert_eq!(
        (compare.references.to_str(), compare.fail),
        (Some("../tests/references/roughness"), Some(0.004))
    );
    check(&manifest, &scene(), Path::new("shaderball.glb")).unwrap();
}

#[test]
fn the_last_axis_is_the_fastest_and_labels_name_values() {
    let jobs = jobs(BY_METAL);
    assert_eq!(jobs.len(), 22);
    assert_eq!(jobs[0].name, "base_color=copper,roughness=0.00");
    assert_eq!(jobs[1].name, "base_color=copper,roughness=0.10");
    assert_eq!(jobs[21].name, "base_color=steel,roughness=1.00");
}

#[test]
fn the_statue_has_four_zipped_materials() {
    let manifest = sound(STATUE);
    let jobs = expand(&manifest, &found(&manifest)).unwrap();
    assert_eq!(
        names(&jobs),
        ["Metallic_Statue", "Subsurface_Statue", "Rough_Plastic", "Shiny_Bunny"]
            .map(|n| format!("material={n}"))
    );
    assert_eq!(jobs[0].coordinates[0].label, "Metallic Statue");
    assert_eq!(jobs[3].overrides.len(), 12);
    let mut scene = scene();
    scene.materials[0].name = "statue".into();
    check(&manifest, &scene, Path::new("statue.glb.gz")).unwrap();
    let mut settings = jobs[3].settings.clone();
    let mut none =
        |_: &Path| -> Result<std::sync::Arc<crate::scene::Image>, edit::BoxedError> { Err("unused".into()) };
    edit::apply_all(&mut scene, &mut settings, &jobs[3].overrides, &mut none).unwrap();
    let bunny = &scene.materials[0].item;
    assert_eq!(bunny.scalar(Parameter::SheenTint).constant(), Some(0.9));
    assert_eq!(bunny.masking, crate::disney::Masking::Remapped);
}

#[test]
fn a_job_without_axes_is_named_after_the_manifest() {
    for (text, name) in [(BALLS, "pink_and_green_balls"), (COPPER, "two_copper_spheres")] {
        let jobs = jobs(text);
        assert_eq!((names(&jobs), jobs[0].settings.spp), (vec![name], 50));
    }
    assert_eq!(jobs("scene = \"a.glb\"")[0].name, "test", "the file's stem");
    assert_eq!(sound("name = \"../a b\"\nscene = \"a.glb\"").folder_name(), "_.._a_b");
}

#[test]
fn several_scenes_are_the_slowest_axis() {
    let text = "scene = [\"a/one.glb\", \"b/two.obj\"]\n[[axis]]\npath = \"render.spp\"\nvalues = [1, 16]\n";
    let jobs = jobs(text);
    assert_eq!(names(&jobs), ["scene=one,spp=1", "scene=one,spp=16", "scene=two,spp=1", "scene=two,spp=16"]);
    assert_eq!(jobs[1].settings.spp, 16);
    assert!(jobs[1].overrides.is_empty(), "render settings are in the settings");
    assert_eq!((jobs[2].coordinates[0].axis.as_str(), jobs[2].coordinates[0].index), ("scene", 1));
    let collision = not_expanded("scene = [\"a/one.glb\", \"b/One.obj\"]");
    assert!(collision[0].contains("two jobs would both be called `scene=One`"), "{collision:?}");
}

#[test]
fn patterns_and_scene_axes_are_relative_to_the_manifest() {
    let manifest = Manifest::parse("scene = \"../scenes/*.glb\"", Path::new("odd [name]/m.toml")).unwrap();
    let pattern = &manifest.scene_patterns()[0];
    assert_eq!(pattern.glob, "odd [[]name[]]/../scenes/*.glb");
    assert_eq!(pattern.path, None);
    let one = expand(&manifest, &["scenes/x.glb".into()]).unwrap();
    assert_eq!(one[0].name, "scene=x", "a pattern is an axis even for one file");
    let none = expand(&manifest, &[]).unwrap_err();
    assert_eq!(messages(&none), ["1:9: no scene matches `../scenes/*.glb` in odd [name]"]);

    let jobs = jobs("[[axis]]\npath = \"scene\"\nvalues = [\"x.glb\", \"y.glb\"]");
    assert_eq!(names(&jobs), ["scene=x", "scene=y"]);
    assert_eq!(jobs[1].scene, Path::new("configs/y.glb"));
}

#[test]
fn short_tables_come_first_then_set_then_axes() {
    let text = with(
        "[set]\nmaterial.ball.roughness = 0.5\n\"material.*.metallic\" = 1\n[material.ball]\nmetallic = 0\n\
         [camera]\nfov = 30\nname = \"main\"\n[environment]\nimage = \"sky.hdr\"\n",
    );
    let job = &jobs(&text)[0];
    let paths: Vec<&str> = job.overrides.iter().map(|o| o.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "camera.fov",
            "environment.image",
            "material.ball.metallic",
            "material.ball.roughness",
            "material.*.metallic"
        ]
    );
    assert_eq!(job.overrides[1].value, Value::Text("configs/sky.hdr".into()));
    assert_eq!(job.settings.camera.as_deref(), Some("main"));
}

#[test]
fn keys_grow_until_axes_are_told_apart() {
    let axis = |path: &str| format!("[[axis]]\npath = \"{path}\"\nvalues = [0, 1]\n");
    let text =
        with(&(axis("material.ball.roughness") + &axis("material.floor.roughness") + &axis("render.seed")));
    assert_eq!(jobs(&text)[1].name, "ball.roughness=0.00,floor.roughness=0.00,seed=1");
}

#[test]
fn exclude_drops_matching_jobs() {
    let axes = "[[axis]]\npath = \"render.spp\"\nvalues = [1, 4]\n\
                [[axis]]\npath = \"material.ball.roughness\"\nname = \"r\"\nvalues = [0.1, 0.2]\nlabels = [\"low\", \"high\"]\n";
    let kept = |rule: &str| names(&jobs(&with(&format!("{axes}[[exclude]]\n{rule}\n")))).join(" ");
    assert_eq!(kept("\"render.spp\" = 1\nr = 0.2"), "spp=1,r=low spp=4,r=low spp=4,r=high");
    assert_eq!(kept("r = \"low\""), "spp=1,r=high spp=4,r=high");
    assert_eq!(kept("\"material.ball.roughness\" = 0.1"), "spp=1,r=high spp=4,r=high");
    let refused = |rule: &str| not_expanded(&with(&format!("{axes}[[exclude]]\n{rule}\n")));
    assert!(refused("r = 0.3")[0].contains("matches no job"));
    let all = with("[[axis]]\npath = \"render.spp\"\nvalues = [1]\n[[exclude]]\n\"render.spp\" = 1\n");
    assert!(not_expanded(&all)[0].contains("leaves no job"));
    let unknown = wrong(&with(&format!("{axes}[[exclude]]\nroughnes = 1\n")));
    assert!(unknown[0].contains("`roughnes` is not an axis"), "{unknown:?}");
}

#[test]
fn equal_values_are_a_collision_that_names_both() {
    let text = with("[[axis]]\npath = \"render.spp\"\nvalues = [4, 8, 4]\n");
    assert_eq!(
        not_expanded(&text),
        [
            "4:17: two jobs would both be called `spp=4`: render.spp = 4 (value 1) and render.spp = 4 (value 3)"
        ]
    );
}

#[test]
fn axes_that_make_no_sense_are_refused() {
    let axis =
        |lines: &str| wrong(&with(&format!("[[axis]]\npath = \"material.a.sheen\"\n{lines}\n"))).join("; ");
    assert!(axis("").contains("needs one of `values`, `range`"));
    assert!(
        axis("values = [1]\nrange = { from = 0, to = 1, steps = 2 }").contains("both `values` and `range`")
    );
    assert!(axis("zip = [\"camera.fov\"]\nvalues = [1]").contains("both `path` and `zip`"));
    assert!(axis("values = []").contains("at least one"));
    assert!(axis("values = [0.1, 2]").contains("must be a number in [0, 1]"));
    assert!(axis("values = [nan]").contains("finite"));
    assert!(axis("values = [0, 1]\nlabels = [\"a\"]").contains("1 labels for 2 values"));
    assert!(axis("range = { from = 0, to = 1, steps = 1 }").contains("one step cannot reach"));
    assert!(axis("range = { from = 0, to = 1, steps = -3 }").contains("whole number"));
    assert!(axis("range = { from = 0, to = 1 }").contains("needs `steps`"));
    assert!(axis("range = { from = 0, to = inf, steps = 3 }").contains("`to` must be a number"));
    assert!(axis("range = { from = 0, to = 2, steps = 3 }").contains("is 2, but must be a number in [0, 1]"));
    assert!(axis("log_range = { from = 0, to = 1, steps = 3 }").contains("above 0"));
    assert!(axis("random = { count = 3, from = 0, to = 1 }").contains("needs `seed`"));
    assert!(axis("random = { seed = 3, from = 0, to = 1 }").contains("needs `count`"));
    assert!(axis("random = { seed = 3, count = 2, distribution = \"gauss\" }").contains("log-uniform"));
    let zip = |values: &str| {
        let paths = "zip = [\"material.a.sheen\", \"render.spp\"]";
        wrong(&with(&format!("[[axis]]\n{paths}\n{values}\n"))).join("; ")
    };
    assert!(zip("values = [[0.1, 2], [0.1]]").contains("1 values for the 2 paths"));
    assert!(zip("values = [0.1]").contains("list of lists"));
    assert!(zip("range = { from = 0, to = 1, steps = 2 }").contains("a `zip` needs `values`"));
}

#[test]
fn paths_are_set_once_and_scenes_named_once() {
    let twice = wrong(&with("[set]\n\"render.spp\" = 4\n[[axis]]\npath = \"render.spp\"\nvalues = [1, 2]\n"));
    assert_eq!(twice, ["5:8: `render.spp` is set twice"]);
    let both = wrong(&with("[[axis]]\npath = \"scene\"\nvalues = [\"x.glb\"]\n"));
    assert_eq!(both, ["3:8: `scene` is set twice"]);
    assert_eq!(wrong("name = \"x\""), ["1:1: the manifest needs `scene`, the file to render"]);
    assert!(wrong(&with("[set]\nscene = \"b.glb\"\n"))[0].contains("at the top"));
}

#[test]
fn the_sheet_names_axes() {
    let text = with(
        "[[axis]]\npath = \"render.spp\"\nvalues = [1]\n[sheet]\ncolumns = \"spp\"\nrows = \"render.sp\"\n",
    );
    assert_eq!(
        wrong(&text),
        ["6:11: `spp` is not an axis of this manifest", "7:8: `render.sp` is not an axis of this manifest"]
    );
}

#[test]
fn whole_numbers_beyond_floats_are_refused() {
    assert!(jobs(&with("[render]\nseed = 9007199254740992"))[0].settings.seed == 1 << 53);
    assert!(wrong(&with("[render]\nseed = 9007199254740993"))[0].contains("2^53"));
    assert!(wrong(&with("[render]\nseed = -1"))[0].contains("whole number in [0, 9007199254740992]"));
    assert!(wrong(&with("[render]\nseed = 99999999999999999999"))[0].contains("2^53"));
}

#[test]
fn a_scene_that_lacks_a_path_is_told_before_rendering() {
    let text = with(
        "[set]\n\"material.bal.sheen\" = 0.1\n[[axis]]\npath = \"light.sun.intensity\"\nvalues = [1, 2, 3]\n\
         [environment]\nimage = \"no such.hdr\"\n[camera]\nname = \"mian\"\n",
    );
    assert_eq!(
        not_in_scene(&text),
        [
            "3:1: in scenes/ball.glb: the scene has no material `bal`",
            "5:8: in scenes/ball.glb: the scene has no light `sun`",
            "8:9: there is no file configs/no such.hdr",
            "10:8: in scenes/ball.glb: the scene has no camera `mian`",
        ]
    );
    let conflict = with(
        "[camera]\nposition = [0, 0, 3]\n[[axis]]\npath = \"camera.orbit\"\nvalues = [[0, 0], [90, 0]]\n",
    );
    assert_eq!(
        not_in_scene(&conflict),
        ["5:8: in scenes/ball.glb: `camera.position` and `camera.orbit` cannot both be set"]
    );
    let camera = with("[render]\ncamera = \"top\"\n");
    assert_eq!(not_in_scene(&camera), ["3:10: in scenes/ball.glb: the scene has no camera `top`"]);
    assert_eq!(
        not_in_scene(&with("[material.ball]\nnormal_scale = 2\n")),
        [
            "3:1: in scenes/ball.glb: `material.ball.normal_scale` cannot be set: the material has no normal map"
        ]
    );
}

#[test]
fn all_errors_come_at_once_on_a_page() {
    let text = r##"name = "slips"
scene = "../scenes/shaderball.glb"
seed = 3

[set]
"material.ball.rougness" = 0.5
"material.ball.base_color" = [0.9, 1.2, 0.1]

[[axis]]
path = "materials.ball.sheen"
rnage = { from = 0, to = 1, steps = 3 }

[[axis]]
path = "render.spp"
values = [16, "many"]

[sheet]
columms = "render.spp"

[compare]
fail = -1
"##;
    let errors = parse(text).unwrap_err();
    insta::assert_snapshot!(errors.to_string(), @r##"
    error: the manifest has no key `seed`
     --> configs/test.toml:3:1
      |
    3 | seed = 3
      | ^^^^
      |
      = help: it belongs in [render]

    error: a material has no field `rougness`
     --> configs/test.toml:6:1
      |
    6 | "material.ball.rougness" = 0.5
      | ^^^^^^^^^^^^^^^^^^^^^^^^
      |
      = help: did you mean `roughness`? a material has `base_color`, `subsurface`, `metallic`, `specular`, `specular_tint`, `roughness`, `anisotropic`, `sheen`, `sheen_tint`, `clearcoat`, `clearcoat_gloss`, `model`, `masking`, `diffuse`, `spec_trans`, `ior`, `diff_trans`, `f90`, `transmission_color`, `diff_trans_color`, `thin_walled`, `absorption`, `emission_color`, `emission_strength`, `opacity`, `cutoff`, `normal_scale`, `rotation`

    error: `material.ball.base_color` is [0.9, 1.2, 0.1], but must be a colour [r, g, b] in [0, 1] or "#rrggbb"
     --> configs/test.toml:7:30
      |
    7 | "material.ball.base_color" = [0.9, 1.2, 0.1]
      |                              ^^^^^^^^^^^^^^^

    error: no path begins with `materials`
      --> configs/test.toml:10:8
       |
    10 | path = "materials.ball.sheen"
       |        ^^^^^^^^^^^^^^^^^^^^^^
       |
       = help: did you mean `material`? paths begin with `material`, `camera`, `light`, `environment`, `render`, `import`, `convert`, `scene`

    error: [[axis]] has no key `rnage`
      --> configs/test.toml:11:1
       |
    11 | rnage = { from = 0, to = 1, steps = 3 }
       | ^^^^^
       |
       = help: did you mean `range`?

    error: `render.spp` is "many", but must be a whole number in [1, 16777216]
      --> configs/test.toml:15:15
       |
    15 | values = [16, "many"]
       |               ^^^^^^

    error: [sheet] has no key `columms`
      --> configs/test.toml:18:1
       |
    18 | columms = "render.spp"
       | ^^^^^^^
       |
       = help: did you mean `columns`?

    error: [compare] needs `references`, the folder of the reference images
      --> configs/test.toml:20:1
       |
    20 | [compare]
       | ^^^^^^^^^

    error: `fail` must be a number of at least 0
      --> configs/test.toml:21:8
       |
    21 | fail = -1
       |        ^^
    "##);
    assert!(errors.render(Color::Always).contains("\u{1b}["));
}

#[test]
fn errors_of_syntax_come_at_once_too() {
    let errors = wrong("scene = \nname = \"a\"\nname = \"b\"\nx = [1, 2\n");
    assert!(errors.len() >= 2, "{errors:?}");
    assert!(errors[0].starts_with("1:"), "{errors:?}");
    assert!(errors.iter().any(|e| e.contains("duplicate")), "{errors:?}");
}

#[test]
fn unreadable_files_are_told() {
    let missing = Manifest::read(Path::new("no/such.toml")).unwrap_err().to_string();
    assert!(missing.contains("cannot read the manifest") && missing.contains("no/such.toml"), "{missing}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.toml");
    std::fs::write(&path, b"name = \"\xff\"").unwrap();
    assert!(Manifest::read(&path).unwrap_err().to_string().contains("byte 8"));
    std::fs::write(&path, ROUGHNESS).unwrap();
    assert_eq!(Manifest::read(&path).unwrap().name, "roughness");
}
