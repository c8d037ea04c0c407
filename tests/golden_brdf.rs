//! The Disney BRDF against golden values: those of a reference evaluation, named by the environment, and a set of our own.

#![expect(clippy::print_stderr, reason = "a skipped test says so, and the errors found are worth reading")]

#[path = "common/outside.rs"]
mod outside;

use std::path::Path;

use outside::outside;
use pipeline::color::Rgb;
use pipeline::disney::{Bsdf, DiffuseModel, Masking, Params};
use pipeline::math::V3;

/// A row's columns by name.
struct Row<'a> {
    header: &'a [&'a str],
    values: Vec<&'a str>,
}

impl Row<'_> {
    fn text(&self, name: &str) -> &str {
        let column = self.header.iter().position(|h| *h == name);
        self.values[column.unwrap_or_else(|| panic!("there is no column {name}"))]
    }

    fn f32(&self, name: &str) -> f32 {
        self.text(name).parse().unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn params(&self) -> Params {
        Params {
            base_color: Rgb::new(
                self.f32("base_color_r"),
                self.f32("base_color_g"),
                self.f32("base_color_b"),
            ),
            subsurface: self.f32("subsurface"),
            metallic: self.f32("metallic"),
            specular: self.f32("specular"),
            specular_tint: self.f32("specular_tint"),
            roughness: self.f32("roughness"),
            anisotropic: self.f32("anisotropic"),
            sheen: self.f32("sheen"),
            sheen_tint: self.f32("sheen_tint"),
            clearcoat: self.f32("clearcoat"),
            clearcoat_gloss: self.f32("clearcoat_gloss"),
            ..Params::default()
        }
    }

    fn direction(&self, name: &str) -> V3<f32> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.f32(&format!("{name}{axis}")));
        V3::new(x, y, z)
    }
}

/// Calls `check` with every row of a CSV file; returns how many there were.
fn for_each_row(path: &Path, mut check: impl FnMut(Row)) -> usize {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let mut rows = 0;
    for line in lines {
        check(Row { header: &header, values: line.split(',').collect() });
        rows += 1;
    }
    rows
}

/// The largest relative error of a channel, against the columns whose names start with `prefix`.
fn relative_error(row: &Row, prefix: &str, masking: Masking, diffuse: DiffuseModel) -> f64 {
    let bsdf = Bsdf::disney(&row.params(), masking, diffuse);
    let f = bsdf.eval(row.direction("v"), row.direction("l"));
    let expected = ["r", "g", "b"].map(|c| row.text(&format!("{prefix}{c}")).parse::<f64>().unwrap());
    let mut worst: f64 = 0.0;
    for (is, should) in f.to_array().into_iter().zip(expected) {
        assert!(is.is_finite() && should > 0.0, "{is} for {should}");
        worst = worst.max((f64::from(is) - should).abs() / should);
    }
    worst
}

#[test]
fn reference_rows_hold_to_a_relative_1e_4() {
    let Some(folder) = outside("PIPELINE_ORACLE") else { return };
    let files =
        [("disney_brdf.csv", Masking::Matched, 4000), ("disney_brdf_2012_g.csv", Masking::Remapped, 1500)];
    for (name, masking, expected_rows) in files {
        let mut worst: f64 = 0.0;
        let rows = for_each_row(&Path::new(&folder).join(name), |row| {
            let error = relative_error(&row, "f", masking, DiffuseModel::Burley);
            worst = worst.max(error);
            assert!(error < 1e-4, "{name}: {error:e} at {:?}", row.values);
        });
        assert_eq!(rows, expected_rows, "{name}");
        eprintln!("{name}: {rows} rows, largest relative error {worst:.2e}");
    }
}

#[test]
fn our_own_rows_hold_to_a_relative_1e_4_for_both_maskings_and_all_diffuse_models() {
    let variants = [
        ("matched_burley_", Masking::Matched, DiffuseModel::Burley),
        ("matched_lambert_", Masking::Matched, DiffuseModel::Lambert),
        ("matched_lambert_fresnel_", Masking::Matched, DiffuseModel::LambertFresnel),
        ("remapped_burley_", Masking::Remapped, DiffuseModel::Burley),
        ("remapped_lambert_", Masking::Remapped, DiffuseModel::Lambert),
        ("remapped_lambert_fresnel_", Masking::Remapped, DiffuseModel::LambertFresnel),
    ];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/disney_brdf.csv");
    let mut worst: f64 = 0.0;
    let rows = for_each_row(&path, |row| {
        for (prefix, masking, diffuse) in variants {
            let error = relative_error(&row, prefix, masking, diffuse);
            worst = worst.max(error);
            assert!(error < 1e-4, "{prefix}: {error:e} at {:?}", row.values);
        }
    });
    assert_eq!(rows, 600);
    eprintln!("{rows} rows, largest relative error {worst:.2e}");
}
