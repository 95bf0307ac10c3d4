//! What can become of light: the events of a path, the causes of a loss, and what is counted.

use crate::math::{Point, Vector};
use serde::{Deserialize, Serialize};

/// Why a ray was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LostCause {
    /// It left the scene, or came to a receiver that ends light, while inside a medium: a crack, or an open shell with a medium.
    NoExit,
    /// It left a body that it was not inside of, or entered one while inside another that stands apart.
    ImpossibleMedium,
    /// It hit a closed opaque solid from inside.
    InsideSolid,
    /// More bodies inside each other than a ray can carry.
    TooDeep,
    /// The intersector's answer is of no use: a distance or normal that is not a number, or a face that the scene does not have.
    NotANumber,
    /// The list that it was to come from could no longer be read: the file was changed or went while it was in use.
    Unreadable,
}

impl LostCause {
    /// Returns its name in files and messages, the same as in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoExit => "no_exit",
            Self::ImpossibleMedium => "impossible_medium",
            Self::InsideSolid => "inside_solid",
            Self::TooDeep => "too_deep",
            Self::NotANumber => "not_a_number",
            Self::Unreadable => "unreadable",
        }
    }
}

/// A ray that was lost, with all that is needed to trace it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LostRay {
    /// Index of the ray.
    pub ray: u64,
    /// Which path of a ray that was split.
    pub branch: u32,
    /// Hits before it was lost.
    pub bounce: u32,
    /// Why it was lost.
    pub cause: LostCause,
    /// Its power, in quanta.
    pub quanta: u64,
    /// Start of its last segment, mm.
    pub origin: Point,
    /// Direction of its last segment.
    pub direction: Vector,
    /// The face where it happened, if it was at one.
    pub face: Option<u32>,
    /// The body it was in, as [`BoundScene::body_names`](crate::simulate::BoundScene::body_names) names it; 0 for the surroundings.
    pub body: u32,
}

/// A vertex of a recorded path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathVertex {
    /// Index of the ray.
    pub ray: u64,
    /// Which path of a ray that was split; a new branch starts where it split off.
    pub branch: u32,
    /// Hits before this vertex, scattering inside bodies among them.
    pub bounce: u32,
    /// Where it is, mm, in scene coordinates.
    pub point: Point,
    /// Power that goes on from here, as a share of an average ray; where the path ends, what arrives.
    pub power: f64,
    /// What happens here.
    pub event: Event,
    /// The placed face where it happens, if it is at one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<u32>,
    /// The body that light came here through, as [`BoundScene::body_names`](crate::simulate::BoundScene::body_names) names it; 0 for the
    /// surroundings. Where a path begins, the body that it begins in.
    #[serde(default, skip_serializing_if = "is_surroundings")]
    pub body: u32,
}

/// Whether a body is what is around everything, which files of vertices leave out.
fn is_surroundings(body: &u32) -> bool {
    *body == 0
}

/// Takes vertices of paths as they come, from any thread.
pub type PathSink<'a> = &'a (dyn Fn(&[PathVertex]) + Sync);

/// What happens at a vertex of a path. Files of numbers count from 0 in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Event {
    /// It starts at a source.
    Emitted,
    /// It splits off another path here: the first vertex of that path.
    Split,
    /// Reflected at a face.
    Reflected,
    /// Transmitted at a face. Where light goes straight on, as through a face without a medium, there is no vertex.
    Transmitted,
    /// Scattered inside a body. Light that a rough face scatters is reflected or transmitted.
    Scattered,
    /// It ends in a face or medium.
    Absorbed,
    /// It ends on a receiver.
    Received,
    /// It leaves the scene.
    Escaped,
    /// It is cut off by a limit.
    CutOff,
    /// It is lost.
    Lost,
}

impl Event {
    /// Returns its name in messages, the same as in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Emitted => "emitted",
            Self::Split => "split",
            Self::Reflected => "reflected",
            Self::Transmitted => "transmitted",
            Self::Scattered => "scattered",
            Self::Absorbed => "absorbed",
            Self::Received => "received",
            Self::Escaped => "escaped",
            Self::CutOff => "cut_off",
            Self::Lost => "lost",
        }
    }
}

/// Event counts of a run or of a part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Rays that left a source.
    pub rays: u64,
    /// Nearest-hit queries, the last of each path included.
    pub segments: u64,
    /// Times that a ray was kept on its side of a face: by the facet's normal in place of the interpolated one, or by mirroring a scattered
    /// or emitted ray.
    pub corrected_normals: u64,
    /// Paths that were lost.
    pub lost: u64,
    /// Paths that a limit cut off.
    pub cut_off: u64,
    /// Paths cut off because they went round by total reflection without end; counted in `cut_off` too.
    pub caught: u64,
    /// Times that light left a body below the one it had come into later, of another index: two bodies that overlap.
    pub overlaps: u64,
    /// The two bodies of one of them, those of the lowest numbers; zeros where there are none.
    pub overlapping: [u32; 2],
    /// Times that light crossed the first of two touching faces alone, as it could be in no body that the second bounds.
    pub refused_contacts: u64,
    /// Rays of luminous faces that started on the spline, as the intersector has their face nowhere near.
    pub misplaced_starts: u64,
    /// Rays that started in the face of a body, and inside of it, as they go into it and the scene does not say what their source is in.
    pub flush_starts: u64,
    /// Source and placed face of one of them, those of the lowest numbers; zeros where there are none.
    pub flush_place: [u32; 2],
}

impl Counts {
    /// Adds the counts of other rays.
    pub(crate) fn add(&mut self, o: &Self) {
        self.rays += o.rays;
        self.segments += o.segments;
        self.corrected_normals += o.corrected_normals;
        self.lost += o.lost;
        self.cut_off += o.cut_off;
        self.caught += o.caught;
        self.add_overlap(o.overlapping, o.overlaps);
        self.refused_contacts += o.refused_contacts;
        self.misplaced_starts += o.misplaced_starts;
        self.add_flush_starts(o.flush_place, o.flush_starts);
    }

    /// Adds `times` meetings of two overlapping bodies, and keeps the pair of the lowest numbers; `[0; 2]` is no pair.
    pub(crate) fn add_overlap(&mut self, pair: [u32; 2], times: u64) {
        self.overlaps += times;
        if self.overlapping == [0; 2] || (pair != [0; 2] && pair < self.overlapping) {
            self.overlapping = pair;
        }
    }

    /// Adds so many rays that started in a face, of a source and a face by their numbers, and keeps the lowest of these; none adds nothing.
    pub(crate) fn add_flush_starts(&mut self, place: [u32; 2], rays: u64) {
        if rays > 0 && (self.flush_starts == 0 || place < self.flush_place) {
            self.flush_place = place;
        }
        self.flush_starts += rays;
    }
}

#[cfg(test)]
mod tests {
    use super::Event::{
        self, Absorbed, CutOff, Emitted, Escaped, Lost, Received, Reflected, Scattered, Split, Transmitted,
    };
    use super::LostCause::{self, ImpossibleMedium, InsideSolid, NoExit, NotANumber, TooDeep, Unreadable};

    #[test]
    fn names_are_those_of_json() {
        for cause in [NoExit, ImpossibleMedium, InsideSolid, TooDeep, NotANumber, Unreadable] {
            assert_eq!(serde_json::to_value(cause).unwrap(), LostCause::name(cause));
        }
        let there = [Emitted, Split, Reflected, Transmitted, Scattered];
        for event in there.into_iter().chain([Absorbed, Received, Escaped, CutOff, Lost]) {
            assert_eq!(serde_json::to_value(event).unwrap(), Event::name(event));
        }
    }
}
