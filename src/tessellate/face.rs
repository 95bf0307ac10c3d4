//! One face from its border and its surface to facets.

use super::Settings;
use super::border::edges::Division;
use super::border::rings::{self, Follows, Rings};
use super::border::trim::Trim;
use super::cells::grid::{self, Ground};
use super::cells::tree::{self, Leaves};
use super::proof::bound::Prover;
use super::proof::near::Near;
use super::repairs::Repair;
use super::sheet::Sheet;
use super::strip::delaunay::{self, Node, Outline, key};
use super::strip::{crease, pair};
use crate::math::{Point, Uv, Vector};
use crate::model::{EdgeId, EdgeUse, Face, Part, TrimLoop};
use rayon::prelude::*;
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
    /// Edges that should have shorter chords: they cross others in the parameter plane, or a facet beside them is not proved.
    pub(super) coarse: Vec<EdgeId>,
    /// Shared positions that are one: vertices of the file in one place, where loops touch.
    pub(super) same: Vec<[u32; 2]>,
    /// What was given up.
    pub(super) repaired: Option<Repair>,
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
    let leaves = tree::split(sheet, settings.judge, &rings, settings.budget, angle);
    let mut prover = Prover::new(sheet, settings.judge);
    let mut border = border(part, &loops, sheet, &rings, shared);
    let fixed: FxHashMap<[u32; 2], ()> = border.segments.iter().map(|s| (key(s[0], s[1]), ())).collect();
    let known = shared.len() + rings.own.len();
    let (lo, hi) = rings.bounds();
    let mut ground =
        Ground { nodes: &mut border.nodes, trims: &border.trims, same: tree::same(lo, hi), next: known as u32 };
    let grid = grid::build(sheet, &mut prover, &leaves, &mut ground);
    let next = ground.next;
    border.divide_poles(&leaves);
    // Where cells reach the border, both are done.
    let mut segments: Vec<[u32; 2]> = Vec::new();
    let mut met: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let all = border.segments.iter().chain(&grid.outline);
    all.clone().for_each(|s| *met.entry(key(s[0], s[1])).or_insert(0) += 1);
    segments.extend(all.filter(|s| met[&key(s[0], s[1])] % 2 == 1));
    let trims = border.trims;
    let scale = if segments.is_empty() { Uv::ONE } else { scale(sheet, &rings, &leaves) };
    let creases = crease::lines(sheet, &border.nodes, &segments);
    let outline = Outline { nodes: border.nodes, segments, creases, trims: &trims, scale, next };
    let mut strip = delaunay::triangulate(sheet, settings.judge, outline, settings.budget)?;
    for &(t, bound, tolerance) in &grid.triangles {
        strip.triangles.push(t);
        strip.bounds.push(bound);
        strip.tolerances.push(tolerance);
    }
    let mut own = rings.own;
    own.extend(strip.nodes.iter().filter(|n| n.position as usize >= known).map(|n| n.place));
    let repaired = match (strip.conflicts.is_empty(), leaves.exhausted) {
        (false, _) => Some(Repair::CrossingBorder),
        (true, true) => Some(Repair::CoarserCells),
        (true, false) => None,
    };
    let mut out = FaceMesh { own, same: border.same, repaired, ..FaceMesh::default() };
    // Where the budget has ended, shorter chords only cost more.
    let unproved = if leaves.exhausted { Vec::new() } else { strip.unproved_chords(&trims, &border.followed) };
    let coarse = strip.conflicts.iter().chain(&strip.crossed).chain(&unproved);
    out.coarse = coarse.filter_map(|s| border.followed.get(&key(s[0], s[1])).copied()).collect();
    let mut emit = Emit { sheet, nodes: &strip.nodes, ids: FxHashMap::default(), out };
    for &(nodes, bound, tolerance) in &grid.quads {
        emit.facet(nodes, None, bound, tolerance);
    }
    for f in pair::join(&strip, &fixed, &mut prover) {
        emit.facet(f.nodes, f.pole, f.bound, f.tolerance);
    }
    (!emit.out.facets.is_empty()).then_some(emit.out)
}

/// The rings as nodes and segments.
struct Border {
    nodes: Vec<Node>,
    segments: Vec<[u32; 2]>,
    trims: FxHashMap<[u32; 2], Trim>,
    /// The edge that a segment follows.
    followed: FxHashMap<[u32; 2], EdgeId>,
    /// Segments that are one point in space.
    poles: Vec<[u32; 2]>,
    /// Positions of vertices that the file has twice, where loops touch.
    same: Vec<[u32; 2]>,
}

fn border(part: &Part, loops: &[TrimLoop], sheet: &Sheet<'_>, rings: &Rings, shared: &[Point]) -> Border {
    let place = |position: u32| {
        let p = position as usize;
        shared.get(p).or_else(|| rings.own.get(p - shared.len())).copied().unwrap_or(Point::ZERO)
    };
    let mut out = Border {
        nodes: Vec::new(),
        segments: Vec::new(),
        trims: FxHashMap::default(),
        followed: FxHashMap::default(),
        poles: Vec::new(),
        same: Vec::new(),
    };
    let (lo, hi) = rings.bounds();
    let near = 1e-9 * (hi - lo);
    let mut vertices: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    let sides: Vec<_> = loops.iter().flat_map(|l| &l.uses).collect();
    let mut followed: Vec<([u32; 2], &EdgeUse, EdgeId, [f64; 2])> = Vec::new();
    for ring in &rings.rings {
        // Loops that touch in a vertex have one corner there, or what follows its chords would be known of one of them alone.
        let ids: Vec<u32> = ring
            .iter()
            .map(|v| {
                let (id, at) = (out.nodes.len() as u32, place(v.position));
                if (v.position as usize) < part.vertices.len() {
                    let first = *vertices.entry(at.to_array().map(f64::to_bits)).or_insert(id);
                    let met = out.nodes.get(first as usize);
                    if let Some(met) = met.filter(|m| (m.uv - v.uv).abs().cmple(near).all()) {
                        if met.position != v.position {
                            out.same.push([met.position, v.position]);
                        }
                        return first;
                    }
                }
                out.nodes.push(Node { uv: v.uv, place: at, position: v.position });
                id
            })
            .collect();
        for (k, v) in ring.iter().enumerate() {
            let (a, b) = (ids[k], ids[(k + 1) % ids.len()]);
            if a == b {
                continue;
            }
            match v.follows {
                Follows::Pole => out.poles.push([a, b]),
                Follows::Seam => out.segments.push([a, b]),
                Follows::Edge { side, t } => {
                    out.segments.push([a, b]);
                    let u = sides[side as usize];
                    if let Some(edge) = u.edge {
                        followed.push(([a, b], u, edge, t));
                    }
                }
            }
        }
    }
    // A face with a long border would hold up the others.
    let trim = |near: &mut Near, &([a, b], u, edge, t): &([u32; 2], &EdgeUse, EdgeId, [f64; 2])| {
        let (x, y) = (out.nodes[a as usize], out.nodes[b as usize]);
        let curve = &part.edges[edge.0 as usize].curve;
        let (uv, xyz) = ([x.uv, y.uv], [x.place, y.place]);
        let mut trim = Trim::new(sheet, curve, u, t, uv, xyz);
        trim.prove(sheet, near, uv, xyz);
        trim
    };
    let trims: Vec<Trim> = followed.par_iter().with_min_len(32).map_init(Near::default, trim).collect();
    out.trims.extend(followed.iter().map(|f| key(f.0[0], f.0[1])).zip(trims));
    out.followed.extend(followed.iter().map(|f| (key(f.0[0], f.0[1]), f.2)));
    out
}

impl Border {
    /// Divides poles where the cells beside them are.
    fn divide_poles(&mut self, leaves: &Leaves) {
        for [from, to] in std::mem::take(&mut self.poles) {
            let (a, b) = (self.nodes[from as usize].uv, self.nodes[to as usize].uv);
            let d = if (b - a).x.abs() > (b - a).y.abs() { 0 } else { 1 };
            let (lo, hi) = (a[d].min(b[d]), a[d].max(b[d]));
            let touching = leaves.border.iter().filter(|c| {
                let slack = 1e-6 * (c.hi[1 - d] - c.lo[1 - d]);
                c.lo[1 - d] - slack <= a[1 - d] && a[1 - d] <= c.hi[1 - d] + slack
            });
            let mut at: Vec<f64> =
                touching.flat_map(|c| [c.lo[d], c.hi[d]]).filter(|&x| x > lo && x < hi).collect();
            at.sort_by(f64::total_cmp);
            at.dedup_by(|y, x| *y - *x < 1e-9 * (hi - lo));
            if a[d] > b[d] {
                at.reverse();
            }
            let mut last = from;
            for x in at {
                let mut uv = a.lerp(b, (x - a[d]) / (b[d] - a[d]));
                uv[d] = x;
                let id = self.nodes.len() as u32;
                self.nodes.push(Node { uv, ..self.nodes[from as usize] });
                self.segments.push([last, id]);
                last = id;
            }
            self.segments.push([last, to]);
        }
    }
}

struct Emit<'e, 's, 'a> {
    sheet: &'s Sheet<'a>,
    nodes: &'e [Node],
    /// Corners by node and the side of a crease on which their facet lies.
    ids: FxHashMap<(u32, u8), u32>,
    out: FaceMesh,
}

impl Emit<'_, '_, '_> {
    fn facet(&mut self, nodes: [u32; 4], pole: Option<(usize, Uv)>, bound: f64, tolerance: f64) {
        let creased = self.sheet.is_creased();
        let all = nodes.map(|n| self.nodes[n as usize].uv);
        let inside = 0.25 * (all[0] + all[1] + all[2] + all[3]);
        let corner = [0, 1, 2, 3].map(|k| {
            if k == 3 && nodes[3] == nodes[2] {
                return u32::MAX;
            }
            match pole {
                Some((at, uv)) if k == at => self.corner(nodes[at], uv, inside),
                _ => {
                    let uv = all[k];
                    let name = (nodes[k], if creased { side(self.sheet.on_creases(uv), inside) } else { 0 });
                    match self.ids.get(&name) {
                        Some(&id) => id,
                        None => {
                            let id = self.corner(nodes[k], uv, inside);
                            self.ids.insert(name, id);
                            id
                        }
                    }
                }
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

    fn corner(&mut self, node: u32, uv: Uv, inside: Uv) -> u32 {
        let normal = self.sheet.normal_towards(uv, inside).unwrap_or(Vector::ZERO);
        self.out.corners.push((self.nodes[node as usize].position, normal, uv));
        (self.out.corners.len() - 1) as u32
    }
}

/// The side of each crease on which `inside` lies.
fn side(on: [Option<f64>; 2], inside: Uv) -> u8 {
    let of = |d: usize| on[d].map_or(0, |crease| if inside[d] < crease { 1 } else { 2 });
    of(0) + 3 * of(1)
}

/// Scale of the parameters in which triangles should look square: lengths in chords where the face bends, so that
/// the strip's triangles lie along the direction that does not bend.
fn scale(sheet: &Sheet<'_>, rings: &Rings, leaves: &Leaves) -> Uv {
    let (lo, hi) = rings.bounds();
    let n = if sheet.affine { 1 } else { 5 };
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
        let d = sheet.second_derivatives(uv);
        let Some(forms) = crate::nurbs::FundamentalForms::new(&d) else { continue };
        sum[0] += weigh(forms.along(Uv::X), d.du.length());
        sum[1] += weigh(forms.along(Uv::Y), d.dv.length());
        count += 1.0;
    }
    let s = Uv::new(sum[0] / count, sum[1] / count);
    if s.is_finite() && s.min_element() > 0.0 { s / s.max_element() } else { Uv::ONE }
}
