//! The account of an import, as `info --json` prints it.

use crate::model::SurfaceKind;
use serde::{Deserialize, Serialize};

/// What a file holds and what could not be read: the object of `info --json`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ImportReport {
    /// Name of the file.
    pub file: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// A hash of its bytes as they were read: it may have been saved anew since.
    #[serde(skip)]
    pub hash: u64,
    /// The names in its FILE_SCHEMA; empty without one.
    pub schema: Vec<String>,
    /// Units of its contexts, by name.
    pub units: UnitNames,
    /// Distinct shapes.
    pub parts: usize,
    /// Placed shapes.
    pub instances: usize,
    /// Shells of distinct shapes.
    pub shells: usize,
    /// Distinct faces.
    pub faces: FaceCounts,
    /// Faces counted once for every instance.
    pub faces_placed: PlacedCounts,
    /// Converted distinct faces by the kind of surface.
    pub by_surface: SurfaceCounts,
    /// Lower and upper corner of the trimmed faces, mm; `None` without any, or when it was not asked for.
    pub bbox_mm: Option<[[f64; 3]; 2]>,
    /// Faces and shapes that were refused.
    pub refusals: Vec<Note>,
    /// Representations with shapes that are no product's shape (of aspects, datums, construction, drawings), and other files
    /// that hold shapes of this one: they are not in the model.
    pub left_out: Vec<Note>,
    /// Items that the file hides and that are read all the same: light meets what a viewer does not show.
    pub hidden: Vec<Note>,
    /// Names of parts and instances.
    pub names: Vec<String>,
    /// Faces and shells that were repaired, and how; a face once for each way.
    pub repairs: Vec<Note>,
    /// Largest distance between an edge and a face it bounds, mm of the part.
    pub gap_max_mm: f64,
    /// Statements and placements that could not be read, with their lines or instances.
    pub problems: Vec<String>,
    /// Whether the file was cut off: shapes may be missing without a trace.
    #[serde(default)]
    pub cut_off: bool,
    /// Time taken.
    pub seconds: Seconds,
    /// Largest resident size of the process so far, bytes; `None` where the system does not report it.
    pub peak_bytes: Option<u64>,
}

/// Names of units.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct UnitNames {
    /// Units of lengths.
    pub length: Vec<String>,
    /// Units of plane angles.
    pub angle: Vec<String>,
}

/// The account of distinct faces: `found = converted + refused`; repaired ones are among the converted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaceCounts {
    /// In the file.
    pub found: usize,
    /// In the model.
    pub converted: usize,
    /// Of those, changed on the way.
    pub repaired: usize,
    /// Not in the model.
    pub refused: usize,
}

/// The account of placed faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlacedCounts {
    /// In the file.
    pub found: usize,
    /// In the model.
    pub converted: usize,
}

/// Distinct converted faces by the kind of surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct SurfaceCounts {
    pub plane: usize,
    pub cylinder: usize,
    pub cone: usize,
    pub sphere: usize,
    pub torus: usize,
    pub revolution: usize,
    pub extrusion: usize,
    pub offset: usize,
    pub bspline: usize,
    pub rational: usize,
    pub tessellated: usize,
    pub other: usize,
}

impl SurfaceCounts {
    /// Counts one more face of this kind of surface.
    pub(super) fn count(&mut self, kind: SurfaceKind) {
        let slot = match kind {
            SurfaceKind::Plane => &mut self.plane,
            SurfaceKind::Cylinder => &mut self.cylinder,
            SurfaceKind::Cone => &mut self.cone,
            SurfaceKind::Sphere => &mut self.sphere,
            SurfaceKind::Torus => &mut self.torus,
            SurfaceKind::Revolution => &mut self.revolution,
            SurfaceKind::Extrusion => &mut self.extrusion,
            SurfaceKind::Offset => &mut self.offset,
            SurfaceKind::Bspline => &mut self.bspline,
            SurfaceKind::Rational => &mut self.rational,
            SurfaceKind::Tessellated => &mut self.tessellated,
            SurfaceKind::Other => &mut self.other,
        };
        *slot += 1;
    }
}

/// A remark about an entity.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Note {
    /// Its `#id`.
    pub id: u64,
    /// Its name in the file.
    pub entity: String,
    /// What happened, and why.
    pub reason: String,
}

/// Time taken, s.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Seconds {
    /// From bytes to records.
    pub parse: f64,
    /// From records to the model.
    pub convert: f64,
}
