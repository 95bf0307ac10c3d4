//! Cases on boxes: walls of cells, coincident faces, slivers, thin gaps, light guides.

use super::case::{Case, Question, Truth};
use crate::math::{Frame, Point, Ray, Vector};
use crate::nurbs::{Surface, sweep};
use crate::study::Random;

/// Makes the cases on boxes.
pub(super) fn cases() -> Vec<Case> {
    vec![cell_walls_case(), coincident_case(), slivers_case(), gap_case(), guide_case()]
}

/// Makes the six faces of a box, normals outward.
pub(super) fn block(min: Point, max: Point) -> Vec<Surface> {
    let size = max - min;
    let mut faces = Vec::new();
    for axis in 0..3 {
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        for high in [false, true] {
            let origin = if high { min + Vector::AXES[axis] * size[axis] } else { min };
            // The two directions are exchanged at the low side, so that their product looks outwards.
            let (a, b) = if high { (x, y) } else { (y, x) };
            let frame = Frame {
                origin,
                x: Vector::AXES[a],
                y: Vector::AXES[b],
                z: Vector::AXES[a].cross(Vector::AXES[b]),
                scale: 1.0,
            };
            faces.push(sweep::plane(&frame, [[0.0, size[a]], [0.0, size[b]]]));
        }
    }
    faces
}

/// Returns the function of the signed distance from a box, mm, negative inside.
pub(super) fn block_distance(min: Point, max: Point) -> impl Fn(Point) -> f64 + Send + Sync + Clone {
    move |p| {
        let d = (p - 0.5 * (min + max)).abs() - 0.5 * (max - min);
        // Outside the distance to the nearest point, inside the least depth.
        d.max(Vector::ZERO).length() + d.max_element().min(0.0)
    }
}

/// Makes the case of rays in the walls and through the corners of a tree's cells.
fn cell_walls_case() -> Case {
    let (min, max) = (Point::ZERO, Point::splat(64.0));
    let mut questions = Vec::new();
    for i in 0..480 {
        let mut random = Random::new(41, i);
        // Multiples of an eighth are where trees and grids put their walls and corners.
        let eighth = |r: &mut Random| ((r.unit() * 7.0).floor() + 1.0) * 8.0;
        let (axis, high) = (i as usize % 3, i % 2 == 0);
        let mut o = Point::new(eighth(&mut random), eighth(&mut random), eighth(&mut random));
        if i % 4 == 1 {
            o[(axis + 1) % 3] = random.between(1.0, 63.0);
        }
        let d = if high { Vector::AXES[axis] } else { -Vector::AXES[axis] };
        let (inside, outside) = (o, o - d * 200.0);
        let exit = if high { 64.0 - o[axis] } else { o[axis] };
        questions
            .push(Question::First { ray: Ray::new(inside, d), truth: Truth::hit(exit, 1.0, 8.0).with_normal(d) });
        let entry = 200.0 - (64.0 - exit);
        questions.push(Question::All {
            ray: Ray::new(outside, d),
            truths: vec![Truth::hit(entry, 1.0, 8.0), Truth::hit(entry + 64.0, 1.0, 8.0)],
        });
        // From a cell corner through a cell corner, in a wall diagonal.
        let mut e = d;
        e[(axis + 1) % 3] = 1.0;
        let room = 64.0 - o[(axis + 1) % 3];
        let t = exit.min(room);
        if (exit - room).abs() > 1.0 {
            let ray = Ray::new(inside, e.normalize());
            questions.push(Question::First { ray, truth: Truth::hit(t * 2f64.sqrt(), 0.7, 4.0) });
        }
    }
    Case {
        name: "cell wall and corner",
        surfaces: block(min, max),
        loops: Vec::new(),
        divisions: 8,
        slack: 0.0,
        distance: Box::new(block_distance(min, max)),
        questions,
    }
}

/// Makes the case of rays that meet two faces in one place.
fn coincident_case() -> Case {
    // Two boxes that share the wall x = 10.
    let (a, b) = ((Point::ZERO, Point::splat(10.0)), (Point::new(10.0, 0.0, 0.0), Point::new(20.0, 10.0, 10.0)));
    let questions = (0..300).map(|i| {
        let mut random = Random::new(42, i);
        let target = Point::new(10.0, random.between(1.0, 9.0), random.between(1.0, 9.0));
        let d = random.hemisphere(if i % 2 == 0 { Vector::X } else { -Vector::X });
        let d = if d.x.abs() < 0.3 { Vector::X * d.x.signum() } else { d };
        // Short enough to start within the box that the ray leaves.
        let t = 0.9 * (1.0 / (d.y.abs() + d.z.abs()).max(0.15)).min(9.0 / d.x.abs());
        Question::First { ray: Ray::new(target - d * t, d), truth: Truth::hit(t, d.x, 5.0) }
    });
    let (da, db) = (block_distance(a.0, a.1), block_distance(b.0, b.1));
    Case {
        name: "coincident faces",
        surfaces: [block(a.0, a.1), block(b.0, b.1)].concat(),
        loops: Vec::new(),
        divisions: 3,
        slack: 0.0,
        distance: Box::new(move |p| if da(p).abs() < db(p).abs() { da(p) } else { db(p) }),
        questions: questions.collect(),
    }
}

/// Makes the case of rays on facets a million times as long as wide.
fn slivers_case() -> Case {
    // A bar in facets as long as the bar; its sides in mm.
    let [length, width, height] = [1000.0, 1e-3, 1e-4];
    let (min, max) = (Point::ZERO, Point::new(length, width, height));
    let questions = (0..300).map(|i| {
        let mut random = Random::new(43, i);
        let target = Point::new(random.between(1.0, length - 1.0), width * random.between(0.05, 0.95), height);
        let d = Vector::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5), -1.0).normalize();
        // Every target lies farther from the long edges than this.
        let margin = 0.04 * width;
        Question::First { ray: Ray::new(target - d * 10.0, d), truth: Truth::hit(10.0, d.z, margin) }
    });
    Case {
        name: "slivers",
        surfaces: block(min, max),
        loops: Vec::new(),
        divisions: 1,
        // Facets a million times longer than wide: barycentric weights carry 1e-11, and t follows them over 1000 mm:
        // 3e-8 mm was seen. A thousandth of the thickness.
        slack: 1e-7,
        distance: Box::new(block_distance(min, max)),
        questions: questions.collect(),
    }
}

/// Makes the case of rays through a gap of air of a micrometre, all crossings traced.
fn gap_case() -> Case {
    // 1 µm of air between two plates.
    let (a, b) = ((Point::ZERO, Point::splat(10.0)), (Point::new(10.001, 0.0, 0.0), Point::new(20.0, 10.0, 10.0)));
    let questions = (0..300).map(|i| {
        let mut random = Random::new(44, i);
        let target = Point::new(10.0, random.between(4.0, 6.0), random.between(4.0, 6.0));
        let d = Vector::new(1.0, random.between(-0.3, 0.3), random.between(-0.3, 0.3)).normalize();
        let hits = [0.0, 10.0, 10.001, 20.0].map(|x| Truth::hit(20.0 + (x - 10.0) / d.x, d.x, 1e-3));
        Question::All { ray: Ray::new(target - d * 20.0, d), truths: hits.into() }
    });
    let (da, db) = (block_distance(a.0, a.1), block_distance(b.0, b.1));
    Case {
        name: "air gap of 1 µm",
        surfaces: [block(a.0, a.1), block(b.0, b.1)].concat(),
        loops: Vec::new(),
        divisions: 3,
        slack: 0.0,
        distance: Box::new(move |p| if da(p).abs() < db(p).abs() { da(p) } else { db(p) }),
        questions: questions.collect(),
    }
}

/// Makes the case of rays that are reflected ten thousand times in a box.
fn guide_case() -> Case {
    let size = Vector::new(10.0, 7.0, 500.0);
    let questions = (0..6).map(|i| {
        let mut random = Random::new(45, i);
        let o = Point::new(random.between(1.0, 9.0), random.between(1.0, 6.0), random.between(10.0, 490.0));
        let d =
            Vector::new(random.between(0.2, 0.9), random.between(0.2, 0.9), random.between(0.3, 1.0)).normalize();
        Question::Guide { ray: Ray::new(o, d), size, reflections: 10_000 }
    });
    Case {
        name: "guide of 1e4 reflections",
        surfaces: block(Point::ZERO, size),
        loops: Vec::new(),
        divisions: 4,
        slack: 0.0,
        distance: Box::new(block_distance(Point::ZERO, size)),
        questions: questions.collect(),
    }
}
