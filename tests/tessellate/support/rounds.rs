//! Random trimmed cylinders, cones, spheres and tori: parts between cuts around the axis, poles and seams included, with a hole and its
//! lid.

use super::shells::fine;
use lampyris::math::{Frame, Point, Uv, Vector};
use lampyris::model::{Analytic, Edge, EdgeId, EdgeUse, Face, Model, Part, Shell, TrimLoop, VertexId};
use lampyris::nurbs::{Curve, Surface, UvCurve, sweep};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

/// What to make.
#[derive(Clone, Debug)]
pub(crate) struct Round {
    kind: usize,
    /// Radius; the second one of a torus, the slope of a cone, the height of a cylinder, in shares of it.
    radius: f64,
    share: f64,
    place: Frame,
    /// Heights of the two cuts in the parameter along the axis, in shares, and their waves; whole circles without waves.
    cuts: [[f64; 3]; 2],
    hole: Option<[f64; 5]>,
    reversed: bool,
    analytic: bool,
}

pub(crate) fn rounds() -> impl Strategy<Value = Round> {
    let axis = (-1f64..1.0, -1f64..1.0, -1f64..1.0, 0f64..1.0).prop_map(|(x, y, z, off)| {
        let axis = Vector::new(x, y, z + 1.5).normalize();
        let off = if off < 0.5 { 0.0 } else { 1000f64.powf(2.0 * off - 1.0) };
        Frame::from_axis(Point::new(off, -0.7 * off, 0.3 * off), axis, None)
    });
    let wave = || prop_oneof![Just([0f64, 1.0]), (0f64..0.08, 1f64..7.0).prop_map(|(a, n)| [a, n.floor()])];
    let cut = move |low: f64, high: f64| (low..high, wave()).prop_map(|(x, [a, n])| [x, a, n]);
    let hole = (0.25f64..0.75, 0.47f64..0.53, -2.5f64..-1.1, 0f64..0.4, 1f64..6.0);
    let hole = hole.prop_map(|(x, y, r, wave, times)| [x, y, 10f64.powf(r), wave, times.floor()]);
    let size = (-4.5f64..4.5).prop_map(|e| 10f64.powf(e));
    let cuts = (cut(0.1, 0.35), cut(0.65, 0.9)).prop_map(|(a, b)| [a, b]);
    let flags = (any::<bool>(), any::<bool>());
    (0usize..4, size, -2f64..0.0, axis, cuts, proptest::option::of(hole), flags).prop_map(
        |(kind, radius, share, axis, cuts, hole, (reversed, analytic))| {
            let place = Frame { origin: axis.origin * radius, ..axis };
            Round { kind, radius, share: 10f64.powf(share), place, cuts, hole, reversed, analytic }
        },
    )
}

impl Round {
    /// The surface; of cones and spheres with poles where the parameter along the axis ends.
    fn surface(&self) -> (Surface, Analytic, [bool; 2]) {
        let (r, x, frame, turn) = (self.radius, self.share, self.place, [0.0, TAU]);
        match self.kind {
            0 => {
                let h = 10.0 * r * x;
                (sweep::cylinder(&frame, r, turn, [0.0, h]), Analytic::Cylinder { frame, radius: r }, [false; 2])
            }
            1 => {
                let half_angle = 1.5 * x;
                let cone = sweep::cone(&frame, r, half_angle, turn, [-r / half_angle.tan(), 0.5 * r]);
                (cone, Analytic::Cone { frame, radius: r, half_angle }, [true, false])
            }
            2 => {
                let ball = sweep::sphere(&frame, r, turn, [-PI / 2.0, PI / 2.0]);
                (ball, Analytic::Sphere { frame, radius: r }, [true; 2])
            }
            _ => {
                let minor = 0.9 * r * x;
                let ring = sweep::torus(&frame, r, minor, turn, [0.0, TAU]);
                (ring, Analytic::Torus { frame, major: r, minor }, [false; 2])
            }
        }
    }

    /// A part of it whose border is open but for lid and pole, and how far trims stray from their edges.
    pub(crate) fn model(&self, gap: f64) -> (Model, f64) {
        let (surface, analytic, poles) = self.surface();
        let [[u0, u1], [v0, v1]] = surface.domain();
        let place = |x: f64, y: f64| Uv::new(u0 + (u1 - u0) * x, v0 + (v1 - v0) * y);
        let (mut part, mut strays) = (Part::default(), 0f64);
        let edge = |part: &mut Part, curve: Curve, vertices: [u32; 2]| {
            part.edges.push(Edge { curve, vertices: vertices.map(VertexId), entity: None });
            EdgeId(part.edges.len() as u32 - 1)
        };
        let mut traced = |part: &mut Part, at: &dyn Fn(f64) -> Uv| {
            let (t, uv, off) = fine(&surface, at, gap);
            strays = strays.max(off);
            let mut points: Vec<Point> = uv.iter().map(|&x| surface.evaluate(x)).collect();
            // Both ends are one place; at the seam they differ by a last bit.
            *points.last_mut().unwrap() = points[0];
            part.vertices.push(points[0]);
            let vertex = part.vertices.len() as u32 - 1;
            (edge(part, Curve::polyline(&t, &points), [vertex; 2]), UvCurve::polyline(&t, &uv), vertex)
        };
        let used = |edge, reversed, uv: &UvCurve| EdgeUse { edge, reversed, uv: uv.clone() };
        // The two ends: a pole is no edge, a cut is one.
        let mut ends = Vec::new();
        for k in 0..2 {
            let [y, wave, times] = self.cuts[k];
            if poles[k] && times as u32 % 2 == 1 {
                let y = k as f64;
                part.vertices.push(surface.evaluate(place(0.0, y)));
                let uv = UvCurve::line(place(0.0, y), place(1.0, y), [0.0, 1.0]);
                ends.push((None, uv, part.vertices.len() as u32 - 1, y));
                continue;
            }
            let (e, uv, vertex) = if wave == 0.0 {
                let v = place(0.0, y).y;
                part.vertices.push(surface.evaluate(Uv::new(u0, v)));
                let vertex = part.vertices.len() as u32 - 1;
                part.edges.push(Edge {
                    curve: surface.isoline(1, v),
                    vertices: [VertexId(vertex); 2],
                    entity: None,
                });
                let uv = UvCurve::line(Uv::new(u0, v), Uv::new(u1, v), [u0, u1]);
                (EdgeId(part.edges.len() as u32 - 1), uv, vertex)
            } else {
                traced(&mut part, &|t| place(t, y + wave * (TAU * times * t).sin()))
            };
            ends.push((Some(e), uv, vertex, y));
        }
        let [low, high] = [0, 1].map(|k| place(0.0, ends[k].3).y);
        part.edges.push(Edge {
            curve: surface.isoline(0, u0).restricted(low, high),
            vertices: [VertexId(ends[0].2), VertexId(ends[1].2)],
            entity: None,
        });
        let seam = Some(EdgeId(part.edges.len() as u32 - 1));
        let [left, right] = [u0, u1].map(|u| UvCurve::line(Uv::new(u, low), Uv::new(u, high), [low, high]));
        let rim = vec![
            used(ends[0].0, false, &ends[0].1),
            used(seam, false, &right),
            used(ends[1].0, true, &ends[1].1),
            used(seam, true, &left),
        ];
        let (mut loops, mut lids) = (vec![TrimLoop { uses: rim }], Vec::new());
        if let Some([x, y, r, wave, times]) = self.hole {
            let ring = |t: f64| {
                let angle = TAU * (if t == 1.0 { 0.0 } else { t });
                let r = r * (1.0 + wave * (times * angle).cos());
                place(x + r * angle.cos(), y + r * angle.sin())
            };
            let (e, uv, _) = traced(&mut part, &ring);
            loops.push(TrimLoop { uses: vec![used(Some(e), true, &uv)] });
            lids.push(vec![TrimLoop { uses: vec![used(Some(e), false, &uv)] }]);
        }
        lids.push(loops);
        let faces = lids.into_iter().map(|loops| Face {
            loops,
            reversed: self.reversed,
            analytic: if self.analytic { analytic } else { Analytic::Other },
            ..Face::whole(surface.clone())
        });
        part.shells = vec![Shell { faces: faces.collect(), ..Shell::default() }];
        (Model::from_part(part), strays)
    }

    /// Its size, mm.
    pub(crate) fn size(&self) -> f64 {
        self.radius
    }
}
