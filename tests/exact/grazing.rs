//! Rays that graze surfaces: none is missed with a certificate; and, when asked for, how long they take.

use crate::support::*;
use lampyris::intersect::exact::{Exact, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{Ray, Uv, Vector};
use lampyris::nurbs::Surface;
use std::time::Instant;

/// Rays that meet a point of the surface under an angle of 1e-6 to 1e-3 to the tangent plane, from outside and from inside.
fn grazing(surface: &Surface, n: usize) -> Vec<Ray> {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let mut s = Random(77);
    (0..n)
        .map(|_| {
            let [u, v] = [s.within(u0, u1), s.within(v0, v1)];
            let at = surface.derivatives(Uv::new(u, v));
            let normal = at.du.cross(at.dv).normalize();
            let along = normal.cross(s.direction()).normalize();
            let angle = 10f64.powf(s.within(-6.0, -3.0)) * if s.unit() < 0.5 { -1.0 } else { 1.0 };
            let d: Vector = (along + normal * angle).normalize();
            Ray::new(at.point - d * 300.0, d)
        })
        .collect()
}

/// Surfaces that curve in different ways, by name.
fn surfaces() -> [(&'static str, Surface); 4] {
    [
        ("sphere", sphere(50.0)),
        ("torus", torus(50.0, 15.0)),
        ("bicubic", bicubic()),
        ("freeform 20 x 20", reflector(20)),
    ]
}

/// Each ray goes through a point of the surface, to rounding, and beneath it by 2.5e-11 mm at least.
#[test]
fn grazing_rays_are_never_missed_with_a_certificate() {
    for (name, surface) in surfaces() {
        let rays = grazing(&surface, 2000);
        let exact = Exact::build(&model([surface]), &Settings::default());
        for ray in &rays {
            let answer = exact.first(ray, &mut Cost::default());
            assert!(answer.hit.is_some() || answer.certainty != Certainty::Certified, "{name}: {ray:?}");
        }
    }
}

#[test]
#[ignore = "prints times, which mean something in release and on a quiet machine alone"]
fn grazing_rays_take_how_long() {
    const RAYS: usize = 20_000;
    for (name, surface) in surfaces() {
        let rays = grazing(&surface, RAYS);
        let exact = Exact::build(&model([surface]), &Settings::default());
        // The shortest of three: being interrupted by other work takes milliseconds.
        let mut each = vec![(f64::INFINITY, true); RAYS];
        let mut flagged = 0;
        for pass in 0..3 {
            for (ray, shortest) in rays.iter().zip(&mut each) {
                let start = Instant::now();
                let answer = exact.first(ray, &mut Cost::default());
                let time = start.elapsed().as_secs_f64() * 1e6;
                let certified = answer.certainty == Certainty::Certified;
                *shortest = (shortest.0.min(time), certified);
                if pass == 0 {
                    flagged += usize::from(!certified);
                }
            }
        }
        each.sort_by(|a, b| a.0.total_cmp(&b.0));
        let worst = each.iter().rfind(|e| e.1).map_or(0.0, |e| e.0);
        println!(
            "{name:18} median {:6.2} µs, p99 {:7.2} µs, worst {:8.2} µs, worst unflagged {worst:8.2} µs; {flagged} of {RAYS} \
             flagged",
            each[RAYS / 2].0,
            each[RAYS * 99 / 100].0,
            each[RAYS - 1].0,
        );
    }
}
