//! Scenes at the limits of floats: what is closed stays closed, what has an answer by algebra finds it, and what is no number is told.

#[path = "../common/mod.rs"]
mod common;
mod furnace;
mod layers;
mod leaks;
mod lights;
mod numbers;
