//! Manifests that ask for too much, are damaged, or mean harm.

use proptest::prelude::*;

use super::*;

#[test]
fn too_many_jobs_are_refused_before_they_are_made() {
    let huge = "[[axis]]\npath = \"render.seed\"\nrange = { from = 0, to = 1, steps = 1_000_000_000 }\n";
    assert_eq!(
        wrong(&with(huge)),
        ["4:9: the manifest asks for 1000000000 jobs, more than max_jobs = 100000"]
    );
    for steps in [
        "sobol = { count = 9223372036854775807, from = 0, to = 1 }",
        "random = { seed = 1, count = 2_000_000, from = 0, to = 1 }",
    ] {
        let text = with(&format!("max_jobs = 1_000_000\n[[axis]]\npath = \"material.a.sheen\"\n{steps}\n"));
        assert!(wrong(&text)[0].contains("more than max_jobs"), "{steps}");
    }
    let axis = |field: &str| {
        format!("[[axis]]\npath = \"material.a.{field}\"\nrange = {{ from = 0, to = 1, steps = 1000 }}\n")
    };
    let product =
        ["sheen", "metallic", "roughness", "specular", "clearcoat", "opacity", "cutoff", "subsurface"]
            .map(axis)
            .concat();
    assert!(wrong(&with(&product))[0].contains("asks for 1000000 jobs"));
    assert_eq!(wrong(&with(&product)).len(), 1, "later axes are not computed");
    let many = "[[axis]]\npath = \"render.spp\"\nvalues = [1]\n".repeat(65);
    assert!(wrong(&with(&many))[0].contains("at most 64 times"));
    let settings: String = (0..200).map(|i| format!("\"material.m{i}.sheen\" = 0\n")).collect();
    let seeds = "[[axis]]\npath = \"render.seed\"\nrange = { from = 1, to = 100_000, steps = 100_000 }\n";
    let wide = not_expanded(&with(&format!("[set]\n{settings}{seeds}")));
    assert!(wide[0].contains("100000 jobs with 201 overrides"), "{wide:?}");
    assert!(wrong(&with("max_jobs = 0"))[0].contains("whole number in [1, 1000000]"));
    let two = with("max_jobs = 1\n[[axis]]\npath = \"render.spp\"\nvalues = [1, 2]\n");
    assert!(wrong(&two)[0].contains("2 jobs, more than max_jobs = 1"));
}

#[test]
fn deep_nesting_and_long_words_are_refused_calmly() {
    let deep = format!("scene = {}1{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(parse(&deep).is_err());
    let dotted = format!("[set]\n{}x = 1", "a.".repeat(50_000));
    assert!(parse(&dotted).is_err());
    let long = with(&format!(
        "[set]\n\"material.{}.sheen\" = 9\n\"{}\" = 1\n",
        "x".repeat(100_000),
        "y".repeat(100_000)
    ));
    assert!(parse(&long).unwrap_err().to_string().len() < 10_000_000);
}

/// Whatever comes of a text, nothing panics, and errors can be shown.
fn survives(text: &str) {
    match parse(text) {
        Err(errors) => {
            assert!(!errors.diagnostics.is_empty());
            assert!(!errors.to_string().is_empty());
        }
        Ok(manifest) => {
            if let Err(errors) = expand(&manifest, &["x.glb".into()]) {
                assert!(!errors.to_string().is_empty());
            }
            if let Err(errors) = check(&manifest, &scene(), Path::new("x.glb")) {
                assert!(!errors.to_string().is_empty());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

    #[test]
    fn damaged_manifests_never_panic(
        which in 0usize..5,
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0u8..4, "[-\\[\\]{}=.,\"'#*\\n a-z0-9é\u{0}]{0,3}"), 1..6),
    ) {
        let mut text: Vec<char> = [ROUGHNESS, BY_METAL, STATUE, BALLS, COPPER][which].chars().collect();
        for (index, kind, insert) in damage {
            let at = index.index(text.len().max(1)).min(text.len());
            match kind {
                0 => text.truncate(at),
                1 => drop(text.drain(at..(at + 4).min(text.len()))),
                _ => drop(text.splice(at..at, insert.chars()).collect::<Vec<_>>()),
            }
        }
        survives(&text.into_iter().collect::<String>());
    }

    #[test]
    fn random_values_at_any_path_never_panic(
        key in prop::sample::select(vec![
            "material.ball.roughness", "material.*.base_color", "material.ball.cutoff", "camera.c2w", "camera.orbit",
            "camera.position", "camera.fov", "light.a.range", "environment.kind", "render.spp", "render.filter", "render.seed",
        ]),
        value in prop::sample::select(vec![
            "0", "-1", "1e308", "-1e308", "nan", "inf", "true", "\"\"", "\"#ffffff\"", "[]", "[[]]", "[1, 2]", "[1, 2, 3]", "[1e38, 1e38, 1e38]",
            "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]", "[[0,0,0,0],[0,0,0,0],[0,0,0,0]]", "1979-05-27", "{}", "0.5", "9223372036854775807", "0xff",
        ]),
        random in any::<f64>(),
    ) {
        survives(&with(&format!("[set]\n\"{key}\" = {value}\n")));
        survives(&with(&format!("[[axis]]\npath = \"{key}\"\nvalues = [{value}, {random:e}]\n")));
        survives(&with(&format!("[[axis]]\npath = \"{key}\"\nrange = {{ from = {value}, to = {random:e}, steps = 5 }}\n")));
    }
}
