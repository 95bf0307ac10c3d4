//! CAD surfaces straight to optical simulation, with an account of what the accuracy cost.
//!
//! A STEP file ([`step`]) or a shape built with the truck kernel ([`truck`]) becomes a [`model::Model`]: trimmed
//! rational B-splines, placed, in millimetres. [`tessellate`] covers it with quad facets that carry the spline's normals and
//! a proved distance to it. Rays meet the facets in an adaptive octree ([`intersect::octree`]) or a BVH
//! ([`intersect::bvh`]), or the spline itself with a certificate ([`intersect::exact`]); all three answer through one
//! trait, [`intersect::Intersector`]. [`simulate`] sends light through, with only the effects a scene calls for;
//! [`study`] says what the accuracy cost and [`report`] shows it.
//!
//! # From a file to light
//!
//! A plano-convex lens focuses a collimated beam; the same rays are traced on facets and on the exact spline.
//!
//! ```
//! use lampyris::intersect::exact::{self, Exact};
//! use lampyris::intersect::octree::{self, Octree};
//! use lampyris::simulate::{RunSettings, Scene, simulate};
//! use lampyris::{step, tessellate};
//! use std::path::Path;
//!
//! let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
//! let lens = step::read(&folder.join("lens_planoconvex_nurbs.stp"), &step::Settings::default())?;
//! assert_eq!(lens.report.faces.refused, 0);
//!
//! let scene = r#"
//!     [[model]]
//!     file = "lens_planoconvex_nurbs.stp"
//!     [[medium]]
//!     name = "glass"
//!     index = 1.5168
//!     [[material]]
//!     part = "*"
//!     medium = "glass"
//!     [[source]]
//!     kind = "collimated"
//!     at = [0, 0, -10]
//!     direction = [0, 0, 1]
//!     radius = 15
//!     power = 1
//!     [[receiver]]
//!     name = "focus"
//!     kind = "plane"
//!     at = [0, 0, 107.026853]
//!     normal = [0, 0, 1]
//!     size = [40, 40]
//!     cells = [20, 20]
//! "#;
//! let scene = Scene::parse(scene, "lens.toml", &folder)?.bind(&lens.model)?;
//! let run = RunSettings { rays: 20_000, ..RunSettings::default() };
//!
//! let facets = tessellate::tessellate(&lens.model, &tessellate::Settings::default());
//! let octree = Octree::build(&facets.mesh, &octree::Settings::default());
//! let on_facets = simulate(&scene, &octree, &run, &|_| true);
//!
//! let spline = Exact::build(&lens.model, &exact::Settings::default());
//! let on_spline = simulate(&scene, &spline, &run, &|_| true);
//!
//! // Power barely shows the facets: two Fresnel losses either way.
//! assert!((on_facets.power.received - on_spline.power.received).abs() < 1e-3);
//! assert!(on_spline.power.imbalance().abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The whole job of the command, from a scene file to figures with both their errors, is [`pipeline`].
//!
//! Lengths are millimetres, angles radians unless a name says otherwise (`angle_deg`), and every result is the same
//! bits for any number of threads.

/// The program of the README, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(feature = "cli")]
pub mod cli;
pub mod formats;
pub mod intersect;
pub mod math;
pub mod mesh;
pub mod model;
pub mod nurbs;
pub mod optics;
pub mod pipeline;
pub mod regulation;
#[cfg(feature = "report")]
pub mod report;
pub mod simulate;
pub mod step;
pub mod study;
pub mod tessellate;
pub mod text;
#[cfg(feature = "truck")]
pub mod truck;

pub use intersect::{Hit, Intersector};
pub use math::{FaceId, Ray};
pub use mesh::FacetMesh;
pub use model::Model;
