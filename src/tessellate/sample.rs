//! Sag and normal error by dense sampling: evaluates splines by their definition and measures distances its own way, so
//! that it can judge the bound. Which facets are sampled where all would take too long is decided in `sample_budget.rs`.

use super::foot_search::{CountedSurface, STILL, nearest_from, search_even_pieces, search_pieces};
use super::triangle_frame::TriangleFrame;
use crate::math::{Point, Uv, Vector};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::nurbs::Surface;
use rayon::prelude::*;
use smallvec::SmallVec;

/// Result of sampling one facet.
#[derive(Clone, Debug, Default)]
pub(super) struct Sampled {
    /// Largest distance found, mm.
    pub(super) sag: f64,
    /// Mean distance of the facet's points to the spline, mm.
    pub(super) mean: f64,
    /// Angles between the bilinear normal and the spline's, radians.
    pub(super) normal_errors: Vec<f32>,
    /// How often the spline was evaluated for it.
    pub(super) evaluations: u64,
}

/// Where a triangle's points are measured, with their shares of its mean: D. A. Dunavant, *High degree efficient symmetrical Gaussian
/// quadrature rules for the triangle*, IJNME 21 (1985), degree 4, and three places more for the largest distance alone. A plain mean of
/// points that are thicker in the middle was 15 % too high on strips of a cylinder.
const POINTS: [(f64, [f64; 3]); 9] = {
    const A: f64 = 0.445948490915965;
    const B: f64 = 0.091576213509771;
    const WA: f64 = 0.223381589678011;
    const WB: f64 = 0.109951743655322;
    [
        (WA, [1.0 - 2.0 * A, A, A]),
        (WA, [A, 1.0 - 2.0 * A, A]),
        (WA, [A, A, 1.0 - 2.0 * A]),
        (WB, [1.0 - 2.0 * B, B, B]),
        (WB, [B, 1.0 - 2.0 * B, B]),
        (WB, [B, B, 1.0 - 2.0 * B]),
        (0.0, [0.34, 0.33, 0.33]),
        (0.0, [0.5, 0.5, 0.0]),
        (0.0, [0.0, 0.5, 0.5]),
    ]
};

/// Share by which feet are farther than the places of the surface for their spacing alone.
const UNEVEN: f64 = 0.05;
/// Surface samples a side of a facet.
const GRID: usize = 8;
/// Share of a triangle's size within which places of a pole are one.
const SAME_PLACE: f64 = 1e-9;

/// Share of the domain within which a place is on a knot, and share of the way into the facet by which its normal is taken beside it.
const BESIDE_KNOT: f64 = 1e-9;

/// Samples every facet, in parallel; facets of ready meshes give zeros. Vertices need their `uv`.
pub(super) fn sample_mesh(mesh: &FacetMesh, model: &Model) -> Vec<Sampled> {
    let facets: Vec<usize> = (0..mesh.facets.len()).collect();
    sample_facets(mesh, model, &facets)
}

/// Samples the facets of these indices, in their order; lengths are mm of the scene.
pub(super) fn sample_facets(mesh: &FacetMesh, model: &Model, facets: &[usize]) -> Vec<Sampled> {
    let faces: Vec<_> = model.placed_faces().collect();
    facets
        .par_iter()
        .map(|&f| {
            let placed = &faces[mesh.facets[f].face.index()];
            let Some(face) = placed.face else { return Sampled::default() };
            let scale = placed.placement.scale;
            let corners = mesh.corners(f).map(|p| placed.placement.local_point(p));
            let sign = if face.reversed { -1.0 } else { 1.0 };
            // The normals of a reversed face are turned back: errors are measured against Su × Sv.
            let normals = mesh.facets[f]
                .vertices
                .map(|v| sign * placed.placement.local_direction(mesh.vertices[v as usize].normal));
            let mut s = sample_facet(&CountedSurface::new(&face.surface), mesh, f, corners, normals);
            s.sag *= scale;
            s.mean *= scale;
            s
        })
        .collect()
}

/// A point of a facet and a near point of the surface.
struct Foot {
    x: Point,
    uv: Uv,
    away: f64,
    /// Its share in the mean of the facet, mm².
    weight: f64,
    /// The facet's interpolated normal.
    normal: Vector,
}

/// Returns the sag and normal errors of facet `f`, in the surface's lengths. `p` are its corners in the part's coordinates, `n` their
/// normals on the side of Su × Sv.
fn sample_facet(
    surface: &CountedSurface<'_>,
    mesh: &FacetMesh,
    f: usize,
    p: [Point; 4],
    n: [Vector; 4],
) -> Sampled {
    let uv = mesh.facets[f].vertices.map(|v| mesh.vertices[v as usize].uv);
    let triangles: &[[usize; 3]] =
        if mesh.facets[f].is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
    let flat: SmallVec<[TriangleFrame; 2]> =
        triangles.iter().map(|t| TriangleFrame::new(t.map(|k| p[k]))).collect();
    let mut out = Sampled::default();
    // From the surface to the facet…
    let has_piece = triangles.len() > 1 || !is_side_of_pole(surface, [0, 1, 2].map(|k| (uv[k], p[k])));
    for (k, t) in triangles.iter().enumerate().filter(|_| has_piece) {
        for i in 0..=GRID {
            // The first side of the second triangle is the diagonal, which the first has looked at.
            for j in k..=GRID - i {
                let b = [(GRID - i - j) as f64, i as f64, j as f64].map(|x| x / GRID as f64);
                let at = surface.point(uv[t[0]] * b[0] + uv[t[1]] * b[1] + uv[t[2]] * b[2]);
                let mut away = flat[k].distance(at);
                // What is no farther from its own triangle than another place was decides nothing.
                if away > out.sag {
                    away = flat.iter().map(|t| t.distance(at)).fold(away, f64::min);
                    out.sag = out.sag.max(away);
                }
            }
        }
    }
    // Corners lie on the surface, but not where the file's own edges do not; the proof counts that gap too.
    for (&x, &at) in p.iter().zip(&uv) {
        if (surface.point(at) - x).length() > out.sag {
            out.sag = out.sag.max(nearest_from(surface, x, at).1);
        }
    }
    // …and from the facet to the surface, at the points of a quadrature, so that the mean is one by area.
    let mut feet: SmallVec<[Foot; 2 * POINTS.len()]> = SmallVec::new();
    for (k, t) in triangles.iter().enumerate() {
        for (weight, b) in POINTS {
            let x = p[t[0]] * b[0] + p[t[1]] * b[1] + p[t[2]] * b[2];
            // Parameters linear on the triangle start the search; the foot is what counts.
            let (at, away) = nearest_from(surface, x, uv[t[0]] * b[0] + uv[t[1]] * b[1] + uv[t[2]] * b[2]);
            feet.push(Foot {
                x,
                uv: at,
                away,
                weight: flat[k].doubled_area() * weight,
                normal: interpolated_normal(triangles.len() == 1, t, b, n),
            });
        }
    }
    let pieces: SmallVec<[[Uv; 3]; 2]> = triangles.iter().map(|t| t.map(|k| uv[k])).collect();
    out.sag = farthest_foot(surface, &mut feet, &pieces, out.sag);
    let area: f64 = flat.iter().map(TriangleFrame::doubled_area).sum();
    out.mean = feet.iter().map(|f| f.weight * f.away).sum::<f64>() / area;
    let middle = uv.into_iter().sum::<Uv>() * 0.25;
    for foot in &feet {
        let at = beside_knots(surface.spline, foot.uv, middle);
        if let (Some(a), Some(e)) = (foot.normal.try_normalize(), surface.spline.normal(at)) {
            // The arctangent keeps its digits at small angles, where a cosine has none.
            out.normal_errors.push(a.cross(e).length().atan2(a.dot(e)) as f32);
        }
    }
    out.evaluations = surface.evaluations();
    out
}

/// Returns parameters `at`, moved a little towards `middle` off knots inside the domain: there the spline may have a crease, of which it is
/// evaluated on the far side. Ends of the domain stay, as poles may lie on them.
fn beside_knots(spline: &Surface, mut at: Uv, middle: Uv) -> Uv {
    for (d, [low, high]) in spline.domain().into_iter().enumerate() {
        let near = BESIDE_KNOT * (high - low);
        let first = spline.knots[d].partition_point(|&k| k < at[d] - near);
        let knot = spline.knots[d].get(first).copied().filter(|&k| k <= at[d] + near && low < k && k < high);
        if let Some(knot) = knot {
            at[d] = knot + BESIDE_KNOT * (middle[d] - knot);
        }
    }
    at
}

/// Returns the largest distance of the feet, or `least` where none is farther; feet beyond it are looked for again over the triangles
/// `pieces` of parameters and moved where that is nearer.
fn farthest_foot(surface: &CountedSurface<'_>, feet: &mut [Foot], pieces: &[[Uv; 3]], least: f64) -> f64 {
    // Only the farthest can raise the largest distance: it alone is looked for again, as long as that brings it nearer.
    while let Some(foot) = feet.iter_mut().max_by(|a, b| a.away.total_cmp(&b.away)) {
        // Two ends of one distance differ by rounding, and no search decides which is right.
        if foot.away <= least * (1.0 + STILL) {
            return least.max(foot.away);
        }
        // A single start may end beside the nearest point: uneven weights bend the parameters, and steps end where they leave the domain.
        let is_plain = |&(uv, away): &(Uv, f64)| away <= least * (1.0 + UNEVEN) && surface.is_inside(uv);
        let (other, nearer) = search_even_pieces(surface, foot.x, pieces, (foot.uv, foot.away))
            .filter(is_plain)
            .unwrap_or_else(|| {
                let whole: SmallVec<[_; 4]> = pieces.iter().flat_map(|&t| piece_with_pole(surface, t)).collect();
                nearest_from(surface, foot.x, search_pieces(surface, foot.x, &whole))
            });
        if nearer >= foot.away * (1.0 - STILL) {
            return foot.away;
        }
        (foot.uv, foot.away) = (other, nearer);
    }
    least
}

/// Whether two corners of a triangle are one place, a pole, though their parameters differ: it has come to a line, and the surface over its
/// parameters, up to the pole along parameter lines, is that of its neighbours.
fn is_side_of_pole(surface: &CountedSurface<'_>, corners: [(Uv, Point); 3]) -> bool {
    (0..3).any(|k| {
        let [(uv, place), (other, same), (_, third)] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
        let is_pole =
            || (surface.point(0.5 * (uv + other)) - place).length() <= SAME_PLACE * (third - place).length();
        place == same && uv != other && is_pole()
    })
}

/// Returns triangles of parameters that cover the surface under a facet's triangle `t`: two where one of its corners is a pole, whose one
/// point is all the side of the domain between the parameters of the other two.
fn piece_with_pole(surface: &CountedSurface<'_>, t: [Uv; 3]) -> SmallVec<[[Uv; 3]; 2]> {
    let places = t.map(|uv| surface.point(uv));
    let near = SAME_PLACE * (places[1] - places[0]).length().max((places[2] - places[0]).length());
    for (k, d) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)] {
        let [a, b] = [t[(k + 1) % 3], t[(k + 2) % 3]];
        let beside = [a, b].map(|other| {
            let mut uv = t[k];
            uv[d] = other[d];
            uv
        });
        if beside[0] != beside[1] && beside.iter().all(|&uv| (surface.point(uv) - places[k]).length() <= near) {
            return SmallVec::from_buf([[a, b, beside[1]], [a, beside[1], beside[0]]]);
        }
    }
    SmallVec::from_slice(&[t])
}

/// Returns the normal, not of unit length, at barycentric `b` of triangle `t` (corner numbers) of a facet: bilinear in the quad's own
/// parameters, linear on a facet that is a single triangle.
fn interpolated_normal(single: bool, t: &[usize; 3], b: [f64; 3], n: [Vector; 4]) -> Vector {
    if single {
        return n[0] * b[0] + n[1] * b[1] + n[2] * b[2];
    }
    let (u, v) = if t[1] == 1 { (b[1] + b[2], b[2]) } else { (b[1], b[1] + b[2]) };
    n[0] * ((1.0 - u) * (1.0 - v)) + n[1] * (u * (1.0 - v)) + n[2] * (u * v) + n[3] * ((1.0 - u) * v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::model::{Face, Part, Shell};
    use crate::nurbs::sweep;
    use crate::tessellate::{Settings, tessellate};

    const RADIUS: f64 = 10.0;

    /// A piece of a ball around the origin whose parameters crowd: weights that grow by powers of `crowding` move them and no point.
    fn ball(crowding: f64) -> Model {
        let mut surface = sweep::sphere(&Frame::IDENTITY, RADIUS, [0.0, 0.8], [-0.3, 0.4]);
        assert_eq!(surface.counts(), [3, 3]);
        surface.points.iter_mut().enumerate().for_each(|(k, p)| *p *= crowding.powi((k / 3 + k % 3) as i32));
        let shells = vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }];
        Model::from_part(Part { shells, ..Part::default() })
    }

    /// The foot of a point inside a ball lies on the line from its centre, however far from a place of equal shares the weights put it.
    #[test]
    fn feet_on_a_ball_are_found_however_its_parameters_crowd() {
        for crowding in [1.0, 30.0, 1e3] {
            let model = ball(crowding);
            let surface = CountedSurface::new(&model.parts[0].shells[0].faces[0].surface);
            let corners = corners(surface.spline);
            let halves = [[0, 1, 2], [0, 2, 3]];
            for (half, b) in halves.into_iter().flat_map(|half| POINTS.map(|(_, b)| (half, b))) {
                // Sides of the flat triangle lie over great circles, which leave the piece.
                let inside = [0, 1, 2].map(|k| 0.2 + 0.4 * b[k]);
                let x = (0..3).map(|k| surface.point(corners[half[k]]) * inside[k]).sum::<Point>();
                let mut feet = [foot(&surface, x, corners[half[0]])];
                let sag = RADIUS - x.length();
                let away = farthest_foot(&surface, &mut feet, &halves.map(|t| t.map(|k| corners[k])), 0.99 * sag);
                // A step and a search each end where less than that share is gained, and a step leaves a seventh of what the last one did.
                assert!((away - sag).abs() < 3.0 * STILL * sag, "{crowding}, {x}: {away} of {sag}");
            }
        }
    }

    /// Beside a slanting sheet the foot lies on its border, where a step towards the plane's own foot leads astray.
    #[test]
    fn feet_on_a_slanting_border_are_found() {
        let sheet = |u: f64, v: f64| Point::new(u + 0.8 * v, 0.6 * v, 0.0);
        let places = [(0.0, 0.0), (0.0, 10.0), (10.0, 0.0), (10.0, 10.0)];
        let points = places.map(|(u, v)| sheet(u, v).extend(1.0)).to_vec();
        let knots = || vec![0.0, 0.0, 10.0, 10.0];
        let surface = Surface { degree: [1, 1], knots: [knots(), knots()], points };
        let across = Vector::new(-0.6, 0.8, 0.0);
        let [a, b, c, d] = corners(&surface);
        for v in [2.0, 4.0, 7.5] {
            let x = sheet(0.0, v) + across * 0.3 + Vector::Z * 0.4;
            let surface = CountedSurface::new(&surface);
            // The nearest place of all others is 1 % nearer to the point than the foot is.
            let away = farthest_foot(&surface, &mut [foot(&surface, x, b)], &[[a, b, c], [a, c, d]], 0.495);
            assert!((away - 0.5).abs() < 1e-3, "{v}: {away}");
        }
    }

    /// A corner of a plane whose one side runs with `v` and the other with its cube: the facet's own triangle of parameters, with one place
    /// of the pole, covers less than half of it.
    #[test]
    fn feet_beside_a_pole_are_found_on_either_side_of_it() {
        let cubic = [0.0, 0.0, 0.0, 1.0].map(|x| Point::X * 0.3 * x);
        let linear = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|y| Point::Y * y);
        let points = [cubic, linear].as_flattened().iter().map(|p| p.extend(1.0)).collect();
        let knots = [vec![0.0, 0.0, 1.0, 1.0], [vec![0.0; 4], vec![1.0; 4]].concat()];
        let surface = Surface { degree: [1, 3], knots, points };
        let surface = CountedSurface::new(&surface);
        let uv = [Uv::new(1.0, 0.45), Uv::new(0.0, 1.0), Uv::new(0.5, 0.0)];
        for (_, b) in POINTS {
            let x = (0..3).map(|k| surface.point(uv[k]) * b[k]).sum::<Point>();
            let away = farthest_foot(&surface, &mut [foot(&surface, x, uv[2])], &[uv], 1e-6);
            assert!(away <= 1e-6, "{b:?}: {away}");
        }
    }

    /// A flat face of which two sides are one corner: S(u, v) = (uv, uv (u − v)). The facet between both ends of the one side is a line,
    /// over whose parameters the surface goes 0.13 mm to the side, where other facets are.
    #[test]
    fn a_facet_that_a_pole_has_made_a_line_stands_for_nothing() {
        let o = Point::ZERO;
        let [a, b, c, d] = [(0.25, 0.0), (0.5, -0.5), (0.5, 0.5), (1.0, 0.0)].map(|(x, y)| Point::new(x, y, 0.0));
        let knots = || vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let points = [o, o, o, o, a, b, o, c, d].map(|p| p.extend(1.0)).to_vec();
        let surface = Surface { degree: [2, 2], knots: [knots(), knots()], points };
        let uvs = [Uv::ZERO, Uv::splat(0.6), Uv::Y];
        assert!((surface.evaluate(Uv::new(0.2, 0.7)) - Point::new(0.14, -0.07, 0.0)).length() < 1e-12);
        let place = |uv: Uv| surface.evaluate(uv);
        let positions = vec![o, place(uvs[1])];
        let vertices = [0, 1, 0].into_iter().zip(uvs);
        let vertices =
            vertices.map(|(position, uv)| crate::mesh::MeshVertex { position, normal: Vector::Z, uv }).collect();
        let facets = vec![crate::mesh::Facet { vertices: [0, 1, 2, 2], face: crate::math::FaceId(0) }];
        let mesh = FacetMesh { positions, vertices, facets, sag: vec![] };
        let shells = vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let sag = sample_mesh(&mesh, &model)[0].sag;
        assert!(sag < 1e-3, "{sag}");
    }

    /// Two flat pieces at a right angle, whose facets are exact, and so are their normals up to the crease.
    #[test]
    fn normals_at_a_crease_are_those_of_the_facets_own_side() {
        let profile = [Point::ZERO, Point::X, Point::X + Point::Z];
        let points = profile.iter().flat_map(|&p| [p, p + Point::Y]).map(|p| p.extend(1.0)).collect();
        let knots = [vec![0.0, 0.0, 1.0, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]];
        let surface = Surface { degree: [1, 1], knots, points };
        for (side, normal) in [(0.5, Vector::Z), (1.5, -Vector::X)] {
            let at = beside_knots(&surface, Uv::new(1.0, 0.0), Uv::new(side, 0.5));
            assert!(
                surface.normal(at).is_some_and(|n| (n - normal).length() < 1e-12) && at.y == 0.0,
                "{side}: {at}"
            );
        }
        let shells = vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let mesh = tessellate(&model, &Settings::uniform(1e-2)).mesh;
        let errors: Vec<f32> = sample_mesh(&mesh, &model).into_iter().flat_map(|s| s.normal_errors).collect();
        assert!(!errors.is_empty() && errors.iter().all(|e| *e < 1e-6), "{errors:?}");
    }

    /// Returns the corners of a surface's domain, in turn.
    fn corners(surface: &Surface) -> [Uv; 4] {
        let [[u0, u1], [v0, v1]] = surface.domain();
        [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Uv::new(u, v))
    }

    /// Returns the foot that is found from a place.
    fn foot(surface: &CountedSurface<'_>, x: Point, start: Uv) -> Foot {
        let (uv, away) = nearest_from(surface, x, start);
        Foot { x, uv, away, weight: 1.0, normal: Vector::Z }
    }

    /// A second search for a foot goes no farther than until parameters are even: it takes less than places and first feet do.
    #[test]
    fn even_parameters_are_searched_a_few_times() {
        let model = ball(1.0);
        let mesh = tessellate(&model, &Settings::uniform(1e-4)).mesh;
        let mut evaluations: Vec<u64> = sample_mesh(&mesh, &model).iter().map(|s| s.evaluations).collect();
        evaluations.sort_unstable();
        let places = ((GRID + 1) * (GRID + 1) + 4 + 2 * POINTS.len()) as u64;
        // At the border of the surface it goes on.
        let median = evaluations[evaluations.len() / 2];
        assert!(median < 2 * places, "{median} of {places}");
    }
}
