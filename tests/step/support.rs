//! Areas and volumes of trimmed faces by quadrature in the parameter plane, apart from the reader and the mesher; and the promises of
//! `model`.
#![allow(dead_code, clippy::neg_cmp_op_on_partial_ord)]

use lampyris::math::{Point, Uv};
use lampyris::model::{Face, Model};

const NODES: [(f64, f64); 5] = [
    (0.046910077030668, 0.118463442528095),
    (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444),
    (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095),
];

/// Area in mm² and outward flux of position over three, mm³ (the volume for a closed shell).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Measure {
    pub(crate) area: f64,
    pub(crate) volume: f64,
}

/// Points along a loop, each use finely sampled.
pub(crate) fn polygon(uses: &[lampyris::model::EdgeUse]) -> Vec<Uv> {
    let mut points = Vec::new();
    for u in uses {
        let breaks = u.uv.breakpoints();
        let n = if u.uv.degree == 1 { 1 } else { 400usize.div_ceil(breaks.len() - 1).max(8) };
        let start = points.len();
        for w in breaks.windows(2) {
            points.extend((0..n).map(|k| u.uv.evaluate(w[0] + (w[1] - w[0]) * k as f64 / n as f64)));
        }
        points.push(u.uv.evaluate(breaks[breaks.len() - 1]));
        if u.reversed {
            points[start..].reverse();
        }
        points.pop();
    }
    points
}

fn cuts(range: [f64; 2], mut inner: Vec<f64>) -> Vec<f64> {
    inner.retain(|x| *x > range[0] && *x < range[1]);
    inner.extend(range);
    inner.sort_by(f64::total_cmp);
    inner.dedup_by(|a, b| (*a - *b).abs() < 1e-12 * (range[1] - range[0]));
    inner
}

/// Integrates over a face in its part's coordinates.
pub(crate) fn measure(face: &Face) -> Measure {
    let s = &face.surface;
    let [[u0, u1], [v0, v1]] = s.domain();
    let polygons: Vec<Vec<Uv>> = if face.loops.is_empty() {
        vec![vec![Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)]]
    } else {
        face.loops.iter().map(|l| polygon(&l.uses)).collect()
    };
    let sign = if face.reversed { -1.0 } else { 1.0 };
    if matches!(face.analytic, lampyris::model::Analytic::Plane { .. }) {
        // The outline alone: rows would miss what small round holes cut away.
        let outline = |p: &Vec<Uv>| (1..p.len() - 1).map(|i| (p[i] - p[0]).perp_dot(p[i + 1] - p[0])).sum::<f64>();
        let d = s.derivatives(Uv::new(u0, v0));
        let n = d.du.cross(d.dv);
        let inside = 0.5 * polygons.iter().map(outline).sum::<f64>();
        return Measure { area: inside.abs() * n.length(), volume: sign * inside.abs() * d.point.dot(n) / 3.0 };
    }
    let knots_u: Vec<f64> = s.knots[0].clone();
    let mut rows = s.knots[1].clone();
    for l in &face.loops {
        rows.extend(l.uses.iter().map(|u| u.start().y));
    }
    let extent = v1 - v0;
    rows.extend((1..16).map(|k| v0 + extent * f64::from(k) / 16.0));
    let rows = cuts([v0, v1], rows);
    let mut m = Measure::default();
    for pair in rows.windows(2) {
        for (x, w) in NODES {
            let v = pair[0] + (pair[1] - pair[0]) * x;
            let weight_v = w * (pair[1] - pair[0]);
            let mut hits: Vec<f64> = Vec::new();
            for p in &polygons {
                let n = p.len();
                for i in 0..n {
                    let (a, b) = (p[i], p[(i + 1) % n]);
                    if (a.y > v) != (b.y > v) {
                        hits.push(a.x + (v - a.y) / (b.y - a.y) * (b.x - a.x));
                    }
                }
            }
            hits.sort_by(f64::total_cmp);
            for span in hits.chunks_exact(2) {
                if !(span[1] - span[0] > 1e-14 * (u1 - u0)) {
                    continue;
                }
                let mut inner = knots_u.clone();
                inner.extend((1..4).map(|k| span[0] + (span[1] - span[0]) * f64::from(k) / 4.0));
                for piece in cuts([span[0], span[1]], inner).windows(2) {
                    for (y, q) in NODES {
                        let u = piece[0] + (piece[1] - piece[0]) * y;
                        let weight = weight_v * q * (piece[1] - piece[0]);
                        let d = s.derivatives(Uv::new(u, v));
                        let n = d.du.cross(d.dv);
                        m.area += weight * n.length();
                        m.volume += weight * sign * d.point.dot(n) / 3.0;
                    }
                }
            }
        }
    }
    m
}

/// Sum over all placed faces; volumes refer to the parts' own origins.
pub(crate) fn measure_model(model: &Model) -> Measure {
    let mut total = Measure::default();
    for placed in model.placed_faces() {
        let scale = placed.placement.scale;
        if let Some(face) = placed.face {
            let m = measure(face);
            total.area += m.area * scale * scale;
            total.volume += m.volume * scale.powi(3);
        } else if let Some(ready) = placed.tessellated {
            total.area += ready.mesh.area() * scale * scale;
        }
    }
    total
}

/// Violations of what [`lampyris::model`] promises about a face.
pub(crate) fn violations(part: &lampyris::model::Part, face: &Face) -> Vec<String> {
    let mut out = Vec::new();
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let slack = [1e-9 * (u1 - u0), 1e-9 * (v1 - v0)];
    let mut area = 0.0;
    let largest = 2e-6 + 2.0 * face.gap;
    for (l, trim) in face.loops.iter().enumerate() {
        let n = trim.uses.len();
        for i in 0..n {
            let (a, b) = (trim.uses[i].end(), trim.uses[(i + 1) % n].start());
            if (a - b).length() > 1e-12 * (1.0 + a.length()) {
                out.push(format!("loop {l} is open by {:e} behind use {i}", (a - b).length()));
            }
        }
        for u in &trim.uses {
            let [t0, t1] = u.uv.domain();
            for k in 0..=20 {
                let t = t0 + (t1 - t0) * f64::from(k) / 20.0;
                let uv = u.uv.evaluate(t);
                let over = (u0 - uv.x).max(uv.x - u1) / slack[0];
                let over = over.max((v0 - uv.y).max(uv.y - v1) / slack[1]);
                if over > 1e4 {
                    out.push(format!("loop {l} leaves the domain at {uv} of {:?}", face.surface.domain()));
                    break;
                }
                if let Some(edge) = u.edge {
                    let e = &part.edges[edge.0 as usize];
                    let miss: Point = face.surface.evaluate(uv) - e.curve.evaluate(t);
                    if miss.length() > largest {
                        out.push(format!("#{:?} misses by {:e}, gap {:e}", e.entity, miss.length(), face.gap));
                        break;
                    }
                }
            }
            if let Some(edge) = u.edge {
                let d = part.edges[edge.0 as usize].curve.domain();
                if d != u.uv.domain() {
                    out.push(format!("uv curve over {:?}, edge over {d:?}", u.uv.domain()));
                }
            }
        }
        let p = polygon(&trim.uses);
        area += (0..p.len()).map(|i| p[i].perp_dot(p[(i + 1) % p.len()])).sum::<f64>();
    }
    if !face.loops.is_empty() && !(area > 0.0) {
        out.push("material lies on the right of the loops".into());
    }
    out
}
