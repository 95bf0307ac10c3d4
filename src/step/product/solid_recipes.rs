//! Solids that a file gives as a recipe: CSG primitives, and areas or faces swept along a line or around an axis. Their faces are exact.
//!
//! Source: ISO 10303-42, 4.5 (solid models). A profile lies in a plane; a sweep turns its loops so that the material is on their left
//! seen from where it goes, so that every side face looks outward by `tangent × sweep`. Known weakness: the file's sense of loops in
//! a profile is believed by area only (the largest loop is the outer one), and booleans of CSG are refused.

use super::topology::{EdgeKey, read_face};
use crate::math::{Frame, Point, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, conic};
use crate::step::chart::{Chart, Kind};
use crate::step::geometry::curves::map_points;
use crate::step::geometry::edges::EdgeContext;
use crate::step::geometry::{GeometryReader, Outcome, Refusal, references};
use crate::step::part21::{Args, Entity};
use std::f64::consts::TAU;

/// Points of a profile nearer to the axis than this stay where they are when it is turned, mm.
const ON_AXIS_MM: f64 = 1e-9;
/// A turn this near to a whole one is whole, rad: angles are written with nine digits and more.
const WHOLE_TURN_SLACK: f64 = 1e-6;
/// Cosine of sweep and normal below which a profile is swept within its own plane.
const FLAT_SWEEP: f64 = 1e-9;

/// A solid as edges and faces, before its faces are trimmed.
#[derive(Default)]
pub(super) struct SolidRecipe {
    pub(super) edges: Vec<Curve>,
    pub(super) faces: Vec<RecipeFace>,
}

/// A face of a recipe: loops run with the material on their left about the outward normal.
pub(super) struct RecipeFace {
    pub(super) chart: Chart,
    pub(super) same_sense: bool,
    /// For each loop the edges, by index, and whether they are run backwards; no loop means the whole closed surface.
    pub(super) loops: Vec<Vec<(usize, bool)>>,
}

/// Closed loops of curves in a plane, mm, and its normal, of unit length.
struct Profile {
    normal: Vector,
    loops: Vec<Vec<Curve>>,
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads the solid of a recipe, mm; booleans, other recipes and sizes that are not positive are refused.
    pub(super) fn solid_recipe(&self, e: Entity<'f, 'a>) -> Outcome<SolidRecipe> {
        if let Some(a) = e.attributes("CSG_SOLID", 1) {
            let root = self.resolve(e, a.id(0), "tree root")?;
            // A tree is a primitive or a boolean: no root is another CSG solid.
            return if root.is_a("CSG_SOLID") { Err(unsupported(root)) } else { self.solid_recipe(root) };
        }
        let moved = e.attributes("EXTRUDED_AREA_SOLID", 1).or_else(|| e.attributes("EXTRUDED_FACE_SOLID", 1));
        if let Some(a) = moved {
            let direction = self.direction(a.id(1)).and_then(|d| d.try_normalize());
            let depth = self.length(a, 2).filter(|d| *d > 0.0);
            let (Some(direction), Some(depth)) = (direction, depth) else {
                return Err(Refusal::new(e, "its direction or depth is missing"));
            };
            let profile = self.profile(e, a.id(0))?;
            return extrude(profile, direction * depth)
                .ok_or_else(|| Refusal::new(e, "its profile is swept within its own plane"));
        }
        let turned = e.attributes("REVOLVED_AREA_SOLID", 1).or_else(|| e.attributes("REVOLVED_FACE_SOLID", 1));
        if let Some(a) = turned {
            let axis = self.resolve(e, a.id(1), "axis")?;
            let angle = a.real(2).map(|x| x * self.units.angle).filter(|x| *x > 0.0);
            let angle = angle.ok_or_else(|| Refusal::new(e, "its angle is not positive"))?;
            let profile = self.profile(e, a.id(0))?;
            return revolve(profile, &self.placement(axis.id)?, angle.min(TAU))
                .ok_or_else(|| Refusal::new(e, "its profile is turned within its own plane"));
        }
        self.primitive(e)
    }

    /// Returns the `k`-th attribute as a length, mm; `None` if it is no finite number.
    fn length(&self, a: Args<'f, 'a>, k: usize) -> Option<f64> {
        a.real(k).map(|x| x * self.units.length).filter(|x| x.is_finite())
    }

    /// Reads a primitive of CSG, mm; refuses anything else.
    fn primitive(&self, e: Entity<'f, 'a>) -> Outcome<SolidRecipe> {
        let size = |a: Args<'f, 'a>, k: usize| {
            let size = self.length(a, k).filter(|x| *x > 0.0);
            size.ok_or_else(|| Refusal::new(e, "a size is not positive"))
        };
        let frame = |a: Args<'f, 'a>| self.placement(self.resolve(e, a.id(0), "position")?.id);
        // Spheres and tori are closed and need no edges: no loop means all of them.
        let whole = |kind: Kind, analytic: Analytic| SolidRecipe {
            edges: Vec::new(),
            faces: vec![RecipeFace { chart: Chart::new(kind, analytic), same_sense: true, loops: Vec::new() }],
        };
        if let Some(a) = e.attributes("SPHERE", 1) {
            let radius = size(a, 0)?;
            let center = self.resolve(e, a.id(1), "centre")?;
            let frame = Frame::translation(self.point(center.id)?);
            return Ok(whole(Kind::Torus { frame, major: 0.0, minor: radius }, Analytic::Sphere { frame, radius }));
        }
        if let Some(a) = e.attributes("TORUS", 1) {
            let (frame, major, minor) = (frame(a)?, size(a, 1)?, size(a, 2)?);
            // A tube that reaches the axis makes a surface that meets itself: no border of a solid.
            if major <= minor {
                return Err(Refusal::new(e, "its tube touches its axis"));
            }
            return Ok(whole(Kind::Torus { frame, major, minor }, Analytic::Torus { frame, major, minor }));
        }
        let polygon = |frame: &Frame, corners: &[[f64; 2]]| {
            let place = |c: &[f64; 2]| frame.point(Point::new(c[0], c[1], 0.0));
            let n = corners.len();
            let sides = (0..n).map(|k| Curve::line(place(&corners[k]), place(&corners[(k + 1) % n]), [0.0, 1.0]));
            Profile { normal: frame.z, loops: vec![sides.collect()] }
        };
        let swept = |profile: Profile, by: Vector| extrude(profile, by).ok_or_else(|| unsupported(e));
        if let Some(a) = e.attributes("BLOCK", 1) {
            let (frame, x, y, z) = (frame(a)?, size(a, 1)?, size(a, 2)?, size(a, 3)?);
            return swept(polygon(&frame, &[[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]]), frame.z * z);
        }
        if let Some(a) = e.attributes("RIGHT_ANGULAR_WEDGE", 1) {
            let (frame, x, y, z) = (frame(a)?, size(a, 1)?, size(a, 2)?, size(a, 3)?);
            let top =
                self.length(a, 4).filter(|t| *t >= 0.0).ok_or_else(|| Refusal::new(e, "its ltx is negative"))?;
            let corners = [[0.0, 0.0], [x, 0.0], [top, y], [0.0, y]];
            // With ltx zero the wedge is a prism over a triangle; an edge without length would be refused.
            let corners = if top > 0.0 { &corners[..] } else { &[[0.0, 0.0], [x, 0.0], [0.0, y]] };
            return swept(polygon(&frame, corners), frame.z * z);
        }
        if let Some(a) = e.attributes("RIGHT_CIRCULAR_CYLINDER", 1) {
            let (frame, height, radius) = (frame(a)?, size(a, 1)?, size(a, 2)?);
            let profile = Profile { normal: frame.z, loops: vec![vec![conic::arc(&frame, radius, [0.0, TAU])]] };
            let mut solid = swept(profile, frame.z * height)?;
            // The side is known in its closed form.
            solid.faces.iter_mut().filter(|f| matches!(f.chart.kind, Kind::Extrusion { .. })).for_each(|side| {
                side.chart = Chart::cylinder(frame, radius);
            });
            return Ok(solid);
        }
        if let Some(a) = e.attributes("RIGHT_CIRCULAR_CONE", 1) {
            let (frame, height) = (frame(a)?, size(a, 1)?);
            let radius = self.length(a, 2).filter(|r| *r >= 0.0);
            let angle = a.real(3).map(|x| x * self.units.angle).filter(|x| *x > 0.0 && *x < 0.25 * TAU);
            let (Some(radius), Some(angle)) = (radius, angle) else {
                return Err(Refusal::new(e, "its radius or semi-angle is no size"));
            };
            let wide = radius + height * angle.tan();
            // The base lies behind the placement, where its axis comes from; the tip, or the smaller face, is in it.
            let place = |r: f64, h: f64| frame.point(Point::new(r, 0.0, h));
            let corners = [place(0.0, -height), place(wide, -height), place(radius, 0.0), place(0.0, 0.0)];
            // Corners that coincide, as at the tip of a cone, give no side.
            let sides = (0..4).map(|k| (corners[k], corners[(k + 1) % 4])).filter(|(p, q)| p != q);
            let sides = sides.map(|(p, q)| Curve::line(p, q, [0.0, 1.0])).collect();
            // The half profile in the plane of x and z, turned about z; with a tip at one end its edge there has no length and is left
            // out.
            let profile = Profile { normal: -frame.y, loops: vec![sides] };
            return revolve(profile, &frame, TAU).ok_or_else(|| unsupported(e));
        }
        Err(unsupported(e))
    }

    /// Reads the swept area `id` of the solid `e`, a CURVE_BOUNDED_SURFACE or a face, as a profile, which must be plane and have a border;
    /// its loops run as the file has them.
    fn profile(&self, e: Entity<'f, 'a>, id: Option<u64>) -> Outcome<Profile> {
        let area = self.resolve(e, id, "swept area")?;
        let (surface, loops) = if let Some(a) = area.attributes("CURVE_BOUNDED_SURFACE", 1) {
            let surface = self.resolve(area, a.id(0), "basis surface")?;
            let boundaries = references(area, a.list(1))?.into_iter();
            (surface, boundaries.map(|b| self.segments(self.entity(b)?, 0)).collect::<Outcome<Vec<_>>>()?)
        } else {
            let plan = read_face(self.file, area.id)?;
            let keys = plan.loops.iter().flatten().map(|(key, _)| key);
            let entities = keys.filter_map(|key| if let EdgeKey::Entity(id) = key { Some(*id) } else { None });
            let others = self.composite_edges(entities);
            let curve = |(key, reversed): &(EdgeKey, bool), is_alone: bool| -> Outcome<Curve> {
                let EdgeKey::Entity(edge) = key else {
                    return Err(Refusal::new(area, "polygonal loops of a profile are not supported"));
                };
                let curve = self
                    .edge(*edge, EdgeContext { is_alone, is_swapped: false, others: &others })?
                    .curve
                    .ok_or_else(|| Refusal::new(area, "an edge has no length"))?;
                Ok(if *reversed { curve.reversed() } else { curve })
            };
            let border = |l: &Vec<(EdgeKey, bool)>| l.iter().map(|use_| curve(use_, l.len() == 1)).collect();
            let loops = plan.loops.iter().map(border).collect::<Outcome<Vec<_>>>()?;
            (self.entity(plan.surface)?, loops)
        };
        let plane =
            surface.attributes("PLANE", 1).ok_or_else(|| Refusal::new(surface, "a profile must be plane"))?;
        let frame = self.placement(self.resolve(surface, plane.id(0), "position")?.id)?;
        if loops.is_empty() {
            return Err(Refusal::new(area, "its profile has no border"));
        }
        Ok(Profile { normal: frame.z, loops })
    }
}

/// Makes the refusal of a recipe of a kind that is not converted.
fn unsupported(e: Entity<'_, '_>) -> Refusal {
    Refusal::new(e, "this kind of recipe is not converted; export the solid as a boundary representation")
}

impl Profile {
    /// Returns the same profile seen from where a sweep goes: the outer loop counter-clockwise, holes clockwise; `None` when it is swept
    /// within its plane.
    fn turn_to_sweep(mut self, sweep: Vector) -> Option<Self> {
        let cosine = self.normal.dot(sweep) / sweep.length();
        if !(cosine.abs() > FLAT_SWEEP) {
            // Written so that it refuses a normal or a sweep that is no number.
            return None;
        }
        if cosine < 0.0 {
            self.normal = -self.normal;
        }
        let areas: Vec<f64> = self.loops.iter().map(|l| signed_area(l, self.normal)).collect();
        // Of loops in a plane the largest holds the others.
        let outer = (0..areas.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()))?;
        for (k, curves) in self.loops.iter_mut().enumerate() {
            if (areas[k] > 0.0) != (k == outer) {
                curves.reverse();
                curves.iter_mut().for_each(|c| *c = c.reversed());
            }
        }
        Some(self)
    }
}

/// Returns the area within a loop of curves that join one another, about a normal, mm².
fn signed_area(curves: &[Curve], normal: Vector) -> f64 {
    // About a point of the loop: far from the origin the products would cancel.
    let Some(center) = curves.first().map(|c| c.evaluate(c.domain()[0])) else { return 0.0 };
    curves.iter().map(|c| c.swept_area(center)).sum::<Vector>().dot(normal)
}

/// Returns the same loops of edges, run the other way.
fn reversed_loops(loops: &[Vec<(usize, bool)>]) -> Vec<Vec<(usize, bool)>> {
    loops.iter().map(|l| l.iter().rev().map(|&(edge, back)| (edge, !back)).collect()).collect()
}

impl SolidRecipe {
    /// Adds an edge and returns its index.
    fn add_edge(&mut self, curve: Curve) -> usize {
        self.edges.push(curve);
        self.edges.len() - 1
    }

    /// Adds a plane cap in the x-y plane of `frame`; `forward` when its outward normal is the profile's.
    fn add_cap(&mut self, frame: Frame, loops: &[Vec<(usize, bool)>], forward: bool) {
        let chart = Chart::new(Kind::Plane { frame }, Analytic::Plane { frame });
        let loops = if forward { loops.to_vec() } else { reversed_loops(loops) };
        self.faces.push(RecipeFace { chart, same_sense: forward, loops });
    }
}

/// Returns the solid of a profile moved by `by`, mm; `None` when that lies in its plane.
fn extrude(profile: Profile, by: Vector) -> Option<SolidRecipe> {
    let profile = profile.turn_to_sweep(by)?;
    let mut solid = SolidRecipe::default();
    let mut bottoms = Vec::new();
    let mut tops = Vec::new();
    for curves in &profile.loops {
        let n = curves.len();
        let bottom: Vec<usize> = curves.iter().map(|c| solid.add_edge(c.clone())).collect();
        let top: Vec<usize> = curves.iter().map(|c| solid.add_edge(map_points(c.clone(), |p| p + by))).collect();
        let start = |c: &Curve| c.evaluate(c.domain()[0]);
        // The edges from the corners of the profile up: each is shared by two sides.
        let posts: Vec<usize> =
            curves.iter().map(|c| solid.add_edge(Curve::line(start(c), start(c) + by, [0.0, 1.0]))).collect();
        for (k, curve) in curves.iter().enumerate() {
            // Two control points are a straight line: the side above it is a plane.
            let chart = match &curve.points[..] {
                [p, q] => {
                    let along = q.project() - p.project();
                    let frame = Frame::from_axis(p.project(), along.cross(by), Some(along));
                    Chart::new(Kind::Plane { frame }, Analytic::Plane { frame })
                }
                _ => Chart::new(Kind::Extrusion { base: curve.clone(), direction: by }, Analytic::Extrusion),
            };
            // Counter-clockwise seen from outside: along the profile, up, back along its copy, down.
            let border = vec![(bottom[k], false), (posts[(k + 1) % n], false), (top[k], true), (posts[k], true)];
            solid.faces.push(RecipeFace { chart, same_sense: true, loops: vec![border] });
        }
        bottoms.push(bottom.iter().map(|&e| (e, false)).collect::<Vec<_>>());
        tops.push(top.iter().map(|&e| (e, false)).collect::<Vec<_>>());
    }
    // A cap may lie anywhere in its plane: any point of the profile will do.
    let origin = solid.edges[0].evaluate(solid.edges[0].domain()[0]);
    let frame = Frame::from_axis(origin, profile.normal, None);
    solid.add_cap(frame, &bottoms, false);
    solid.add_cap(Frame { origin: origin + by, ..frame }, &tops, true);
    Some(solid)
}

/// Returns the solid of a profile turned about the z axis of a frame by an angle, radians; from nearly 2π on a whole turn without caps.
/// `None` when the profile is turned within its own plane.
fn revolve(profile: Profile, axis: &Frame, angle: f64) -> Option<SolidRecipe> {
    // Which way the profile sets out is decided by the middle of the curve that is farthest from the axis.
    let points: Vec<Point> =
        profile.loops.iter().flatten().map(|c| c.evaluate(0.5 * (c.domain()[0] + c.domain()[1]))).collect();
    let far = points.into_iter().max_by(|a, b| axis_distance(axis, *a).total_cmp(&axis_distance(axis, *b)))?;
    let profile = profile.turn_to_sweep(axis.z.cross(far - axis.origin))?;
    let whole = angle >= TAU - WHOLE_TURN_SLACK;
    let angle = if whole { TAU } else { angle };
    let turn = |p: Point| rotated(axis, angle, p);
    let mut solid = SolidRecipe::default();
    let mut starts = Vec::new();
    let mut ends = Vec::new();
    for curves in &profile.loops {
        let n = curves.len();
        // An edge on the axis stays where it is and bounds no side.
        let on_axis = |c: &Curve| c.points.iter().all(|p| axis_distance(axis, p.project()) <= ON_AXIS_MM);
        let first: Vec<usize> = curves.iter().map(|c| solid.add_edge(c.clone())).collect();
        let last: Vec<usize> = curves
            .iter()
            .zip(&first)
            .map(|(c, &edge)| if whole || on_axis(c) { edge } else { solid.add_edge(map_points(c.clone(), turn)) })
            .collect();
        let mut arcs: Vec<Option<usize>> = Vec::with_capacity(n);
        // Each corner runs along an arc; two sides share it. A corner on the axis stays a point.
        for c in curves {
            let p = c.evaluate(c.domain()[0]);
            let q = axis.local_point(p);
            let radius = q.x.hypot(q.y);
            arcs.push((radius > ON_AXIS_MM).then(|| {
                let center = axis.point(Point::new(0.0, 0.0, q.z));
                let frame = Frame::from_axis(center, axis.z, Some(p - center));
                solid.add_edge(conic::arc(&frame, radius, [0.0, angle]))
            }));
        }
        for (k, curve) in curves.iter().enumerate().filter(|(_, c)| !on_axis(c)) {
            let mut border = vec![(first[k], false)];
            border.extend(arcs[(k + 1) % n].map(|arc| (arc, false)));
            border.push((last[k], true));
            border.extend(arcs[k].map(|arc| (arc, true)));
            let chart = Chart::revolution(*axis, curve.clone());
            // The chart's normal is turn × tangent, against `tangent × sweep`: the sides look outward against it.
            solid.faces.push(RecipeFace { chart, same_sense: false, loops: vec![border] });
        }
        starts.push(first.iter().map(|&e| (e, false)).collect::<Vec<_>>());
        ends.push(last.iter().map(|&e| (e, false)).collect::<Vec<_>>());
    }
    if !whole {
        let origin = solid.edges[0].evaluate(solid.edges[0].domain()[0]);
        let frame = Frame::from_axis(origin, profile.normal, None);
        solid.add_cap(frame, &starts, false);
        let normal = turn(origin + profile.normal) - turn(origin);
        solid.add_cap(Frame::from_axis(turn(origin), normal, None), &ends, true);
    }
    Some(solid)
}

/// Returns the distance of a point from the z axis of a frame, in the frame's units.
fn axis_distance(axis: &Frame, p: Point) -> f64 {
    let q = axis.local_point(p);
    q.x.hypot(q.y)
}

/// Returns a point turned by an angle, radians, about the z axis of a frame.
pub(super) fn rotated(axis: &Frame, angle: f64, p: Point) -> Point {
    let (q, (sin, cos)) = (axis.local_point(p), angle.sin_cos());
    axis.point(Point::new(cos * q.x - sin * q.y, sin * q.x + cos * q.y, q.z))
}
