//! The files that make `aris/config` a whole config root: what a run chooses from beside the scenes.

use super::{Made, MakeError};

/// A path tracer whose paths have 17 vertices at most: 16 scatterings.
macro_rules! path_of {
    ($mis:literal, $lights:literal) => {
        concat!(
            "name: path\nconfig:\n  max_path_length: 17\n  cont_prob: 0.95\n  mis: ",
            $mis,
            "\n  enable_emitter_sample: ",
            $lights,
            "\n"
        )
    };
}

/// Path, content, and what it is.
const FILES: [(&str, &str, &str); 13] = [
    (
        "aris/config/render.yaml",
        "defaults:
  - scene: cbox
  - integrator: path_mis
  - _self_

spp: 64
# A factor of width and height; -1 for none.
scale: -1
# Beside output.png, output.exr.
save_exr: false
",
        "the primary config",
    ),
    ("aris/config/integrator/path_mis.yaml", path_of!(true, true), "light and BSDF sampling"),
    ("aris/config/integrator/path_ems.yaml", path_of!(false, true), "light sampling alone"),
    ("aris/config/integrator/path_bf.yaml", path_of!(false, false), "BSDF sampling alone"),
    (
        "aris/config/integrator/whitted.yaml",
        "name: whitted\nconfig:\n  max_path_length: 17\n  cont_prob: 0.95\n",
        "direct light, and mirrors",
    ),
    (
        "aris/config/integrator/point.yaml",
        "name: point\nconfig:\n  position: [0, 1.2, 0.6]\n  energy: [40, 40, 40]\n",
        "a point light in the box",
    ),
    ("aris/config/integrator/normals.yaml", "name: normals\nconfig: {}\n", "shading normals"),
    ("aris/config/integrator/albedo.yaml", "name: albedo\nconfig: {}\n", "colours of diffuse"),
    ("aris/config/integrator/depths.yaml", "name: depths\nconfig: {}\n", "one over depth"),
    ("aris/config/integrator/ao.yaml", "name: ao\nconfig: {}\n", "ambient occlusion"),
    (
        "aris/config/integrator/emitter_check.yaml",
        "name: emitter_check\nconfig: {}\n",
        "light without cosines",
    ),
    ("aris/config/scene/environment/none.yaml", "name: none\nconfig: {}\n", "no environment"),
    (
        "aris/config/scene/environment/white.yaml",
        "name: constant\nconfig:\n  color: [1, 1, 1]\n",
        "an even white one",
    ),
];

/// All of them.
pub(crate) fn make() -> Result<Vec<Made>, MakeError> {
    let made = |&(path, text, about): &(&'static str, &str, &str)| Made {
        path,
        bytes: text.as_bytes().to_vec(),
        about: about.to_owned(),
    };
    Ok(FILES.iter().map(made).collect())
}
