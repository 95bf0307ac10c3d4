//! Rays of a source made many at a time: the arithmetic of one, in loops over arrays that run in vectors.

use super::stream::Stream;
use super::{Emitter, Lobe, Shape, cosine_of_cone, on_rectangle, radius_on_disc, sine_of};
use crate::math::{Point, Vector};
use crate::optics::sampling::sin_cos_turns;

/// Rays made at a time.
pub(super) const SHEAF: usize = 64;

/// A number of each ray.
pub(super) type Numbers = [f64; SHEAF];

/// Rays that start one after another.
#[derive(Clone, Debug)]
pub(super) struct Sheaf {
    origins: [Numbers; 3],
    directions: [Numbers; 3],
}

impl Sheaf {
    pub(super) fn empty() -> Box<Self> {
        Box::new(Self { origins: [[0.0; SHEAF]; 3], directions: [[0.0; SHEAF]; 3] })
    }

    /// Where the ray at one place starts, and where it goes.
    #[inline(always)]
    pub(super) fn ray(&self, k: usize) -> (Point, Vector) {
        let (k, [x, y, z], [a, b, c]) = (k % SHEAF, &self.origins, &self.directions);
        (Point::new(x[k], y[k], z[k]), Vector::new(a[k], b[k], c[k]))
    }
}

/// Sines and cosines of whole turns.
#[inline(always)]
fn sines(turns: &Numbers) -> [Numbers; 2] {
    let [mut sin, mut cos] = [[0.0; SHEAF]; 2];
    for k in 0..SHEAF {
        (sin[k], cos[k]) = sin_cos_turns(turns[k]);
    }
    [sin, cos]
}

/// Products of two numbers of each ray.
#[inline(always)]
fn products(a: &Numbers, b: &Numbers) -> Numbers {
    let mut products = [0.0; SHEAF];
    for k in 0..SHEAF {
        products[k] = a[k] * b[k];
    }
    products
}

/// A number times one of each ray.
#[inline(always)]
fn scaled(a: f64, b: &Numbers) -> Numbers {
    products(&[a; SHEAF], b)
}

/// Adds a number of each ray times a vector.
#[inline(always)]
fn add(sums: &mut [Numbers; 3], vector: Vector, numbers: &Numbers) {
    for axis in 0..3 {
        let (sums, part) = (&mut sums[axis], vector[axis]);
        for k in 0..SHEAF {
            sums[k] += part * numbers[k];
        }
    }
}

impl Emitter {
    /// Whether its rays can be made so.
    pub(super) fn makes_sheaves(&self) -> bool {
        let of_shape = matches!(self.shape, Shape::Point | Shape::Disc(_) | Shape::Rectangle(_));
        of_shape
            && match self.lobe {
                Lobe::Cone(_) | Lobe::Collimated => true,
                Lobe::Cosine(exponent) => exponent == 0.5,
                Lobe::Measured(_) => false,
            }
    }

    /// Makes the rays that start from the `started`-th on.
    #[inline(always)]
    pub(super) fn make(&self, stream: &mut Stream, started: u32) {
        let Some(mut sheaf) = stream.sheaf.take() else { return };
        self.place(stream.pairs_from(started, 0), &mut sheaf.origins);
        self.direct(stream.pairs_from(started, 1), &mut sheaf.directions);
        stream.sheaf = Some(sheaf);
    }

    #[inline(always)]
    fn place(&self, [u, v]: [Numbers; 2], origins: &mut [Numbers; 3]) {
        let f = self.frame;
        let [mut x, mut y] = [u, v];
        match self.shape {
            Shape::Disc(radius) => {
                let [sin, cos] = sines(&v);
                let mut r = u;
                for k in 0..SHEAF {
                    r[k] = radius_on_disc(radius, u[k]);
                }
                (x, y) = (products(&r, &cos), products(&r, &sin));
            }
            Shape::Rectangle(half) => {
                for k in 0..SHEAF {
                    [x[k], y[k]] = on_rectangle(half, [u[k], v[k]]);
                }
            }
            Shape::Point | Shape::Faces(_) | Shape::List(_) => {}
        }
        *origins = [[f.origin.x; SHEAF], [f.origin.y; SHEAF], [f.origin.z; SHEAF]];
        if !matches!(self.shape, Shape::Point) {
            add(origins, f.x, &x);
            add(origins, f.y, &y);
        }
    }

    #[inline(always)]
    fn direct(&self, [u, v]: [Numbers; 2], directions: &mut [Numbers; 3]) {
        let f = self.frame;
        let mut cos_theta = u;
        match self.lobe {
            Lobe::Cone(limit) => {
                for k in 0..SHEAF {
                    cos_theta[k] = cosine_of_cone(limit, u[k]);
                }
            }
            Lobe::Cosine(_) => {
                for k in 0..SHEAF {
                    cos_theta[k] = (1.0 - u[k]).sqrt();
                }
            }
            Lobe::Collimated | Lobe::Measured(_) => {
                *directions = [[f.z.x; SHEAF], [f.z.y; SHEAF], [f.z.z; SHEAF]];
                return;
            }
        }
        let mut sin_theta = cos_theta;
        for k in 0..SHEAF {
            sin_theta[k] = sine_of(cos_theta[k]);
        }
        let [sin, cos] = sines(&v);
        let [x, y] = [products(&sin_theta, &cos), products(&sin_theta, &sin)];
        *directions = [scaled(f.x.x, &x), scaled(f.x.y, &x), scaled(f.x.z, &x)];
        add(directions, f.y, &y);
        add(directions, f.z, &cos_theta);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Ray};
    use crate::simulate::scene::Sampling;
    use smallvec::SmallVec;

    /// A ray that is traced once more alone must be the one that was traced among others.
    #[test]
    fn a_ray_is_the_same_alone_and_among_others() {
        let frame = Frame::from_axis(Point::new(1.0, -2.0, 3.0), Vector::new(0.36, 0.48, -0.8), None);
        let shapes = [Shape::Point, Shape::Disc(15.0), Shape::Rectangle([0.5, 2.0])];
        let lobes = [Lobe::Cone(-1.0), Lobe::Cone(0.7), Lobe::Collimated, Lobe::Cosine(0.5), Lobe::Cosine(0.2)];
        for (shape, lobe) in shapes.iter().flat_map(|s| lobes.iter().map(move |l| (s.clone(), l.clone()))) {
            let (wavelengths, polarised, inside) = (None, None, SmallVec::new());
            let emitter = Emitter {
                power: 1.0,
                rays: None,
                inside,
                stated: false,
                wavelengths,
                polarised,
                frame,
                shape,
                lobe,
            };
            let rays = 5000;
            let stream = || Stream::new(7, Sampling::Sobol, [3, 128], 0, rays).of(&emitter);
            let (mut among, mut alone) = (stream(), stream());
            let [mut a, mut b] = [Ray::new(Point::ZERO, Vector::Z); 2];
            let mut seen = vec![false; rays as usize];
            for started in 0..rays as u32 {
                let (ticket, _) = emitter.next(&mut among, 100, started, &mut a);
                seen[ticket.index as usize] = true;
                if started % 7 == 0 {
                    assert_eq!(emitter.alone(&mut alone, 100, ticket.index, &mut b).0.ray, ticket.ray);
                    let bits = |r: &Ray| [r.origin, r.direction].map(|v| v.to_array().map(f64::to_bits));
                    assert_eq!(bits(&a), bits(&b), "{emitter:?}");
                    assert!(a.direction.is_normalized());
                }
            }
            assert!(seen.iter().all(|s| *s), "{emitter:?}");
        }
    }
}
