//! The shipped sweep against its committed references: the same source gives the same pixels, whatever the optimisation, and a
//! missing reference fails.

use std::path::Path;

use pipeline::job::{Build, Destination, References, load, plan, run};
use pipeline::record::Verdict;
use pipeline::render::Control;
use pipeline::sweep;

#[test]
fn jobs_of_the_roughness_sweep_are_their_references() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sweep = sweep::open(&root.join("configs/roughness.toml")).expect("the manifest");
    let loaded =
        load(&sweep.jobs[0].scene, &Default::default(), &Default::default(), None).expect("the scene");
    let build = Build::current().expect("the executable");
    let folder = tempfile::tempdir().expect("a folder");
    let references = References {
        folder: root.join("tests/references/roughness"),
        limits: Default::default(),
        thresholds: Default::default(),
        idiff: None,
    };
    let destination = Destination { folder: folder.path().to_owned(), references: Some(references) };
    for name in ["roughness=0.00", "roughness=0.40", "roughness=1.00"] {
        let job = sweep.jobs.iter().find(|j| j.name == name).expect(name);
        let planned = plan(job, &loaded, &build).expect("a plan");
        let record = run(&planned, &loaded, &build, &destination, &Control::default()).expect("a record");
        assert_eq!(record.verdict, Verdict::Same, "{name}");
        assert_eq!(record.counts.bad_samples, 0, "{name}");
    }
}
