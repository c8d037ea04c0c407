//! Thousands of layers that are almost not there.

use std::time::Instant;

use glam::Vec3;
use pipeline::color::Rgb;
use pipeline::scene::light::{Light, LightKind};
use pipeline::scene::material::{Opacity, Param};
use pipeline::scene::{Camera, Material, Mesh, Named};

use crate::common::{emitting, lambert, mean, render_scene, scene, small, square};

const LAYERS: u32 = 4000;
const ALPHA: f32 = 0.0005;

fn transmittance() -> f64 {
    libm::pow(1.0 - f64::from(ALPHA), f64::from(LAYERS))
}

/// Squares above each other from y = 1 to y = 1 + `height`; all in one plane for 0.
fn veils(height: f32) -> (Mesh, Material) {
    let mut all = Mesh { name: "veils".into(), ..Mesh::default() };
    for i in 0..LAYERS {
        let first = all.positions.len() as u32;
        let layer = square(3.0, 1.0 + height * i as f32 / LAYERS as f32);
        all.positions.extend(layer.positions);
        all.triangles.extend(layer.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let mut veil = lambert(0.0);
    veil.opacity = Opacity { alpha: Param::Constant(ALPHA), cutoff: None };
    (all, veil)
}

/// A shadow ray multiplies what each layer lets pass; a path decides at each whether it is there, and none counts as a bounce.
#[test]
fn four_thousand_layers_of_alpha_let_their_product_through() {
    let start = Instant::now();
    for height in [1.0, 0.0] {
        let below = Camera::look_at(Vec3::new(0.1, 0.5, 0.2), Vec3::new(0.1, 0.0, 0.2), Vec3::Z, 0.1);
        let mut world = scene(vec![(square(50.0, 0.0), lambert(0.8)), veils(height)], below);
        let kind = LightKind::Directional { direction: -Vec3::Y };
        world.lights.push(Named::new("sun", Light { kind, color: Rgb::WHITE, intensity: 1.0 }));
        let exact = 0.8 / std::f64::consts::PI * transmittance();
        let shadowed = render_scene(&world, &small(4, 4, 4, 1));
        assert!((mean(&shadowed) / exact - 1.0).abs() < 1e-3, "shadow: {} {exact}", mean(&shadowed));

        let above = Camera::look_at(Vec3::new(0.1, 4.0, 0.2), Vec3::new(0.1, 0.0, 0.2), Vec3::Z, 0.1);
        let lit = scene(vec![(square(50.0, 0.0), emitting(lambert(0.0), 1.0)), veils(height)], above);
        let seen = render_scene(&lit, &small(16, 16, 16, 0));
        // Four standard deviations of as many independent decisions.
        let exact = transmittance();
        let tolerance = 4.0 * (exact * (1.0 - exact) / f64::from(16 * 16 * 16)).sqrt();
        assert!((mean(&seen) - exact).abs() < tolerance, "sight: {} {exact} ± {tolerance}", mean(&seen));
        assert_eq!(shadowed.counts.bad_samples + seen.counts.bad_samples, 0);
    }
    assert!(start.elapsed().as_secs() < 120, "time grows with the number of layers, not with its square");
}
