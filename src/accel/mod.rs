//! Ray acceleration: BVH build and traversal. The only place that names obvhs.
