//! How fast the BSDF is: `cargo bench --bench bsdf`. Each figure is the time of [`BATCH`] calls.

use divan::{Bencher, black_box};
use pipeline::color::Rgb;
use pipeline::disney::{Bsdf, DiffuseModel, Masking, Parameter, Params};
use pipeline::math::{V3, hash};

/// Calls a measurement makes, each with other directions and numbers.
const BATCH: u64 = 1024;

const MATERIALS: [&str; 6] = ["plastic", "metal", "car paint", "wax", "glass", "leaf"];

fn main() {
    divan::main();
}

fn params(name: &str) -> Params {
    use Parameter as P;
    let scalars: &[(P, f32)] = match name {
        "metal" => &[(P::Metallic, 1.0), (P::Roughness, 0.3), (P::Anisotropic, 0.5)],
        "car paint" => &[(P::Metallic, 0.5), (P::Clearcoat, 1.0), (P::Roughness, 0.4)],
        "wax" => &[(P::Subsurface, 1.0), (P::Sheen, 0.5)],
        "glass" => &[(P::SpecTrans, 1.0), (P::Roughness, 0.3)],
        "leaf" => &[(P::DiffTrans, 1.0), (P::Roughness, 0.4)],
        _ => &[],
    };
    let mut params = Params { base_color: Rgb::new(0.7, 0.3, 0.1), ..Params::default() };
    for (parameter, value) in scalars {
        *params.get_mut(*parameter) = *value;
    }
    params
}

fn bsdf(name: &str) -> Bsdf {
    Bsdf::disney(&params(name), Masking::Matched, DiffuseModel::Burley)
}

/// Numbers in [0, 1).
fn unit(call: u64, dimension: u64) -> f32 {
    hash::unit_f32((hash::combine(call, dimension) >> 32) as u32)
}

/// Views above, and lights around each one's mirror direction.
fn directions() -> Vec<(V3<f32>, V3<f32>)> {
    let any = |call, dimension| {
        V3::new(
            unit(call, dimension) - 0.5,
            unit(call, dimension + 1) - 0.5,
            0.01 + unit(call, dimension + 2),
        )
    };
    (0..BATCH)
        .map(|call| {
            let wo = any(call, 0).normalize();
            (wo, (V3::new(-wo.x, -wo.y, wo.z) + any(call, 3)).normalize())
        })
        .collect()
}

#[divan::bench(args = MATERIALS)]
fn construct(bencher: Bencher, name: &str) {
    let params = params(name);
    bencher.bench(|| {
        for _ in 0..BATCH {
            black_box(Bsdf::disney(black_box(&params), Masking::Matched, DiffuseModel::Burley));
        }
    });
}

#[divan::bench(args = MATERIALS)]
fn eval(bencher: Bencher, name: &str) {
    let (bsdf, directions) = (bsdf(name), directions());
    bencher.bench(|| {
        for &(wo, wi) in &directions {
            black_box(bsdf.eval(wo, wi));
        }
    });
}

#[divan::bench(args = MATERIALS)]
fn pdf(bencher: Bencher, name: &str) {
    let (bsdf, directions) = (bsdf(name), directions());
    bencher.bench(|| {
        for &(wo, wi) in &directions {
            black_box(bsdf.pdf(wo, wi));
        }
    });
}

#[divan::bench(args = MATERIALS)]
fn eval_with_pdf(bencher: Bencher, name: &str) {
    let (bsdf, directions) = (bsdf(name), directions());
    bencher.bench(|| {
        for &(wo, wi) in &directions {
            black_box(bsdf.eval_with_pdf(wo, wi));
        }
    });
}

#[divan::bench(args = MATERIALS)]
fn sample(bencher: Bencher, name: &str) {
    let (bsdf, directions) = (bsdf(name), directions());
    let numbers: Vec<[f32; 3]> = (0..BATCH).map(|call| [6, 7, 8].map(|d| unit(call, d))).collect();
    bencher.bench(|| {
        for (&(wo, _), &[u_lobe, u0, u1]) in directions.iter().zip(&numbers) {
            black_box(bsdf.sample(wo, u_lobe, [u0, u1]));
        }
    });
}
