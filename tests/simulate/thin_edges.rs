//! Light next to the thin edge of a body that lies on another: each face is crossed, however near to a contact it is.

use crate::touching::{on_facets, on_spline};
use crate::turned::assembly;
use lampyris::math::{Point, Vector};
use lampyris::model::{Face, Model, Part, Shell};
use lampyris::nurbs::Surface;
use lampyris::simulate::Results;
use std::f64::consts::PI;

/// Angle of the edge, radians: 2°.
const EDGE: f64 = PI / 90.0;
/// Angle of the light in the base to its top, radians: 5°.
const GRAZING: f64 = PI / 36.0;
/// Default of `[run] glue_mm`.
const GLUE: f64 = 1e-3;

fn patch(corners: [Point; 4]) -> Face {
    let knots = vec![0.0, 0.0, 1.0, 1.0];
    let [a, b, c, d] = corners.map(|p| p.extend(1.0));
    Face::whole(Surface { degree: [1, 1], knots: [knots.clone(), knots], points: vec![a, d, b, c] })
}

/// A prism from y = −5 to 5 over a convex quadrangle in x and z, counterclockwise with x to the right and z up.
fn prism(name: &str, outline: [[f64; 2]; 4]) -> Part {
    let at = |k: usize, y: f64| Point::new(outline[k % 4][0], y, outline[k % 4][1]);
    let mut faces: Vec<Face> =
        (0..4).map(|k| patch([at(k, 5.0), at(k + 1, 5.0), at(k + 1, -5.0), at(k, -5.0)])).collect();
    faces.push(patch([0, 1, 2, 3].map(|k| at(k, -5.0))));
    faces.push(patch([3, 2, 1, 0].map(|k| at(k, 5.0))));
    let shells = vec![Shell { faces, closed: true, ..Shell::default() }];
    Part { name: name.into(), shells, ..Part::default() }
}

/// A base with its top in z = 0, on it a wedge with its edge along y in the origin and its back at x = 10, with a gap between, and, where
/// `covered`, a cover on the wedge that ends over its edge.
fn wedge_on_base(gap: f64, covered: bool) -> Model {
    let tan = EDGE.tan();
    let mut parts = vec![
        prism("base", [[-40.0, -5.0], [40.0, -5.0], [40.0, 0.0], [-40.0, 0.0]]),
        prism("wedge", [[0.0, gap], [10.0, gap], [10.1, gap + 5.0 * tan], [10.0, gap + 10.0 * tan]]),
    ];
    if covered {
        parts.push(prism("cover", [[0.0, gap], [10.0, gap + 10.0 * tan], [10.0, 8.0], [0.0, 8.0]]));
    }
    assembly(parts)
}

/// The direction behind an interface with this normal, on the light's side of it or not, and the share that passes (Snell, Fresnel).
fn refracted(d: Vector, normal: Vector, [n1, n2]: [f64; 2]) -> (Vector, f64) {
    let n = normal * normal.dot(d).signum();
    let (eta, cos_i) = (n1 / n2, n.dot(d));
    let cos_t = (1.0 - eta * eta * (1.0 - cos_i * cos_i)).sqrt();
    let s = ((n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)).powi(2);
    let p = ((n1 * cos_t - n2 * cos_i) / (n1 * cos_t + n2 * cos_i)).powi(2);
    (d * eta + n * (cos_t - eta * cos_i), 1.0 - 0.5 * (s + p))
}

/// A way through base and wedge in closed form.
struct Way {
    /// Where it meets the top of the base.
    contact: Point,
    /// Directions in the base and beyond the wedge.
    ends: [Vector; 2],
    /// Where it leaves the wedge.
    exit: Point,
    /// What passes both interfaces.
    share: f64,
}

/// The way that meets the top of the base at `x` towards the edge (`sign` −1) or away from it (1), from `indices[0]` through the wedge
/// over a gap into `indices[2]`.
fn way(x: f64, sign: f64, gap: f64, indices: [f64; 3]) -> Way {
    let d = Vector::new(sign * GRAZING.cos(), 0.0, GRAZING.sin());
    let slope = Vector::new(-EDGE.sin(), 0.0, EDGE.cos());
    let (inside, share) = refracted(d, Vector::Z, [indices[0], indices[1]]);
    let (out, share_out) = refracted(inside, slope, [indices[1], indices[2]]);
    let contact = Point::new(x, 0.0, 0.0);
    // Light that was refracted at the top of the base goes on to the wedge from there, over a gap as through glass.
    let exit = contact + inside * ((Point::new(0.0, 0.0, gap) - contact).dot(slope) / inside.dot(slope));
    Way { contact, ends: [d, out], exit, share: share * share_out }
}

fn text(model: &Model, indices: &[f64], around: f64) -> String {
    let mut text = format!(
        "ambient = 'around'\n[run]\nrays = 100\ninterfaces = 'split'\nsplit_floor = 0\n[[medium]]\nname = 'around'\nindex = {around:?}\n"
    );
    for (part, index) in model.parts.iter().zip(indices) {
        let name = &part.name;
        text += &format!(
            "[[medium]]\nname = 'of {name}'\nindex = {index:?}\n[[material]]\npart = '{name}'\nmedium = 'of {name}'\n"
        );
    }
    text
}

/// A beam of 0.1 µm from a place along a direction, and a receiver of 0.2 mm across another direction.
fn beam(from: Point, along: Vector, to: Point, across: Vector) -> String {
    format!(
        "[[source]]\nkind = 'collimated'\nat = {:?}\ndirection = {:?}\nradius = 1e-4
        [[receiver]]\nname = 'end'\nat = {:?}\nnormal = {:?}\nsize = [0.2, 0.2]\n",
        from.to_array(),
        along.to_array(),
        to.to_array(),
        across.to_array()
    )
}

fn on_both(model: &Model, text: &str) -> [(&'static str, Results); 2] {
    [("facets", on_facets(model, text)), ("spline", on_spline(model, text))]
}

/// From the base through the wedge and out, and back: nearer than the light takes to get through the glue distance, and farther.
#[test]
fn light_crosses_a_wedge_next_to_its_edge() {
    let indices = [1.5, 1.52];
    for (gap, covered) in [(0.0, false), (0.0, true), (0.5 * GLUE, false), (0.5 * GLUE, true)] {
        // Without a cover the surroundings take its place.
        let (model, cover) = (wedge_on_base(gap, covered), 1.55);
        for (x, sign) in [2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.2].into_iter().flat_map(|x| [(x, 1.0), (x, -1.0)]) {
            let way = way(x, sign, gap, [indices[0], indices[1], cover]);
            // Light that goes through the gap beside the wedge, or out of the end of the cover over the edge, is not checked where it
            // goes. The beam is 2.3 µm long where it meets the base.
            let beside = sign < 0.0 && (covered || x < gap / GRAZING.tan() + 1.5e-3);
            let [inside, out] = way.ends;
            let (low, high) = (way.contact - inside * 20.0, way.exit + out * 5.0);
            let all = text(&model, &[indices[0], indices[1], cover], if covered { 1.0 } else { cover });
            for (name, ends) in [
                ("up", beam(low, inside, high, out)),
                ("down", beam(high, -out, way.contact - inside * 5.0, -inside)),
            ] {
                for (surface, found) in on_both(&model, &(all.clone() + &ends)) {
                    let case = format!("{name}, x {x} {sign}, gap {gap}, covered {covered}, {surface}");
                    assert_eq!(found.lost_rays, 0, "{case}: {:?}", found.ledger.first());
                    let power = found.receivers[0].power;
                    assert!(beside || (power - way.share).abs() < 1e-5, "{case}: {power}, not {}", way.share);
                }
            }
        }
    }
}

/// Base and wedge of one glass in air: light that is totally reflected at the slope comes back into the base, steeper by twice the angle of
/// the edge, and none is lost.
#[test]
fn light_that_a_slope_reflects_crosses_its_contact_again() {
    let model = wedge_on_base(0.0, false);
    for x in [2e-3, 5e-3, 1e-2, 2e-2, 5e-2] {
        for sign in [-1.0, 1.0] {
            let way = way(x, sign, 0.0, [1.5; 3]);
            let back = GRAZING - sign * 2.0 * EDGE;
            let down = Vector::new(sign * back.cos(), 0.0, -back.sin());
            // Away from the edge it meets the slope at 3° and comes back at 1°.
            let to = way.exit + down * 5.0;
            let all = text(&model, &[1.5, 1.5], 1.0);
            let ends = beam(way.contact - way.ends[0] * 20.0, way.ends[0], to, down);
            for (surface, found) in on_both(&model, &(all + &ends)) {
                assert_eq!(found.lost_rays, 0, "x {x} {sign}, {surface}: {:?}", found.ledger.first());
                assert!((found.receivers[0].power - 1.0).abs() < 1e-9, "x {x} {sign}, {surface}");
            }
        }
    }
}
