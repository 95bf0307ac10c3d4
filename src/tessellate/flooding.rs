//! Which faces of a triangulation lie inside its border, found by steps from face to face: the middle of a sliver beside a straight side is
//! rounded to either side of it.

use spade::handles::{DirectedEdgeHandle, FixedFaceHandle, PossiblyOuterTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Triangulation};
use std::collections::VecDeque;

/// A side of a face of a triangulation.
pub(super) type Side<'c, V> = DirectedEdgeHandle<'c, V, (), CdtEdge<()>, ()>;

/// Work of a walk.
pub(super) struct Steps {
    /// Faces that were decided.
    pub(super) asked: usize,
    /// Sides that were examined.
    pub(super) looked: usize,
}

/// Tells of all faces of a triangulation, by their indices, whether they lie inside; the outer one does not. The answer turns at every side
/// that `is_border` names.
pub(super) fn faces_inside<V: HasPosition>(
    cdt: &ConstrainedDelaunayTriangulation<V>,
    is_border: impl Fn(&Side<'_, V>) -> bool,
) -> (Vec<Option<bool>>, Steps) {
    let outer = cdt.outer_face().fix();
    let mut inside = vec![None; cdt.num_all_faces()];
    inside[outer.index()] = Some(false);
    let steps = flood(cdt, &mut inside, [outer], is_border);
    (inside, steps)
}

/// Tells all faces that can be reached from `known` ones, breadth first, and sets them in `inside`, by the index of the face; the answer
/// turns at every side that `is_border` names.
pub(super) fn flood<V: HasPosition>(
    cdt: &ConstrainedDelaunayTriangulation<V>,
    inside: &mut [Option<bool>],
    known: impl IntoIterator<Item = FixedFaceHandle<PossiblyOuterTag>>,
    is_border: impl Fn(&Side<'_, V>) -> bool,
) -> Steps {
    let mut steps = Steps { asked: 0, looked: 0 };
    let mut queue: VecDeque<_> = known.into_iter().collect();
    while let Some(face) = queue.pop_front() {
        let is_inside = inside[face.index()] == Some(true);
        let mut ask_beyond = |e: Side<'_, V>| {
            steps.looked += 1;
            // Hull edges run along the outer face or against it, by version; take the unknown side.
            for side in [e, e.rev()] {
                let next = side.face();
                if inside[next.index()].is_none() {
                    inside[next.index()] = Some(is_inside != is_border(&e));
                    steps.asked += 1;
                    queue.push_back(next.fix());
                }
            }
        };
        match cdt.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().into_iter().for_each(&mut ask_beyond),
            None => cdt.convex_hull().for_each(&mut ask_beyond),
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use spade::Point2;

    /// Constrains the sides of a square about the origin, whose corners stand `half` from both axes.
    fn add_square(cdt: &mut ConstrainedDelaunayTriangulation<Point2<f64>>, half: f64) {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let corners = corners.map(|[x, y]| cdt.insert(Point2::new(x, y)).unwrap());
        for k in 0..4 {
            assert!(cdt.add_constraint(corners[k], corners[(k + 1) % 4]));
        }
    }

    /// The area of the faces inside, and what the walk over all faces took.
    fn enclosed(cdt: &ConstrainedDelaunayTriangulation<Point2<f64>>) -> (f64, Steps) {
        let (inside, steps) = faces_inside(cdt, |side| side.is_constraint_edge());
        let area = cdt.inner_faces().filter(|f| inside[f.index()] == Some(true)).map(|f| f.area()).sum();
        (area, steps)
    }

    /// A square of 100 mm², a hole of 36 in it, an island of 4 in that, and a corner far outside.
    #[test]
    fn every_border_turns_the_answer() {
        let mut cdt = ConstrainedDelaunayTriangulation::new();
        add_square(&mut cdt, 5.0);
        assert_eq!(enclosed(&cdt).0, 100.0);
        add_square(&mut cdt, 3.0);
        assert_eq!(enclosed(&cdt).0, 64.0);
        add_square(&mut cdt, 1.0);
        cdt.insert(Point2::new(20.0, 0.0)).unwrap();
        let (area, steps) = enclosed(&cdt);
        assert_eq!(area, 68.0);
        // All but the outer one, each once.
        assert_eq!(steps.asked, cdt.num_inner_faces());
    }

    /// Of a walk from one known face what lies beyond others that are known stays as it is.
    #[test]
    fn known_faces_stop_the_walk() {
        let mut cdt = ConstrainedDelaunayTriangulation::new();
        add_square(&mut cdt, 5.0);
        add_square(&mut cdt, 3.0);
        let (known, _) = faces_inside(&cdt, |side| side.is_constraint_edge());
        let is_in_hole = |face: FixedFaceHandle<PossiblyOuterTag>| {
            cdt.face(face).as_inner().is_some_and(|f| f.center().x.abs().max(f.center().y.abs()) < 3.0)
        };
        let hole: Vec<_> = cdt.all_faces().map(|f| f.fix()).filter(|&f| is_in_hole(f)).collect();
        let mut inside = known.clone();
        inside[hole[1].index()] = None;
        let steps = flood(&cdt, &mut inside, [hole[0]], |side| side.is_constraint_edge());
        assert_eq!((inside, steps.asked), (known, 1));
    }
}
