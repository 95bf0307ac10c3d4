//! Settings of an import.

/// Far below any tolerance of meshing, 1e-3 mm at the finest, so that uv curves never show in it.
const UV_TOLERANCE_MM: f64 = 1e-6;

/// How a file is read.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Allowed distance between a uv curve on its surface and the foot points of its edge, mm. Halving it adds about
    /// a fifth to the pieces of each curve.
    pub uv_tolerance: f64,
    /// Surface evaluations that one face may take before it is refused; 1e6 are about a second. The search for a way of its seam past its
    /// holes counts as evaluations that take as long.
    pub face_budget: u64,
    /// Most products and shapes that the assemblies of a file may place; each takes about 500 bytes. Beyond it the file is refused.
    pub max_placed: u64,
    /// Whether the report gets [`super::ImportReport::bbox_mm`], which takes longer than reading where trims are long.
    pub measure_box: bool,
    /// Millimetres per unit of length, for files whose own unit is wrong; every context of the file then has it. `None` believes the file.
    pub length_unit_mm: Option<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            uv_tolerance: UV_TOLERANCE_MM,
            face_budget: 3_000_000,
            max_placed: 1 << 20,
            measure_box: true,
            length_unit_mm: None,
        }
    }
}
