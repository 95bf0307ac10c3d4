//! Rays of a source made many at a time: the arithmetic of one, in loops over arrays that run in vectors.

use super::Emitter;
use super::shape::{
    LAMBERTIAN, Lobe, Shape, lambertian_cosine, point_on_rectangle, radius_on_disc, sine_from_cosine,
    sine_from_versine, versine_in_cone,
};
use super::stream::{PACKET, PacketNumbers, Stream};
use crate::math::{Point, Vector};
use crate::optics::sampling::sin_cos_turns;

/// Rays that start one after another.
#[derive(Clone, Debug)]
pub(super) struct RayPacket {
    origins: [PacketNumbers; 3],
    directions: [PacketNumbers; 3],
}

impl RayPacket {
    /// Makes a packet of zeros, to be filled.
    pub(super) fn boxed() -> Box<Self> {
        Box::new(Self { origins: [[0.0; PACKET]; 3], directions: [[0.0; PACKET]; 3] })
    }

    /// Returns origin and direction of the ray that starts as the `k`-th, modulo the size of a packet.
    #[inline(always)]
    pub(super) fn ray(&self, k: usize) -> (Point, Vector) {
        let k = k % PACKET;
        let ([x, y, z], [a, b, c]) = (&self.origins, &self.directions);
        (Point::new(x[k], y[k], z[k]), Vector::new(a[k], b[k], c[k]))
    }

    /// Makes the rays that start from the `started`-th on; `stream` must have been refilled for them.
    #[inline(always)]
    pub(super) fn fill(&mut self, emitter: &Emitter, stream: &Stream, started: u32) {
        emitter.fill_origins(stream.pairs_from(started, 0), &mut self.origins);
        emitter.fill_directions(stream.pairs_from(started, 1), &mut self.directions);
    }
}

/// Returns sine and cosine of each angle, given in whole turns.
#[inline(always)]
fn sines_and_cosines(turns: &PacketNumbers) -> [PacketNumbers; 2] {
    let [mut sin, mut cos] = [[0.0; PACKET]; 2];
    for k in 0..PACKET {
        (sin[k], cos[k]) = sin_cos_turns(turns[k]);
    }
    [sin, cos]
}

/// Returns the products of two arrays, number by number.
#[inline(always)]
fn products(a: &PacketNumbers, b: &PacketNumbers) -> PacketNumbers {
    let mut products = [0.0; PACKET];
    for k in 0..PACKET {
        products[k] = a[k] * b[k];
    }
    products
}

/// Returns each number times `a`.
#[inline(always)]
fn scaled(a: f64, b: &PacketNumbers) -> PacketNumbers {
    products(&[a; PACKET], b)
}

/// Adds to the k-th vector in `sums`, whose x, y and z stand in arrays of their own, `vector` times the k-th number.
#[inline(always)]
fn add_multiples(sums: &mut [PacketNumbers; 3], vector: Vector, numbers: &PacketNumbers) {
    for axis in 0..3 {
        let (sums, part) = (&mut sums[axis], vector[axis]);
        for k in 0..PACKET {
            sums[k] += part * numbers[k];
        }
    }
}

impl Emitter {
    /// Whether its rays can be made in packets: from a point, disc or rectangle, into a cone, Lambert's cosine or one direction.
    pub(super) fn fits_packets(&self) -> bool {
        // Powers, measured lobes and faces are left to rays one by one: their formulas branch or call.
        let simple_shape = matches!(self.shape, Shape::Point | Shape::Disc(_) | Shape::Rectangle(_));
        simple_shape
            && match self.lobe {
                Lobe::Cone(_) | Lobe::Collimated => true,
                Lobe::Cosine(exponent) => exponent == LAMBERTIAN,
                Lobe::Measured(_) => false,
            }
    }

    /// Writes the starts, mm in scene coordinates, for the uniform numbers u and v, by the formulas that serve single rays.
    #[inline(always)]
    fn fill_origins(&self, [u, v]: [PacketNumbers; 2], origins: &mut [PacketNumbers; 3]) {
        let f = self.frame;
        let [mut x, mut y] = [u, v];
        match self.shape {
            Shape::Disc(radius) => {
                let [sin, cos] = sines_and_cosines(&v);
                let mut r = u;
                for k in 0..PACKET {
                    r[k] = radius_on_disc(radius, u[k]);
                }
                (x, y) = (products(&r, &cos), products(&r, &sin));
            }
            Shape::Rectangle(half) => {
                for k in 0..PACKET {
                    [x[k], y[k]] = point_on_rectangle(half, [u[k], v[k]]);
                }
            }
            Shape::Point | Shape::Faces(_) | Shape::List(_) => {}
        }
        *origins = [[f.origin.x; PACKET], [f.origin.y; PACKET], [f.origin.z; PACKET]];
        if !matches!(self.shape, Shape::Point) {
            add_multiples(origins, f.x, &x);
            add_multiples(origins, f.y, &y);
        }
    }

    /// Writes the unit directions for the uniform numbers u and v, by the formulas that serve single rays.
    #[inline(always)]
    fn fill_directions(&self, [u, v]: [PacketNumbers; 2], directions: &mut [PacketNumbers; 3]) {
        let f = self.frame;
        let [mut cos_theta, mut sin_theta] = [u; 2];
        match self.lobe {
            Lobe::Cone(rim) => {
                // Plain loops over whole arrays: the compiler makes vectors of them under the caller's instruction set.
                for k in 0..PACKET {
                    let versine = versine_in_cone(rim, u[k]);
                    cos_theta[k] = 1.0 - versine;
                    sin_theta[k] = sine_from_versine(versine);
                }
            }
            Lobe::Cosine(_) => {
                for k in 0..PACKET {
                    cos_theta[k] = lambertian_cosine(u[k]);
                    sin_theta[k] = sine_from_cosine(cos_theta[k]);
                }
            }
            Lobe::Collimated | Lobe::Measured(_) => {
                *directions = [[f.z.x; PACKET], [f.z.y; PACKET], [f.z.z; PACKET]];
                return;
            }
        }
        let [sin, cos] = sines_and_cosines(&v);
        let [x, y] = [products(&sin_theta, &cos), products(&sin_theta, &sin)];
        *directions = [scaled(f.x.x, &x), scaled(f.x.y, &x), scaled(f.x.z, &x)];
        add_multiples(directions, f.y, &y);
        add_multiples(directions, f.z, &cos_theta);
    }
}

#[cfg(test)]
mod tests {
    use super::super::sampler::RaySampler;
    use super::super::stream::Portion;
    use super::*;
    use crate::math::{Frame, Ray};
    use crate::simulate::scene::Sampling;
    use smallvec::SmallVec;

    /// A ray that is traced once more by itself must be the one that was traced in the batch.
    #[test]
    fn a_single_ray_is_that_of_the_batch() {
        let frame = Frame::from_axis(Point::new(1.0, -2.0, 3.0), Vector::new(0.36, 0.48, -0.8), None);
        let shapes = [Shape::Point, Shape::Disc(15.0), Shape::Rectangle([0.5, 2.0])];
        let lobes = [Lobe::Cone(2.0), Lobe::Cone(0.3), Lobe::Collimated, Lobe::Cosine(0.5), Lobe::Cosine(0.2)];
        for (shape, lobe) in shapes.iter().flat_map(|s| lobes.iter().map(move |l| (s.clone(), l.clone()))) {
            let (wavelengths, polarised, inside) = (None, None, SmallVec::new());
            let emitter = Emitter {
                power: 1.0,
                rays: None,
                inside,
                media_stated: false,
                wavelengths,
                polarised,
                frame,
                shape,
                lobe,
                near_start: None,
            };
            let rays = 5000;
            let portion = Portion { replicate: 3, source: 0, rays, lattice: [0, 1] };
            let sampler = || RaySampler::new(&emitter, 7, Sampling::Sobol, portion, 100);
            let (mut batch, mut single) = (sampler(), sampler());
            let [mut a, mut b] = [Ray::new(Point::ZERO, Vector::Z); 2];
            let mut seen = vec![false; rays as usize];
            for started in 0..rays as u32 {
                let (index, _) = batch.next_ray(&emitter, started, &mut a);
                seen[index.in_stream as usize] = true;
                if started % 7 == 0 {
                    assert_eq!(single.single_ray(&emitter, index.in_stream, &mut b).0.in_run, index.in_run);
                    let bits = |r: &Ray| [r.origin, r.direction].map(|v| v.to_array().map(f64::to_bits));
                    assert_eq!(bits(&a), bits(&b), "{emitter:?}");
                    assert!(a.direction.is_normalized());
                }
            }
            assert!(seen.iter().all(|s| *s), "{emitter:?}");
        }
    }
}
