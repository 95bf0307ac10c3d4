//! Samples that edges of faces in contact must have: those of each other where they run together, where borders cross seams and each other,
//! and enough for the facets on both sides of a border that runs inside the other face.

use super::trimmed::TrimmedFace;
use crate::math::{Point, Uv};
use crate::model::EdgeId;
use crate::tessellate::border::edges::Division;
use crate::tessellate::proof::flat_triangle::distance_to_chord;
use rustc_hash::FxHashMap;

/// Halvings that find where a border crosses a seam: to the spacing of numbers.
const CROSSING_HALVINGS: usize = 52;
/// Share of the domain within which a place is on the seam.
const ON_SEAM: f64 = 1e-7;

/// Share of the tolerance that chords of a border take inside the other face: the facets on both sides of it have the rest. At 0.87 of it
/// a carrier came to 4,600 facets in place of 25.
const CHORD_SHARE: f64 = 0.5;
/// Pieces of each chord whose ends are tested for lying on the other face.
const CROSSING_PIECES: usize = 8;
/// Steps from one edge to the other and back that find where they cross: each takes the square of the cosine between them.
const CROSSING_STEPS: usize = 60;

/// Share of the glue distance within which two samples are one place.
const ONE_PLACE: f64 = 1e-6;

/// The parameters of all edges, both ends included and ascending, of the instances that have others than before contacts.
pub(super) type ContactSamples = FxHashMap<usize, Vec<Vec<f64>>>;

/// One face's edges with the divisions they have so far.
pub(super) struct EdgeSamples<'f, 'm> {
    pub(super) face: &'f TrimmedFace<'m>,
    pub(super) divisions: &'f [Division],
}

impl EdgeSamples<'_, '_> {
    /// Returns the parameters of an edge, ascending.
    fn parameters<'s>(&'s self, edge: EdgeId, samples: &'s ContactSamples) -> &'s [f64] {
        match samples.get(&self.face.key.instance) {
            Some(of_edges) => &of_edges[edge.0 as usize],
            None => &self.divisions[edge.0 as usize].t,
        }
    }

    /// Returns the places of the samples of an edge, in the model's coordinates.
    fn places(&self, edge: EdgeId, samples: &ContactSamples) -> Vec<Point> {
        self.parameters(edge, samples).iter().map(|&t| self.place(edge, t)).collect()
    }

    /// Adds a parameter to an edge, in place of that of `moved` where one is given.
    fn set_sample(&self, edge: EdgeId, t: f64, moved: Option<f64>, samples: &mut ContactSamples) {
        let before = || self.divisions.iter().map(|d| d.t.clone()).collect();
        let of_edge = &mut samples.entry(self.face.key.instance).or_insert_with(before)[edge.0 as usize];
        of_edge.retain(|&s| Some(s) != moved);
        let place = of_edge.partition_point(|&s| s < t);
        of_edge.insert(place, t);
    }

    /// Returns the point of an edge at `t`, in the model's coordinates.
    fn place(&self, edge: EdgeId, t: f64) -> Point {
        self.face.frame.point(self.face.part.edges[edge.0 as usize].curve.evaluate(t))
    }

    /// Adds `t` to an edge unless a sample of it lies within `glue` mm.
    fn request_sample(&self, edge: EdgeId, t: f64, glue: f64, samples: &mut ContactSamples) {
        if self.nearest_sample(edge, self.place(edge, t), samples).1 > glue {
            self.set_sample(edge, t, None, samples);
        }
    }

    /// Returns the parameter of the sample of an edge that is nearest to a place, and how far it is, mm.
    fn nearest_sample(&self, edge: EdgeId, p: Point, samples: &ContactSamples) -> (f64, f64) {
        let away = self.parameters(edge, samples).iter().map(|&s| (s, (self.place(edge, s) - p).length()));
        away.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((f64::NAN, f64::INFINITY))
    }

    /// Adds `t` to an edge, or moves the nearest sample there where that lies within `glue` mm: chords between nearly the same places would
    /// leave a sliver between the two faces. The ends of an edge are corners of the face and stay.
    fn move_sample(&self, edge: EdgeId, t: f64, glue: f64, samples: &mut ContactSamples) {
        let (nearest, away) = self.nearest_sample(edge, self.place(edge, t), samples);
        let known = self.parameters(edge, samples);
        let is_end = [known.first(), known.last()].contains(&Some(&nearest));
        if away > glue {
            self.set_sample(edge, t, None, samples);
        } else if away > ONE_PLACE * glue && !is_end {
            self.set_sample(edge, t, Some(nearest), samples);
        }
    }

    /// Adds the samples of another face's edges that lie within `glue` mm of this face's edges; a sample of ours that lies so near to one
    /// of theirs moves there.
    pub(super) fn take_over(&self, other: &EdgeSamples<'_, '_>, glue: f64, samples: &mut ContactSamples) {
        let edges = self.face.edges();
        for theirs in other.face.edges() {
            let places = other.places(theirs, samples);
            // Every edge of either: two faces may touch along edges that are divided quite differently.
            for &ours in &edges {
                for &p in &places {
                    let (t, away) = self.face.nearest_on_edge(ours, p);
                    if away > glue {
                        continue;
                    }
                    let (nearest, distance) = self.nearest_sample(ours, self.place(ours, t), samples);
                    let here = self.place(ours, nearest);
                    // One that another of theirs is nearer to is that one's; `p` itself is as near, to rounding.
                    let least = distance - ONE_PLACE * glue;
                    if distance > glue || places.iter().all(|q| (*q - here).length() >= least) {
                        self.move_sample(ours, t, glue, samples);
                    }
                }
            }
        }
    }

    /// Asks for samples on edges that run inside another face, so that their chords take no more than a share of its tolerance.
    pub(super) fn shorten_chords(&self, other: &TrimmedFace<'_>, glue: f64, samples: &mut ContactSamples) {
        let borders = other.edges();
        for edge in self.face.edges() {
            for pair in self.parameters(edge, samples).to_vec().windows(2) {
                let place = |f: f64| self.place(edge, pair[0] + f * (pair[1] - pair[0]));
                let middle = place(0.5);
                let (uv, away) = other.project(middle);
                // Along the other's border the chord is a side of its own.
                if away > glue || !other.contains(uv) || other.is_at_border(&borders, middle, glue) {
                    continue;
                }
                let sag = distance_to_chord(middle, &[place(0.0), place(1.0)]);
                let limit = CHORD_SHARE * other.surface.tolerance(uv) * other.frame.scale.abs();
                // The sag falls with the square of the number of parts.
                let parts = (sag / limit).sqrt().ceil();
                (1..parts as usize).for_each(|k| {
                    self.request_sample(edge, pair[0] + k as f64 / parts * (pair[1] - pair[0]), glue, samples)
                });
            }
        }
    }

    /// Asks for samples on both edges where one of this face crosses one of another into it or out of it.
    pub(super) fn cross_edges(&self, other: &EdgeSamples<'_, '_>, glue: f64, samples: &mut ContactSamples) {
        // Where seams are crossed is determined elsewhere.
        let rims = other.face.rims();
        if rims.is_empty() {
            return;
        }
        for edge in self.face.rims() {
            let inside = |t: f64| other.face.holds_inside(&rims, self.place(edge, t), glue);
            let at_border = |t: f64| other.face.is_at_border(&rims, self.place(edge, t), glue);
            for pair in self.parameters(edge, samples).to_vec().windows(2) {
                // What runs along the other border takes its samples over.
                if at_border(pair[0]) && at_border(pair[1]) {
                    continue;
                }
                let step = (pair[1] - pair[0]) / CROSSING_PIECES as f64;
                for k in 0..CROSSING_PIECES {
                    let [mut lo, mut hi] = [k, k + 1].map(|k| pair[0] + step * k as f64);
                    if k > 0 && at_border(lo) {
                        self.request_crossing(other, (edge, lo), glue, samples);
                    }
                    let from = inside(lo);
                    if from == inside(hi) || at_border(lo) || at_border(hi) {
                        continue;
                    }
                    for _ in 0..CROSSING_HALVINGS {
                        let m = 0.5 * (lo + hi);
                        if inside(m) == from { lo = m } else { hi = m }
                    }
                    self.request_crossing(other, (edge, 0.5 * (lo + hi)), glue, samples);
                }
            }
        }
    }

    /// Asks for a sample on an edge, where it crosses the nearest border edge of another face near this parameter, and one on that edge;
    /// for none where the two stay more than `glue` mm apart.
    fn request_crossing(
        &self,
        other: &EdgeSamples<'_, '_>,
        (edge, mut t): (EdgeId, f64),
        glue: f64,
        samples: &mut ContactSamples,
    ) {
        let p = self.place(edge, t);
        let distance = |e: &EdgeId| other.face.nearest_on_edge(*e, p).1;
        let nearest = other.face.rims().into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(crossed) = nearest else { return };
        let mut s = other.face.nearest_on_edge(crossed, p).0;
        for _ in 0..CROSSING_STEPS {
            t = self.face.nearest_on_edge(edge, other.place(crossed, s)).0;
            s = other.face.nearest_on_edge(crossed, self.place(edge, t)).0;
        }
        if (self.place(edge, t) - other.place(crossed, s)).length() <= glue {
            self.move_sample(edge, t, glue, samples);
            other.move_sample(crossed, s, glue, samples);
        }
    }

    /// Asks for samples where edges of this face cross the seam of its carrier.
    pub(super) fn cross_seams(&self, carrier: &TrimmedFace<'_>, glue: f64, samples: &mut ContactSamples) {
        for edge in self.face.edges() {
            for pair in self.parameters(edge, samples).to_vec().windows(2) {
                for d in (0..2).filter(|&d| carrier.surface.closed[d]) {
                    let at = |t: f64| carrier.project(self.place(edge, t)).0;
                    if let Some(crossing) = seam_crossing(carrier, d, [pair[0], pair[1]], at) {
                        self.move_sample(edge, crossing, glue, samples);
                    }
                }
            }
        }
    }
}

/// Returns the parameter at which a curve on a closed carrier crosses its seam in direction `d` (0 for u, 1 for v); `at` gives the
/// carrier's parameters. `None` where it does not, or where an end lies on the seam already.
pub(super) fn seam_crossing(
    carrier: &TrimmedFace<'_>,
    d: usize,
    [mut lo, mut hi]: [f64; 2],
    at: impl Fn(f64) -> Uv,
) -> Option<f64> {
    let [a, b] = carrier.surface.spline.domain()[d];
    let share = |t: f64| (at(t)[d] - a) / (b - a);
    let (from, to) = (share(lo), share(hi));
    // Across a seam the share of the period jumps by nearly one; a point on it may count on either side.
    let on_seam = |x: f64| x.min(1.0 - x) <= ON_SEAM;
    // A jump of less than half a period is the curve's own way.
    if on_seam(from) || on_seam(to) || (from - to).abs() <= 0.5 {
        return None;
    }
    for _ in 0..CROSSING_HALVINGS {
        let m = 0.5 * (lo + hi);
        if (share(m) > 0.5) == (from > 0.5) { lo = m } else { hi = m }
    }
    Some(0.5 * (lo + hi))
}
