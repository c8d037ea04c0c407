//! The Disney BSDF: parameters with checked ranges, microfacet terms, lobes, `eval`, `sample` and `pdf`.
//!
//! [`Bsdf`] is what the integrator sees. Behind it each lobe has a file of its own, with its value, its sampler and the density
//! of that sampler side by side; `probabilities` is the one place that says how often each lobe is sampled, and `bound` how large the
//! weights of samples get by that.
//!
//! Everything is generic over [`crate::math::Real`], so that the `f64` twin the tests measure against is the same source; and what is
//! reflected over [`crate::math::Number`], so that four surfaces side by side ([`FourBsdfs`]) are, too.

mod bound;
mod bsdf;
mod clearcoat;
mod dielectric;
mod diffuse;
mod four;
mod fresnel;
mod microfacet;
mod mixture;
mod pair;
mod parameter;
mod probabilities;
mod sheen;
mod specular;
pub mod stress;
#[cfg(test)]
mod tests;
mod transmission;

pub use bsdf::{Bsdf, BsdfSample, Lobe};
pub use four::FourBsdfs;
pub use fresnel::{fresnel_dielectric, schlick_weight};
pub use microfacet::{ALPHA_MIN, Alpha, alpha_from_roughness};
pub use parameter::{
    BASE_COLOR, DiffuseModel, Masking, Model, OutOfRange, Parameter, Params, check_base_color,
};
