//! What a model holds, face by face: the figures by which a person or a selector distinguishes faces.

use super::outline::Outline;
use super::{Colour, Face, Instance, Model, Part, Shell, SurfaceKind, TessellatedFace};
use crate::math::quadrature::GAUSS;
use crate::math::{Aabb, Frame, Uv, safe_newton};
use crate::nurbs::UvCurve;
use serde::{Serialize, Serializer};

/// A part with its solids: an element of `info --faces --json`.
#[derive(Clone, Debug, Serialize)]
pub struct PartAccount {
    /// Name of the product, empty when it had none.
    pub name: String,
    /// How often it is placed.
    pub instances: usize,
    /// Its solids and sheets.
    pub solids: Vec<SolidAccount>,
}

/// A solid with its voids, or a sheet.
#[derive(Clone, Debug, Serialize)]
pub struct SolidAccount {
    /// Number in the part, from 0; what selectors call `solid`.
    pub index: usize,
    /// Name, empty when it had none.
    pub name: String,
    /// Whether the file says that it is closed.
    pub closed: bool,
    /// Its faces in the file's order.
    pub faces: Vec<FaceAccount>,
}

impl SolidAccount {
    /// Lower and upper corner of the box around its faces, mm, where the first instance stands; `None` without faces.
    pub fn bbox_mm(&self) -> Option<[[f64; 3]; 2]> {
        self.faces.iter().map(|f| f.bbox_mm).reduce(|a, b| {
            let lower = std::array::from_fn(|k| a[0][k].min(b[0][k]));
            let upper = std::array::from_fn(|k| a[1][k].max(b[1][k]));
            [lower, upper]
        })
    }

    /// Sides of that box, mm; 0 without faces and where rounding alone makes a flat one thick.
    pub fn size_mm(&self) -> [f64; 3] {
        /// The rounding of places up to 100 m.
        const ROUNDING_MM: f64 = 1e-9;
        let [low, high] = self.bbox_mm().unwrap_or_default();
        let side = |k: usize| high[k] - low[k];
        std::array::from_fn(|k| if side(k) < ROUNDING_MM { 0.0 } else { side(k) })
    }

    /// The colour that all its faces show; `None` where they differ or one has none.
    pub fn colour(&self) -> Option<Colour> {
        let first = self.faces.first()?.colour?;
        self.faces.iter().all(|f| f.colour == Some(first)).then_some(first)
    }
}

/// A face. Lengths are mm, and places are where the part's first instance stands (the part's own coordinates without one).
#[derive(Clone, Debug, Serialize)]
pub struct FaceAccount {
    /// The `#id` in its file; `None` when it came from none.
    pub id: Option<u64>,
    /// Name, empty when it had none.
    pub name: String,
    /// The colour that shows, as `#rrggbb`.
    #[serde(serialize_with = "hex_colour")]
    pub colour: Option<Colour>,
    /// The layer.
    pub layer: Option<String>,
    /// The kind of surface.
    pub kind: SurfaceKind,
    /// Radius of a cylinder or sphere, or of a torus' tube, mm.
    pub radius_mm: Option<f64>,
    /// Area inside the trims, mm².
    pub area_mm2: f64,
    /// Lower and upper corner of a box around it, mm.
    pub bbox_mm: [[f64; 3]; 2],
    /// A point on the face, away from its edges, mm.
    pub at: [f64; 3],
}

/// Writes a colour as `#rrggbb`, none as null.
fn hex_colour<S: Serializer>(colour: &Option<Colour>, serializer: S) -> Result<S::Ok, S::Error> {
    colour.map(|c| c.to_string()).serialize(serializer)
}

/// Pieces into which a span of an edge, and of the surface across it, is divided: of a circular hole in a cylinder half as wide as its
/// radius, 1e-6 of the area is then missed.
const PIECES: usize = 2;
/// Knots in u for each in v from which on rows run along v: of fewer, arcs mostly, the kinks at knots cost accuracy where rows cross them.
const MANY_KNOTS: usize = 8;
/// Share of a span within which its crossing of a row of knots is known: what the piece on the wrong side adds is below rounding.
const CROSSING_SHARE: f64 = 1e-12;

impl Model {
    /// Returns every part with its solids and faces, in order; parts without faces are left out, those without an instance are not.
    pub fn account(&self) -> Vec<PartAccount> {
        // The first instance stands for all: one place to look at is enough to know a face.
        let mut first: Vec<Option<&Instance>> = vec![None; self.parts.len()];
        let mut count = vec![0; self.parts.len()];
        for instance in &self.instances {
            let part = instance.part.0 as usize;
            first[part].get_or_insert(instance);
            count[part] += 1;
        }
        let parts = self.parts.iter().zip(first).zip(count).filter(|((part, _), _)| part.face_count() > 0);
        parts
            .map(|((part, instance), instances)| PartAccount {
                name: part.name.clone(),
                instances,
                solids: part.account(instance),
            })
            .collect()
    }
}

impl Part {
    /// Returns its solids and sheets with their faces where an instance stands, or in the part's own coordinates without one.
    fn account(&self, instance: Option<&Instance>) -> Vec<SolidAccount> {
        let placement = instance.map_or(Frame::IDENTITY, |i| i.placement);
        let inherited = instance.and_then(|i| i.colour).or(self.colour);
        let mut solids: Vec<SolidAccount> = Vec::new();
        for (index, shells) in self.solids().into_iter().enumerate() {
            let shells: &[Shell] = &self.shells[shells];
            let face = |shell: &Shell, face: &Face| face.account(&placement, shell.colour.or(inherited));
            solids.push(SolidAccount {
                index,
                name: shells[0].name.clone(),
                closed: shells[0].closed,
                faces: shells.iter().flat_map(|s| s.faces.iter().map(move |f| face(s, f))).collect(),
            });
        }
        // Ready meshes have no shells; they are one more solid behind the others.
        if !self.tessellated.is_empty() {
            solids.push(SolidAccount {
                index: solids.len(),
                name: String::new(),
                closed: false,
                faces: self.tessellated.iter().map(|t| t.account(&placement, inherited)).collect(),
            });
        }
        solids
    }
}

impl Face {
    /// Returns name, colour, kind, area, box and a point of the face where `placement` puts it; `inherited` is the colour that shows where
    /// it has none of its own.
    fn account(&self, placement: &Frame, inherited: Option<Colour>) -> FaceAccount {
        FaceAccount {
            id: self.entity,
            name: self.name.clone(),
            colour: self.colour.or(inherited),
            layer: self.layer.as_deref().map(str::to_owned),
            kind: self.analytic.kind(),
            radius_mm: self.analytic.radius().map(|r| r * placement.scale),
            area_mm2: self.area() * placement.scale * placement.scale,
            bbox_mm: corners(self.bounds(placement)),
            at: placement.point(self.surface.evaluate(self.inner_parameters())).to_array(),
        }
    }

    /// Surface parameters of a point inside the trims, well away from them where the face is wide; of trims without extent, a point of
    /// them.
    pub fn inner_parameters(&self) -> Uv {
        let outline = Outline::new(self);
        // A loop that crosses none of the rows has no extent that could hold a point: its corner is on it then.
        outline.inner_point().unwrap_or(outline.corners()[0])
    }

    /// Area inside the trims in the part's coordinates, mm²: by Green's theorem along the loops, relatively within about 1e-5.
    ///
    /// ```
    /// use lampyris::{math::Frame, model::Face, nurbs::sweep};
    /// use std::f64::consts::PI;
    /// let ball = sweep::sphere(&Frame::IDENTITY, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]);
    /// assert!((Face::whole(ball).area() / (400.0 * PI) - 1.0).abs() < 1e-5);
    /// ```
    pub fn area(&self) -> f64 {
        let [[u0, u1], [v0, v1]] = self.surface.domain();
        let corners = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
        // Between knots the density of area is smooth, which is what Gauss' rule needs.
        let mut breaks = self.surface.knots.clone();
        breaks.iter_mut().for_each(Vec::dedup);
        // An extruded spline has hundreds of knots one way, which would all be met on every row along them.
        let swept = usize::from(breaks[0].len() > MANY_KNOTS * breaks[1].len());
        let sweep = Sweep { face: self, breaks, swept };
        if self.loops.is_empty() {
            let sides = (0..4).map(|k| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]));
            // The sign shows which way the loops run; an area has none.
            return sides.map(|side| sweep.area_beside(&side)).sum::<f64>().abs();
        }
        let loops = self.bounding_loops();
        let uses = loops.iter().flat_map(|l| &l.uses);
        uses.map(|u| if u.reversed { -sweep.area_beside(&u.uv) } else { sweep.area_beside(&u.uv) })
            .sum::<f64>()
            .abs()
    }
}

/// The area between a curve of the parameter plane and the lower end of one parameter.
struct Sweep<'f> {
    face: &'f Face,
    /// Distinct knots in u and v, between which the density of area is smooth.
    breaks: [Vec<f64>; 2],
    /// The parameter from whose lower end the area reaches to the curve: 0 for u, 1 for v.
    swept: usize,
}

impl Sweep<'_> {
    /// Signed area, mm², between a curve and the lower end of the swept parameter, positive where the other one rises: the integral of the
    /// row areas over the latter.
    fn area_beside(&self, curve: &UvCurve) -> f64 {
        let (mut sum, across) = (0.0, 1 - self.swept);
        for span in curve.breakpoints().windows(2) {
            for piece in self.smooth_pieces(curve, [span[0], span[1]]).windows(2) {
                let width = piece[1] - piece[0];
                for (x, weight) in GAUSS {
                    let d = curve.derivatives(piece[0] + x * width);
                    // A piece along a row adds nothing to an integral across it, and its row need not be computed.
                    if d.first[across] != 0.0 {
                        sum += weight * width * d.first[across] * self.row_area(d.point);
                    }
                }
            }
        }
        sum
    }

    /// Parameters at which a span of a curve is divided, both ends included: at the rows of knots between those of its ends, each crossed
    /// once, and in [`PIECES`] between.
    fn smooth_pieces(&self, curve: &UvCurve, [t0, t1]: [f64; 2]) -> Vec<f64> {
        let across = 1 - self.swept;
        let v0 = curve.evaluate(t0)[across];
        let v1 = curve.evaluate(t1)[across];
        let between = |k: &&f64| **k > v0.min(v1) && **k < v0.max(v1);
        let crossed: Vec<f64> = self.breaks[across].iter().filter(between).copied().collect();
        let mut cuts = vec![t0, t1];
        // A straight line's crossings are known in closed form.
        if curve.degree == 1 {
            cuts.extend(crossed.iter().map(|k| t0 + (t1 - t0) * (k - v0) / (v1 - v0)));
        } else {
            let crossing = |k: &f64| {
                let above = |t: f64| {
                    let d = curve.derivatives(t);
                    (d.point[across] - k, d.first[across])
                };
                safe_newton(above, t0, t1, CROSSING_SHARE * (t1 - t0))
            };
            cuts.extend(crossed.iter().filter_map(crossing));
        }
        cuts.sort_by(f64::total_cmp);
        let mut pieces: Vec<f64> = cuts
            .windows(2)
            .flat_map(|w| (0..PIECES).map(|i| w[0] + (w[1] - w[0]) * i as f64 / PIECES as f64))
            .collect();
        pieces.push(t1);
        pieces
    }

    /// Integral of the surface's density of area over the swept parameter, from its lower end up to that of `end`, along the row on which
    /// `end` lies.
    fn row_area(&self, end: Uv) -> f64 {
        let mut sum = 0.0;
        for span in self.breaks[self.swept].windows(2).filter(|s| s[0] < end[self.swept]) {
            let width = (span[1].min(end[self.swept]) - span[0]) / PIECES as f64;
            for piece in 0..PIECES {
                for (x, weight) in GAUSS {
                    let mut at = end;
                    at[self.swept] = span[0] + (piece as f64 + x) * width;
                    let d = self.face.surface.derivatives(at);
                    // The area of a patch of surface is |Su × Sv| du dv.
                    sum += weight * width * d.du.cross(d.dv).length();
                }
            }
        }
        sum
    }
}

impl TessellatedFace {
    /// Returns name, colour, area, box and a point of the face where `placement` puts it, in the inherited colour where it has none.
    /// Without facets the point is the placement's origin.
    fn account(&self, placement: &Frame, inherited: Option<Colour>) -> FaceAccount {
        let corner = |k: usize| self.mesh.positions[self.mesh.vertices[k].position as usize];
        // The middle of the first facet.
        let middle = self.mesh.facets.first().map(|f| {
            let [a, b, c, _] = f.vertices.map(|v| corner(v as usize));
            (a + b + c) / 3.0
        });
        let points = self.mesh.positions.iter().map(|&p| placement.point(p));
        FaceAccount {
            id: self.entity,
            name: self.name.clone(),
            colour: self.colour.or(inherited),
            layer: self.layer.as_deref().map(str::to_owned),
            kind: SurfaceKind::Tessellated,
            radius_mm: None,
            area_mm2: self.mesh.area() * placement.scale * placement.scale,
            bbox_mm: corners(Aabb::from_points(points)),
            at: middle.map_or(placement.origin, |p| placement.point(p)).to_array(),
        }
    }
}

/// Returns the lower and the upper corner of a box.
fn corners(b: Aabb) -> [[f64; 3]; 2] {
    [b.min.to_array(), b.max.to_array()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Analytic, EdgeUse, TrimLoop};
    use crate::nurbs::{ControlPoint, Surface, sweep};
    use std::f64::consts::PI;
    use std::iter;

    const TURN: [f64; 2] = [0.0, 2.0 * PI];

    #[test]
    fn a_flat_solid_has_no_thickness() {
        let face = |colour: Option<Colour>| FaceAccount {
            id: None,
            name: String::new(),
            colour,
            layer: None,
            kind: SurfaceKind::Plane,
            radius_mm: None,
            area_mm2: 16.0,
            bbox_mm: [[-2.0, -2.0, 7.0], [2.0, 2.0, 7.000_000_000_000_002]],
            at: [0.0; 3],
        };
        let grey = Some(Colour([0.5; 3]));
        let solid = |faces: Vec<FaceAccount>| SolidAccount { index: 0, name: String::new(), closed: false, faces };
        assert_eq!(solid(vec![face(grey)]).size_mm(), [4.0, 4.0, 0.0]);
        assert_eq!(
            [solid(vec![face(grey), face(grey)]), solid(vec![face(grey), face(None)])].map(|s| s.colour()),
            [grey, None]
        );
        assert_eq!(solid(Vec::new()).size_mm(), [0.0; 3]);
    }

    #[test]
    fn areas_of_whole_surfaces_are_those_of_their_formulas() {
        let f = Frame::IDENTITY;
        let sphere = Face::whole(sweep::sphere(&f, 3.0, TURN, [-PI / 2.0, PI / 2.0]));
        let torus = Face::whole(sweep::torus(&f, 5.0, 2.0, TURN, TURN));
        let cone = Face::whole(sweep::cone(&f, 1.0, 0.5, TURN, [0.0, 4.0]));
        let (r, slope) = (1.0 + 4.0 * 0.5f64.tan(), 4.0 / 0.5f64.cos());
        for (face, area) in [(sphere, 36.0 * PI), (torus, 40.0 * PI * PI), (cone, PI * (1.0 + r) * slope)] {
            assert!((face.area() / area - 1.0).abs() < 1e-5, "{} {area}", face.area());
        }
    }

    /// A square of 10 mm whose lower half has a hundredth of the parameters, beside a trim of degree two.
    #[test]
    fn bent_trims_are_divided_where_they_cross_knots() {
        let points = [0.0, 10.0].map(|x| [0.0, 5.0, 10.0].map(|y| glam::DVec4::new(x, y, 0.0, 1.0)));
        let knots = [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 0.01, 1.0, 1.0]];
        let square = Face::whole(Surface { degree: [1, 1], knots, points: points.as_flattened().to_vec() });
        let side = [0.0, 0.2, 1.0].map(|v| glam::DVec3::new(1.0, v, 1.0)).to_vec();
        let bent = UvCurve { degree: 2, knots: vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], points: side };
        let straight = [(Uv::ONE, Uv::Y), (Uv::Y, Uv::ZERO), (Uv::ZERO, Uv::X)];
        let uvs = iter::once(bent).chain(straight.map(|(a, b)| UvCurve::line(a, b, [0.0, 1.0])));
        let uses = uvs.map(|uv| EdgeUse { edge: None, reversed: false, uv }).collect();
        let area = Face { loops: vec![TrimLoop { uses }], ..square }.area();
        assert!((area - 100.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn a_round_hole_is_left_out_of_area_and_point() {
        let line = |a: Uv, b: Uv| EdgeUse { edge: None, reversed: false, uv: UvCurve::line(a, b, [0.0, 1.0]) };
        let c = [Uv::new(0.0, 0.0), Uv::new(10.0, 0.0), Uv::new(10.0, 10.0), Uv::new(0.0, 10.0)];
        let outer = TrimLoop { uses: (0..4).map(|k| line(c[k], c[(k + 1) % 4])).collect() };
        let circle =
            crate::nurbs::conic::arc(&Frame::translation(crate::math::Vector::new(5.0, 5.0, 0.0)), 2.0, TURN);
        let points = circle.points.iter().map(|p| glam::DVec3::new(p.x, p.y, p.weight())).collect();
        let uv = UvCurve { degree: 2, knots: circle.knots.clone(), points };
        let hole = TrimLoop { uses: vec![EdgeUse { edge: None, reversed: true, uv }] };
        let plane = sweep::plane(&Frame::IDENTITY, [[0.0, 10.0], [0.0, 10.0]]);
        let face = Face {
            loops: vec![outer, hole],
            analytic: Analytic::Plane { frame: Frame::IDENTITY },
            ..Face::whole(plane)
        };
        assert!((face.area() - (100.0 - 4.0 * PI)).abs() < 1e-6, "{}", face.area());
        let p = face.inner_parameters();
        assert!((p - Uv::splat(5.0)).length() > 2.5, "{p}");
        assert_eq!(
            face.account(&Frame::IDENTITY, Some(Colour([1.0, 0.5, 0.0]))).colour.map(|c| c.to_string()),
            Some("#ff8000".into())
        );
    }
}
