//! Comparing images: idiff's semantics, a strict mode, and the real idiff as cross-check.
