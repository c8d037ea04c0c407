//! Scene conversion and batch rendering with a Disney path tracer.
//!
//! Data flows one way: a file is *imported* into a [`scene::Scene`] of source materials, *converted* to Disney materials,
//! *prepared* for rendering, *rendered* into a [`raster::Raster`], written, compared with a reference and reported.
//! Each step is a function from one plain data type to the next.
//!
//! # Conventions
//!
//! - `wo` points to the viewer and `wi` to the light, both away from the surface, in a local frame whose z is the shading normal.
//! - `eval` returns the BSDF without the cosine; the integrator multiplies. `sample` returns `Option<BsdfSample>`.
//! - Every pdf says its measure: solid angle, area or discrete. Angles are radians inside and degrees in files; lengths are
//!   metres; y is up.
//! - Colours are linear with Rec. 709 primaries inside; a texture says how it is encoded, keeps 8-bit data as 8 bits, and is
//!   filtered bilinearly without mip levels.
//! - (`ax`, `ay`) come from (roughness, anisotropic) in one function; alpha is roughness², the floor of 0.001 holds per axis,
//!   after the aspect.
//! - Environment images: u = ½ + atan2(z, x)/2π, v = acos(y)/π from the top; `rotation` turns the image about +y,
//!   counter-clockwise seen from above. `fov` is vertical unless it is called `fov_x`.
//! - Depth `Z` is the distance along the viewing axis, 0 where nothing was hit.
//! - Transforms read destination first: `world_from_object`, `camera_from_world`. A camera may be a reflection.
//! - A path's depth is its number of scattering events: `max_depth` 0 shows emission alone, 1 adds direct light.
//! - A sample is a pure function of (seed, pixel, sample index, path vertex, dimension) and of the power of two that the samples a
//!   pixel fit in; the same job gives the same bits with any number of threads.
//!
//! # Floors
//!
//! A module uses only floors below its own; `tests/architecture.rs` keeps it so.
//!
//! | floor | modules |
//! |---|---|
//! | 8 | [`cli`] |
//! | 7 | [`mod@bench`], [`check`], [`inspect`] |
//! | 6 | [`sweep`] |
//! | 5 | [`job`], [`report`], [`export`] |
//! | 4 | [`render`], [`compare`], [`output`], [`library`] |
//! | 3 | [`import`], [`convert`], [`manifest`], [`accel`], [`light`] |
//! | 2 | [`record`], [`scene`], [`imagefile`] |
//! | 1 | [`disney`], [`raster`], [`settings`] |
//! | 0 | [`math`], and above it [`color`] |

#[macro_use]
mod named;

pub mod accel;
pub mod bench;
pub mod check;
pub mod cli;
pub mod color;
pub mod compare;
pub mod convert;
pub mod disney;
pub mod export;
pub mod imagefile;
pub mod import;
pub mod inspect;
pub mod job;
pub mod library;
pub mod light;
pub mod manifest;
pub mod math;
pub mod output;
pub mod raster;
pub mod record;
pub mod render;
pub mod report;
pub mod scene;
pub mod settings;
pub mod sweep;
