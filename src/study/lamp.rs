//! Three lamps of one generator: one cavity, three cavities, twelve cavities with thousands of spline patches.

use super::sample_models;
use crate::math::{Homogeneous, Point};
use crate::model::Model;
use crate::nurbs::{ControlPoint, Surface};
use std::fmt::Write;

/// A generated lamp with the scene that lights it.
#[derive(Clone, Debug)]
pub struct Lamp {
    /// `simple`, `moderate` or `intricate`, as in the paper's table.
    pub name: &'static str,
    /// The reflectors, one face each.
    pub model: Model,
    /// Bézier patches in all.
    pub patches: usize,
    /// The scene file: an LED in the focus of every cavity, all reflectors mirrors, a wall at 5 m.
    pub scene: String,
}

/// Half the side of a cavity, mm.
const HALF_SIDE: f64 = 30.0;
/// Distance of neighbouring cavities, mm.
const PITCH: f64 = 66.0;

/// Generates the three lamps, simple first.
pub fn lamps() -> Vec<Lamp> {
    vec![lamp("simple", 1, 8, 0.0), lamp("moderate", 3, 12, 0.02), lamp("intricate", 12, 20, 0.05)]
}

/// Makes a lamp of reflectors of `spans`² bicubic patches each, rippled by `ripple` mm to spread the light, and its scene.
fn lamp(name: &'static str, cavities: usize, spans: usize, ripple: f64) -> Lamp {
    let columns = cavities.min(4);
    let mut surfaces = Vec::new();
    let mut scene = String::from(
        "title = \"generated lamp\"\n\n[[material]]\npart = \"*\"\nsurface = \"mirror\"\nreflectance = 0.95\n",
    );
    for c in 0..cavities {
        let at = [(c % columns) as f64 * PITCH, (c / columns) as f64 * PITCH];
        // Other focal lengths, so that no cavity repeats another's patches.
        let focus = 18.0 + 12.0 * c as f64 / cavities as f64;
        surfaces.push(cavity(at, focus, spans, ripple));
        let power = 1.0 / cavities as f64;
        // Writing to a string cannot fail.
        let _ = write!(
            scene,
            "\n[[source]]\nkind = \"lambertian\"\nat = [{:?}, {:?}, {focus:?}]\ndirection = [0, 0, -1]\nsize = [1, 1]\npower = {power:?}\n",
            at[0], at[1]
        );
    }
    scene.push_str("\n[[receiver]]\nname = \"wall\"\nkind = \"plane\"\nat = [0, 0, 5000]\nnormal = [0, 0, 1]\nsize = [4000, 4000]\ncells = [40, 40]\n");
    Lamp { name, model: sample_models::model(name, surfaces), patches: cavities * spans * spans, scene }
}

/// Makes a paraboloid of focal length `focus`, mm, rippled by `ripple` mm, over a square about a centre, mm, as a spline of `spans`²
/// bicubic patches: control points on the function at the Greville abscissae.
fn cavity([x0, y0]: [f64; 2], focus: f64, spans: usize, ripple: f64) -> Surface {
    let inner = (0..=spans).map(|i| -HALF_SIDE + 2.0 * HALF_SIDE * i as f64 / spans as f64);
    let knots: Vec<f64> =
        std::iter::repeat_n(-HALF_SIDE, 3).chain(inner).chain(std::iter::repeat_n(HALF_SIDE, 3)).collect();
    let greville: Vec<f64> = knots[1..knots.len() - 1].windows(3).map(|w| (w[0] + w[1] + w[2]) / 3.0).collect();
    let height = |x: f64, y: f64| {
        // A span is a quarter of a wave: cubic splines follow it with ease.
        let waves = std::f64::consts::PI * spans as f64 / (4.0 * HALF_SIDE);
        (x * x + y * y) / (4.0 * focus) + ripple * (waves * x).cos() * (waves * y).cos()
    };
    let at = |x: f64, y: f64| Homogeneous::weighted(Point::new(x0 + x, y0 + y, height(x, y)), 1.0);
    let points =
        greville.iter().flat_map(|&x| greville.iter().map(move |&y| (x, y))).map(|(x, y)| at(x, y)).collect();
    Surface { degree: [3, 3], knots: [knots.clone(), knots], points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Scene;
    use std::path::Path;

    #[test]
    fn lamps_have_the_patches_they_claim_and_their_scenes_bind() {
        for lamp in lamps() {
            let patches: usize =
                lamp.model.placed_faces().filter_map(|p| p.face).map(|f| f.surface.bezier_patches().len()).sum();
            assert_eq!(patches, lamp.patches);
            let scene = Scene::parse(&lamp.scene, "lamp.toml", Path::new(".")).unwrap();
            scene.bind(&lamp.model).unwrap();
        }
        assert!(lamps()[2].patches >= 4000);
    }
}
