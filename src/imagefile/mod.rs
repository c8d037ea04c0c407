//! Rasters to and from EXR, PNG, JPEG and HDR, with bounded memory.
