//! Techniques that are left out for measuring: savings change no bit, the others nothing but noise.

use std::path::Path;
use std::sync::Arc;

use pipeline::accel::Kernel;
use pipeline::convert::ConvertOptions;
use pipeline::import::ImportOptions;
use pipeline::job::{LoadedScene, load};
use pipeline::render::{Control, Prepared, Rendered, Techniques, render};
use pipeline::settings::{RenderSettings, Use};

const ALL: Techniques = Techniques {
    sobol: true,
    lobes_by_albedo: true,
    lights_by_gloss: true,
    roulette: true,
    light_paths: true,
    path_reuse: true,
    splitting: true,
    adaptive: true,
    constants: true,
    coverage: true,
    useful_light: true,
};

/// One of opaque surfaces alone, and one with mirrors, glass, cut-outs and textures.
const SCENES: [&str; 2] = ["cornell.obj", "spheres.glb"];

fn scene(name: &str) -> LoadedScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    load(&path, &ImportOptions::default(), &ConvertOptions::default(), None).expect("a scene")
}

fn prepared(scene: &LoadedScene, spp: u32) -> Prepared {
    let light_paths = Use::Always;
    let size = RenderSettings { width: Some(32), height: Some(24), ..RenderSettings::default() };
    let settings = RenderSettings {
        spp,
        light_paths,
        path_reuse: Use::Always,
        splitting: Use::Always,
        adaptive: Use::Always,
        ..size
    };
    Prepared::new(Arc::clone(&scene.scene), Arc::clone(&scene.geometry), &settings).expect("prepared")
}

fn rendered(scene: &Prepared) -> Rendered {
    render(scene, &Control::default())
}

/// Every value of every layer.
fn bits(rendered: &Rendered) -> Vec<u32> {
    let channels = rendered.raster.layers.iter().flat_map(|layer| &layer.channels);
    channels.flat_map(|channel| channel.values.iter().map(|value| value.to_bits())).collect()
}

#[test]
fn all_are_in_use_unless_one_is_left_out() {
    assert_eq!(Techniques::default(), ALL);
}

#[test]
fn what_saves_work_alone_changes_no_bit() {
    let savings = [
        Techniques { constants: false, ..ALL },
        Techniques { coverage: false, ..ALL },
        Techniques { useful_light: false, ..ALL },
        Techniques { constants: false, coverage: false, useful_light: false, ..ALL },
    ];
    for name in SCENES {
        let scene = scene(name);
        let whole = rendered(&prepared(&scene, 8));
        for techniques in savings {
            let without = rendered(&prepared(&scene, 8).with(techniques));
            assert!(bits(&without) == bits(&whole), "{name}: {techniques:?}");
        }
        let mut scene = scene;
        scene.geometry = Arc::new((*scene.geometry).clone().with_kernel(Kernel::PORTABLE));
        assert_eq!(scene.geometry.tree().kernel().name(), "portable");
        let portable = rendered(&prepared(&scene, 8));
        assert!(bits(&portable) == bits(&whole), "{name}: portable");
        assert_eq!(portable.counts, whole.counts);
    }
}

#[test]
fn what_is_left_out_is_not_done() {
    let (opaque, all_sorts) = (scene("cornell.obj"), scene("spheres.glb"));
    let skips = |prepared: Prepared, what: &str| prepared.skipped().iter().any(|skip| skip.contains(what));
    for (what, techniques) in [
        ("parameters worked out once", Techniques { constants: false, ..ALL }),
        ("every surface is opaque", Techniques { coverage: false, ..ALL }),
    ] {
        assert!(skips(prepared(&opaque, 1), what));
        assert!(!skips(prepared(&opaque, 1).with(techniques), what));
    }
    let rays = |techniques| rendered(&prepared(&all_sorts, 8).with(techniques)).counts.rays;
    assert!(rays(Techniques { useful_light: false, ..ALL }) > rays(ALL));
    assert!(rays(Techniques { roulette: false, ..ALL }) > rays(ALL));
    assert!(rays(Techniques { light_paths: false, ..ALL }) < rays(ALL));
    assert!(rays(Techniques { splitting: false, ..ALL }) < rays(ALL));
}

/// The mean of all values of the picture with the variance of that mean, or more, which the data part tells.
fn mean(rendered: &Rendered) -> (f64, f64) {
    let sum = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>();
    let data = rendered.raster.layer("data").expect("data");
    let variance = |c: &str| sum(&data.channel(&format!("variance.{c}")).expect("a variance").values);
    let planes = rendered.raster.picture().rgb().expect("a colour picture");
    let count = (3 * planes[0].len()) as f64;
    // The channels of a pixel rise and fall together: their deviations add up.
    let deviation = ["R", "G", "B"].map(|c| variance(c).sqrt()).iter().sum::<f64>() / count;
    // And so may those of the four pixels of a block that use each other's paths.
    let deviation = 2.0 * deviation;
    (planes.map(sum).iter().sum::<f64>() / count, deviation * deviation)
}

#[test]
fn without_what_lessens_noise_the_expectation_is_the_same() {
    for name in SCENES {
        let scene = scene(name);
        let whole = rendered(&prepared(&scene, 256));
        let (expected, own_variance) = mean(&whole);
        for techniques in [
            Techniques { sobol: false, ..ALL },
            Techniques { lobes_by_albedo: false, ..ALL },
            Techniques { lights_by_gloss: false, ..ALL },
            Techniques { roulette: false, ..ALL },
            Techniques { light_paths: false, ..ALL },
            Techniques { path_reuse: false, ..ALL },
            Techniques { splitting: false, ..ALL },
            Techniques { adaptive: false, ..ALL },
        ] {
            let without = rendered(&prepared(&scene, 256).with(techniques));
            // The box has a single light and no material of two lobes, and the other's cut-outs keep paths from being reused.
            let same = match name {
                "cornell.obj" => !techniques.lobes_by_albedo || !techniques.lights_by_gloss,
                _ => !techniques.path_reuse,
            };
            assert_eq!(bits(&without) == bits(&whole), same, "{name}: {techniques:?}");
            let (found, variance) = mean(&without);
            let deviation = (own_variance + variance).sqrt();
            assert!(deviation < 0.02 * expected, "{name}: {techniques:?}: ± {deviation}");
            assert!(
                (found - expected).abs() < 3.5 * deviation,
                "{name}: {techniques:?}: {found} ± {deviation}, not {expected}"
            );
        }
    }
}

#[test]
fn independent_numbers_are_noisier() {
    let scene = scene("cornell.obj");
    let variance = |techniques| mean(&rendered(&prepared(&scene, 64).with(techniques))).1;
    assert!(variance(Techniques { sobol: false, ..ALL }) > 1.1 * variance(ALL));
}
