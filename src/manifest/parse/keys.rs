//! The keys of each table; a test holds them against the schema.

/// The top of the file.
pub(in crate::manifest) const MANIFEST: &[&str] = &[
    "name",
    "scene",
    "set",
    "axis",
    "exclude",
    "max_jobs",
    "render",
    "camera",
    "environment",
    "light",
    "material",
    "materials",
    "allow_outside",
    "sheet",
    "compare",
    "output",
];
/// `[[axis]]`.
pub(in crate::manifest) const AXIS: &[&str] =
    &["path", "zip", "name", "labels", "values", "range", "log_range", "random", "sobol"];
/// The keys of an axis of which there must be exactly one.
pub(in crate::manifest) const STEPS: &[&str] = &["values", "range", "log_range", "random", "sobol"];
/// `range` and `log_range`.
pub(in crate::manifest) const INTERVAL: &[&str] = &["from", "to", "steps"];
/// `sobol`.
pub(in crate::manifest) const SEQUENCE: &[&str] = &["count", "from", "to"];
/// `random`.
pub(in crate::manifest) const RANDOM: &[&str] =
    &["seed", "count", "distribution", "from", "to", "mean", "sd"];
/// `[sheet]`.
pub(in crate::manifest) const SHEET: &[&str] = &["columns", "rows", "title", "cell_width", "display"];
/// `[sheet.display]`.
pub(in crate::manifest) const DISPLAY: &[&str] = &["tone", "exposure"];
/// `[compare]`.
pub(in crate::manifest) const COMPARE: &[&str] = &[
    "references",
    "fail",
    "failpercent",
    "failrelative",
    "hardfail",
    "allowfailures",
    "warn",
    "warnpercent",
    "warnrelative",
    "hardwarn",
    "mean",
    "rms",
];

/// The keys that people look for at the top or in another table.
pub(in crate::manifest) const HOMES: &[(&str, &[&str])] = &[
    (
        "[render]",
        &[
            "width",
            "height",
            "spp",
            "error",
            "replicates",
            "seed",
            "max_depth",
            "filter",
            "filter_radius",
            "integrator",
            "nee",
            "mis",
            "light_paths",
            "path_reuse",
            "splitting",
            "adaptive",
        ],
    ),
    ("[sheet]", &["columns", "rows", "cell_width"]),
    ("[sheet.display]", DISPLAY),
    ("[compare]", COMPARE),
    ("[[axis]]", &["values", "labels", "range", "log_range", "random", "sobol", "zip"]),
];
