//! The scenes that come with the project.

use pipeline::raster::{Attribute, Raster};

use crate::support::{Desk, SMALL_ARGUMENTS, repository};

/// Every scene by its file.
const SCENES: [&str; 8] = [
    "spheres.glb",
    "shaderball.glb",
    "statue.glb.gz",
    "cornell.obj",
    "aris/config/scene/cbox.yaml",
    "aris/config/scene/cbox_balls.yaml",
    "aris/config/scene/cbox_copper.yaml",
    "aris/config/scene/cbox_diffuse.yaml",
];

#[test]
fn no_scene_has_a_bad_sample_or_a_black_picture() {
    let desk = Desk::with_three_jobs("");
    for scene in SCENES {
        let path = repository("scenes").join(scene);
        let arguments = ["render", path.to_str().unwrap(), "-o", "a.exr"];
        let run = desk.run(arguments.iter().chain(&SMALL_ARGUMENTS)).ends_with(0).tells(" triangles, ");
        assert!(!run.stderr.contains("not finite"), "{scene}: {}", run.stderr);
        let has_camera = scene != "cornell.obj";
        assert_eq!(run.stderr.contains("warning: "), !has_camera, "{scene}: {}", run.stderr);
        let raster = desk.raster("a.exr");
        let [r, g, b] = raster.picture().rgb().unwrap();
        let values = || r.iter().chain(g).chain(b);
        assert!(values().all(|v| v.is_finite() && *v >= 0.0), "{scene}");
        assert!(values().sum::<f32>() > 10.0, "{scene} is black");
    }
}

/// One box written twice, with the same triangles in the same order, materials and light: with Aris' camera all pixels have the
/// same bits but some on the spheres' outlines. There an interpolated normal may face away from the viewer, where a surface of
/// Aris, which has one side, is black, and one of OBJ, which has two, is not.
#[test]
fn the_cornell_box_as_obj_and_as_aris_scene_is_the_same_picture() {
    let desk = Desk::with_three_jobs("");
    let obj = repository("scenes/cornell.obj");
    let aris = repository("scenes/aris/config/scene/cbox_diffuse.yaml");
    // With each pixel's own paths.
    let size = ["--width", "48", "--height", "36", "--spp", "16", "--set", "render.path_reuse=never"];
    let camera = [
        "--set",
        "camera.c2w=[[-1.0, 0.0, 0.0, 0.0], [0.0, 0.9996573249755573, 0.02617694830787315, 0.92], \
         [0.0, -0.02617694830787315, 0.9996573249755573, 5.4]]",
        "--set",
        "camera.fov_x=28",
        "--set",
        "camera.pixel_offset=[-0.5, -0.5]",
    ];
    let render = |scene: &std::path::Path, output: &'static str, more: &[&str]| {
        let arguments = ["render", scene.to_str().unwrap(), "-o", output];
        desk.run(arguments.iter().chain(&size).chain(more)).ends_with(0);
        desk.raster(output)
    };
    let (from_obj, from_aris) = (render(&obj, "obj.exr", &camera), render(&aris, "aris.exr", &[]));
    let plane = |raster: &Raster, part: usize, name: &str| -> Vec<u32> {
        raster.layers[part].channel(name).expect(name).values.iter().map(|v| v.to_bits()).collect()
    };
    assert!(plane(&from_obj, 1, "Z") == plane(&from_aris, 1, "Z"), "the same triangles from the same place");
    let unequal = |part: usize, names: &[&str]| -> Vec<usize> {
        let planes: Vec<_> =
            names.iter().map(|n| (plane(&from_obj, part, n), plane(&from_aris, part, n))).collect();
        (0..48 * 36).filter(|&i| planes.iter().any(|(a, b)| a[i] != b[i])).collect()
    };
    let (colors, normals) = (unequal(0, &["R", "G", "B"]), unequal(1, &["normal.X", "normal.Y", "normal.Z"]));
    assert!(colors.len() <= 48 * 36 / 200, "{} pixels differ", colors.len());
    assert!(
        normals.iter().all(|i| colors.contains(i)) && colors.len() <= normals.len() + 2,
        "{colors:?} {normals:?}"
    );
    // So few samples do not move the mean.
    desk.run(["diff", "obj.exr", "aris.exr", "--fail", "0.2", "--mean", "0.0002"]).ends_with(0);
    let key = |raster: &Raster| match raster.picture().attribute("pipeline:key") {
        Some(Attribute::Text(key)) => key.clone(),
        other => panic!("{other:?}"),
    };
    assert!(key(&from_obj) != key(&from_aris), "two scenes were rendered, not one");
}
