//! One face from its border and its surface to facets.

use super::bound::Prover;
use super::cells::{self, Leaves};
use super::edges::Division;
use super::pair;
use super::rings::{self, Follows, Rings};
use super::sheet::Sheet;
use super::strip::{self, Node, Outline, key};
use super::trim::Trim;
use super::{Settings, grid};
use crate::math::{Point, Uv, Vector};
use crate::model::{EdgeId, Face, Part};
use rustc_hash::FxHashMap;

/// The facets of a face in its part's coordinates.
#[derive(Default)]
pub(super) struct FaceMesh {
    /// Position (shared below the number of shared ones, else own), outward normal and parameters of each corner.
    pub(super) corners: Vec<(u32, Vector, Uv)>,
    pub(super) own: Vec<Point>,
    /// Counter-clockwise seen from outside.
    pub(super) facets: Vec<[u32; 4]>,
    pub(super) bounds: Vec<f64>,
    pub(super) tolerances: Vec<f64>,
    /// Edges whose chords cross others in the parameter plane.
    pub(super) crossing: Vec<EdgeId>,
    /// Whether something was given up: crossing borders, an exhausted budget.
    pub(super) repaired: bool,
}

/// Meshes a face; `None` when nothing can be made of it.
pub(super) fn mesh(
    part: &Part,
    face: &Face,
    sheet: &Sheet<'_>,
    divisions: &[Division],
    shared: &[Point],
    settings: &Settings,
) -> Option<FaceMesh> {
    let loops = rings::loops(face);
    let rings = rings::build(part, &loops, sheet, divisions, shared);
    if rings.rings.iter().all(|r| r.len() < 3) {
        return None;
    }
    let angle = settings.angle_deg.map(f64::to_radians);
    let leaves = cells::split(sheet, settings.judge, &rings, settings.budget, angle);
    let mut prover = Prover::new(sheet, settings.judge);
    let grid = grid::build(sheet, &mut prover, &leaves);
    let place = |position: u32, own: &[Point]| {
        let p = position as usize;
        shared.get(p).or_else(|| own.get(p - shared.len())).copied().unwrap_or(Point::ZERO)
    };
    let mut own = rings.own.clone();
    let mut nodes: Vec<Node> = Vec::with_capacity(grid.nodes.len());
    for &(uv, p) in &grid.nodes {
        nodes.push(Node { uv, place: p, position: (shared.len() + own.len()) as u32 });
        own.push(p);
    }
    let mut segments = grid.outline.clone();
    let mut trims: FxHashMap<[u32; 2], Trim> = FxHashMap::default();
    let sides: Vec<_> = loops.iter().flat_map(|l| &l.uses).collect();
    let mut followed: FxHashMap<[u32; 2], EdgeId> = FxHashMap::default();
    for ring in &rings.rings {
        let first = nodes.len() as u32;
        let (points, follows) = with_poles(ring, &leaves);
        let n = points.len() as u32;
        for &(uv, position) in &points {
            nodes.push(Node { uv, place: place(position, &own), position });
        }
        for (k, follow) in (0..n).zip(follows) {
            let (a, b) = (first + k, first + (k + 1) % n);
            segments.push([a, b]);
            if let Follows::Edge { side, t } = follow {
                let u = sides[side as usize];
                let (x, y) = (nodes[a as usize], nodes[b as usize]);
                if let Some(edge) = u.edge {
                    let curve = &part.edges[edge.0 as usize].curve;
                    trims.insert(key(a, b), Trim::new(sheet, curve, u, t, [x.uv, y.uv], [x.place, y.place]));
                    followed.insert(key(a, b), edge);
                }
            }
        }
    }
    let fixed: FxHashMap<[u32; 2], ()> = segments.iter().map(|s| (key(s[0], s[1]), ())).collect();
    let outline = Outline {
        nodes,
        segments,
        trims,
        scale: scale(sheet, &rings, &leaves),
        next: (shared.len() + own.len()) as u32,
    };
    let strip = strip::triangulate(sheet, settings.judge, outline, settings.budget)?;
    let known = shared.len() + own.len();
    own.extend(strip.nodes.iter().filter(|n| n.position as usize >= known).map(|n| n.place));
    let mut out =
        FaceMesh { own, repaired: leaves.exhausted || !strip.conflicts.is_empty(), ..FaceMesh::default() };
    out.crossing = strip.conflicts.iter().filter_map(|s| followed.get(&key(s[0], s[1])).copied()).collect();
    let mut emit = Emit { sheet, nodes: &strip.nodes, ids: FxHashMap::default(), out };
    for f in &grid.facets {
        emit.facet(f.nodes, None, f.bound, f.tolerance);
    }
    for f in pair::join(&strip, &fixed, &mut prover) {
        emit.facet(f.nodes, f.pole, f.bound, f.tolerance);
    }
    (!emit.out.facets.is_empty()).then_some(emit.out)
}

struct Emit<'e, 's, 'a> {
    sheet: &'s Sheet<'a>,
    nodes: &'e [Node],
    ids: FxHashMap<u32, u32>,
    out: FaceMesh,
}

impl Emit<'_, '_, '_> {
    fn facet(&mut self, nodes: [u32; 4], pole: Option<Uv>, bound: f64, tolerance: f64) {
        let corner = [0, 1, 2, 3].map(|k| {
            if k == 3 && nodes[3] == nodes[2] {
                return u32::MAX;
            }
            match pole {
                Some(uv) if k == 2 => self.corner(nodes[2], uv),
                _ => match self.ids.get(&nodes[k]) {
                    Some(&id) => id,
                    None => {
                        let id = self.corner(nodes[k], self.nodes[nodes[k] as usize].uv);
                        self.ids.insert(nodes[k], id);
                        id
                    }
                },
            }
        });
        let [a, b, c, d] =
            if corner[3] == u32::MAX { [corner[0], corner[1], corner[2], corner[2]] } else { corner };
        let turned =
            if self.sheet.flipped() { if c == d { [a, c, b, b] } else { [a, d, c, b] } } else { [a, b, c, d] };
        self.mend_normals(turned);
        self.out.facets.push(turned);
        self.out.bounds.push(bound);
        self.out.tolerances.push(tolerance);
    }

    /// Where the surface has no normal, a corner takes that of its first facet.
    fn mend_normals(&mut self, [a, b, c, d]: [u32; 4]) {
        let bare = |n: u32, out: &FaceMesh| out.corners[n as usize].1 == Vector::ZERO;
        if ![a, b, c, d].iter().any(|&n| bare(n, &self.out)) {
            return;
        }
        let place = |uv: Uv| self.sheet.point(uv);
        let p = [a, b, c, d].map(|n| place(self.out.corners[n as usize].2));
        let n = (p[1] - p[0]).cross(p[2] - p[0]) + (p[2] - p[0]).cross(p[3] - p[0]);
        let n = n.try_normalize().unwrap_or(Vector::Z);
        for k in [a, b, c, d] {
            if bare(k, &self.out) {
                self.out.corners[k as usize].1 = n;
            }
        }
    }

    fn corner(&mut self, node: u32, uv: Uv) -> u32 {
        let normal = self.sheet.normal(uv).unwrap_or(Vector::ZERO);
        self.out.corners.push((self.nodes[node as usize].position, normal, uv));
        (self.out.corners.len() - 1) as u32
    }
}

/// Vertices of a ring, with poles divided where the cells beside them are.
fn with_poles(ring: &[rings::RingVertex], leaves: &Leaves) -> (Vec<(Uv, u32)>, Vec<Follows>) {
    let (mut points, mut follows) = (Vec::new(), Vec::new());
    for (i, v) in ring.iter().enumerate() {
        points.push((v.uv, v.position));
        follows.push(v.follows);
        if v.follows != Follows::Pole {
            continue;
        }
        let (a, b) = (v.uv, ring[(i + 1) % ring.len()].uv);
        let d = if (b - a).x.abs() > (b - a).y.abs() { 0 } else { 1 };
        let (lo, hi) = (a[d].min(b[d]), a[d].max(b[d]));
        let touching = leaves.border.iter().filter(|c| {
            let slack = 1e-6 * (c.hi[1 - d] - c.lo[1 - d]);
            c.lo[1 - d] - slack <= a[1 - d] && a[1 - d] <= c.hi[1 - d] + slack
        });
        let mut at: Vec<f64> = touching.flat_map(|c| [c.lo[d], c.hi[d]]).filter(|&x| x > lo && x < hi).collect();
        at.sort_by(f64::total_cmp);
        at.dedup_by(|y, x| *y - *x < 1e-9 * (hi - lo));
        if a[d] > b[d] {
            at.reverse();
        }
        for x in at {
            let f = (x - a[d]) / (b[d] - a[d]);
            let mut uv = a.lerp(b, f);
            uv[d] = x;
            points.push((uv, v.position));
            follows.push(Follows::Pole);
        }
    }
    (points, follows)
}

/// Scale of the parameters in which triangles should look square: lengths in chords where the face bends, so that
/// the strip's triangles lie along the direction that does not bend.
fn scale(sheet: &Sheet<'_>, rings: &Rings, leaves: &Leaves) -> Uv {
    let points = rings.rings.iter().flatten().map(|v| v.uv);
    let (lo, hi) = points.fold((Uv::INFINITY, Uv::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let n = 5;
    let grid = |k: usize| lo + (Uv::new((k / n) as f64, (k % n) as f64) + 0.5) / n as f64 * (hi - lo);
    // Cells at the border are where the strip will be.
    let step = leaves.border.len() / 64 + 1;
    let mut at: Vec<Uv> = leaves.border.iter().step_by(step).map(|c| c.center()).collect();
    if at.len() < 4 {
        at.extend((0..n * n).map(grid));
    }
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    let diagonal = sheet.size.max(1e-300);
    // Below this curvature the whole face is one chord.
    let floor = 8.0 * sheet.field.loosest() / (diagonal * diagonal);
    let weigh = |k: f64, speed: f64| k.abs().max(floor).sqrt() * speed;
    for uv in at {
        let d = sheet.surface.second_derivatives(uv);
        let Some(forms) = crate::nurbs::FundamentalForms::new(&d) else { continue };
        sum[0] += weigh(forms.along(Uv::X), d.du.length());
        sum[1] += weigh(forms.along(Uv::Y), d.dv.length());
        count += 1.0;
    }
    let s = Uv::new(sum[0] / count, sum[1] / count);
    if s.is_finite() && s.min_element() > 0.0 { s / s.max_element() } else { Uv::ONE }
}
