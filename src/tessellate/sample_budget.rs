//! Which facets are sampled, where all of a model would take too long.
//!
//! A facet takes some 150 evaluations of its spline, one of a wild surface ten times as many. A first look at some facets of each face
//! measures what one of them takes. If all together take more than the model may, faces share it: none gets more than a common limit, and
//! of the facets of a face that takes more, those without proof come first and the others are spread evenly. Work is counted, not timed, so
//! that the outcome is the same on any machine.

use super::sample::{Sampled, sample_facets};
use super::tessellation::FacetQuality;
use crate::math::FaceId;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::nurbs::Surface;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Most work for one model, in control points that are visited: some eight seconds of one core, half a million bicubic facets.
const MOST_WORK: f64 = 2.5e9;
/// Work for a model of any size, and what each of its faces adds: one and a half seconds, and a hundred facets.
const WORK_OF_ANY: f64 = 5e8;
/// See [`WORK_OF_ANY`].
const WORK_OF_FACE: f64 = 5e5;
/// What an evaluation takes besides its control points, in as many of them: spans and basis functions.
const BESIDES: f64 = 20.0;
/// Facets of a face in the first look.
const FIRST_LOOK: usize = 64;

/// The facets of a face, and what they take.
struct FaceWork {
    facets: Range<usize>,
    /// For one facet, on the mean.
    each: f64,
}

impl FaceWork {
    /// Returns the work of all facets, in control points visited.
    fn sum(&self) -> f64 {
        self.each * self.facets.len() as f64
    }
}

/// What was sampled on the facets of a mesh: once for all facets that are the same at several places.
pub(super) struct MeshSamples {
    /// `None` for what is left out.
    sampled: Vec<Option<Sampled>>,
    /// Of each facet, the index of its sample.
    places: Vec<u32>,
}

impl MeshSamples {
    /// What was sampled on a facet, or on the one that it is a copy of; `None` where that was left out.
    pub(super) fn facet(&self, facet: usize) -> Option<&Sampled> {
        self.sampled[self.places[facet] as usize].as_ref()
    }

    /// Returns the errors of normals of what was sampled, radians, each with the number of facets that have it.
    pub(super) fn normal_errors(&self) -> Vec<(f32, u64)> {
        let mut copies = vec![0; self.sampled.len()];
        self.places.iter().for_each(|&place| copies[place as usize] += 1);
        let known = self.sampled.iter().zip(copies).filter_map(|(s, n)| Some((s.as_ref()?, n)));
        known.flat_map(|(s, n)| s.normal_errors.iter().map(move |&error| (error, n))).collect()
    }

    /// Samples these facets and keeps what was found.
    fn fill(&mut self, mesh: &FacetMesh, model: &Model, facets: Vec<usize>) {
        let made = sample_facets(mesh, model, &facets);
        facets.into_iter().zip(made).for_each(|(f, s)| self.sampled[self.places[f] as usize] = Some(s));
    }
}

/// Samples the facets of a mesh; `quality` says which are proved. A face that `originals` says to be a copy of another one, by its number,
/// is not sampled again.
pub(super) fn sample_within_budget(
    mesh: &FacetMesh,
    model: &Model,
    quality: &[FacetQuality],
    originals: &[FaceId],
) -> MeshSamples {
    let mut samples = MeshSamples { sampled: Vec::new(), places: Vec::with_capacity(mesh.facets.len()) };
    // Facets stand in the order of their faces, and originals before their copies.
    let mut first_places: FxHashMap<FaceId, u32> = FxHashMap::default();
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for facets in mesh.facets.chunk_by(|a, b| a.face == b.face) {
        let start = samples.places.len();
        let count = samples.sampled.len();
        let first = *first_places.entry(originals[facets[0].face.index()]).or_insert(count as u32);
        samples.places.extend(first..first + facets.len() as u32);
        if first as usize == count {
            samples.sampled.resize(count + facets.len(), None);
            ranges.push(start..start + facets.len());
        }
    }
    let first: Vec<usize> = ranges.iter().flat_map(|r| spread(r.clone().collect(), FIRST_LOOK)).collect();
    samples.fill(mesh, model, first);
    let visited = points_visited_of_faces(model);
    let work = |facets: Range<usize>| {
        let looked: Vec<u64> = facets.clone().filter_map(|f| Some(samples.facet(f)?.evaluations)).collect();
        let evaluations = looked.iter().sum::<u64>() as f64 / looked.len() as f64;
        let face = mesh.facets[facets.start].face.index();
        FaceWork { facets, each: evaluations * visited[face] }
    };
    let faces: Vec<FaceWork> = ranges.into_iter().map(work).collect();
    let limit = common_limit(faces.iter().map(FaceWork::sum).collect(), most_work(faces.len()));
    let chosen = faces.iter().flat_map(|face| {
        let left: Vec<usize> = face.facets.clone().filter(|&f| samples.facet(f).is_none()).collect();
        let count = if face.sum() <= limit { left.len() } else { (limit / face.each) as usize };
        let (proved, open): (Vec<usize>, Vec<usize>) = left.into_iter().partition(|&f| quality[f].certified);
        let mut chosen = spread(open, count);
        let rest = count - chosen.len();
        chosen.extend(spread(proved, rest));
        chosen
    });
    let chosen: Vec<usize> = chosen.collect();
    samples.fill(mesh, model, chosen);
    samples
}

/// Samples facets, each list of one face, evenly spread over a list whose facets all together would take more than a model of so many
/// faces may; returns what was sampled, by list.
pub(super) fn sample_lists(mesh: &FacetMesh, model: &Model, lists: &[Vec<usize>]) -> Vec<Vec<Sampled>> {
    sample_lists_within(mesh, model, lists, most_work(lists.len()))
}

/// As [`sample_lists`], with the work, in control points, that the lists share after the first look.
fn sample_lists_within(mesh: &FacetMesh, model: &Model, lists: &[Vec<usize>], most: f64) -> Vec<Vec<Sampled>> {
    let visited = points_visited_of_faces(model);
    let mut sampled: Vec<Vec<Sampled>> =
        lists.iter().map(|list| sample_facets(mesh, model, &spread(list.clone(), FIRST_LOOK))).collect();
    let each: Vec<f64> = (lists.iter().zip(&sampled))
        .map(|(list, looked)| {
            let evaluations: u64 = looked.iter().map(|s| s.evaluations).sum();
            list.first().map_or(0.0, |&f| visited[mesh.facets[f].face.index()]) * evaluations as f64
                / looked.len().max(1) as f64
        })
        .collect();
    let sum = |(list, each): (&Vec<usize>, &f64)| list.len() as f64 * each;
    let limit = common_limit(lists.iter().zip(&each).map(sum).collect(), most);
    for ((list, each), sampled) in lists.iter().zip(&each).zip(&mut sampled) {
        // The first look has all of a short list.
        if list.len() > FIRST_LOOK {
            let all = list.len() as f64 * each <= limit;
            let count = if all { list.len() } else { (limit / each) as usize };
            sampled.extend(sample_facets(mesh, model, &spread(list.clone(), count)));
        }
    }
    sampled
}

/// Returns the most work for a model of so many faces, in control points visited.
fn most_work(faces: usize) -> f64 {
    MOST_WORK.min(WORK_OF_ANY + WORK_OF_FACE * faces as f64)
}

/// Returns what one evaluation of each placed face takes, in control points; 0 for ready meshes.
fn points_visited_of_faces(model: &Model) -> Vec<f64> {
    model.placed_faces().map(|f| f.face.map_or(0.0, |face| points_visited(&face.surface))).collect()
}

/// Returns `count` of the facets, evenly spread over them; all where there are no more.
fn spread(facets: Vec<usize>, count: usize) -> Vec<usize> {
    let n = facets.len();
    if n <= count { facets } else { (0..count).map(|k| facets[k * n / count]).collect() }
}

/// Returns the work of one evaluation of a surface, in control points visited, with [`BESIDES`].
fn points_visited(surface: &Surface) -> f64 {
    let [p, q] = surface.degree;
    BESIDES + ((p + 1) * (q + 1)) as f64
}

/// Returns the limit to which shares are cut so that they add up to `most`; infinite where they do not exceed it.
fn common_limit(mut shares: Vec<f64>, most: f64) -> f64 {
    shares.sort_by(f64::total_cmp);
    let mut left = most;
    for (k, &share) in shares.iter().enumerate() {
        // What smaller ones leave of their parts goes to the larger.
        let part = left / (shares.len() - k) as f64;
        if share > part {
            return part;
        }
        left -= share;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Vector};
    use crate::model::{Face, Part, Shell};
    use crate::nurbs::sweep;
    use crate::tessellate::{Settings, tessellate};

    /// Tubes of radius 10: two in one place each, one of twice the size.
    #[test]
    fn equal_facets_are_sampled_once() {
        let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 20.0]));
        let shells = vec![Shell { faces: vec![tube], ..Shell::default() }];
        let mut model = Model::from_part(Part { shells, ..Part::default() });
        for (x, scale) in [(100.0, 1.0), (200.0, 2.0)] {
            let placement = Frame { scale, ..Frame::translation(Vector::X * x) };
            model.instances.push(crate::model::Instance { placement, ..model.instances[0].clone() });
        }
        let made = tessellate(&model, &Settings { measure: true, ..Settings::uniform(0.05) });
        let samples = sample_within_budget(&made.mesh, &model, &made.quality, &[FaceId(0), FaceId(0), FaceId(2)]);
        let count = made.mesh.facets.len() / 3;
        assert_eq!((samples.places.len(), samples.sampled.len()), (3 * count, 2 * count));
        let sag = |k: usize| samples.facet(k * count).map(|s| s.sag).expect("a facet of each tube");
        assert!(sag(0) == sag(1) && (sag(2) - 2.0 * sag(0)).abs() < 1e-9);
        // The largest is that of the tube of twice the size, and every facet counts in the quantiles.
        assert_eq!(
            made.report.sag_mm.sampled_max,
            Some((0..3 * count).filter_map(|k| samples.facet(k)).map(|s| s.sag).fold(0.0, f64::max))
        );
        let copies = |n: u64| samples.normal_errors().iter().filter(|e| e.1 == n).count();
        assert!(copies(1) > 0 && copies(2) > 0 && copies(1) + copies(2) == samples.normal_errors().len());
    }

    /// Two lists of a tube's facets: within the budget all are sampled, beyond it the first look and what the budget leaves.
    #[test]
    fn lists_of_facets_share_a_budget() {
        let tube = Face::whole(sweep::cylinder(&Frame::IDENTITY, 10.0, [0.0, 3.0], [0.0, 20.0]));
        let shells = vec![Shell { faces: vec![tube], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let mesh = tessellate(&model, &Settings::uniform(0.001)).mesh;
        let all: Vec<usize> = (0..mesh.facets.len()).collect();
        assert!(all.len() > 2 * FIRST_LOOK, "{}", all.len());
        let lists = [all[..FIRST_LOOK / 2].to_vec(), all.clone()];
        let largest = |sampled: &[Sampled]| sampled.iter().map(|s| s.sag).fold(0.0, f64::max);
        let whole = sample_lists(&mesh, &model, &lists);
        let by_themselves = [0, 1].map(|k| largest(&sample_facets(&mesh, &model, &lists[k])));
        assert_eq!([0, 1].map(|k| largest(&whole[k])), by_themselves);
        let cut = sample_lists_within(&mesh, &model, &lists, 0.0);
        assert_eq!([cut[0].len(), cut[1].len()], [FIRST_LOOK / 2, FIRST_LOOK]);
        let nothing = sample_lists(&mesh, &model, &[Vec::new()]);
        assert!(nothing[0].is_empty());
    }

    #[test]
    fn a_limit_cuts_the_largest_shares_only() {
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 14.0), f64::INFINITY);
        // 1 + 3 + 5, and 1 + 2 + 2.
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 9.0), 5.0);
        assert_eq!(common_limit(vec![10.0, 1.0, 3.0], 5.0), 2.0);
    }

    #[test]
    fn facets_are_spread_evenly() {
        assert_eq!(spread((10..20).collect(), 5), [10, 12, 14, 16, 18]);
        assert_eq!(spread((10..12).collect(), 5), [10, 11]);
        assert!(spread((10..12).collect(), 0).is_empty());
    }
}
