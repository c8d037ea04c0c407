//! Sweep manifests: parsed with positions, expanded into jobs, checked against a scene.
