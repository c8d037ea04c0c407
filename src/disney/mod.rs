//! The Disney BSDF: parameters with checked ranges, microfacet terms, lobes, `eval`, `sample` and `pdf`.
//!
//! Everything is generic over [`crate::math::Real`], so that the `f64` twin the tests measure against is the same source.

mod parameter;

pub use parameter::{
    BASE_COLOR, DiffuseModel, Masking, Model, OutOfRange, Parameter, Params, check_base_color,
};
