//! What a case of the stability suite is: surfaces with questions whose answers are known, and the scene made of them.

use crate::math::{Frame, Point, Ray, Vector};
use crate::mesh::FacetMesh;
use crate::model::{Model, TrimLoop};
use crate::nurbs::Surface;
use crate::study::sample_models;
use serde::Serialize;

/// One difficulty: surfaces, and questions about them whose answers are known.
pub struct Case {
    /// Short name, as in the table.
    pub name: &'static str,
    pub(super) surfaces: Vec<Surface>,
    /// Loops that trim each surface; a case with loops has no mesh.
    pub(super) loops: Vec<TrimLoop>,
    /// Facets along each side of a knot rectangle.
    pub(super) divisions: usize,
    /// Error of a facet hit that is right beyond sag and rounding, mm.
    pub(super) slack: f64,
    /// Signed distance from the true surface, or along z for surfaces `z = f(x, y)`; positive outside.
    pub(super) distance: Box<dyn Fn(Point) -> f64 + Send + Sync>,
    pub(super) questions: Vec<Question>,
}

/// The true first hit of a ray, in the case's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    /// `None` for a miss.
    pub(super) t: Option<f64>,
    /// |cos| of the angle of incidence.
    pub(super) cos: f64,
    /// How far the surface must move for the answer to change, mm: depth of a hit, clearance of a miss.
    pub(super) margin: f64,
    /// Outward unit normal where it is unique.
    pub(super) normal: Option<Vector>,
}

impl Truth {
    /// Makes a truth: a hit at distance `t`, mm, that stays one while the surface moves by less than `margin`, mm. `cos` is that of the
    /// angle of incidence, of either sign.
    pub(super) fn hit(t: f64, cos: f64, margin: f64) -> Self {
        Self { t: Some(t), cos: cos.abs(), margin, normal: None }
    }
    /// Makes a truth: a miss that stays one while the surface moves by less than `margin`, mm.
    pub(super) fn miss(margin: f64) -> Self {
        Self { t: None, cos: 1.0, margin, normal: None }
    }
    /// Returns the distance along the ray, mm, which rounding grows with; 0 for a miss, judged where the ray starts.
    pub(super) fn distance(&self) -> f64 {
        self.t.unwrap_or(0.0)
    }
    /// Returns the truth with this outward unit normal at the hit.
    pub(super) fn with_normal(self, normal: Vector) -> Self {
        Self { normal: Some(normal), ..self }
    }
}

/// One ray, or one path, with its answer.
pub(super) enum Question {
    /// The first hit.
    First { ray: Ray, truth: Truth },
    /// All crossings of a straight ray, each left by identity and asked for the next.
    All { ray: Ray, truths: Vec<Truth> },
    /// From the hit of `toward` inside the sphere of this radius about the origin, on in another direction.
    Chord { toward: Ray, direction: Vector, radius: f64 },
    /// From the hit of `toward` on a wall of the box from the origin to `size`, on in another direction.
    Onward { toward: Ray, direction: Vector, size: Vector },
    /// Mirrored inside the box from the origin to `size`, so many times.
    Guide { ray: Ray, size: Vector, reflections: usize },
}

/// Where the case is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Variant {
    /// As it is.
    Home,
    /// Moved by 1e6 mm along each axis.
    Shifted,
    /// A thousand times smaller.
    Small,
    /// A thousand times larger.
    Large,
    /// Turned by an odd angle about an odd axis.
    Rotated,
    /// A million times smaller: tens of nanometres.
    Tiny,
    /// A million times larger: tens of kilometres.
    Huge,
}

impl Variant {
    /// Those of lamps and their parts.
    pub const ALL: [Self; 5] = [Self::Home, Self::Shifted, Self::Small, Self::Large, Self::Rotated];
    /// Sizes at which absolute limits show.
    pub const EXTREME: [Self; 2] = [Self::Tiny, Self::Huge];

    /// Returns the word used in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "home",
            Self::Shifted => "shifted",
            Self::Small => "small",
            Self::Large => "large",
            Self::Rotated => "rotated",
            Self::Tiny => "tiny",
            Self::Huge => "huge",
        }
    }

    /// Returns the frame that takes the case's coordinates to the variant's.
    fn frame(self) -> Frame {
        match self {
            Self::Home => Frame::IDENTITY,
            Self::Shifted => Frame::translation(Vector::new(1e6, -1e6, 1e6)),
            Self::Small => Frame { scale: 1e-3, ..Frame::IDENTITY },
            Self::Large => Frame { scale: 1e3, ..Frame::IDENTITY },
            Self::Tiny => Frame { scale: 1e-6, ..Frame::IDENTITY },
            Self::Huge => Frame { scale: 1e6, ..Frame::IDENTITY },
            Self::Rotated => {
                Frame::from_axis(Point::ZERO, Vector::new(0.31, -0.73, 0.52), Some(Vector::new(0.9, 0.27, 0.13)))
            }
        }
    }
}

/// A case in one variant, ready to be traced.
pub struct Scene<'a> {
    /// The case.
    pub case: &'a Case,
    /// Where it was put.
    pub variant: Variant,
    /// Its surfaces there.
    pub model: Model,
    /// A uniform mesh of them.
    pub mesh: FacetMesh,
    /// From the case's coordinates to those of the model and mesh.
    pub(super) frame: Frame,
}

/// What an intersector stands on: facets are right within their sag, splines to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// The facets of [`Scene::mesh`].
    Facets,
    /// The surfaces themselves.
    Spline,
}

impl Case {
    /// Puts the case into the place of a variant, and meshes it uniformly; a trimmed case has an empty mesh.
    pub fn scene(&self, variant: Variant) -> Scene<'_> {
        let frame = variant.frame();
        // The control points themselves are moved: the truth of a moved case is that of the case, to their
        // rounding.
        let placed = self.surfaces.iter().map(|s| s.transformed(|p| frame.point(p)));
        let mut model = sample_models::model(self.name, placed);
        let mesh = if self.loops.is_empty() {
            sample_models::grid_mesh(&model, self.divisions)
        } else {
            // The plain mesher knows no trims, so that such a case is traced on the spline alone.
            for face in model.parts.iter_mut().flat_map(|p| &mut p.shells).flat_map(|s| &mut s.faces) {
                face.loops.clone_from(&self.loops);
            }
            FacetMesh::default()
        };
        Scene { case: self, variant, model, mesh, frame }
    }
}
