//! Rendering: preparing a scene, tracing paths, collecting film.
