//! Light in rooms of mirrors whose faces lie off the edges that they share, as those of files do: it stays in.

use crate::files::part21;
use crate::support::*;
use lampyris::intersect::Cost;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::math::{Homogeneous, Point, Ray, Uv, Vector};
use lampyris::model::Model;
use lampyris::nurbs::Surface;

/// Side of the room, mm.
const SIDE: f64 = 10.0;

/// A closed cube over `[0, SIDE]³`, of which each face lies off its edges by at most `gap`, mm, along its normal.
fn room(gap: f64, s: &mut Random) -> Model {
    let text = part21(
        "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2))REPRESENTATION_CONTEXT('',''));\n\
        #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n#3=SHAPE_REPRESENTATION('',(#4),#1);\n\
        #4=BLOCK('',#5,10.,10.,10.);\n#5=AXIS2_PLACEMENT_3D('',#6,$,$);\n#6=CARTESIAN_POINT('',(0.,0.,0.));\n",
    );
    let import = lampyris::step::read_bytes("room.stp", text.as_bytes(), &lampyris::step::Settings::default());
    let mut model = import.expect("Part 21").model;
    for face in &mut model.parts[0].shells[0].faces {
        // The plane goes on beyond its edges, as far as they may lie off it.
        let [[u0, u1], [v0, v1]] = face.surface.domain();
        let [corner, along_u, along_v] =
            [[u0, v0], [u1, v0], [u0, v1]].map(|[u, v]| face.surface.evaluate(Uv::new(u, v)));
        let (du, dv) = ((along_u - corner) / (u1 - u0), (along_v - corner) / (v1 - v0));
        let off = du.cross(dv).normalize() * s.within(-gap, gap);
        let ends = [[u0 - 1.0, u1 + 1.0], [v0 - 1.0, v1 + 1.0]];
        let point = |u: f64, v: f64| corner + off + du * (u - u0) + dv * (v - v0);
        face.surface = Surface {
            degree: [1, 1],
            knots: ends.map(|[low, high]| vec![low, low, high, high]),
            points: [[0, 0], [0, 1], [1, 0], [1, 1]]
                .map(|[i, j]| Homogeneous::from((point(ends[0][i], ends[1][j]), 1.0)))
                .to_vec(),
        };
        face.gap = gap;
    }
    model
}

/// A place on an edge of the room.
fn on_edge(s: &mut Random) -> Point {
    let axis = (3.0 * s.unit()) as usize % 3;
    let mut place = Point::ZERO;
    for k in 0..3 {
        place[k] = if k == axis { s.within(0.0, SIDE) } else { SIDE * f64::from(s.unit() < 0.5) };
    }
    place
}

#[test]
fn light_stays_in_a_room_whose_edges_gape() {
    for gap in [1e-6, 1e-4, 1e-2] {
        let mut s = Random(31);
        let (mut lost, mut turned) = (0, 0);
        for _ in 0..20 {
            let exact = Exact::build(&room(gap, &mut s), &Settings::default());
            for _ in 0..500 {
                let start = Point::splat(0.5 * SIDE) + 0.3 * SIDE * s.direction();
                let target = on_edge(&mut s) + s.direction() * (2.0 * gap * s.unit());
                let mut ray = Ray::from_points(start, target).expect("apart");
                for _ in 0..8 {
                    let Some(hit) = exact.first(&ray, &mut Cost::default()).hit else {
                        lost += 1;
                        break;
                    };
                    // What is inside comes to each face from its inner side.
                    if hit.normal.dot(ray.direction) <= 0.0 {
                        turned += 1;
                        break;
                    }
                    let direction = ray.direction - 2.0 * hit.normal.dot(ray.direction) * hit.normal;
                    ray = Ray::new(ray.point_at(hit.t), direction.normalize()).with_departure(hit.departure());
                }
            }
        }
        assert_eq!([lost, turned], [0, 0], "of 10,000 rays at gaps of {gap} mm");
    }
}

/// A ray that is traced on behind what it met does not meet that again, and one whose range has ended meets nothing.
#[test]
fn what_was_met_in_a_gap_is_not_met_again() {
    let gap = 1e-4;
    let exact = Exact::build(&room(gap, &mut Random(5)), &Settings::default());
    let down = Ray::new(Point::new(5.0, gap, 5.0), -Vector::Z);
    let floor = exact.first(&down, &mut Cost::default()).hit.expect("the floor lies below");
    let start = down.point_at(floor.t);
    let ray = Ray::new(start, Vector::new(0.0, -0.6, 0.8)).with_departure(floor.departure());
    let wall = exact.first(&ray, &mut Cost::default()).hit.expect("the wall stands beside");
    assert!(wall.face != floor.face && wall.t < 4.0 * gap, "{wall:?}");
    for range in [[wall.t.next_up(), f64::INFINITY], [wall.t + gap, 1.0], [0.0, -0.1 * gap]] {
        let again = exact.first(&ray.with_range(range[0], range[1]), &mut Cost::default()).hit;
        assert_eq!(again, None, "{range:?}");
    }
}
