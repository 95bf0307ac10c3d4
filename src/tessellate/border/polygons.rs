//! The border of a face as polygons in its parameter plane, on the shared samples of its edges.

use super::curve_chords::{self, Effort};
use super::edges::Division;
use crate::math::polygon::signed_area;
use crate::math::{NearPoints, Point, Uv};
use crate::model::{EdgeId, EdgeUse, Face, Part, TrimLoop};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::Position;
use std::borrow::Cow;

/// Distance, mm, and share of the surface's size, within which corners that a face makes itself are one: ten times what the readers
/// of files let the ends of neighbouring trims lie apart.
const COINCIDENT_CORNERS: [f64; 2] = [1e-9, 1e-6];
/// Share of the face's extent, in parameters, within which corners at one place of the file's vertices are one. The two sides of a seam are
/// all of the extent apart, and so are the ends of a pole.
const SAME_CORNER: f64 = 1e-3;
/// Width, as a share of the domain, that the rounding of parameters gives to a polygon all of whose corners lie on one line: some fifty
/// ulps.
const ROUNDED_WIDTH: f64 = 1e-14;
/// Share of the surface's size within which a side without an edge is one point, or two such sides are one seam: such sides come
/// from analytic surfaces, whose poles and seams close to rounding, or from splines fitted to them.
const CLOSED_SIDE: f64 = 1e-5;
/// Steps in which the shape of a side without an edge is compared with others.
const SHAPE_STEPS: u32 = 8;
/// Kinks of a straight-sided uv curve up to which each becomes a corner.
const MAX_KINKS: usize = 30;
/// Share of the tolerance that the chords of a seam take: both its sides are cells' sides, and the cells take the other half.
const SEAM_SHARE: f64 = 0.48;

/// A vertex of a border polygon, and what the polygon's edge that starts there follows.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct PolygonVertex {
    pub(in crate::tessellate) uv: Uv,
    pub(in crate::tessellate) position: Position,
    pub(in crate::tessellate) side: BorderSide,
}

/// What one edge of a border polygon follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tessellate) enum BorderSide {
    /// The part's edge of this use (counted through all loops) over a parameter interval.
    Edge { edge_use: u32, t: [f64; 2] },
    /// A straight line of the parameter plane without an edge of the part: one side of a seam, or a free border.
    Seam,
    /// A line of the parameter plane that is one point in space.
    Pole,
}

/// The border polygons of a face, one for each loop.
#[derive(Default)]
pub(in crate::tessellate) struct BorderPolygons {
    /// In order of the loops; the last corner is joined to the first.
    pub(in crate::tessellate) polygons: Vec<Vec<PolygonVertex>>,
    /// Places of the positions that are not shared with other faces, in the part's coordinates.
    pub(in crate::tessellate) own: Vec<Point>,
    /// Pairs of shared positions in one place: vertices that the file has twice, where loops touch, and samples where edges cross.
    pub(in crate::tessellate) coincident: Vec<[u32; 2]>,
    /// Whether edges cross in corners of theirs, which [`Self::join_meeting_corners`] has made one.
    pub(in crate::tessellate) meets_itself: bool,
}

impl BorderPolygons {
    /// Returns the box, in parameters, around all polygons: lowest and highest corner. Infinite and inverted without any.
    pub(in crate::tessellate) fn bounds(&self) -> (Uv, Uv) {
        let all = self.polygons.iter().flatten();
        all.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(l, h), v| (l.min(v.uv), h.max(v.uv)))
    }

    /// Whether no polygon encloses anything in the parameter plane: each is one chord or none, or narrower than its corners are rounded.
    /// `extent` is that of the surface's domain.
    pub(in crate::tessellate) fn enclose_nothing(&self, extent: Uv) -> bool {
        let encloses = |polygon: &Vec<PolygonVertex>| {
            if polygon.len() <= 2 {
                return false;
            }
            let corners = || polygon.iter().map(|v| v.uv / extent);
            let away = || corners().map(|uv| uv - polygon[0].uv / extent);
            let reach = corners().map(|uv| uv.abs().max_element()).fold(1.0, f64::max);
            // Not by its area, which is nothing of a loop like an eight too.
            let farther =
                |a: Uv, b: Uv| if b.length_squared().total_cmp(&a.length_squared()).is_lt() { a } else { b };
            let along = away().fold(Uv::ZERO, farther).normalize_or_zero();
            let width = away().map(|p| along.perp_dot(p).abs()).fold(0.0, f64::max);
            width > ROUNDED_WIDTH * reach
        };
        !self.polygons.iter().any(encloses)
    }

    /// Gives corners at one of the file's `vertices`, or at two within `rounding` mm, the parameters and the position of the first, where
    /// parameters differ by less than [`SAME_CORNER`]. Trims end beside the vertex, as far as the file is rough, and where a loop passes
    /// it twice, or two loops touch, their chords would cross there.
    fn join_corners(&mut self, vertices: &[Point], rounding: f64) {
        let (lo, hi) = self.bounds();
        let near = SAME_CORNER * (hi - lo);
        let mut joined: Vec<(u32, Uv)> = Vec::new();
        let mut places = NearPoints::within(rounding.max(f64::MIN_POSITIVE));
        for corner in self.polygons.iter_mut().flatten() {
            let Position::Shared(vertex) = corner.position else { continue };
            let Some(&place) = vertices.get(vertex as usize) else { continue };
            let place_of = |k: u32| vertices[joined[k as usize].0 as usize];
            let is_same = |k: u32| (joined[k as usize].1 - corner.uv).abs().cmple(near).all();
            match places.first(place, place_of, is_same) {
                Some(k) => {
                    let (first, uv) = joined[k as usize];
                    if first != vertex {
                        self.coincident.push([first, vertex]);
                    }
                    (corner.uv, corner.position) = (uv, Position::Shared(first));
                }
                None => {
                    places.insert(place, joined.len() as u32);
                    joined.push((vertex, corner.uv));
                }
            }
        }
    }
}

/// Corners of a polygon from which on the check that its chords leave anything of its loop is skipped.
const MANY_CORNERS: usize = 8;
/// Share of a loop's area that the polygon of its chords keeps.
const KEPT_AREA: f64 = 0.1;

/// Returns the edges of loops whose chords enclose less than [`KEPT_AREA`] of the loop's area in parameters, or turn inside out: an arc and
/// a flat hyperbola over one chord, say. Polygons of more than [`MANY_CORNERS`] corners are not checked.
pub(in crate::tessellate) fn edges_of_collapsed_loops(
    loops: &[TrimLoop],
    polygons: &BorderPolygons,
) -> Vec<EdgeId> {
    let mut found = Vec::new();
    for (trim, polygon) in loops.iter().zip(&polygons.polygons).filter(|(_, p)| p.len() <= MANY_CORNERS) {
        let mut curves: Vec<Uv> = Vec::new();
        for u in &trim.uses {
            let ([t0, t1], first) = (u.uv.domain(), curves.len());
            let at = |i: u32| u.uv.evaluate(t0 + (t1 - t0) * f64::from(i) / f64::from(SHAPE_STEPS));
            curves.extend((0..=SHAPE_STEPS).map(at));
            if u.reversed {
                curves[first..].reverse();
            }
        }
        let chords: Vec<Uv> = polygon.iter().map(|v| v.uv).collect();
        let (chords, curves) = (signed_area(&chords), signed_area(&curves));
        // Opposite signs or nearly nothing: the chords' polygon is another region than the loop's.
        if chords * curves < KEPT_AREA * curves * curves {
            found.extend(trim.uses.iter().filter_map(|u| u.edge));
        }
    }
    found
}

/// Returns the loops that bound a face, with the border of its surface's domain where the face reaches it: of a face without loops, or with
/// holes alone.
pub(in crate::tessellate) fn loops(face: &Face) -> Cow<'_, [TrimLoop]> {
    if face.loops.is_empty() { Cow::Owned(vec![face.domain_border()]) } else { face.bounding_loops() }
}

/// Builds a polygon for each loop, its corners at the part's shared positions. Sides without an edge get samples of their own, the same on
/// both sides of a seam, and corners at those of `imprinted` that lie on them. Parameters are clamped to the surface's domain.
pub(in crate::tessellate) fn build(
    part: &Part,
    loops: &[TrimLoop],
    surface: &FaceSurface<'_>,
    divisions: &[Division],
    imprinted: &ImprintedPoints<'_>,
) -> BorderPolygons {
    let mut out = BorderPolygons::default();
    // Trims of neighbouring uses end where the file's rounding lets them, and a corner of the face must still be
    // one.
    let near = COINCIDENT_CORNERS[1] * surface.size + COINCIDENT_CORNERS[0];
    let mut own = OwnPoints { points: Vec::new(), near };
    let mut seams: Vec<SeamSide> = Vec::new();
    let mut edge_use = 0;
    for trim in loops {
        let n = trim.uses.len();
        // Where each use starts, in space: the vertex of an edge decides, of either neighbour.
        let starts: Vec<Position> = (0..n)
            .map(|k| {
                let (before, here) = (&trim.uses[(k + n - 1) % n], &trim.uses[k]);
                vertex_position(part, here, 0)
                    .or(vertex_position(part, before, 1))
                    .unwrap_or_else(|| own.find_or_add(surface.point(surface.spline.clamp(here.start()))))
            })
            .collect();
        let mut polygon: Vec<PolygonVertex> = Vec::new();
        for (k, u) in trim.uses.iter().enumerate() {
            let first = polygon.len();
            let (from, to) = (starts[k], starts[(k + 1) % n]);
            match u.edge {
                Some(edge) => polygon.extend(edge_side(u, &divisions[edge.0 as usize], edge_use, from)),
                None => polygon.extend(free_side(u, surface, [from, to], &mut own, &mut seams, imprinted)),
            }
            // The use's own start, which the curve of an edge shared with other faces may miss by a digit.
            if let Some(v) = polygon.get_mut(first) {
                v.uv = u.start();
            }
            edge_use += 1;
        }
        for v in &mut polygon {
            v.uv = surface.spline.clamp(v.uv);
        }
        // Uses without length leave their vertex twice.
        polygon.dedup_by(|b, a| a.uv == b.uv && a.position == b.position);
        if polygon.len() > 1 && polygon[0].uv == polygon[polygon.len() - 1].uv {
            polygon.pop();
        }
        out.polygons.push(polygon);
    }
    out.own = own.points;
    out.join_corners(&part.vertices, surface.rounding);
    out
}

/// Returns the shared position of the vertex where a use starts (`end` 0) or ends (1), in the direction of the loop; `None` without an
/// edge.
fn vertex_position(part: &Part, u: &EdgeUse, end: usize) -> Option<Position> {
    let vertices = part.edges[u.edge?.0 as usize].vertices;
    Some(Position::Shared(vertices[if u.reversed { 1 - end } else { end }].0))
}

/// Returns the vertices of a side along an edge, in the direction of the loop, without its end. `from` is the position of its start;
/// `edge_use` the number of the use through all loops.
fn edge_side<'d>(
    u: &'d EdgeUse,
    division: &'d Division,
    edge_use: u32,
    from: Position,
) -> impl Iterator<Item = PolygonVertex> + 'd {
    let n = division.t.len();
    (0..n - 1).map(move |i| {
        let (k, next) = if u.reversed { (n - 1 - i, n - 2 - i) } else { (i, i + 1) };
        let position = if i == 0 { from } else { Position::Shared(division.first + k as u32 - 1) };
        let t = [division.t[k], division.t[next]];
        PolygonVertex { uv: u.uv.evaluate(t[0]), position, side: BorderSide::Edge { edge_use, t } }
    })
}

/// The first side of a seam, kept so that the second one takes its samples.
struct SeamSide {
    /// Places at even steps along it.
    shape: Vec<Point>,
    /// Its inner samples: shares of the way along it, in [0, 1], and positions.
    samples: Vec<(f64, Position)>,
}

/// Returns the vertices of a side without an edge, without its end: one vertex for a pole; otherwise samples of its own, which go to `own`
/// and `seams`, or those of the side in `seams` that runs back through the same places. `from` and `to` are the positions of its ends.
fn free_side(
    u: &EdgeUse,
    surface: &FaceSurface<'_>,
    [from, to]: [Position; 2],
    own: &mut OwnPoints,
    seams: &mut Vec<SeamSide>,
    imprinted: &ImprintedPoints<'_>,
) -> Vec<PolygonVertex> {
    let [t0, t1] = u.uv.domain();
    let uv = |f: f64| {
        let t = if u.reversed { t1 + (t0 - t1) * f } else { t0 + (t1 - t0) * f };
        surface.spline.clamp(u.uv.evaluate(t))
    };
    let at = |f: f64| surface.point(uv(f));
    let shape: Vec<Point> = (0..=SHAPE_STEPS).map(|i| at(f64::from(i) / f64::from(SHAPE_STEPS))).collect();
    let near = CLOSED_SIDE * surface.size;
    // All of it in one place, and the vertices at its ends the same: nothing of the border lies here in space.
    if shape.iter().all(|p| (*p - shape[0]).length() <= near) && from == to {
        return vec![PolygonVertex { uv: uv(0.0), position: from, side: BorderSide::Pole }];
    }
    // The other side of a seam runs back through the same points.
    let runs_back = |s: &&SeamSide| s.shape.iter().rev().zip(&shape).all(|(a, b)| (*a - *b).length() <= near);
    let samples: Vec<(f64, Position)> = match seams.iter().find(runs_back) {
        // The second side takes the first one's samples, so that cells on both sides meet.
        Some(s) => s.samples.iter().rev().map(|&(f, position)| (1.0 - f, position)).collect(),
        None => {
            // Seen from its first use: ascending in the curve's own parameter on both sides.
            let inner: Vec<f64> = u.uv.breakpoints()[1..].iter().map(|t| (t - t0) / (t1 - t0)).collect();
            // Straight pieces with many kinks are a sampled curve, of which the kinks are no corners.
            let kinks: Vec<f64> = if inner.len() < MAX_KINKS && u.uv.degree == 1 { inner } else { vec![1.0] };
            let mut breaks = vec![0.0];
            breaks.extend(
                kinks.iter().map(|&f| if u.reversed { 1.0 - f } else { f }).filter(|f| *f > 0.0 && *f < 1.0),
            );
            breaks.push(1.0);
            breaks.sort_by(f64::total_cmp);
            let tolerance = |f: f64, _| SEAM_SHARE * surface.tolerance(uv(f));
            let mut fs = curve_chords::chord_parameters(&breaks, Effort::UNKNOWN_CURVE, at, tolerance);
            imprinted.add_samples(&mut fs, at);
            let samples: Vec<(f64, Position)> = fs[1..fs.len() - 1].iter().map(|&f| (f, own.add(at(f)))).collect();
            seams.push(SeamSide { shape, samples: samples.clone() });
            samples
        }
    };
    let all = std::iter::once((0.0, from)).chain(samples);
    all.map(|(f, position)| PolygonVertex { uv: uv(f), position, side: BorderSide::Seam }).collect()
}

/// Positions that a face makes for itself, looked up by place.
struct OwnPoints {
    points: Vec<Point>,
    /// Distance within which they are one, mm.
    near: f64,
}

impl OwnPoints {
    /// Adds a place, even where one is near already.
    fn add(&mut self, p: Point) -> Position {
        self.points.push(p);
        Position::Own(self.points.len() as u32 - 1)
    }

    /// Returns the first position of its own within `near` of `p`, or a new one at `p`.
    fn find_or_add(&mut self, p: Point) -> Position {
        // By place, not by parameters: both ends of a seam are one corner.
        match self.points.iter().position(|q| (*q - p).length() <= self.near) {
            Some(k) => Position::Own(k as u32),
            None => self.add(p),
        }
    }
}

/// Corners of a face of another solid that lies on this one, in this part's coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::tessellate) struct ImprintedPoints<'p> {
    pub(in crate::tessellate) points: &'p [Point],
    /// Distance within which two places are one, mm.
    pub(in crate::tessellate) near: f64,
}

impl ImprintedPoints<'_> {
    /// Of a face that no other lies on.
    pub(in crate::tessellate) const NONE: Self = ImprintedPoints { points: &[], near: 0.0 };

    /// Adds to `samples`, ascending parameters of the curve `at`, the nearest one to each point that lies within `near` of the curve and is
    /// not within `near` of a sample.
    fn add_samples(&self, samples: &mut Vec<f64>, at: impl Fn(f64) -> Point) {
        for &p in self.points {
            let off = |t: f64| (at(t) - p).length();
            // The best of all chords, then halving by thirds: chords turn little.
            let nearest = |w: &[f64]| {
                let (mut lo, mut hi) = (w[0], w[1]);
                for _ in 0..NEAREST_STEPS {
                    let (x, y) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                    if off(x) < off(y) { hi = y } else { lo = x }
                }
                0.5 * (lo + hi)
            };
            let all = samples.windows(2).map(nearest).map(|t| (off(t), t));
            let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((away, t)) = best
                && away <= self.near
                // A point that a sample stands for already would leave a side without length.
                && samples.iter().all(|&s| (at(s) - p).length() > self.near)
            {
                samples.insert(samples.partition_point(|&s| s < t), t);
            }
        }
    }
}

/// Steps by a third that find the nearest point of a curve: to the spacing of numbers.
const NEAREST_STEPS: usize = 90;
