//! The strips between a border's chords and its curves in the parameter plane, in which no inner corner of a facet may stand.
//!
//! A side of a face that is straight in space can be a bent curve in parameters. On the hollow side of the curve the chord takes in a strip
//! of the surface that is no part of the face: a corner there would stand out beyond the edge.

use crate::math::Uv;
use crate::tessellate::proof::border_chord::BorderChord;

/// A convex polygon, counter-clockwise, and the box around it.
struct Sliver {
    hull: Vec<Uv>,
    lo: Uv,
    hi: Uv,
}

impl Sliver {
    /// Whether `p` lies inside the polygon by more than `near` in u and v.
    fn holds(&self, p: Uv, near: Uv) -> bool {
        if p.cmple(self.lo).any() || p.cmpge(self.hi).any() {
            return false;
        }
        let ends = self.hull.iter().zip(self.hull.iter().cycle().skip(1));
        // A box of that half size around the place lies wholly to the left of every side.
        ends.into_iter().all(|(&a, &b)| {
            let d = b - a;
            d.perp_dot(p - a) > d.x.abs() * near.y + d.y.abs() * near.x
        })
    }
}

/// The strips of one face that are wider than its parameters are near each other.
pub(in crate::tessellate) struct Slivers {
    /// In order of their lowest v.
    all: Vec<Sliver>,
    /// The largest extent of one along v.
    tallest: f64,
    /// Parameters nearer than this are one.
    resolution: Uv,
}

impl Slivers {
    /// Takes what lies between `chords` and their curves; parameters within `resolution` are one.
    pub(in crate::tessellate) fn new<'c>(chords: impl Iterator<Item = &'c BorderChord>, resolution: Uv) -> Self {
        let sliver = |chord: &BorderChord| {
            let points = chord.between.iter();
            let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(lo, hi), &p| (lo.min(p), hi.max(p)));
            let hull = chord.between.clone();
            let middle = hull.iter().sum::<Uv>() / hull.len() as f64;
            let sliver = Sliver { hull, lo, hi };
            // The rounding of trims leaves nothing between.
            sliver.holds(middle, resolution).then_some(sliver)
        };
        let mut all: Vec<Sliver> = chords.filter(|c| c.between.len() > 2).filter_map(sliver).collect();
        all.sort_by(|a, b| a.lo.y.total_cmp(&b.lo.y));
        let tallest = all.iter().map(|s| s.hi.y - s.lo.y).fold(0.0, f64::max);
        Self { all, tallest, resolution }
    }

    /// Returns those that may reach into the heights from `low` to `high`.
    fn between(&self, low: f64, high: f64) -> &[Sliver] {
        let from = self.all.partition_point(|s| s.lo.y < low - self.tallest);
        let to = self.all.partition_point(|s| s.lo.y <= high);
        &self.all[from.min(to)..to]
    }

    /// Whether a corner at `p` would stand in one of them.
    pub(in crate::tessellate) fn hold(&self, p: Uv) -> bool {
        self.between(p.y, p.y).iter().any(|s| s.holds(p, self.resolution))
    }

    /// Whether the box around one of them meets the rectangle from `lo` to `hi`.
    pub(in crate::tessellate) fn may_meet(&self, lo: Uv, hi: Uv) -> bool {
        self.between(lo.y, hi.y).iter().any(|s| s.lo.cmple(hi).all() && s.hi.cmpge(lo).all())
    }
}
