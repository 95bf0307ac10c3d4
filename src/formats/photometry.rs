//! Luminous intensity over two angles: its directions, its symmetries and its flux.

use crate::math::Vector;

/// Angles this near to each other are one, degrees: files write them with three decimals, sums and mirrors round them to 1e-13.
pub(crate) const SAME_ANGLE_DEG: f64 = 1e-9;

/// Steps between planes that may lie between the last one and the whole turn without a word: one plane may have been left out.
const MOST_CLOSED_STEPS: f64 = 2.0;

/// Luminous intensity over two angles: what an IES LM-63 or EULUMDAT file holds.
///
/// ```
/// use lampyris::formats::{PhotometricType, parse_ies};
///
/// let text = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 0\n0 180\n0\n100 100\n";
/// let lamp = parse_ies(std::path::Path::new("lamp.ies"), text)?;
/// assert_eq!(lamp.kind, PhotometricType::C);
/// // 100 cd in every direction are 400 π lm.
/// assert!((lamp.flux() - 400.0 * std::f64::consts::PI).abs() < 1e-9);
/// # Ok::<(), lampyris::formats::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// What the two angles mean.
    pub kind: PhotometricType,
    /// C-planes, or H; ascending, degrees.
    pub horizontal_deg: Vec<f64>,
    /// γ, or V; ascending, degrees.
    pub vertical_deg: Vec<f64>,
    /// Candela with all multipliers applied, `candela[h * vertical_deg.len() + v]`.
    pub candela: Vec<f64>,
    /// Lumens of the lamps inside, all together; `None` for absolute photometry.
    pub lamp_lumens: Option<f64>,
    /// Electrical power, W.
    pub watts: f64,
    /// Width, length and height of the luminous opening, mm; negative where LM-63 means round shapes.
    pub opening_mm: [f64; 3],
    /// Keywords in the file's order, with LM-63 names (`TEST`, `MANUFAC`, `LUMINAIRE`, …).
    pub keywords: Vec<(String, String)>,
}

/// What the two angles of a [`Photometry`] mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PhotometricType {
    /// C-planes about the main axis and γ from it: luminaires.
    #[default]
    C,
    /// Horizontal polar axis: H is the elevation out of the vertical plane, V turns about the horizontal. Floodlights.
    B,
    /// Vertical polar axis: V is the elevation above the horizontal plane, H turns about the vertical. Headlamps.
    A,
}

impl PhotometricType {
    /// The unit direction of two angles in degrees, C or H first.
    ///
    /// Components for type C: along the plane C 0, the plane C 90, and the main axis (γ = 0, down for a luminaire). For A and B:
    /// to positive H, to positive V, and forward. Seen along the main axis, C runs counterclockwise, as in the plan of a luminaire
    /// that shines down, and positive H lies to the right of positive V.
    pub fn direction(self, horizontal_deg: f64, vertical_deg: f64) -> Vector {
        let (sh, ch) = horizontal_deg.to_radians().sin_cos();
        let (sv, cv) = vertical_deg.to_radians().sin_cos();
        match self {
            // γ from the axis: its sine opens the cone, C turns about it.
            Self::C => Vector::new(sv * ch, sv * sh, cv),
            Self::B => Vector::new(sh, ch * sv, ch * cv),
            Self::A => Vector::new(cv * sh, sv, cv * ch),
        }
    }

    /// The angles of a direction of any length, degrees: C in `[0, 360)`, γ in `[0, 180]`; H and V about 0, the one from the polar plane
    /// within ±90, the other within ±180.
    pub fn angles_deg(self, d: Vector) -> [f64; 2] {
        let [h, v] = match self {
            Self::C => {
                let c = d.y.atan2(d.x).to_degrees();
                // Not rem_euclid alone: it rounds a small negative angle up to 360.
                let c = if c < 0.0 { (c + 360.0) % 360.0 } else { c };
                // By atan2 of the lengths, not acos of the cosine: near the axis a cosine loses half of its digits.
                return [c, d.x.hypot(d.y).atan2(d.z).to_degrees()];
            }
            Self::B => [d.x.atan2(d.y.hypot(d.z)), d.y.atan2(d.z)],
            Self::A => [d.x.atan2(d.z), d.y.atan2(d.x.hypot(d.z))],
        };
        [h.to_degrees(), v.to_degrees()]
    }
}

impl Photometry {
    /// Returns the same intensities over all planes that symmetry implies.
    ///
    /// Type C: one plane, or planes that end at 90°, 180°, or run from 90° to 270°, become planes from 0° to 360°.
    /// Other planes from 0° to less than 360° are closed by the first one at 360°. Types A and B: horizontal angles that start at 0° are
    /// mirrored to negative ones. Anything else stays as it is, also intensities that do not fill their planes.
    pub fn expanded(&self) -> Self {
        // Planes that are not filled cannot be mirrored: their rows would run out.
        if self.candela.len() != self.horizontal_deg.len() * self.vertical_deg.len() {
            return self.clone();
        }
        let (Some(&first), Some(&last)) = (self.horizontal_deg.first(), self.horizontal_deg.last()) else {
            return self.clone();
        };
        let planes: Vec<(f64, usize)> = self.horizontal_deg.iter().copied().zip(0..).collect();
        let mirrored = |planes: &[(f64, usize)], about: f64| {
            let images = planes.iter().rev().map(|&(c, i)| (2.0 * about - c, i));
            let mut all: Vec<(f64, usize)> = planes.iter().copied().chain(images).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            // Planes on the mirror are their own images, and would stand twice.
            all.dedup_by(|a, b| (a.0 - b.0).abs() < SAME_ANGLE_DEG);
            all
        };
        let all = match self.kind {
            PhotometricType::C if planes.len() == 1 => vec![(0.0, 0), (360.0, 0)],
            PhotometricType::C if first == 0.0 && last == 90.0 => mirrored(&mirrored(&planes, 90.0), 180.0),
            PhotometricType::C if first == 0.0 && last == 180.0 => mirrored(&planes, 180.0),
            PhotometricType::C if first == 90.0 && last == 270.0 => {
                // The other half: mirrored in the plane C 90 – C 270.
                let right = planes.iter().filter(|p| p.0 <= 180.0).map(|&(c, i)| (180.0 - c, i));
                let left = planes.iter().filter(|p| p.0 >= 180.0).map(|&(c, i)| (540.0 - c, i));
                let mut all: Vec<_> = right.chain(planes.iter().copied()).chain(left).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0));
                all.dedup_by(|a, b| (a.0 - b.0).abs() < SAME_ANGLE_DEG);
                all
            }
            // The turn is closed by its first plane once more: interpolation needs no case of its own there.
            PhotometricType::C if first == 0.0 && last < 360.0 => {
                planes.iter().copied().chain([(360.0, 0)]).collect()
            }
            PhotometricType::A | PhotometricType::B if first == 0.0 && last > 0.0 => mirrored(&planes, 0.0),
            _ => return self.clone(),
        };
        let rows = self.vertical_deg.len();
        let plane = |i: usize| self.candela[i * rows..(i + 1) * rows].iter().copied();
        let mut candela: Vec<f64> = all.iter().flat_map(|&(_, i)| plane(i)).collect();
        let mut horizontal_deg: Vec<f64> = all.iter().map(|p| p.0).collect();
        let ((low, first), (high, last)) = (all[0], all[all.len() - 1]);
        if self.kind == PhotometricType::C && low > 0.0 {
            // Mirrored planes without one at 180°: between the last and the first of a turn light goes on as between any two.
            let share = (360.0 - high) / (low + 360.0 - high);
            let between: Vec<f64> = plane(last).zip(plane(first)).map(|(a, b)| a + share * (b - a)).collect();
            candela.splice(0..0, between.iter().copied());
            candela.extend(between);
            horizontal_deg.insert(0, 0.0);
            horizontal_deg.push(360.0);
        }
        self.with_intensities(horizontal_deg, self.vertical_deg.clone(), candela)
    }

    /// Tells of planes C that leave a part of the turn open which no symmetry of the formats fills, and what it is taken for; `None` where
    /// none is.
    pub(crate) fn open_turn(&self) -> Option<String> {
        let is_one_turn = self.kind == PhotometricType::C && self.horizontal_deg.len() > 1;
        let planes = self.horizontal_deg.as_slice();
        let (&first, &last) = planes.first().zip(planes.last()).filter(|_| is_one_turn)?;
        let all = self.expanded().horizontal_deg;
        if all[all.len() - 1] - all[0] < 360.0 - SAME_ANGLE_DEG {
            return Some(format!(
                "its planes run from C {first}° to {last}°, which no symmetry makes a whole turn: there is no light in the others"
            ));
        }
        // The last plane before the first one, which closes the turn.
        let widest = planes.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let is_closed = all.len() == planes.len() + 1 && 360.0 - last > MOST_CLOSED_STEPS * widest;
        is_closed.then(|| {
            format!("its planes end at C {last}°, which no symmetry makes a whole turn: from there to C 360° its light goes over into \
                 that of C 0°")
        })
    }

    /// The same luminaire with other angles and intensities; nothing of its own is copied, of which fine far fields have much.
    fn with_intensities(&self, horizontal_deg: Vec<f64>, vertical_deg: Vec<f64>, candela: Vec<f64>) -> Self {
        let Self { kind, lamp_lumens, watts, opening_mm, .. } = *self;
        let keywords = self.keywords.clone();
        Self { kind, horizontal_deg, vertical_deg, candela, lamp_lumens, watts, opening_mm, keywords }
    }

    /// Lumens of the whole distribution, exact for intensities bilinear in the angles; symmetry is expanded first.
    ///
    /// NaN when the intensities do not fill their planes.
    pub fn flux(&self) -> f64 {
        let all = self.expanded();
        if all.candela.len() != all.horizontal_deg.len() * all.vertical_deg.len() {
            return f64::NAN;
        }
        let rows = all.vertical_deg.len();
        // The polar angle's weights: its integrals against the hat functions of its nodes.
        let (polar, offset, turning) = match self.kind {
            PhotometricType::C => (&all.vertical_deg, 0.0f64, &all.horizontal_deg),
            PhotometricType::A => (&all.vertical_deg, 90.0, &all.horizontal_deg),
            PhotometricType::B => (&all.horizontal_deg, 90.0, &all.vertical_deg),
        };
        // Evenly about the turn: each half of a hat is a triangle of height 1.
        let around = hat_integrals(turning, |a, b| [0.5 * (b - a), 0.5 * (b - a)]);
        let from_pole =
            hat_integrals(polar, |a, b| sine_integrals(a + offset.to_radians(), b + offset.to_radians()));
        let weight = |h: usize, v: usize| match self.kind {
            PhotometricType::B => from_pole[h] * around[v],
            _ => around[h] * from_pole[v],
        };
        (0..all.horizontal_deg.len())
            .flat_map(|h| (0..rows).map(move |v| (h, v)))
            .map(|(h, v)| all.candela[h * rows + v] * weight(h, v))
            .sum()
    }
}

impl Photometry {
    /// Returns the lumens of type C from γ = 0° to 90°, as [`Photometry::flux`] counts them: down, for a luminaire.
    pub(super) fn downward_flux(&self) -> f64 {
        const HORIZONTAL_DEG: f64 = 90.0;
        let rows = self.vertical_deg.len();
        let below = self.vertical_deg.iter().take_while(|v| **v < HORIZONTAL_DEG).count();
        if below == 0 {
            return 0.0;
        }
        let mut vertical_deg = self.vertical_deg[..below].to_vec();
        let mut candela: Vec<Vec<f64>> = self.candela.chunks(rows).map(|plane| plane[..below].to_vec()).collect();
        // Between the rows on its sides the light on the horizontal plane is linear, as the flux takes it.
        if let Some(&above) = self.vertical_deg.get(below) {
            let last = self.vertical_deg[below - 1];
            let share = (HORIZONTAL_DEG - last) / (above - last);
            vertical_deg.push(HORIZONTAL_DEG);
            for (cut, plane) in candela.iter_mut().zip(self.candela.chunks(rows)) {
                cut.push(plane[below - 1] + share * (plane[below] - plane[below - 1]));
            }
        }
        let below = self.with_intensities(self.horizontal_deg.clone(), vertical_deg, candela.concat());
        drop(candela);
        below.flux()
    }
}

/// Integrals of the hat functions of nodes in degrees; `halves` gives those of the falling and the rising half on an interval in radians.
fn hat_integrals(nodes_deg: &[f64], halves: impl Fn(f64, f64) -> [f64; 2]) -> Vec<f64> {
    let mut sums = vec![0.0; nodes_deg.len()];
    for (i, pair) in nodes_deg.windows(2).enumerate() {
        let [falling, rising] = halves(pair[0].to_radians(), pair[1].to_radians());
        sums[i] += falling;
        sums[i + 1] += rising;
    }
    sums
}

/// Computes `∫ (b−x)/(b−a) sin x dx` and `∫ (x−a)/(b−a) sin x dx` over `[a, b]`, radians, `a < b`.
fn sine_integrals(a: f64, b: f64) -> [f64; 2] {
    // By parts: what the integral of cos x leaves is the mean of the cosine over the interval.
    let mean = (b.sin() - a.sin()) / (b - a);
    [a.cos() - mean, mean - b.cos()]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::f64::consts::PI;

    pub(in crate::formats) fn photometry_of(
        kind: PhotometricType,
        h: &[f64],
        v: &[f64],
        f: impl Fn(f64, f64) -> f64,
    ) -> Photometry {
        Photometry {
            kind,
            horizontal_deg: h.to_vec(),
            vertical_deg: v.to_vec(),
            candela: h.iter().flat_map(|&h| v.iter().map(move |&v| (h, v))).map(|(h, v)| f(h, v)).collect(),
            lamp_lumens: None,
            watts: 12.5,
            opening_mm: [0.0; 3],
            keywords: vec![("TEST".into(), "none".into())],
        }
    }

    pub(in crate::formats) fn steps(a: f64, b: f64, n: usize) -> Vec<f64> {
        (0..=n).map(|i| a + (b - a) * i as f64 / n as f64).collect()
    }

    #[test]
    fn angles_and_directions_are_inverse() {
        for kind in [PhotometricType::A, PhotometricType::B, PhotometricType::C] {
            for (h, v) in [(10.0, 20.0), (60.0, 80.0), (0.0, 35.0)] {
                let d = kind.direction(h, v);
                let [a, b] = kind.angles_deg(d);
                assert!((a - h).abs() < 1e-12 && (b - v).abs() < 1e-12 && (d.length() - 1.0).abs() < 1e-15);
            }
        }
        // A point to the right and up, at V = 5° from any side: types differ away from the axes only.
        assert!(
            (PhotometricType::A.direction(30.0, 0.0) - PhotometricType::B.direction(30.0, 0.0)).length() < 1e-15
        );
        assert!(
            (PhotometricType::A.direction(0.0, 30.0) - PhotometricType::B.direction(0.0, 30.0)).length() < 1e-15
        );
        let c = PhotometricType::C.angles_deg(Vector::new(1.0, -1e-300, 0.0))[0];
        assert!((0.0..360.0).contains(&c));
    }

    #[test]
    fn flux_of_a_sphere_and_of_a_cosine() {
        for (kind, h, v) in [
            (PhotometricType::C, [0.0, 360.0], [0.0, 180.0]),
            (PhotometricType::A, [-180.0, 180.0], [-90.0, 90.0]),
            (PhotometricType::B, [-90.0, 90.0], [-180.0, 180.0]),
        ] {
            let p = photometry_of(kind, &steps(h[0], h[1], 8), &steps(v[0], v[1], 8), |_, _| 1.0);
            assert!((p.flux() - 4.0 * PI).abs() < 1e-12, "{kind:?}");
        }
        // π lumens from cos γ; the interpolation error falls with the square of the step.
        let error = |n| {
            (photometry_of(PhotometricType::C, &[0.0], &steps(0.0, 90.0, n), |_, v| v.to_radians().cos()).flux()
                - PI)
                .abs()
        };
        assert!(error(90) < 2e-4 && (3.9..4.1).contains(&(error(45) / error(90))));
    }

    #[test]
    fn symmetry_is_expanded_to_whole_turns() {
        let quarter = photometry_of(PhotometricType::C, &[0.0, 45.0, 90.0], &[0.0, 90.0], |h, v| h + v);
        let whole = quarter.expanded();
        assert_eq!(whole.horizontal_deg, [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0, 360.0]);
        let first: Vec<f64> = whole.candela.iter().step_by(2).copied().collect();
        assert_eq!(first, [0.0, 45.0, 90.0, 45.0, 0.0, 45.0, 90.0, 45.0, 0.0]);
        let half = photometry_of(PhotometricType::C, &[90.0, 180.0, 270.0], &[0.0, 90.0], |h, _| h);
        let whole = half.expanded();
        assert_eq!(whole.horizontal_deg, [0.0, 90.0, 180.0, 270.0, 360.0]);
        assert_eq!(
            whole.candela.iter().step_by(2).copied().collect::<Vec<_>>(),
            [180.0, 90.0, 180.0, 270.0, 180.0]
        );
        // Without a plane at 180°: 80° and 340° are images, and a fifth of the way between them lies 0°.
        let half =
            photometry_of(PhotometricType::C, &[90.0, 100.0, 200.0, 270.0], &[0.0, 90.0], |h, _| h).expanded();
        assert_eq!(half.horizontal_deg, [0.0, 80.0, 90.0, 100.0, 200.0, 270.0, 340.0, 360.0]);
        let first: Vec<f64> = half.candela.iter().step_by(2).copied().collect();
        assert_eq!(first, [180.0, 100.0, 90.0, 100.0, 200.0, 270.0, 200.0, 180.0]);
        let beam = photometry_of(PhotometricType::A, &[0.0, 10.0], &[0.0, 5.0], |h, v| h + v).expanded();
        assert_eq!((beam.horizontal_deg.as_slice(), beam.candela[1]), ([-10.0, 0.0, 10.0].as_slice(), 15.0));
        let open = photometry_of(PhotometricType::C, &steps(0.0, 345.0, 23), &[0.0, 90.0], |_, _| 1.0);
        assert_eq!(open.expanded().horizontal_deg.last(), Some(&360.0));
    }

    #[test]
    fn planes_that_leave_the_turn_open_are_told_of() {
        let of = |planes: &[f64]| photometry_of(PhotometricType::C, planes, &[0.0, 90.0], |_, _| 1.0).open_turn();
        let whole: [&[f64]; 6] =
            [&[0.0], &[0.0, 90.0], &[0.0, 90.0, 180.0], &[0.0, 120.0, 240.0], &[90.0, 180.0, 270.0], &[0.0, 360.0]];
        assert!(whole.into_iter().all(|planes| of(planes).is_none()));
        assert!(of(&steps(0.0, 345.0, 23)).is_none());
        assert!(of(&[0.0, 45.0]).unwrap().contains("end at C 45°"));
        for dark in [&[180.0, 270.0, 360.0], &[-90.0, 0.0, 90.0]] {
            assert!(of(dark).unwrap().contains("no light in the others"));
        }
        // Types A and B are beams, and may end anywhere.
        assert!(photometry_of(PhotometricType::A, &[-10.0, 10.0], &[0.0, 5.0], |_, _| 1.0).open_turn().is_none());
    }

    #[test]
    fn keywords_of_ies_files_stay_keywords() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ies");
        let mut p = photometry_of(PhotometricType::C, &[0.0], &[0.0, 90.0], |_, _| 1.0);
        let keywords = [("TEST", ""), ("MANUFAC", "A,\nand B\n"), ("LA]MP\r\nTILT=NONE\r\n[", "one\u{1b}")];
        p.keywords = keywords.map(|(name, value)| (name.into(), value.into())).to_vec();
        crate::formats::write_ies(&path, &p).unwrap();
        let read = crate::formats::read_ies(&path).unwrap().keywords;
        let expected = [("TEST", ""), ("MANUFAC", "A,\nand B\n"), ("LAMPTILT=NONE", "one")];
        assert_eq!(read, expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
    }
}
