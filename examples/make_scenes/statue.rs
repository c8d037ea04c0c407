//! The statue: a stylised stone head on a plinth, a polygonised distance field with displacement.

use std::io::Write;

use flate2::{Compression, GzBuilder};
use glam::{DVec2, DVec3};
use pipeline::math::{Number, Real, hash};

use super::field::{blend, carve, ellipsoid, limb, round_box, round_max};
use super::glb::{Glb, GlbError};
use super::mesh::Boundary;
use super::nets::{Lattice, polygonise};
use super::revolve::Profile;
use super::studio::{Softbox, Sweep};
use super::{Made, MakeError};

/// Side of the polygoniser's cells: gives a little over 200,000 triangles.
const CELL: f64 = 0.00922;
/// Height of the plinth; the head stands on it.
const PLINTH: f64 = 0.42;

/// `statue.glb.gz`.
pub(crate) fn make() -> Result<Vec<Made>, MakeError> {
    // The level cut at the bottom lies in the middle of a layer of cells.
    let lattice = Lattice {
        origin: DVec3::new(-0.72, -2.5 * CELL, -0.62),
        end: DVec3::new(0.72, 1.92, 0.72),
        cell: CELL,
    };
    let up = DVec3::Y * (PLINTH + 0.012);
    let statue = polygonise(&solid, &lattice).moved(up).rounded().checked("statue", Boundary::Closed)?;

    let mut glb = Glb::default();
    let statue_material = glb.plain("statue", [0.6, 0.57, 0.52], 0.55);
    let plinth_material = glb.plain("plinth", [0.12, 0.12, 0.13], 0.3);
    let floor_material = glb.plain("floor", [0.5, 0.5, 0.5], 0.9);
    glb.mesh("statue", &statue, statue_material);
    let mut plinth = plinth().revolve(80).rounded().checked("plinth", Boundary::Closed)?;
    plinth.uvs.clear();
    glb.mesh("plinth", &plinth, plinth_material);
    let sweep = Sweep { half_width: 10.0, front: 10.0, back: -3.5, radius: 2.5, height: 8.0, tile: 1.0 };
    let mut floor = sweep.mesh().rounded().checked("floor", Boundary::Open)?;
    floor.uvs.clear();
    glb.mesh("floor", &floor, floor_material);
    let target = DVec3::new(0.0, 1.3, 0.0);
    let lights = [
        Softbox {
            name: "key_light",
            position: DVec3::new(-4.0, 4.6, 3.2),
            target,
            size: [2.2, 2.2],
            color: [1.0, 0.96, 0.9],
            radiance: 24.0,
        },
        Softbox {
            name: "fill_light",
            position: DVec3::new(5.2, 2.6, 3.6),
            target,
            size: [2.0, 3.2],
            color: [0.88, 0.94, 1.0],
            radiance: 4.0,
        },
        Softbox {
            name: "rim_light",
            position: DVec3::new(3.0, 5.0, -3.0),
            target,
            size: [2.4, 1.2],
            color: [1.0, 1.0, 1.0],
            radiance: 26.0,
        },
    ];
    for light in &lights {
        light.add(&mut glb);
    }
    glb.camera(DVec3::new(1.6, 1.7, 5.0), DVec3::new(0.0, 1.14, 0.0), 28.0, 4.0 / 3.0);
    let about = format!("{} triangles, {} of them the statue's", glb.triangles(), statue.triangles.len());
    Ok(vec![Made { path: "statue.glb.gz", bytes: gzip(&glb.finish("statue")?)?, about }])
}

/// The bytes in gzip's format without a time or a name, so that they depend on the content alone.
fn gzip(bytes: &[u8]) -> Result<Vec<u8>, GlbError> {
    let mut encoder = GzBuilder::new().mtime(0).write(vec![], Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}

fn plinth() -> Profile {
    Profile::corners(
        &[
            [0.0, 0.002, 0.0],
            [0.78, 0.002, 0.012],
            [0.78, 0.1, 0.025],
            [0.68, 0.13, 0.03],
            [0.66, PLINTH - 0.08, 0.03],
            [0.74, PLINTH - 0.05, 0.012],
            [0.74, PLINTH, 0.015],
            [0.0, PLINTH, 0.0],
        ],
        0.25,
    )
}

/// The stone: the head with its displacement.
fn solid(p: DVec3) -> f64 {
    let head = head(p);
    // Displacement matters near the surface alone; elsewhere the sign is all that is asked for.
    if head.abs() > 0.06 { head } else { head - displacement(p) }
}

/// The head without displacement. It looks along +z; the left and the right half are alike.
fn head(p: DVec3) -> f64 {
    let q = DVec3::new(p.x.abs(), p.y, p.z);
    let skull = ellipsoid(q - DVec3::new(0.0, 1.27, -0.06), DVec3::new(0.40, 0.55, 0.46));
    // The jaw is narrower than the temples.
    let jaw = DVec3::new(q.x * (1.0 + 0.42 * smoothstep((1.12 - q.y) / 0.55)), q.y, q.z);
    let face = round_box(jaw - DVec3::new(0.0, 1.05, 0.10), DVec3::new(0.31, 0.52, 0.28), 0.17);
    let chin = ellipsoid(q - DVec3::new(0.0, 0.60, 0.30), DVec3::new(0.19, 0.14, 0.15));
    let neck = limb(q, DVec3::new(0.0, 0.15, -0.10), DVec3::new(0.0, 0.80, -0.04), 0.27, 0.24);
    let shoulders = ellipsoid(q - DVec3::new(0.0, -0.02, -0.06), DVec3::new(0.64, 0.32, 0.36));
    let brow = limb(q, DVec3::new(0.0, 1.315, 0.385), DVec3::new(0.27, 1.30, 0.27), 0.062, 0.045);
    let bridge = limb(q, DVec3::new(0.0, 1.31, 0.38), DVec3::new(0.0, 0.99, 0.52), 0.045, 0.062);
    let wing = ellipsoid(q - DVec3::new(0.06, 0.965, 0.455), DVec3::new(0.052, 0.045, 0.065));
    let cheek = ellipsoid(q - DVec3::new(0.19, 1.06, 0.28), DVec3::new(0.10, 0.11, 0.09));
    let upper_lip = limb(q, DVec3::new(0.0, 0.832, 0.395), DVec3::new(0.12, 0.815, 0.34), 0.036, 0.016);
    let lower_lip = limb(q, DVec3::new(0.0, 0.772, 0.39), DVec3::new(0.095, 0.785, 0.345), 0.038, 0.016);
    let ear = limb(q, DVec3::new(0.405, 1.25, -0.05), DVec3::new(0.345, 0.98, 0.0), 0.062, 0.045);
    let socket = ellipsoid(q - DVec3::new(0.15, 1.205, 0.42), DVec3::new(0.105, 0.06, 0.10));
    let eye = ellipsoid(q - DVec3::new(0.15, 1.195, 0.295), DVec3::new(0.085, 0.058, 0.075));
    let lid = round_max(eye - 0.014, eye_slit(q), 0.009);

    let mut d = blend(skull, face, 0.18);
    d = blend(d, chin, 0.16);
    d = blend(d, cheek, 0.12);
    d = blend(d, blend(neck, shoulders, 0.30), 0.10);
    d = blend(d, brow, 0.07);
    d = carve(d, socket, 0.06);
    d = blend(d, bridge, 0.06);
    d = blend(d, wing, 0.035);
    d = blend(d, eye, 0.02);
    d = blend(d, lid, 0.02);
    d = carve(d, mouth_line(q), 0.02);
    d = blend(d, upper_lip, 0.035);
    d = blend(d, lower_lip, 0.035);
    d = blend(d, ear, 0.05);
    // The bust ends in a level cut.
    round_max(d, -p.y, 0.012)
}

/// Negative above the upper and below the lower lid's edge.
fn eye_slit(q: DVec3) -> f64 {
    let along = (q.x - 0.15) / 0.085;
    let opening = 0.026 * (1.0 - along * along).max(-1.0);
    opening - (q.y - 1.195).abs()
}

/// The line between the lips.
fn mouth_line(q: DVec3) -> f64 {
    limb(q, DVec3::new(0.0, 0.803, 0.43), DVec3::new(0.098, 0.80, 0.37), 0.014, 0.006)
}

/// Outward displacement: locks of hair over the skull and the neck, and the grain of hewn stone everywhere.
fn displacement(p: DVec3) -> f64 {
    // The bottom stays level.
    let grain = smoothstep((p.y - 0.01) / 0.04);
    hair(p) + grain * (0.0025 * noise(p * 23.0) + 0.0012 * noise(p * 51.0 + DVec3::splat(7.3)))
}

/// Combed ridges that run from the parting backwards and end at the hairline.
fn hair(p: DVec3) -> f64 {
    let q = DVec3::new(p.x.abs(), p.y, p.z);
    // How far behind the hairline: a plane that leans back over the forehead and falls behind the ears.
    let hairline = (q.y - 1.42) * 0.75 - (q.z - 0.20) * 0.66 - 0.25 * (q.x - 0.3).max(0.0);
    let strength = smoothstep(hairline / 0.06) * smoothstep((q.y - 0.72) / 0.10);
    if strength == 0.0 {
        return 0.0;
    }
    let (side, height) = (q.x, q.y - 1.12);
    let around = Real::atan2(side, height);
    let wave = 1.4 * Real::sin(8.0 * q.z + 3.0 * around) + 0.7 * noise(q * 5.0);
    let lock = Real::sin((38.0 * around + wave) / 2.0);
    let lock = (lock * lock + 0.03).sqrt();
    // Locks grow too narrow for the polygons where they meet behind; there they melt into a cap.
    let apart = smoothstep((DVec2::new(side, height).length() - 0.2) / 0.22);
    strength * (0.008 + 0.034 * 0.7f64.lerp(lock, apart))
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Gradient noise in about [-1, 1] (Perlin 2002, with hashed gradients): twice continuously differentiable.
fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let corner = |k: u32| {
        let offset = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        gradient(cell + offset).dot(f - offset)
    };
    let (x, y, z) = (smoothstep(f.x), smoothstep(f.y), smoothstep(f.z));
    let edge = |k: u32| corner(k).lerp(corner(k + 1), x);
    edge(0).lerp(edge(2), y).lerp(edge(4).lerp(edge(6), y), z)
}

/// A vector of a lattice point, each component in [-1, 1).
fn gradient(cell: DVec3) -> DVec3 {
    let word = |x: f64| x as i64 as u64;
    let bits = hash::combine(hash::combine(word(cell.x), word(cell.y)), word(cell.z));
    let component = |shift: u32| (bits >> shift & 0xffff) as f64 / 32_768.0 - 1.0;
    DVec3::new(component(0), component(16), component(32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_fits_its_lattice_and_stands_on_the_plinth() {
        assert!(solid(DVec3::new(0.0, 1.0, 0.0)) < 0.0);
        for p in [DVec3::new(0.0, -0.02, 0.0), DVec3::new(0.0, 1.9, 0.0), DVec3::new(0.7, 0.1, 0.0)] {
            assert!(solid(p) > 0.0, "{p}");
        }
        // The plinth's upper face begins to round off at 0.725.
        assert!((0..64).all(|i| solid(DVec3::new(0.725, 0.02 + 0.01 * f64::from(i), 0.0)) > 0.0));
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        for x in [-2.0, 0.0, 3.0] {
            let (a, b) = (DVec3::new(x - 1e-9, 0.3, 0.7), DVec3::new(x + 1e-9, 0.3, 0.7));
            assert!((noise(a) - noise(b)).abs() < 1e-7);
        }
    }
}
