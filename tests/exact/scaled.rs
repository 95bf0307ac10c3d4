//! Parts that are placed at other scales: bands are lengths of the world.

use crate::support::*;
use lampyris::intersect::Cost;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::math::{Frame, Point, Ray, Uv, Vector};
use lampyris::model::{EdgeUse, Face, Instance, Model, Part, PartId, Shell, TrimLoop};
use lampyris::nurbs::{UvCurve, sweep};

/// A square of `size` units with a slot through its middle, whose left side lies `beyond` units behind the middle.
fn slotted(size: f64, beyond: f64) -> Face {
    let rectangle = |[u0, u1]: [f64; 2], [v0, v1]: [f64; 2]| {
        let corners = [[u0, v0], [u1, v0], [u1, v1], [u0, v1]].map(Uv::from);
        let side = |k: usize| UvCurve::line(corners[k], corners[(k + 1) % 4], [0.0, 1.0]);
        (0..4).map(|k| EdgeUse { edge: None, reversed: false, uv: side(k) }).collect::<Vec<_>>()
    };
    let outer = rectangle([0.0, size], [0.0, size]);
    // Clockwise.
    let mut slot = rectangle([0.5 * size + beyond, 0.7 * size], [0.2 * size, 0.8 * size]);
    slot.reverse();
    for side in &mut slot {
        side.reversed = true;
    }
    let loops = [outer, slot].map(|uses| TrimLoop { uses }).to_vec();
    Face { loops, ..face(sweep::plane(&Frame::IDENTITY, [[0.0, size]; 2])) }
}

#[test]
fn roots_beside_a_trim_are_flagged_at_every_scale() {
    const SIZE_MM: f64 = 100.0;
    // The band is 1e-6 mm.
    const BEYOND_MM: f64 = 3e-7;
    for scale in [1.0, 1e-3, 1e3] {
        let face = slotted(SIZE_MM / scale, BEYOND_MM / scale);
        let part = Part { shells: vec![Shell { faces: vec![face], ..Shell::default() }], ..Part::default() };
        let mut model = Model::from_part(part);
        let place = |scale: f64, z: f64| Frame { scale, ..Frame::translation(z * Vector::Z) };
        model.instances[0].placement = place(scale, 0.0);
        // Another place of the same part, ten times as large, does not change what the first one needs.
        model.instances.push(Instance {
            part: PartId(0),
            placement: place(10.0 * scale, -50.0),
            ..model.instances[0].clone()
        });
        let exact = Exact::build(&model, &Settings::default());
        // Half of the domain is where two cells of the face's grid meet: the slot begins in the second.
        for (off, inside, flagged) in [
            (-6e-7, true, true),
            (-2e-7, true, true),
            (8e-7, false, true),
            (-2e-6, true, false),
            (2e-6, false, false),
        ] {
            let x = 0.5 * SIZE_MM + BEYOND_MM + off;
            let ray = Ray::new(Point::new(x, 0.5 * SIZE_MM, 10.0), -Vector::Z).with_range(0.0, 20.0);
            let answer = exact.first(&ray, &mut Cost::default());
            assert_eq!(answer.near_trim, flagged, "{off} mm at a scale of {scale}");
            // Within the band of a free border either answer is right.
            assert!(flagged || answer.hit.is_some() == inside, "{off} mm at a scale of {scale}: {answer:?}");
        }
    }
}
