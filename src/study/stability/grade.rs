//! Grades for an intersector: each query of a case is made, and the answer compared with the known truth.

use super::case::{Geometry, Question, Scene, Truth};
use crate::intersect::{Certainty, Cost, Hit, Intersector};
use crate::math::{Point, Ray, Vector};
use serde::Serialize;

/// Error of a normal that no facet reaches, rad.
const NORMAL: f64 = 1e-6;
/// Distance from a pole at which coordinates rounded to r turn the normal by r over it, mm.
const NEAR_POLE: f64 = 1e-6;
/// A point this near counts as on the surface, mm, beside rounding.
const ON_SURFACE: f64 = 1e-9;
/// A hit nearer to its start than this share of the chord is the start itself.
const AT_START: f64 = 1e-9;
/// Along a trim the spline promises no more than this, mm: twice the default of [`crate::intersect::exact::Settings::trim_band`], which
/// is measured across the ray and not across the edge.
const TRIM_BAND: f64 = 2e-6;
/// |cos| of the incidence below which the band is taken as no longer.
const GRAZING: f64 = 1e-3;

/// Grade of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// Agrees with the truth.
    Right,
    /// Not proved, and says so.
    Flagged,
    /// Disagrees with the truth in silence.
    Wrong,
}

/// Roundings of the ray and of the model that a truth's margin must exceed to count against an intersector.
const ROUNDINGS: f64 = 8.0;

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// Name of the variant.
    pub variant: String,
    /// Name of the intersector.
    pub intersector: String,
    /// Rays or paths traced.
    pub rays: u64,
    /// Right answers.
    pub right: u64,
    /// Answers that say they are not sure.
    pub flagged: u64,
    /// Wrong without a word.
    pub wrong: u64,
}

impl Scene<'_> {
    /// Makes every query on an intersector and counts the grades; a trimmed case makes none on facets.
    pub fn ask(&self, name: &str, intersector: &dyn Intersector, geometry: Geometry) -> Row {
        let mut row = Row {
            case: self.case.name.into(),
            variant: self.variant.name().into(),
            intersector: name.into(),
            rays: 0,
            right: 0,
            flagged: 0,
            wrong: 0,
        };
        for grade in self.grades(intersector, geometry) {
            row.rays += 1;
            match grade {
                Grade::Right => row.right += 1,
                Grade::Flagged => row.flagged += 1,
                Grade::Wrong => row.wrong += 1,
            }
        }
        row
    }
}

/// Steps of the search for a missed crossing of the band.
const STEPS: usize = 256;

impl Scene<'_> {
    /// Returns one grade per question, in order; none for facets of a trimmed case.
    pub fn grades(&self, intersector: &dyn Intersector, geometry: Geometry) -> Vec<Grade> {
        // A trimmed case has no mesh.
        if geometry == Geometry::Facets && self.mesh.facets.is_empty() {
            return Vec::new();
        }
        let grader = Grader { scene: self, intersector, geometry, band: self.band() };
        self.case.questions.iter().map(|q| grader.grade(q)).collect()
    }

    /// Returns the ray of each question where the scene stands; for paths the first ray.
    pub fn rays(&self) -> Vec<Ray> {
        let first = |q: &Question| match q {
            Question::First { ray, .. } | Question::All { ray, .. } | Question::Guide { ray, .. } => *ray,
            Question::Chord { toward, .. } | Question::Onward { toward, .. } => *toward,
        };
        self.case.questions.iter().map(|q| self.ray(&first(q))).collect()
    }

    /// Moves a ray of the case into the place of the variant.
    fn ray(&self, local: &Ray) -> Ray {
        let range = |t: f64| t * self.frame.scale;
        Ray::new(self.frame.point(local.origin), self.frame.direction(local.direction).normalize())
            .with_range(range(local.t_min), range(local.t_max))
    }

    /// Returns the largest sag of the facets, in the case's own millimetres; 0 without facets.
    fn band(&self) -> f64 {
        self.mesh.sag.iter().copied().fold(0.0, f64::max) / self.frame.scale
    }

    /// Returns the rounding of coordinates of the size that the ray's numbers have here at distance `t`, both in the case's own
    /// millimetres.
    pub fn resolution(&self, ray: &Ray, t: f64) -> f64 {
        // In the place where the case stands: coordinates there set the rounding, not those at home.
        let reach = self.frame.point(ray.origin).length() + self.frame.scale * t.abs() + self.frame.origin.length();
        f64::EPSILON * (reach / self.frame.scale + 1.0)
    }
}

/// The intersector under test, and by how much facets may be off.
struct Grader<'a> {
    scene: &'a Scene<'a>,
    intersector: &'a dyn Intersector,
    geometry: Geometry,
    band: f64,
}

/// Whether a hit says that it is not sure.
fn is_flagged(hit: &Hit) -> bool {
    matches!(hit.certainty, Certainty::Tangent | Certainty::Uncertified)
}

impl Grader<'_> {
    /// Asks for the nearest hit of a ray in the scene's place.
    fn ask(&self, ray: &Ray) -> Option<Hit> {
        self.intersector.intersect(ray, &mut Cost::default())
    }

    /// Whether a miss of the spline is one that the intersector itself is not sure of: it has no hit to carry the flag, but
    /// it counts a fallback.
    fn unsure_miss(&self, ray: &Ray) -> bool {
        let mut cost = Cost::default();
        self.geometry == Geometry::Spline
            && self.intersector.intersect(ray, &mut cost).is_none()
            && cost.fallbacks > 0
    }

    /// Grades a miss where there should be a hit: wrong, or flagged where the spline is not sure of it.
    fn grade_miss(&self, ray: &Ray) -> Grade {
        if self.unsure_miss(ray) { Grade::Flagged } else { Grade::Wrong }
    }

    /// Whether the truth is too close to call: its margin is within the rounding of the input, plus the trim band on a trimmed spline.
    fn is_undecided(&self, truth: &Truth, resolution: f64) -> bool {
        let trimmed = self.geometry == Geometry::Spline && !self.scene.case.loops.is_empty();
        let band = if trimmed { TRIM_BAND / self.scene.frame.scale } else { 0.0 };
        truth.margin <= ROUNDINGS * resolution + band
    }

    /// Asks a question and grades the answer.
    fn grade(&self, question: &Question) -> Grade {
        match question {
            Question::First { ray, truth } => {
                let asked = self.scene.ray(ray);
                self.grade_first([ray, &asked], truth, self.ask(&asked).as_ref())
            }
            Question::All { ray, truths } => self.grade_all(ray, truths),
            Question::Chord { toward, direction, radius } => self.grade_chord(toward, *direction, *radius),
            Question::Onward { toward, direction, size } => self.grade_onward(toward, *direction, *size),
            Question::Guide { ray, size, reflections } => self.grade_guide(ray, *size, *reflections),
        }
    }

    /// Returns the distance of a hit in the case's own millimetres.
    fn local_t(&self, hit: &Hit) -> f64 {
        hit.t / self.scene.frame.scale
    }

    /// Grades a first hit of a ray, given as in the case and as traced, by what is promised on the spline or on facets.
    fn grade_first(&self, [ray, asked]: [&Ray; 2], truth: &Truth, hit: Option<&Hit>) -> Grade {
        match self.geometry {
            Geometry::Spline => self.first_on_spline([ray, asked], truth, hit),
            Geometry::Facets if self.right_within_sag(ray, truth, hit) => Grade::Right,
            Geometry::Facets => Grade::Wrong,
        }
    }

    /// Grades a first hit on the spline of a ray, given as in the case and as traced: right to the last digits, or flagged where it says
    /// that it is not proved.
    fn first_on_spline(&self, [ray, asked]: [&Ray; 2], truth: &Truth, hit: Option<&Hit>) -> Grade {
        let resolution = self.scene.resolution(ray, truth.distance());
        let open = self.is_undecided(truth, resolution);
        let right = match (truth.t, hit) {
            (None, None) => true,
            (Some(_), None) => open,
            (None, Some(h)) => open && self.on_surface(ray, h, resolution),
            (Some(t), Some(h)) => {
                // Rounding of a crossing grows with one over the cosine.
                let close = (self.local_t(h) - t).abs() <= 16.0 * resolution * (1.0 + 1.0 / truth.cos);
                let normal = truth.normal.map(|n| self.scene.frame.normal(n));
                // 1e-6 rad is far below what any facet reaches; coordinates rounded to r turn the normal of the surface
                // itself by r/1e-6 at 1e-6 mm from a pole.
                let along = normal.is_none_or(|n| h.normal.cross(n).length() < NORMAL + resolution / NEAR_POLE);
                (close && along) || (open && self.on_surface(ray, h, resolution))
            }
        };
        match (right, hit) {
            // An answer that says it is unsure counts as such, right or not, unless the truth itself is open.
            (_, Some(h)) if is_flagged(h) && !open => Grade::Flagged,
            (true, _) => Grade::Right,
            (false, Some(h)) if is_flagged(h) => Grade::Flagged,
            (false, None) if self.unsure_miss(asked) => Grade::Flagged,
            _ => Grade::Wrong,
        }
    }

    /// Whether a hit lies on the true surface, to rounding.
    fn on_surface(&self, ray: &Ray, hit: &Hit, resolution: f64) -> bool {
        (self.scene.case.distance)(ray.point_at(self.local_t(hit))).abs() <= 64.0 * resolution + ON_SURFACE
    }

    /// Whether the point at distance `t`, in the case's own millimetres, lies within the facets' sag of the surface.
    fn in_band(&self, ray: &Ray, t: f64) -> bool {
        let slack = self.scene.case.slack + 64.0 * self.scene.resolution(ray, t);
        (self.scene.case.distance)(ray.point_at(t)).abs() <= self.band + slack
    }

    /// Whether a first hit, or a miss, is right for facets: within their band, and not behind a surface that stands in the way.
    fn right_within_sag(&self, ray: &Ray, truth: &Truth, hit: Option<&Hit>) -> bool {
        let slack = self.scene.case.slack + 64.0 * self.scene.resolution(ray, truth.distance());
        let Some(h) = hit else { return truth.t.is_none() || truth.margin <= self.band + slack };
        let t = self.local_t(h);
        if !self.in_band(ray, t) {
            return false;
        }
        let Some(true_t) = truth.t else { return true };
        // Between the true hit and a later one the ray must not have been through the whole band.
        let start = (self.scene.case.distance)(ray.point_at(true_t - 2.0 * self.band - slack)).signum();
        let through = |i: usize| {
            let at = true_t + (t - true_t) * i as f64 / STEPS as f64;
            start * (self.scene.case.distance)(ray.point_at(at)) < -self.band - slack
        };
        t <= true_t || !(1..STEPS).any(through)
    }

    /// Asks for all crossings of a ray, each from the one before, and grades them together against `truths`, by distance: right if each
    /// lies at its truth and none is missing or too many; on facets each within the band of the sag, and those that the sag may miss in
    /// pairs. On the spline flagged, right or not, where a hit or the last miss says that it is unsure.
    fn grade_all(&self, ray: &Ray, truths: &[Truth]) -> Grade {
        let mut next = self.scene.ray(ray);
        let origin = next.origin;
        let mut hits: Vec<Hit> = Vec::new();
        let mut unsure = false;
        // Two more than there are, to see answers that are too many.
        while hits.len() <= truths.len() + 2 {
            let Some(h) = self.ask(&next) else {
                unsure = self.unsure_miss(&next);
                break;
            };
            let p = next.point_at(h.t);
            hits.push(Hit { t: (p - origin).dot(next.direction), ..h });
            next = Ray::new(p, next.direction).with_departure(h.departure());
        }
        let resolution = self.scene.resolution(ray, truths.last().map_or(0.0, Truth::distance));
        let right = match self.geometry {
            Geometry::Facets => {
                // Crossings that the facets can miss by their sag do so in pairs, in and out.
                let sure = truths.iter().filter(|t| t.margin > self.band).count();
                let sequence = hits.len() >= sure
                    && hits.len() <= truths.len()
                    && (truths.len() - hits.len()).is_multiple_of(2);
                sequence && hits.iter().all(|h| self.in_band(ray, self.local_t(h)))
            }
            Geometry::Spline => {
                let close = |(t, h): (&Truth, &Hit)| {
                    t.t.is_some_and(|t_true| {
                        (self.local_t(h) - t_true).abs() <= 64.0 * resolution * (1.0 + 1.0 / t.cos)
                    })
                };
                hits.len() == truths.len() && truths.iter().zip(&hits).all(close)
            }
        };
        match right {
            _ if self.geometry == Geometry::Spline && (unsure || hits.iter().any(is_flagged)) => Grade::Flagged,
            true => Grade::Right,
            false => Grade::Wrong,
        }
    }

    /// Asks for a hit inside a sphere and from there for the other end of a chord, and grades that end; wrong, or flagged, where either is
    /// missed; facets may miss a chord that their sag may hide.
    fn grade_chord(&self, toward: &Ray, direction: Vector, radius: f64) -> Grade {
        let frame = &self.scene.frame;
        let first = self.scene.ray(toward);
        let Some(h) = self.ask(&first) else { return self.grade_miss(&first) };
        let origin = frame.local_point(first.point_at(h.t));
        let local = Ray::new(origin, direction);
        let from = h.departure();
        let second = Ray::new(first.point_at(h.t), frame.direction(direction).normalize()).with_departure(from);
        // From a point o of a sphere around the origin the chord along d is −2 o·d long.
        let true_t = -2.0 * origin.dot(direction);
        let cos = (origin.dot(direction) / radius).abs();
        let truth = Truth::hit(true_t, cos, radius * cos * cos * 0.5);
        let answer = self.ask(&second);
        match self.geometry {
            // From a hit that is not the one aimed at, a chord may run another way.
            Geometry::Spline if is_flagged(&h) => Grade::Flagged,
            Geometry::Spline => self.first_on_spline([&local, &second], &truth, answer.as_ref()),
            Geometry::Facets => {
                let right = answer.as_ref().map_or(truth.margin <= self.band, |a| {
                    let t = self.local_t(a);
                    // From inside, a chord is missed only if the ray got out of the band on the far side.
                    self.in_band(&local, t) && t > AT_START * true_t && t <= true_t + self.band_reach(&truth)
                });
                if right { Grade::Right } else { Grade::Wrong }
            }
        }
    }

    /// Asks for a hit in a box and from there for the next wall, and grades that; wrong, or flagged, where the first is missed.
    fn grade_onward(&self, toward: &Ray, direction: Vector, size: Vector) -> Grade {
        let frame = &self.scene.frame;
        let first = self.scene.ray(toward);
        let Some(h) = self.ask(&first) else { return self.grade_miss(&first) };
        let start = first.point_at(h.t);
        let local = Ray::new(frame.local_point(start), direction);
        let next = Ray::new(start, frame.direction(direction).normalize()).with_departure(h.departure());
        // Where it leaves the box; it runs away from the wall that it starts on.
        let ways = [0, 1, 2].map(|a: usize| {
            let wall = if direction[a] > 0.0 { size[a] } else { 0.0 };
            (wall - local.origin[a]) / direction[a]
        });
        let axis = Vector::from_array(ways).min_position();
        // Over the wall that it leaves the ray has risen by this when it meets the next.
        let margin = direction.abs().min_element() * ways[axis];
        let truth = Truth::hit(ways[axis], direction[axis], margin);
        self.grade_first([&local, &next], &truth, self.ask(&next).as_ref())
    }

    /// Returns how far along the ray the sag band stretches behind a hit, mm.
    fn band_reach(&self, truth: &Truth) -> f64 {
        4.0 * self.band / truth.cos.max(GRAZING)
    }

    /// Follows reflections in a box and grades where they end, known by unfolding: wrong at once where one is missed, flagged where the end
    /// is wrong and some hit was not sure.
    fn grade_guide(&self, ray: &Ray, size: Vector, reflections: usize) -> Grade {
        let frame = &self.scene.frame;
        let mut ray_here = self.scene.ray(ray);
        let mut path = 0.0;
        let mut any_flag = false;
        for _ in 0..reflections {
            let Some(h) = self.ask(&ray_here) else { return Grade::Wrong };
            any_flag |= is_flagged(&h);
            path += h.t / frame.scale;
            let d = ray_here.direction;
            let turned = (d - h.geometric_normal * (2.0 * d.dot(h.geometric_normal))).normalize();
            let from = h.departure();
            ray_here = Ray::new(ray_here.point_at(h.t), turned).with_departure(from);
        }
        // Unfolded, the path is straight; folding each coordinate back gives the true end.
        let fold = |x: f64, l: f64| {
            let y = x.rem_euclid(2.0 * l);
            if y > l { 2.0 * l - y } else { y }
        };
        let straight = ray.point_at(path);
        let end = Point::new(fold(straight.x, size.x), fold(straight.y, size.y), fold(straight.z, size.z));
        let off = frame.local_point(ray_here.origin).distance(end);
        let rounding = reflections as f64 * 16.0 * self.scene.resolution(ray, size.length());
        if off <= rounding + path * reflections as f64 * 4.0 * f64::EPSILON {
            Grade::Right
        } else if any_flag {
            Grade::Flagged
        } else {
            Grade::Wrong
        }
    }
}
