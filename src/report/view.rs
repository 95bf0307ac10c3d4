//! 3-D views as plain data, made of facets, lines and points, simplified until a report can show them.

use super::view_triangles::{FaceTriangles, merge_corners, triangles_of, used_points};
use crate::formats::{ColourMap, Facets, Group, Polylines};
use crate::math::Point;
use crate::text::{figures, grouped};

/// A 3-D view: turns in the report, a static picture beside it.
#[derive(Clone, Debug)]
pub struct View {
    /// Stem of its files.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// What is drawn, mm.
    pub shapes: Vec<Shape>,
}

/// One thing in a 3-D view.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Shape {
    /// Triangles.
    Surface {
        /// Name in the legend.
        name: String,
        /// Corners, mm.
        points: Vec<[f32; 3]>,
        /// Indices into `points`.
        triangles: Vec<[u32; 3]>,
        /// Red, green, blue in `[0, 1]`.
        colour: [f64; 3],
        /// From 0, invisible, to 1.
        opacity: f64,
        /// A value for each triangle in place of the colour.
        values: Option<Values>,
        /// What the points from one on belong to, by rising first point: selectors of faces.
        labels: Vec<(u32, String)>,
    },
    /// Polylines.
    Lines {
        /// Name in the legend.
        name: String,
        /// The lines, mm.
        lines: Vec<Vec<[f32; 3]>>,
        /// Red, green, blue in `[0, 1]`.
        colour: [f64; 3],
        /// Width on the screen, pixels.
        width: f64,
    },
    /// Points.
    Points {
        /// Name in the legend.
        name: String,
        /// Where they are, mm.
        points: Vec<[f32; 3]>,
        /// Red, green, blue in `[0, 1]`.
        colour: [f64; 3],
    },
}

/// Values that colour triangles.
#[derive(Clone, Debug)]
pub struct Values {
    /// What they mean, with the unit.
    pub label: String,
    /// One a triangle.
    pub values: Vec<f32>,
    /// Colours from the smallest to the largest.
    pub map: ColourMap,
}

/// More triangles than this are simplified for showing: base64 of 60,000 is 3 MB of the report.
const SHOWN: usize = 60_000;
/// Triangles that a surface keeps in any case, so that it is recognised, unless surfaces are so many that these would pass [`SHOWN`].
const LEAST_SHOWN: usize = 2000;

/// Least brightness that a part is drawn with, of its brightest primary: of a darker one shading would show no form.
const DARKEST: f64 = 0.3;

/// Returns the colour that a part is drawn with: its own, very dark ones lightened.
fn relief_colour(colour: [f64; 3]) -> [f64; 3] {
    let lift = (DARKEST - colour.into_iter().fold(0.0, f64::max)).max(0.0);
    colour.map(|primary| primary + lift)
}

impl View {
    /// Draws facets in the colours of their parts, simplified where there are more than 60,000 triangles, which the caption then says.
    pub fn of_facets(name: &str, title: &str, facets: &Facets) -> Self {
        let mut view = Self { name: name.into(), title: title.into(), caption: String::new(), shapes: Vec::new() };
        let mut merged = 0.0f64;
        let total: usize = facets.mesh.facets.iter().map(|f| f.triangle_count()).sum();
        let surfaces = shown_surfaces(facets);
        let least = LEAST_SHOWN.min(SHOWN / surfaces.len().max(1));
        for shown in surfaces {
            let all = triangles_of(facets, &shown.facets, !facets.labels.is_empty());
            let limit = (SHOWN * all.triangles.len()).div_ceil(total.max(1)).max(least);
            let (FaceTriangles { points, faces, triangles }, cell) = merge_corners(all, limit);
            merged = merged.max(cell);
            let labels =
                run_starts(&faces).filter_map(|(first, f)| Some((first, facets.labels.get(f as usize)?.clone())));
            view.shapes.push(Shape::Surface {
                name: shown.name,
                points,
                triangles,
                colour: relief_colour(shown.group.colour),
                opacity: shown.group.opacity,
                values: None,
                labels: labels.collect(),
            });
        }
        if merged > 0.0 {
            view.caption = format!(
                "Shown simplified: corners closer than about {} mm are merged; the traced mesh is untouched.",
                figures(merged, 2)
            );
        }
        view
    }

    /// Draws facets coloured by a value each, by index; of more than 60,000 triangles every so many, which the caption then says. Facets
    /// without a value have none to colour them.
    pub fn of_values(
        name: &str,
        title: &str,
        facets: &Facets,
        label: &str,
        values: &[f64],
        map: ColourMap,
    ) -> Self {
        let total: usize = facets.mesh.facets.iter().map(|f| f.triangle_count()).sum();
        let step = total.div_ceil(SHOWN).max(1);
        let caption = match step {
            1 => String::new(),
            _ => format!("Shown: one triangle in {step} of {}.", grouped(total as u64)),
        };
        let mut view = Self { name: name.into(), title: title.into(), caption, shapes: Vec::new() };
        // Clear parts apart, so that one sees through them.
        for shown in shown_surfaces(facets) {
            let FaceTriangles { mut points, mut triangles, .. } = triangles_of(facets, &shown.facets, false);
            let mut per_triangle: Vec<f32> = Vec::with_capacity(triangles.len());
            for &i in &shown.facets {
                let value = values.get(i).map_or(f32::NAN, |v| *v as f32);
                // Triangles come facet by facet in this order, as they are not gathered by face.
                per_triangle.extend(std::iter::repeat_n(value, facets.mesh.facets[i].triangle_count()));
            }
            // Every so many triangles: merging corners would mix the values.
            if step > 1 {
                triangles = triangles.into_iter().step_by(step).collect();
                per_triangle = per_triangle.into_iter().step_by(step).collect();
                (points, triangles) = used_points(&points, &triangles);
            }
            let values = Some(Values { label: label.into(), values: per_triangle, map });
            let opacity = if shown.group.opacity < 1.0 { 0.4 } else { 1.0 };
            view.shapes.push(Shape::Surface {
                name: shown.name,
                points,
                triangles,
                colour: [0.6; 3],
                opacity,
                values,
                labels: Vec::new(),
            });
        }
        view
    }

    /// Returns the view with a sentence in front of its caption.
    pub fn caption(mut self, text: &str) -> Self {
        self.caption = format!("{text} {}", self.caption).trim().to_owned();
        self
    }

    /// Returns the view with polylines, mm; those of a single point are left out.
    pub fn lines(mut self, name: &str, lines: &Polylines, colour: [f64; 3]) -> Self {
        let lines: Vec<Vec<[f32; 3]>> = (lines.lines())
            .filter(|line| line.len() > 1)
            .map(|line| line.iter().map(|p| p.as_vec3().to_array()).collect())
            .collect();
        if !lines.is_empty() {
            self.shapes.push(Shape::Lines { name: name.into(), lines, colour, width: 1.5 });
        }
        self
    }

    /// Returns the view with points, mm.
    pub fn points(mut self, name: &str, points: &[Point], colour: [f64; 3]) -> Self {
        if !points.is_empty() {
            let points = points.iter().map(|p| p.as_vec3().to_array()).collect();
            self.shapes.push(Shape::Points { name: name.into(), points, colour });
        }
        self
    }

    /// Returns the view with surfaces of this opacity at most, so that what is behind them shines through.
    pub fn faded(mut self, most: f64) -> Self {
        for shape in &mut self.shapes {
            if let Shape::Surface { opacity, .. } = shape {
                *opacity = opacity.min(most);
            }
        }
        self
    }

    /// Returns lowest and highest coordinates of everything shown, mm; `None` where that is nothing.
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        let all = self.shapes.iter().flat_map(|s| -> Box<dyn Iterator<Item = &[f32; 3]>> {
            match s {
                Shape::Surface { points, .. } | Shape::Points { points, .. } => Box::new(points.iter()),
                Shape::Lines { lines, .. } => Box::new(lines.iter().flatten()),
            }
        });
        all.fold(None, |b: Option<[[f32; 3]; 2]>, p| {
            let [mut lo, mut hi] = b.unwrap_or([*p, *p]);
            for k in 0..3 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
            Some([lo, hi])
        })
    }
}

/// Parts that are shown under names of their own; of more, those that look the same are one surface, for a thousand entries of a
/// legend say nothing and took 20 s.
const NAMED: usize = 40;

/// One surface of a view.
struct Shown<'a> {
    name: String,
    group: &'a Group,
    facets: Vec<usize>,
}

/// Divides the facets of a view by part or, where there are more than [`NAMED`], by look.
fn shown_surfaces<'a>(facets: &'a Facets) -> Vec<Shown<'a>> {
    let lists = facets.by_group().into_iter().zip(&facets.groups).filter(|(list, _)| !list.is_empty());
    let mut all: Vec<Shown> =
        lists.map(|(facets, group)| Shown { name: group.name.clone(), group, facets }).collect();
    if all.len() <= NAMED {
        return all;
    }
    let mut looks: Vec<(Shown, usize)> = Vec::new();
    for part in all.drain(..) {
        let same = |s: &Shown| (s.group.colour, s.group.opacity) == (part.group.colour, part.group.opacity);
        match looks.iter_mut().find(|(s, _)| same(s)) {
            Some((s, more)) => {
                s.facets.extend(part.facets);
                *more += 1;
            }
            None => looks.push((part, 0)),
        }
    }
    let named = |(s, more): (Shown<'a>, usize)| match more {
        0 => s,
        _ => Shown { name: format!("{} and {} more", s.name, grouped(more as u64)), ..s },
    };
    looks.into_iter().map(named).collect()
}

/// Returns the index of the first of each run of equal numbers, and the number.
fn run_starts(numbers: &[u32]) -> impl Iterator<Item = (u32, u32)> {
    let starts = numbers.iter().enumerate().filter(|(k, n)| *k == 0 || numbers[k - 1] != **n);
    starts.map(|(k, n)| (k as u32, *n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{FaceId, Uv, Vector};
    use crate::mesh::{Facet, FacetMesh, MeshVertex};

    #[test]
    fn black_parts_are_drawn_with_form() {
        assert_eq!(relief_colour([0.0; 3]), [0.3; 3]);
        assert_eq!(relief_colour([0.1, 0.0, 0.2]).map(|c| (c * 100.0).round()), [20.0, 10.0, 30.0]);
        let bright = [0.0, 0.3, 0.9];
        assert_eq!(relief_colour(bright), bright);
    }

    #[test]
    fn many_parts_of_one_look_are_one_surface() {
        let part_count = 100;
        let mut mesh = FacetMesh::default();
        for k in 0..part_count {
            let first = mesh.vertices.len() as u32;
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)] {
                let position = mesh.positions.len() as u32;
                mesh.positions.push(Point::new(x, y, f64::from(k)));
                mesh.vertices.push(MeshVertex { position, normal: Vector::Z, uv: Uv::ZERO });
            }
            mesh.facets.push(Facet { vertices: [first, first + 1, first + 2, first + 2], face: FaceId(k as u32) });
        }
        let look = |k: i32| if k % 2 == 0 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let groups = |n: i32| (0..n).map(|k| Group::solid(&format!("p{k}"), look(k))).collect();
        let of = |n: i32| {
            let group_of_face = (0..part_count).map(|k| (k % n) as u32).collect();
            let facets = Facets { groups: groups(n), group_of_face, ..Facets::plain(&mesh, "") };
            let view = View::of_facets("v", "V", &facets);
            let named = |s: &Shape| match s {
                Shape::Surface { name, triangles, .. } => (name.clone(), triangles.len()),
                _ => panic!(),
            };
            view.shapes.iter().map(named).collect::<Vec<_>>()
        };
        assert_eq!(of(100), [("p0 and 49 more".to_owned(), 50), ("p1 and 49 more".to_owned(), 50)]);
        let few = of(20);
        assert!(few.len() == 20 && few.iter().all(|(_, n)| *n == 5), "{few:?}");
    }
}
