//! Tolerances that follow the radius of curvature: for each face a share of its own.

use crate::math::FaceId;
use crate::tessellate::{Settings, ToleranceLaw, ToleranceOverride, ToleranceScope};
use serde::Serialize;

/// Local tolerances for a model: on each face in proportion to the radius of curvature.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TolerancePlan {
    /// Faces that enough rays met to be judged on their own.
    pub places: Vec<RelativeTolerance>,
    /// The tolerance of all other faces.
    pub other: RelativeTolerance,
    /// No tolerance is larger, mm.
    pub coarsest_mm: f64,
    /// No tolerance is smaller, mm.
    pub finest_mm: f64,
}

/// A tolerance in proportion to the radius of curvature.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RelativeTolerance {
    /// The placed faces; those of one face of a part stand together.
    #[serde(serialize_with = "numbers")]
    pub faces: Vec<FaceId>,
    /// Tolerance over radius.
    pub of_radius: f64,
    /// The radii between which it follows, mm: nearly the least and the largest that rays met.
    pub radii_mm: [f64; 2],
}

/// Writes faces as their numbers.
fn numbers<S: serde::Serializer>(faces: &[FaceId], s: S) -> Result<S::Ok, S::Error> {
    s.collect_seq(faces.iter().map(|f| f.0))
}

impl TolerancePlan {
    /// Makes a plan of the same tolerance, mm, everywhere.
    pub fn uniform(tolerance_mm: f64) -> Self {
        // A power law between equal radii is a constant.
        let other = RelativeTolerance { faces: Vec::new(), of_radius: tolerance_mm, radii_mm: [1.0, 1.0] };
        Self { places: Vec::new(), other, coarsest_mm: tolerance_mm, finest_mm: tolerance_mm }
    }

    /// Makes a plan of the same tolerance, mm, everywhere, to be made coarser or finer within bounds.
    pub(in crate::study) fn even(tolerance_mm: f64, [finest_mm, coarsest_mm]: [f64; 2]) -> Self {
        Self { coarsest_mm, finest_mm, ..Self::uniform(tolerance_mm) }
    }

    /// Multiplies all tolerances; the bounds stay.
    pub(in crate::study) fn scale(&mut self, factor: f64) {
        for share in self.places.iter_mut().chain([&mut self.other]) {
            share.of_radius *= factor;
        }
    }

    /// Returns the least and the largest tolerance of a place, those at the ends of its radii kept within the bounds, and the radii at
    /// which they are reached; all in mm.
    pub(in crate::study) fn range(&self, share: &RelativeTolerance) -> ([f64; 2], [f64; 2]) {
        let clamp = |t: f64| t.clamp(self.finest_mm, self.coarsest_mm);
        let tolerance = share.radii_mm.map(|r| clamp(share.of_radius * r));
        // The radii at which exactly these are reached, so that in between it is in proportion.
        let radii = [0, 1].map(|k| tolerance[k] / share.of_radius.max(f64::MIN_POSITIVE));
        (tolerance, if tolerance[0] == tolerance[1] { share.radii_mm } else { radii })
    }

    /// Returns what the least tolerance would be without the lower bound, mm; of places alone where there are any.
    pub(in crate::study) fn unbounded_mm(&self) -> f64 {
        // Where places have their own, the rest is only a default that no face may use.
        let shares = self.places.iter().chain(self.places.is_empty().then_some(&self.other));
        shares.map(|s| s.of_radius * s.radii_mm[0]).fold(self.coarsest_mm, f64::min).max(f64::MIN_POSITIVE)
    }

    /// Returns the least and the largest tolerance, mm; those of places alone where there are any.
    pub fn tolerance_mm(&self) -> [f64; 2] {
        let shares = self.places.iter().chain(self.places.is_empty().then_some(&self.other));
        let ends = shares.map(|s| self.range(s).0);
        ends.fold([f64::INFINITY, 0.0], |[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Returns the largest tolerance, mm, the one for faces without a place among them.
    pub(in crate::study) fn loosest_mm(&self) -> f64 {
        let all = self.places.iter().chain([&self.other]);
        all.map(|share| self.range(share).0[1]).fold(0.0, f64::max)
    }

    /// Puts the plan into the mesher's settings, before overrides that are there already: those win.
    pub fn apply(&self, settings: &mut Settings) {
        (settings.tolerance, settings.radii) = self.range(&self.other);
        settings.law = ToleranceLaw::Power;
        let own = self.places.iter().map(|share| {
            let (tolerance, radii) = self.range(share);
            ToleranceOverride { scope: ToleranceScope::Placed(share.faces.clone()), tolerance, radii: Some(radii) }
        });
        // In front: of several overrides for a face the last one counts.
        settings.overrides.splice(0..0, own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_keeps_within_its_bounds_and_follows_the_radius_between_them() {
        let mut plan = TolerancePlan::even(0.1, [0.01, 1.0]);
        plan.other = RelativeTolerance { faces: Vec::new(), of_radius: 0.001, radii_mm: [2.0, 5000.0] };
        // 0.001 of 2 mm is below the lower bound, which 10 mm reach; of 5 m above the upper one, which a metre reaches.
        assert_eq!(plan.range(&plan.other), ([0.01, 1.0], [10.0, 1000.0]));
        assert_eq!((plan.tolerance_mm(), plan.loosest_mm()), ([0.01, 1.0], 1.0));
        assert_eq!(plan.unbounded_mm(), 0.002);
        plan.scale(100.0);
        // 0.1 of 2 mm is within the bounds; the upper one is reached by 10 mm.
        assert_eq!(plan.range(&plan.other), ([0.2, 1.0], [2.0, 10.0]));
    }
}
