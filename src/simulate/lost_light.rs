//! Where light was lost, why, and what to do about it.

use super::bind::BoundScene;
use super::body::AMBIENT;
use super::outcome::{LostCause, LostRay};
use super::surfaces::{FaceOptics, Surface};
use crate::text::figures;
use std::collections::BTreeMap;

/// Most reasons that are reported.
const TOLD_REASONS: usize = 3;
/// Largest gap that is not worth a word, mm: what curves in parameters are allowed.
const NO_GAP_MM: f64 = 1e-6;

impl BoundScene {
    /// Returns where most rays of the ledger were lost, why, and what helps, in words; the [`TOLD_REASONS`] most frequent first, none of an
    /// empty ledger.
    pub(crate) fn loss_reasons(&self, ledger: &[LostRay]) -> Vec<String> {
        let mut places: BTreeMap<(u32, Option<&str>, LostCause), usize> = BTreeMap::new();
        for l in ledger {
            let at = l.face.and_then(|f| self.instance(f));
            *places.entry((l.body, at, l.cause)).or_default() += 1;
        }
        let mut places: Vec<_> = places.into_iter().collect();
        // A stable sort: equals stay in the order of their places, whatever threads did.
        places.sort_by_key(|(_, number)| std::cmp::Reverse(*number));
        places.truncate(TOLD_REASONS);
        let told = places.into_iter().map(|((body, at, cause), number)| {
            let place = match (self.body_names(body).filter(|_| body != AMBIENT), at) {
                (Some([name, medium]), _) => format!("in '{name}' ({medium})"),
                (None, Some(name)) => format!("at '{name}'"),
                (None, None) => "outside all bodies".into(),
            };
            format!("{number} {place}: {}{}", self.reason(cause, at), self.known_causes(cause, body, at))
        });
        told.collect()
    }

    /// Returns what happened to light that was lost so at an instance, and what helps.
    fn reason(&self, cause: LostCause, at: Option<&str>) -> &'static str {
        match cause {
            LostCause::NoExit => {
                "light left the scene inside a body, by a gap between faces, an open shell or a missing face"
            }
            LostCause::ImpossibleMedium => {
                "light came to a face from the wrong side, as through an open shell, where a mesh is turned or bodies overlap, or where \
                 facets cross, of two faces that lie nearer to each other than the tolerance: there a finer one helps, or \
                 `--intersector exact`"
            }
            LostCause::InsideSolid if self.lets_light_into_solid(at) => {
                "a face of it lets light through, but what is behind has no medium, and its other faces are opaque: give the part a \
                 `medium`, or the face a surface that lets nothing through"
            }
            LostCause::InsideSolid => {
                "light came to a closed opaque solid from inside, as from a source that lies in it: move the source out, or, where the solid \
                 is drawn around a hollow, give the part a `medium` of index 1"
            }
            LostCause::TooDeep => {
                "more bodies lie in each other than a ray can carry, as after it entered an open shell again and again"
            }
            LostCause::NotANumber => "a place or direction is no number",
            LostCause::Unreadable => "the ray file was changed or went while it was in use",
        }
    }

    /// Returns what is known of the file and the sources that explains such a loss in a body or at an instance, to go on the sentence with.
    fn known_causes(&self, cause: LostCause, body: u32, at: Option<&str>) -> String {
        if !matches!(cause, LostCause::NoExit | LostCause::ImpossibleMedium) {
            return String::new();
        }
        let concerned = (0u32..).zip(&self.bodies).filter(|(k, b)| *k == body || at == Some(b.name.as_str()));
        let gap = concerned.map(|(_, body)| body.gap).fold(0.0, f64::max);
        let mut known = String::new();
        if self.emitters.iter().any(|emitter| emitter.media_stated) {
            known += ", or because a source does not lie where its `inside` says";
        }
        if gap > NO_GAP_MM {
            known +=
                &format!("; the file has edges up to {} mm off the faces that they bound there", figures(gap, 3));
        }
        known
    }

    /// Whether a face of this instance lets light through, though no medium is behind it.
    fn lets_light_into_solid(&self, instance: Option<&str>) -> bool {
        let is_open = |face: &FaceOptics| {
            face.body == AMBIENT && matches!(&self.surfaces[face.surface as usize], Surface::Coated(c) if !c.opaque)
        };
        let of_instance =
            |face: usize| self.instances.get(self.instance_of_face[face] as usize).map(String::as_str);
        (0..self.faces.len()).any(|face| is_open(&self.faces[face]) && of_instance(face) == instance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::model::Model;
    use crate::simulate::Scene;
    use std::path::Path;

    #[test]
    fn gaps_of_the_file_and_stated_media_are_named() {
        let told = |source: &str, gap: f64| {
            let text = format!("[[source]]\nkind = 'point'\n{source}\n");
            let scene = Scene::parse(&text, "s.toml", Path::new(".")).unwrap();
            let mut bound = scene.bind(&Model::default()).unwrap();
            bound.bodies[AMBIENT as usize].gap = gap;
            let ray = LostRay {
                ray: 0,
                branch: 0,
                bounce: 0,
                cause: LostCause::NoExit,
                quanta: 1,
                origin: Point::ZERO,
                direction: Vector::Z,
                face: None,
                body: AMBIENT,
            };
            bound.loss_reasons(&[ray]).remove(0)
        };
        let plain = told("", 1e-9);
        assert!(!plain.contains("`inside`") && plain.ends_with("a missing face"), "{plain}");
        let stated = told("inside = []", 0.001_65);
        assert!(stated.contains("its `inside` says; the file has edges up to 0.00165 mm off"), "{stated}");
    }
}
