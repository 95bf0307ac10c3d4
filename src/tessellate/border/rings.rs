//! The border of a face as polygons in its parameter plane, on the shared samples of its edges.

use super::edges::{self, Division};
use crate::math::{Point, Uv};
use crate::model::{EdgeUse, Face, Part, TrimLoop};
use crate::nurbs::UvCurve;
use crate::tessellate::sheet::Sheet;

/// A vertex of a border polygon, and what the polygon's edge that starts there follows.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct RingVertex {
    pub(in crate::tessellate) uv: Uv,
    /// Below the number of shared positions: one of those; otherwise one of the face's own.
    pub(in crate::tessellate) position: u32,
    pub(in crate::tessellate) follows: Follows,
}

/// What one edge of a border polygon follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tessellate) enum Follows {
    /// The part's edge of use `side` (counted through all loops) over a parameter interval.
    Edge { side: u32, t: [f64; 2] },
    /// A straight line of the parameter plane whose two sides are one in space, or a free border.
    Seam,
    /// A line of the parameter plane that is one point in space.
    Pole,
}

/// All polygons of a face.
#[derive(Default)]
pub(in crate::tessellate) struct Rings {
    pub(in crate::tessellate) rings: Vec<Vec<RingVertex>>,
    /// Positions that are not shared with other faces.
    pub(in crate::tessellate) own: Vec<Point>,
}

impl Rings {
    /// The box around all polygons.
    pub(in crate::tessellate) fn bounds(&self) -> (Uv, Uv) {
        let all = self.rings.iter().flatten();
        all.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(l, h), v| (l.min(v.uv), h.max(v.uv)))
    }
}

/// The loops of a face; of an untrimmed one, the rim of its domain.
pub(in crate::tessellate) fn loops(face: &Face) -> Vec<TrimLoop> {
    if !face.loops.is_empty() {
        return face.loops.clone();
    }
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let corners = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
    let uses = (0..4)
        .map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            let t = if k % 2 == 0 { [u0, u1] } else { [v0, v1] };
            // Opposite sides run over the same parameters, so that a seam's two sides have the same samples.
            let uv = if k < 2 { UvCurve::line(a, b, t) } else { UvCurve::line(b, a, t) };
            EdgeUse { edge: None, reversed: k >= 2, uv }
        })
        .collect();
    vec![TrimLoop { uses }]
}

/// Builds the polygons; shared positions are `positions`.
pub(in crate::tessellate) fn build(
    part: &Part,
    loops: &[TrimLoop],
    sheet: &Sheet<'_>,
    divisions: &[Division],
    positions: &[Point],
) -> Rings {
    let mut rings = Rings::default();
    let near = 1e-6 * sheet.size + 1e-9;
    let mut own = Own { shared: positions, own: Vec::new(), near };
    let mut seams: Vec<SeamSide> = Vec::new();
    let mut side = 0;
    for trim in loops {
        let n = trim.uses.len();
        // Where each use starts, in space: the vertex of an edge decides, of either neighbour.
        let starts: Vec<u32> = (0..n)
            .map(|k| {
                let (before, here) = (&trim.uses[(k + n - 1) % n], &trim.uses[k]);
                let of = |u: &EdgeUse, end: usize| {
                    u.edge.map(|e| part.edges[e.0 as usize].vertices[if u.reversed { 1 - end } else { end }].0)
                };
                of(here, 0)
                    .or(of(before, 1))
                    .unwrap_or_else(|| own.find(sheet.point(sheet.surface.clamp(here.start()))))
            })
            .collect();
        let mut ring: Vec<RingVertex> = Vec::new();
        for (k, u) in trim.uses.iter().enumerate() {
            let first = ring.len();
            let (from, to) = (starts[k], starts[(k + 1) % n]);
            match u.edge {
                Some(edge) => along_edge(&mut ring, u, &divisions[edge.0 as usize], side, from),
                None => without_edge(&mut ring, u, sheet, [from, to], &mut own, &mut seams),
            }
            if let Some(v) = ring.get_mut(first) {
                v.uv = u.start();
            }
            side += 1;
        }
        for v in &mut ring {
            v.uv = sheet.surface.clamp(v.uv);
        }
        ring.dedup_by(|b, a| a.uv == b.uv && a.position == b.position);
        if ring.len() > 1 && ring[0].uv == ring[ring.len() - 1].uv {
            ring.pop();
        }
        rings.rings.push(ring);
    }
    rings.own = own.own;
    rings
}

fn along_edge(ring: &mut Vec<RingVertex>, u: &EdgeUse, division: &Division, side: u32, from: u32) {
    let n = division.t.len();
    for i in 0..n - 1 {
        let (k, next) = if u.reversed { (n - 1 - i, n - 2 - i) } else { (i, i + 1) };
        let position = if i == 0 { from } else { division.first + k as u32 - 1 };
        let t = [division.t[k], division.t[next]];
        ring.push(RingVertex { uv: u.uv.evaluate(t[0]), position, follows: Follows::Edge { side, t } });
    }
}

/// One side of a seam that has been sampled, to be met again from the other side.
struct SeamSide {
    points: Vec<Point>,
    positions: Vec<u32>,
    fractions: Vec<f64>,
}

fn without_edge(
    ring: &mut Vec<RingVertex>,
    u: &EdgeUse,
    sheet: &Sheet<'_>,
    [from, to]: [u32; 2],
    own: &mut Own<'_>,
    seams: &mut Vec<SeamSide>,
) {
    let [t0, t1] = u.uv.domain();
    let uv = |f: f64| {
        let t = if u.reversed { t1 + (t0 - t1) * f } else { t0 + (t1 - t0) * f };
        sheet.surface.clamp(u.uv.evaluate(t))
    };
    let at = |f: f64| sheet.point(uv(f));
    let looks: Vec<Point> = (0..=8).map(|i| at(i as f64 / 8.0)).collect();
    if looks.iter().all(|p| (*p - looks[0]).length() <= 1e-5 * sheet.size) && from == to {
        ring.push(RingVertex { uv: uv(0.0), position: from, follows: Follows::Pole });
        return;
    }
    let partner = seams
        .iter()
        .find(|s| s.points.iter().rev().zip(&looks).all(|(a, b)| (*a - *b).length() <= 1e-5 * sheet.size));
    let (fractions, inner): (Vec<f64>, Vec<u32>) = match partner {
        Some(s) => {
            (s.fractions.iter().rev().map(|f| 1.0 - f).collect(), s.positions.iter().rev().copied().collect())
        }
        None => {
            // Seen from its first use: ascending in the curve's own parameter on both sides.
            let inner: Vec<f64> = u.uv.breakpoints()[1..].iter().map(|t| (t - t0) / (t1 - t0)).collect();
            let kinks: Vec<f64> = if inner.len() < 30 && u.uv.degree == 1 { inner } else { vec![1.0] };
            let mut breaks = vec![0.0];
            breaks.extend(
                kinks.iter().map(|&f| if u.reversed { 1.0 - f } else { f }).filter(|f| *f > 0.0 && *f < 1.0),
            );
            breaks.push(1.0);
            breaks.sort_by(f64::total_cmp);
            let fs = edges::parameters(&breaks, at, |f, _| 0.48 * sheet.tolerance(uv(f)));
            let fs: Vec<f64> = fs[1..fs.len() - 1].to_vec();
            let ids = fs.iter().map(|&f| own.add(at(f))).collect();
            (fs, ids)
        }
    };
    if partner.is_none() {
        seams.push(SeamSide { points: looks, positions: inner.clone(), fractions: fractions.clone() });
    }
    ring.push(RingVertex { uv: uv(0.0), position: from, follows: Follows::Seam });
    for (f, position) in fractions.into_iter().zip(inner) {
        ring.push(RingVertex { uv: uv(f), position, follows: Follows::Seam });
    }
}

/// Positions that a face makes itself, found again by place.
struct Own<'p> {
    shared: &'p [Point],
    own: Vec<Point>,
    near: f64,
}

impl Own<'_> {
    fn add(&mut self, p: Point) -> u32 {
        self.own.push(p);
        (self.shared.len() + self.own.len() - 1) as u32
    }

    fn find(&mut self, p: Point) -> u32 {
        match self.own.iter().position(|q| (*q - p).length() <= self.near) {
            Some(k) => (self.shared.len() + k) as u32,
            None => self.add(p),
        }
    }
}
