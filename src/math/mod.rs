//! Numbers: the float abstraction, vectors and frames, hashing, low-discrepancy points, warps and statistics.
//!
//! Everything random or transcendental comes from here, so that the same input gives the same bits on every machine.

mod arctangent;
pub mod frame;
pub mod hash;
mod number;
mod real;
pub mod sobol;
pub mod stats;
mod vec3;
pub mod warp;

pub use frame::Frame;
pub use number::Number;
pub use real::Real;
pub use vec3::V3;
