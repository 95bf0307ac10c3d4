//! What may use what.

/// Modules and their layers; modules of one layer do not see each other.
pub(crate) const LAYERS: &[(&str, u32)] = &[
    ("math", 0),
    ("nurbs", 1),
    ("mesh", 1),
    ("formats", 2),
    ("model", 2),
    ("step", 3),
    ("kernel", 3),
    ("tessellate", 3),
    ("intersect", 3),
    ("optics", 3),
    ("simulate", 4),
    ("study", 5),
    ("report", 6),
    ("cli", 7),
];

/// The modules of a large folder in their order: each uses only those before it. Modules in one group (`"face part"`) belong
/// together and may use each other; the folder's own file comes last unless `mod` has a place.
pub(crate) const INNER: &[(&str, &[&str])] = &[
    (
        "nurbs",
        &["basis", "mod", "spline", "surface patch", "conic", "curvature", "cut", "project", "sanitise", "sweep"],
    ),
    (
        "step",
        &[
            "bounds", "chart", "error", "mod", "part21", "geometry", "report", "settings", "trim", "product",
            "import",
        ],
    ),
    (
        "tessellate",
        &[
            "sample",
            "settings",
            "proof sheet",
            "angles",
            "border",
            "strip",
            "cells",
            "assemble face repairs mod report fallback",
        ],
    ),
];

/// Large folders whose order is still to be stated; `cargo test --test architecture propose -- --ignored --nocapture` prints one.
pub(crate) const UNORDERED: &[&str] = &[
    "cli",
    "cli/commands",
    "cli/work",
    "formats",
    "intersect",
    "intersect/exact",
    "intersect/octree",
    "kernel",
    "optics",
    "report",
    "simulate",
    "simulate/kernel",
    "simulate/scene",
    "step/product",
    "study",
    "tessellate/proof",
    "truck",
];

/// Crates that only these modules may name.
pub(crate) const DOORS: &[(&str, &[&str])] = &[
    ("truck_modeling", &["kernel"]),
    ("truck_meshalgo", &["kernel"]),
    ("truck_polymesh", &["kernel", "formats"]),
    ("obvhs", &["intersect"]),
    ("spade", &["tessellate"]),
    ("clap", &["cli"]),
    ("miette", &["cli"]),
    ("indicatif", &["cli"]),
    ("comfy_table", &["cli", "report"]),
    ("maud", &["report"]),
    ("plotly", &["report"]),
    ("image", &["formats"]),
    ("npyz", &["formats"]),
    ("zip", &["formats"]),
    ("eulumdat", &["formats"]),
];
