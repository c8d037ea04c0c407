//! The program as its users run it: arguments and files in, files, text and an exit code out.
//!
//! Scenes are small and manifests are written for each test; every test has a folder of its own.

mod aris;
mod bad_input;
mod bench;
mod command_line;
mod configs;
mod convert;
mod convert_gltf;
mod convert_mitsuba;
mod determinism;
mod diff;
mod failures;
mod inspect;
mod instances;
mod manifests;
mod references;
mod render;
mod resume;
mod scenes;
mod support;
mod sweep;

#[path = "../common/outside.rs"]
mod outside;
