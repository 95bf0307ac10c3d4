//! The bodies around the start of a ray, from geometry, for sources that do not say what they lie in.

use super::{Context, settle};
use crate::intersect::Cost;
use crate::math::{Departure, Ray};
use crate::simulate::bind::AMBIENT;
use crate::simulate::emitter::{Stream, Ticket};
use smallvec::SmallVec;

/// Bodies, outermost first.
pub(crate) type Bodies = SmallVec<[u16; 4]>;

/// What the rays of a source start in.
#[derive(Clone, Debug)]
pub(crate) enum Around {
    /// All in the same bodies.
    Same(Bodies),
    /// Each must be asked: the source lies on a surface, or reaches into a body.
    Each,
}

/// Rays of a source that are asked before it is believed that all start in the same bodies.
const ASKED: u64 = 64;
/// Faces on the way out after which it is given up.
const DEEP: usize = 1000;

/// What the rays of each source start in.
pub(crate) fn sources(context: &Context<'_>) -> Vec<Around> {
    let emitters = context.bound.emitters.iter().zip(&context.plan.shares).enumerate();
    emitters
        .map(|(source, (emitter, share))| {
            if emitter.stated || !context.bound.has_media() {
                return Around::Same(emitter.inside.clone());
            }
            let replicates = context.plan.replicates;
            let mut first: Option<Bodies> = None;
            for k in 0..ASKED.min(u64::from(replicates)) {
                // One ray of each of so many replicates: they are spread over the whole of a ray list.
                let replicate = (k * u64::from(replicates) / ASKED.min(u64::from(replicates))) as u32;
                let [from, to] = share.range(replicate, replicates);
                if from == to {
                    continue;
                }
                let which = [replicate, replicates];
                let s = context.settings;
                let mut stream = Stream::new(s.seed, s.sampling, which, source as u32, to - from, emitter.pairs());
                let index = (to - from) * k / ASKED;
                let ticket = Ticket { ray: from + index, index: index as u32 };
                stream.prepare(ticket);
                let emission = emitter.emit(&stream, ticket);
                let mut ray = emission.ray;
                if let Some((face, normal)) = emission.from {
                    settle(context, face, normal, &mut ray);
                }
                let found = bodies(context, &ray);
                if first.get_or_insert_with(|| found.clone()) != &found {
                    return Around::Each;
                }
            }
            Around::Same(first.unwrap_or_default())
        })
        .collect()
}

/// The bodies that a ray leaves on its straight way out without having entered them.
pub(crate) fn bodies(context: &Context<'_>, ray: &Ray) -> Bodies {
    let (mut left, mut entered) = (Bodies::new(), Bodies::new());
    let mut at = Ray { t_max: f64::INFINITY, ..*ray };
    // Where faces of two bodies lie in one place, only the last one met is left out of the next question: what was met there before
    // does not count again, and then the place is passed over.
    let mut here: SmallVec<[u32; 4]> = SmallVec::new();
    for _ in 0..DEEP {
        let Some(hit) = context.intersector.intersect(&at, &mut Cost::default()) else { break };
        let same = context.bound.scene.run.glue_mm / at.direction.dot(hit.geometric_normal).abs().max(1e-3);
        if hit.t > same {
            here.clear();
        }
        if here.contains(&hit.primitive) {
            at.t_min = same;
            here.clear();
            continue;
        }
        here.push(hit.primitive);
        let body = context.bound.faces.get(hit.face.index()).map_or(AMBIENT, |f| f.body);
        if body != AMBIENT {
            if at.direction.dot(hit.geometric_normal) < 0.0 {
                entered.push(body);
            } else if let Some(k) = entered.iter().rposition(|b| *b == body) {
                entered.remove(k);
            } else {
                left.push(body);
            }
        }
        let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
        at = Ray::new(at.at(hit.t), at.direction).leaving(from);
    }
    // A solid that is turned inside out is left before it is entered.
    left.retain(|b| !entered.contains(b));
    left.reverse();
    left
}
