//! What the facets must hold to, and the tolerance as a function of curvature.

use crate::math::FaceId;

/// Least tolerance that scenes and options may ask for, mm: an atom. A picometre lies within the rounding of coordinates, and took minutes.
pub const LEAST_TOLERANCE_MM: f64 = 1e-7;

/// Tolerance or radius, mm, in place of one that is not positive: less than any machine makes.
const LEAST_LENGTH: f64 = 1e-9;

/// Requirements on the facets, and work limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Sag allowed at the sharpest and at the flattest places, mm; equal numbers make it uniform.
    pub tolerance: [f64; 2],
    /// Radii of curvature, mm, at and below which the tight tolerance holds, and from which on the loose one does.
    /// Between them the tolerance rises smoothly with the logarithm of the radius. The default 5 and 300 mm keep the mean
    /// deviation of every fixture under 0.08 mm with half the facets of a uniform 0.05 mm; with 5 and 100 mm the shallow freeform
    /// reflector has 0.096 mm.
    pub radii: [f64; 2],
    /// How the tolerance runs between the two radii.
    pub law: ToleranceLaw,
    /// Largest angle between a facet and the surface normals at its corners, degrees; `None` for no such condition. Faces that would need
    /// more cells for it than their budget get the least angle that it allows: [`super::Report::over_angle`] names them.
    pub angle_deg: Option<f64>,
    /// Other tolerances for some places; of several that match a face, the last counts.
    pub overrides: Vec<ToleranceOverride>,
    /// Most cells of one face that are held to its tolerance; beyond it, cells are coarser, a few times as many at most, counted as
    /// not certified, and the face as repaired.
    pub budget: usize,
    /// Most cells that the faces of all parts together may be sure to need, beside some for each; the largest of a model that needs more
    /// are left without facets ([`super::FailureCause::TooManyFacets`]).
    pub most_cells: u64,
    /// Cells for each control point of the model's surfaces, beside 200,000, that `budget` and `most_cells` are cut to at the default
    /// tolerance, so that what a model costs follows its size; and of one large face beside 50,000, or four times what its curvature
    /// foretells where that is more. Infinite for no such cut.
    pub cells_of_point: f64,
    /// Most steps that the proofs of one face may take, each a sum of two control points; a face of a surface so wild that they take more
    /// is left without facets ([`super::FailureCause::TooManySteps`]). One whose facets in all rounds together weigh as much, a facet as
    /// 10,000 steps, is not meshed anew; what does not hold there is counted.
    pub most_steps: u64,
    /// What decides whether a facet is good enough.
    pub acceptance: Acceptance,
    /// Distance, mm, within which faces of two solids are one interface, and are faceted once: where one lies wholly on the other, both
    /// have the same facets there. 0 facets each by itself.
    pub glue_mm: f64,
    /// Whether [`super::Report`] gets sampled sag and normal errors, which costs about twice the time of meshing.
    pub measure: bool,
}

/// Another tolerance for some faces.
#[derive(Clone, Debug, PartialEq)]
pub struct ToleranceOverride {
    /// The faces to which it applies.
    pub scope: ToleranceScope,
    /// As [`Settings::tolerance`].
    pub tolerance: [f64; 2],
    /// As [`Settings::radii`], where these faces need their own.
    pub radii: Option<[f64; 2]>,
}

/// How the tolerance runs between the radii of [`Settings::radii`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToleranceLaw {
    /// Smoothly with the logarithm of the radius.
    #[default]
    Smooth,
    /// As a power of the radius; in proportion to it where the tolerances stand to each other as the radii do. A mirror of
    /// radius R with interpolated normals misdirects light by sag over R, so that such a tolerance means the same angle everywhere.
    Power,
}

/// The faces that a [`ToleranceOverride`] is for.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ToleranceScope {
    /// All faces of the parts of this name.
    Part(String),
    /// All faces of this name.
    Face(String),
    /// Faces read from this entity of the file.
    Entity(u64),
    /// These placed faces, such as all mirrors of a scene. A part is meshed once, so the tolerance holds in all
    /// its places.
    Placed(Vec<FaceId>),
}

/// What decides whether a facet is good enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Acceptance {
    /// The proved bound.
    #[default]
    Proved,
    /// Dense sampling of the true distance: proves nothing; it shows what the proof costs in facets.
    Sampled,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: [0.05, 0.2],
            radii: [5.0, 300.0],
            law: ToleranceLaw::Smooth,
            angle_deg: None,
            overrides: Vec::new(),
            budget: 400_000,
            most_cells: 4_000_000,
            cells_of_point: 50.0,
            most_steps: 4_000_000_000,
            acceptance: Acceptance::Proved,
            glue_mm: 0.0,
            measure: false,
        }
    }
}

impl Settings {
    /// Makes settings with the same tolerance everywhere, mm.
    pub fn uniform(tolerance: f64) -> Self {
        Self { tolerance: [tolerance; 2], ..Self::default() }
    }

    /// Returns the smallest and the largest tolerance anywhere, overrides among them, mm.
    pub fn range(&self) -> [f64; 2] {
        let all = self.overrides.iter().map(|o| o.tolerance).chain([self.tolerance]).flatten();
        all.fold([f64::INFINITY, 0.0], |[low, high], t| [low.min(t), high.max(t)])
    }

    /// Returns the largest tolerance anywhere, mm.
    pub fn loosest(&self) -> f64 {
        self.range()[1]
    }
}

/// Share of the tightest tolerance below which facets are not divided for an angle. At a corner where a surface has no normal they went
/// down to a picometre, and some no longer met those of the next face.
const LEAST_SHARE: f64 = 0.01;

/// The tolerance as a function of curvature, for one face in its part's own lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToleranceField {
    /// Tightest and loosest, and the radii of curvature at which they are reached, mm.
    range: [f64; 2],
    radii: [f64; 2],
    law: ToleranceLaw,
    /// Largest angle between a facet and the normals at its corners, radians: that of [`Settings::angle_deg`], or the least that the face
    /// can be held to.
    pub(super) angle: Option<f64>,
}

impl ToleranceField {
    /// Cleans and orders tolerances and radii, mm of the scene, and divides them by `scale`, that of the placement. What is not finite and
    /// positive becomes [`LEAST_LENGTH`].
    pub(super) fn new(tolerance: [f64; 2], radii: [f64; 2], law: ToleranceLaw, scale: f64) -> Self {
        // A length that is no number becomes the least there is, so that nothing is ever looser than requested.
        let clean = |x: f64| if x.is_finite() && x > 0.0 { x / scale } else { LEAST_LENGTH };
        let [a, b] = tolerance.map(clean);
        let [r, s] = radii.map(clean);
        Self { range: [a.min(b), a.max(b)], radii: [r.min(s), r.max(s)], law, angle: None }
    }

    /// Returns the tolerance where the sharpest normal curvature is `k`, 1/mm in the part's lengths; the loosest at 0, the tightest at NaN.
    pub(super) fn tolerance_at(&self, k: f64) -> f64 {
        let ([tight, loose], [sharp, flat]) = (self.range, self.radii);
        // Flatter than the flattest radius, and sharper than the sharpest: the ends hold as they are, and no
        // logarithm of zero is taken.
        if tight == loose || k * flat <= 1.0 {
            return loose;
        }
        if k.is_nan() || k * sharp >= 1.0 {
            return tight;
        }
        let x = (1.0 / (k * sharp)).ln() / (flat / sharp).ln();
        match self.law {
            // The cubic 3x² − 2x³ has no kinks at the ends, where sizes of neighbouring facets would jump.
            ToleranceLaw::Smooth => tight + (loose - tight) * x * x * (3.0 - 2.0 * x),
            ToleranceLaw::Power => tight * (loose / tight).powf(x),
        }
    }

    /// Returns the same with no tolerance above that share of the other's; radii and law are those of `self`.
    pub(super) fn tighter(self, other: &Self, share: f64) -> Self {
        let range = [0, 1].map(|k| self.range[k].min(share * other.range[k]));
        Self { range, ..self }
    }

    /// Whether both have the same tolerances; radii, law and angle are not compared.
    pub(super) fn has_range_of(&self, other: &Self) -> bool {
        self.range == other.range
    }

    /// Returns the same field with no tolerance above `most`.
    pub(super) fn at_most(self, most: f64) -> Self {
        Self { range: self.range.map(|x| x.min(most)), ..self }
    }

    /// Returns the sag, mm, at which a chord meets the angle condition where the curvature is `k`, 1/mm: the chord's ends turn by k·L/2 and
    /// it sags k·L²/8, or of one of [`Self::least_of_angle`]. Infinite without a condition.
    pub(super) fn sag_at_angle(&self, k: f64) -> f64 {
        // No chord is made shorter than the least for its angle.
        self.angle.map_or(f64::INFINITY, |a| a * a / (2.0 * k.min(2.0 * a / self.least_of_angle())))
    }

    /// Returns the length, mm, below which facets are not divided for an angle: [`LEAST_SHARE`] of the tightest tolerance.
    pub(super) fn least_of_angle(&self) -> f64 {
        LEAST_SHARE * self.range[0]
    }

    /// Returns the tolerance at the sharpest places, mm.
    pub(super) fn tightest(&self) -> f64 {
        self.range[0]
    }

    /// Returns the tolerance at the flattest places, mm.
    pub(super) fn loosest(&self) -> f64 {
        self.range[1]
    }
}
