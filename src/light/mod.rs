//! Light selection and sampling.
