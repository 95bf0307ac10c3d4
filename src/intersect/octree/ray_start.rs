//! Where a ray starts against the boxes of a mesh.

use super::mesh_box::MeshBox;
use super::ray::{BoxRay, Rows, SieveRay};
use crate::math::Ray;

/// Smallest component of a direction that is divided by: along it a ray moves by less than the room around boxes in 10⁵ scene
/// sizes, and 1e12 mm times its inverse is still a number in f32.
pub(super) const LEAST_COMPONENT: f64 = 1e-18;
/// What a start that was moved along its ray is wrong by, relative to the way: four roundings in f64.
pub(super) const SHIFT_ERROR: f64 = 1e-15;
/// Rounding of f32, 2⁻²⁴, rounded up.
pub(super) const ROUNDING: f32 = 6e-8;

/// Overwrites what box tests and sieves need of a ray, in the mesh's coordinates, but for its range and shear, in plain Rust. Returns where
/// box distances start, mm along the ray; `None` where it passes by the whole mesh. `slack` is how wrong its start may be, mm.
///
/// Far origins are moved to where they enter, since f32 is good only near the mesh. Rays of one kind mostly start all inside or all
/// outside.
#[inline(always)]
pub(super) fn start(
    ray: &Ray,
    mesh_box: &MeshBox,
    slack: f64,
    boxes: &mut BoxRay,
    sieve: &mut SieveRay,
) -> Option<f64> {
    let direction = [ray.direction.x, ray.direction.y, ray.direction.z, 1.0];
    let origin = [ray.origin.x, ray.origin.y, ray.origin.z, 0.0];
    let inverse = direction.map(|d| 1.0 / if d.abs() < LEAST_COMPONENT { LEAST_COMPONENT.copysign(d) } else { d });
    let shift = match mesh_box.inner_start(ray) {
        Some(start) if mesh_box.holds(origin) => start,
        _ => enter_mesh(ray, mesh_box, origin, inverse)?,
    };
    let moved = moved(slack, shift);
    let mut octant = 0;
    // Not the way to the mesh as a fourth: sieves need the largest.
    (boxes.origin[3], boxes.inverse[3], boxes.slack[3]) = (0.0, 1.0, 0.0);
    (sieve.high[3], sieve.low[3]) = (0.0, 0.0);
    for a in 0..3 {
        let inverse = inverse[a] as f32;
        let exact = (origin[a] - mesh_box.center[a]) + direction[a] * shift;
        let o = exact as f32;
        boxes.origin[a] = o;
        boxes.inverse[a] = inverse;
        boxes.slack[a] = ((4.0 * o.abs() + mesh_box.reach[a]) * ROUNDING + moved) * inverse.abs();
        sieve.high[a] = o;
        sieve.low[a] = (exact - f64::from(o)) as f32;
        octant |= usize::from(inverse < 0.0) << a;
    }
    boxes.rows = Rows::ALL[octant];
    sieve.slack = moved;
    Some(shift)
}

/// How wrong a start may be that was moved along its ray, mm.
#[inline(always)]
pub(super) fn moved(slack: f64, shift: f64) -> f32 {
    (slack + shift.abs() * SHIFT_ERROR) as f32
}

/// Where a ray that starts outside enters the box around the mesh, mm along it; `None` where it passes by. The last of four lanes does not
/// count.
#[inline(always)]
pub(super) fn enter_mesh(ray: &Ray, mesh_box: &MeshBox, origin: [f64; 4], inverse: [f64; 4]) -> Option<f64> {
    let passage = mesh_box.passage(ray, origin, inverse);
    // Guessed wrong at times, but most rays of a source that shines all around end here.
    ((passage.near <= passage.far) & passage.near.is_finite()).then_some(passage.near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::{Instructions, Kernel, Level};
    use crate::math::{Aabb, Point, Vector};

    /// A range that begins a little before a start inside begins there, in the box or not; one from far before it where it enters the box.
    #[test]
    fn ranges_that_begin_before_their_start_begin_near_the_mesh() {
        let bounds = Aabb { min: Point::new(-3.0, 0.0, 5.0), max: Point::new(7.0, 2.0, 11.0) };
        let mesh_box = MeshBox::new(Point::new(2.0, 1.0, 8.0), &bounds);
        for (t_min, begins) in [(0.2, 0.0), (0.0, 0.0), (-0.2, -0.2), (-3.0, -3.0), (-100.0, -1.0)] {
            let ray = Ray::new(Point::new(1.0, 0.5, 6.0), Vector::Z).with_range(t_min, f64::INFINITY);
            for level in [Level::PORTABLE, Level::avx2()] {
                let (found, boxes, _) = level.run(Start { ray: &ray, mesh_box: &mesh_box });
                assert!((found.unwrap() - begins).abs() < 1e-12, "{t_min}: {found:?}");
                assert_eq!(boxes.origin[2], (6.0 - 8.0 + begins) as f32);
            }
        }
    }

    /// What a ray is in boxes and sieves.
    struct Start<'a> {
        ray: &'a Ray,
        mesh_box: &'a MeshBox,
    }

    impl Kernel for Start<'_> {
        type Output = (Option<f64>, BoxRay, SieveRay);

        fn run<I: Instructions>(self) -> Self::Output {
            let (mut boxes, mut sieve) = (BoxRay::default(), SieveRay::default());
            #[cfg(target_arch = "x86_64")]
            if I::AVX2 {
                let shift =
                    super::super::ray_start_avx2::start(self.ray, self.mesh_box, 0.5, &mut boxes, &mut sieve);
                return (shift, boxes, sieve);
            }
            (start(self.ray, self.mesh_box, 0.5, &mut boxes, &mut sieve), boxes, sieve)
        }
    }

    /// From inside, from a side, a corner and far off, along axes and past: all instruction sets say the same, and the way to the mesh
    /// is no size of what a sieve needs.
    #[test]
    fn rays_start_alike_with_all_instructions() {
        let bounds = Aabb { min: Point::new(-3.0, 0.0, 5.0), max: Point::new(7.0, 2.0, 11.0) };
        let mesh_box = MeshBox::new(Point::new(2.0, 1.0, 8.0), &bounds);
        let inside = Point::new(1.0, 0.5, 6.0);
        for (origin, direction, shift) in [
            (inside, Vector::new(0.6, -0.0, -0.8), Some(0.0)),
            (inside, Vector::new(-1e-20, 1.0, 0.0), Some(0.0)),
            (Point::new(2.0, 1.0, 1e5), -Vector::Z, Some(1e5 - 11.0)),
            (Point::new(-7.0, 0.5, 2.0), Vector::new(0.8, 0.0, 0.6), Some(5.0)),
            (Point::new(2.0, 1.0, 1e5), Vector::Z, None),
        ] {
            let ray = Ray::new(origin, direction);
            let [plain, other] =
                [Level::PORTABLE, Level::avx2()].map(|level| level.run(Start { ray: &ray, mesh_box: &mesh_box }));
            assert_eq!(plain.0.is_some(), shift.is_some(), "{ray:?}");
            let Some(shift) = shift else { continue };
            for (found, boxes, sieve) in [plain, other] {
                // To the rounding of where it enters, which is outward.
                let found = found.unwrap();
                assert!(found <= shift && found >= shift * (1.0 - 1e-12), "{found} {shift}");
                let start = ray.point_at(found) - Point::new(2.0, 1.0, 8.0);
                for a in 0..3 {
                    assert!((f64::from(boxes.origin[a]) - start[a]).abs() < 1e-6 * start[a].abs().max(1.0));
                    assert!((f64::from(sieve.high[a]) + f64::from(sieve.low[a]) - start[a]).abs() < 1e-10);
                    assert_eq!(
                        usize::from(boxes.rows.octant >> a & 1),
                        usize::from(direction[a].is_sign_negative())
                    );
                }
                assert_eq!((sieve.high[3], sieve.low[3]), (0.0, 0.0));
            }
            assert_eq!(plain.0, other.0);
            assert_eq!(plain.1.inverse[..3], other.1.inverse[..3]);
            assert_eq!(plain.1.slack[..3], other.1.slack[..3]);
        }
    }
}
