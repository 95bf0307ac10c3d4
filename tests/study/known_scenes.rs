//! Scenes whose figures are known in closed form or by a computation that shares nothing with the program.

use crate::axial::{Interface, Spot, spot, transmitted};
use lampyris::math::{Frame, Homogeneous, Point, Vector};
use lampyris::model::{Instance, Model, PartId};
use lampyris::nurbs::{ControlPoint, Surface, sweep};
use lampyris::study::sample_models;
use lampyris::truck::{Conic, Lens, Reflector};
use std::f64::consts::{FRAC_PI_2, PI};

/// A scene with the figures of its one receiver, as far as they are known.
pub(crate) struct KnownScene {
    pub(crate) name: String,
    pub(crate) model: Model,
    pub(crate) text: String,
    pub(crate) figures: Vec<(&'static str, f64)>,
    /// Half side of the receiver, mm or degrees: positions are counted to 1e-4 of it.
    pub(crate) half: f64,
}

fn about_axis(name: String, model: Model, text: String, Spot { power, rms }: Spot, half: f64) -> KnownScene {
    let figures = vec![("power", power), ("rms_1", rms), ("rms_2", rms), ("centroid_1", 0.0), ("centroid_2", 0.0)];
    KnownScene { name, model, text, figures, half }
}

fn glass(index: f64) -> String {
    format!("[[medium]]\nname = 'glass'\nindex = {index:?}\n[[material]]\npart = '*'\nmedium = 'glass'\n")
}

/// Parallel light along +z on a disc, counted behind so many interfaces on the plane `z`.
fn parallel(disc: f64, start: f64, z: f64, half: f64, interactions: usize) -> String {
    format!(
        "[[source]]\nkind = 'collimated'\nat = [0, 0, {start:?}]\nradius = {disc:?}\npower = 1\n\
         [[receiver]]\nname = 'plane'\nat = [0, 0, {z:?}]\nsize = [{0:?}, {0:?}]\ncells = [40, 40]\nabsorbs = false\n\
         interactions = {interactions}\n",
        2.0 * half
    )
}

/// A lens of two conics in parallel light of 0.8 of its aperture, on the plane `z` behind it.
pub(crate) fn lens(name: &str, lens: Lens, index: f64, z: f64) -> KnownScene {
    let disc = 0.8 * lens.half_aperture;
    let interface = |z: f64, c: Conic, index: f64| Interface { z, radius: c.radius, conic: c.conic, index };
    let surfaces = [interface(0.0, lens.front, index), interface(lens.thickness, lens.back, 1.0)];
    let found = spot(&surfaces, disc, z);
    let half = (4.0 * found.rms).max(0.05 * lens.half_aperture);
    let text = glass(index) + &parallel(disc, -lens.half_aperture, z, half, 2);
    about_axis(name.into(), lens.model("lens").unwrap().model, text, found, half)
}

/// A ball of glass, as a whole sphere.
pub(crate) fn ball(radius: f64, index: f64) -> KnownScene {
    let sphere = sweep::sphere(&Frame::IDENTITY, radius, [0.0, 2.0 * PI], [-FRAC_PI_2, FRAC_PI_2]);
    let mut model = sample_models::model("ball", [sphere]);
    model.parts[0].shells[0].closed = true;
    let surfaces = [
        Interface { z: -radius, radius, conic: 0.0, index },
        Interface { z: radius, radius: -radius, conic: 0.0, index: 1.0 },
    ];
    let (disc, z) = (0.6 * radius, 1.4 * radius);
    let found = spot(&surfaces, disc, z);
    let half = 4.0 * found.rms;
    let text = glass(index) + &parallel(disc, -2.0 * radius, z, half, 2);
    about_axis(format!("ball of {radius} mm"), model, text, found, half)
}

/// Two lenses cemented along one sphere.
pub(crate) fn doublet(scale: f64) -> KnownScene {
    let [front, inner, back] = [61.0, -45.0, -190.0].map(|r| Conic::sphere(scale * r));
    let (thick, thin, aperture) = (7.0 * scale, 3.0 * scale, 12.0 * scale);
    let crown = Lens { front, back: inner, thickness: thick, half_aperture: aperture };
    let flint = Lens { front: inner, back, thickness: thin, half_aperture: aperture };
    let mut model = crown.model("crown").unwrap().model;
    let second = flint.model("flint").unwrap().model;
    model.parts.extend(second.parts);
    let part = PartId(model.parts.len() as u32 - 1);
    let placement = Frame::translation(Point::new(0.0, 0.0, thick));
    model.instances.push(Instance { name: "flint".into(), path: String::new(), part, placement, colour: None });
    let interface = |z: f64, c: Conic, index: f64| Interface { z, radius: c.radius, conic: c.conic, index };
    let surfaces =
        [interface(0.0, front, 1.5168), interface(thick, inner, 1.62), interface(thick + thin, back, 1.0)];
    let (disc, z) = (0.8 * aperture, 95.0 * scale);
    let found = spot(&surfaces, disc, z);
    let half = (4.0 * found.rms).max(0.05 * aperture);
    let media = "[[medium]]\nname = 'crown'\nindex = 1.5168\n[[medium]]\nname = 'flint'\nindex = 1.62\n\
        [[material]]\npart = 'crown'\nmedium = 'crown'\n[[material]]\npart = 'flint'\nmedium = 'flint'\n";
    about_axis(
        format!("doublet × {scale}"),
        model,
        media.to_owned() + &parallel(disc, -aperture, z, half, 3),
        found,
        half,
    )
}

/// A paraboloid with a square LED of side `s` in its focus: on the axis the whole opening shines with the radiance of the source.
pub(crate) fn parabolic_lamp(focus: f64, s: f64) -> KnownScene {
    let dish = Reflector { shape: Conic::paraboloid(focus), half_aperture: focus, hole: 0.0 };
    // Cells well within the cone that sees nothing but the source: 0.24·s/f.
    let half = 21.0 * 0.2 * (s / focus).to_degrees() / 2.0;
    let text = format!(
        "[run]\nunit = 'lm'\n[[material]]\npart = '*'\nsurface = 'mirror'\nreflectance = 1.0\n\
         [[source]]\nkind = 'lambertian'\nat = [0, 0, {focus:?}]\ndirection = [0, 0, -1]\nsize = [{s:?}, {s:?}]\npower = 100\n\
         [[receiver]]\nname = 'far'\nkind = 'far_field'\nnormal = [0, 0, 1]\nh_deg = [{0:?}, {half:?}]\nv_deg = [{0:?}, {half:?}]\n\
         cells = [21, 21]\n",
        -half
    );
    let figures = vec![("max", 100.0 * focus * focus / (s * s)), ("centroid_1", 0.0), ("centroid_2", 0.0)];
    KnownScene {
        name: format!("paraboloid f {focus}, LED {s} mm"),
        model: dish.model("dish").unwrap().model,
        text,
        figures,
        half,
    }
}

/// An ellipsoid with a point source in one focus: all that meets it comes together in the other.
pub(crate) fn ellipsoid(scale: f64) -> KnownScene {
    let (a, b, h) = (50.0 * scale, 30.0 * scale, 20.0 * scale);
    let dish = Reflector::ellipsoid(a, b, h).unwrap();
    let focus = a - (a * a - b * b).sqrt();
    let edge = a - a * (1.0 - (h / b).powi(2)).sqrt() - focus;
    let power = 0.5 * (1.0 + edge / edge.hypot(h));
    let half = 2.0 * scale;
    let text = format!(
        "[[material]]\npart = '*'\nsurface = 'mirror'\nreflectance = 1.0\n[[source]]\nkind = 'point'\nat = [0, 0, {focus:?}]\npower = 1\n\
         [[receiver]]\nname = 'focus'\nat = [0, 0, {:?}]\nsize = [{1:?}, {1:?}]\ncells = [20, 20]\nabsorbs = false\ninteractions = 1\n",
        2.0 * a - focus,
        2.0 * half
    );
    about_axis(
        format!("ellipsoid × {scale}"),
        dish.model("dish").unwrap().model,
        text,
        Spot { power, rms: 0.0 },
        half,
    )
}

/// A concave spherical mirror in parallel light, on the plane of its paraxial focus.
pub(crate) fn spherical_mirror(radius: f64) -> KnownScene {
    let dish = Reflector { shape: Conic::sphere(radius), half_aperture: 0.3 * radius, hole: 0.0 };
    let disc = 0.25 * radius;
    let (mut power, mut square) = (0.0, 0.0);
    for k in 0..4000 {
        let h = disc * (f64::from(k) + 0.5) / 4000.0;
        let cos = (1.0 - (h / radius).powi(2)).sqrt();
        let (crossing, sag) = (radius - 0.5 * radius / cos, radius * (1.0 - cos));
        let y = h * (crossing - 0.5 * radius) / (crossing - sag);
        power += h;
        square += 0.5 * h * y * y;
    }
    let rms = (square / power).sqrt();
    let half = 5.0 * rms;
    let text = format!(
        "[[material]]\npart = '*'\nsurface = 'mirror'\nreflectance = 1.0\n\
         [[source]]\nkind = 'collimated'\nat = [0, 0, {:?}]\ndirection = [0, 0, -1]\nradius = {disc:?}\npower = 1\n\
         [[receiver]]\nname = 'focus'\nat = [0, 0, {:?}]\nsize = [{2:?}, {2:?}]\ncells = [40, 40]\nabsorbs = false\ninteractions = 1\n",
        0.7 * radius,
        0.5 * radius,
        2.0 * half
    );
    about_axis(
        format!("spherical mirror R {radius}"),
        dish.model("dish").unwrap().model,
        text,
        Spot { power: 1.0, rms },
        half,
    )
}

/// A freeform mirror z = c·x² + d·y² in parallel light.
pub(crate) fn freeform(c: f64, d: f64) -> KnownScene {
    let side = 12.0;
    let along = |k: f64| [k * side * side, -k * side * side, k * side * side];
    let point = |i: usize, j: usize| {
        let at = |k: usize| side * (k as f64 - 1.0);
        Homogeneous::weighted(Point::new(at(i), at(j), along(c)[i] + along(d)[j]), 1.0)
    };
    let knots = vec![-side, -side, -side, side, side, side];
    let points = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| point(i, j)).collect();
    let surface = Surface { degree: [2, 2], knots: [knots.clone(), knots], points };
    let (disc, z) = (10.0, 40.0);
    let (mut count, mut squares) = (0.0, [0.0; 2]);
    for k in 0..400 {
        let r = disc * (f64::from(k) + 0.5) / 400.0;
        for l in 0..400 {
            let (sin, cos) = (2.0 * PI * (f64::from(l) + 0.5) / 400.0).sin_cos();
            let p = Point::new(r * cos, r * sin, c * (r * cos).powi(2) + d * (r * sin).powi(2));
            let n = Vector::new(-2.0 * c * p.x, -2.0 * d * p.y, 1.0).normalize();
            let out = -Vector::Z + n * (2.0 * n.z);
            let at = p + out * ((z - p.z) / out.z);
            count += r;
            squares = [squares[0] + r * at.x * at.x, squares[1] + r * at.y * at.y];
        }
    }
    let rms = squares.map(|s: f64| (s / count).sqrt());
    let half = 3.0 * rms[0].max(rms[1]);
    let text = format!(
        "[[material]]\npart = '*'\nsurface = 'mirror'\nreflectance = 1.0\n\
         [[source]]\nkind = 'collimated'\nat = [0, 0, 60]\ndirection = [0, 0, -1]\nradius = {disc:?}\npower = 1\n\
         [[receiver]]\nname = 'plane'\nat = [0, 0, {z:?}]\nx = [1, 0, 0]\nsize = [{0:?}, {0:?}]\ncells = [40, 40]\nabsorbs = false\n\
         interactions = 1\n",
        2.0 * half
    );
    let figures =
        vec![("power", 1.0), ("rms_1", rms[0]), ("rms_2", rms[1]), ("centroid_1", 0.0), ("centroid_2", 0.0)];
    KnownScene {
        name: format!("freeform {c}, {d}"),
        model: sample_models::model("mirror", [surface]),
        text,
        figures,
        half,
    }
}

/// A round rod with a Lambertian source on its end: what it takes in, it keeps, and gives out as a plate of it would.
pub(crate) fn round_guide(radius: f64, length: f64, index: f64) -> KnownScene {
    let rod = Lens { front: Conic::FLAT, back: Conic::FLAT, thickness: length, half_aperture: radius };
    let (mut power, steps) = (0.0, 20_000);
    for k in 0..steps {
        // Uniform in sin² is Lambertian.
        let sin2 = (f64::from(k) + 0.5) / f64::from(steps);
        let (cos, inside) = ((1.0 - sin2).sqrt(), (1.0 - sin2 / (index * index)).sqrt());
        let lost = 1.0 - transmitted(1.0, index, cos, inside);
        power += (1.0 - lost) / (1.0 + lost) / f64::from(steps);
    }
    let half = 20.0 * radius;
    let text = format!(
        "{}[[source]]\nkind = 'lambertian'\nat = [0, 0, {:?}]\nradius = {:?}\npower = 1\n\
         [[receiver]]\nname = 'end'\nat = [0, 0, {:?}]\nsize = [{4:?}, {4:?}]\ncells = [20, 20]\n",
        glass(index),
        -1e-3 * radius,
        0.2 * radius,
        length + 1e-3 * radius,
        2.0 * half
    );
    let figures = vec![("power", power), ("centroid_1", 0.0), ("centroid_2", 0.0)];
    KnownScene {
        name: format!("rod {radius} × {length}"),
        model: rod.model("rod").unwrap().model,
        text,
        figures,
        half,
    }
}

/// A thick plate in light at 45°: each ray is shifted sideways, and light to and fro adds up.
pub(crate) fn plate() -> KnownScene {
    let mut faces = Vec::new();
    for (z, x, y) in [
        (Vector::Z, Vector::X, Vector::Y),
        (-Vector::Z, Vector::Y, Vector::X),
        (Vector::X, Vector::Y, Vector::Z),
        (-Vector::X, Vector::Z, Vector::Y),
        (Vector::Y, Vector::Z, Vector::X),
        (-Vector::Y, Vector::X, Vector::Z),
    ] {
        let half = Vector::new(200.0, 200.0, 5.0);
        let frame = Frame { x, y, z, ..Frame::translation(z * half.dot(z.abs())) };
        let [a, b] = [half.dot(x.abs()), half.dot(y.abs())];
        faces.push(sweep::plane(&frame, [[-a, a], [-b, b]]));
    }
    let mut model = sample_models::model("plate", faces);
    model.parts[0].shells[0].closed = true;
    let (cos, inside): (f64, f64) = (0.5f64.sqrt(), (1.0 - 0.5 / 2.25f64).sqrt());
    let share = transmitted(1.0, 1.5, cos, inside);
    // Straight on the ray would be at x = z; the plate takes off what it goes less far sideways within.
    let shift = 10.0 * (1.0 - cos / (1.5 * inside));
    let text = glass(1.5)
        + "[[source]]\nkind = 'collimated'\nat = [-50, 0, -50]\ndirection = [1, 0, 1]\nradius = 3\npower = 1\n\
           [[receiver]]\nname = 'plane'\nat = [50, 0, 50]\nx = [1, 0, 0]\nsize = [40, 40]\ncells = [20, 20]\nabsorbs = false\ninteractions = 2\n";
    let figures = vec![("power", share * share), ("centroid_1", -shift), ("centroid_2", 0.0)];
    KnownScene { name: "plate at 45°".into(), model, text, figures, half: 20.0 }
}

/// A ball of glass with a point source in its centre, which shines alike in all directions: the flux of a cone of half angle `gamma` and
/// of a rectangle of `h` × `v` about the axis, degrees.
pub(crate) fn zones(radius: f64, gamma: f64, [h, v]: [f64; 2]) -> [KnownScene; 2] {
    let cone = 0.5 * (1.0 - gamma.to_radians().cos());
    // Of type A: H turns about the polar axis, V is the elevation.
    let rectangle = 2.0 * h.to_radians() * 2.0 * v.to_radians().sin() / (4.0 * PI);
    let zones = [
        ("cone", format!("angles = 'C'\nh_deg = [0, 360]\nv_deg = [0, {gamma:?}]\n"), cone),
        ("rectangle", format!("h_deg = [{:?}, {h:?}]\nv_deg = [{:?}, {v:?}]\n", -h, -v), rectangle),
    ];
    zones.map(|(name, range, flux)| {
        let centred = ball(radius, 1.5);
        let text = format!(
            "{}[[source]]\nkind = 'point'\npower = 1\n[[receiver]]\nname = 'zone'\nkind = 'far_field'\ncells = [1, 1]\n{range}",
            glass(1.5)
        );
        KnownScene { name: format!("zone, {name}"), text, figures: vec![("power", flux)], half: h, ..centred }
    })
}

/// All of them.
pub(crate) fn all() -> Vec<KnownScene> {
    let sphere = Conic::sphere;
    let hyperboloid = Lens {
        front: Conic::FLAT,
        back: Conic { radius: -25.0, conic: -2.25 },
        thickness: 8.0,
        half_aperture: 12.0,
    };
    let asphere =
        Lens { front: Conic { radius: 3.0, conic: -0.6 }, back: sphere(-20.0), thickness: 2.0, half_aperture: 2.0 };
    let biconvex = Lens { front: sphere(500.0), back: sphere(-500.0), thickness: 60.0, half_aperture: 120.0 };
    let [cone, rectangle] = zones(5.0, 30.0, [20.0, 10.0]);
    vec![
        cone,
        rectangle,
        parabolic_lamp(25.0, 1.0),
        parabolic_lamp(25.0, 0.2),
        parabolic_lamp(25.0, 3.0),
        lens("hyperboloid, perfect focus", hyperboloid, 1.5, 58.0),
        lens("asphere of 4 mm", asphere, 1.5, 5.5),
        lens("biconvex of 240 mm", biconvex, 1.5168, 480.0),
        ball(5.0, 1.5),
        ball(0.5, 1.8),
        doublet(1.0),
        ellipsoid(1.0),
        spherical_mirror(100.0),
        freeform(0.008, 0.004),
        round_guide(5.0, 100.0, 1.5),
        plate(),
    ]
}
