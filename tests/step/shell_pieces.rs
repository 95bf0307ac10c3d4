//! Closed shells that are several by their edges, and such as are none.

use crate::shells::{CUBE, SIDE, cube_corners, read, solid_text};
use lampyris::step::Import;
use lampyris::tessellate::{self, tessellate};

/// A body with plane faces: its corners, and those of each face counter-clockwise from outside.
struct Body {
    corners: Vec<[f64; 3]>,
    faces: Vec<Vec<usize>>,
}

impl Body {
    /// A block with these lower and upper corners.
    fn block(low: [f64; 3], high: [f64; 3]) -> Self {
        let corners = cube_corners().into_iter().take(8);
        let corner = |p: [f64; 3]| [0, 1, 2].map(|k| low[k] + (high[k] - low[k]) * p[k] / SIDE);
        Self { corners: corners.map(corner).collect(), faces: CUBE.iter().map(|face| face.to_vec()).collect() }
    }

    /// What stands on a counter-clockwise outline between z = 0 and a height.
    fn prism(outline: &[[f64; 2]], height: f64) -> Self {
        let n = outline.len();
        let at = |z: f64| outline.iter().map(|&[x, y]| [x, y, z]).collect::<Vec<_>>();
        let side = |k: usize| vec![k, (k + 1) % n, (k + 1) % n + n, k + n];
        // From its first corner on, whose angle is convex.
        let bottom: Vec<usize> = std::iter::once(0).chain((1..n).rev()).collect();
        let faces = [bottom, (n..2 * n).collect()].into_iter().chain((0..n).map(side)).collect();
        Self { corners: [at(0.0), at(height)].concat(), faces }
    }

    /// The same with all faces looking inwards.
    fn turned(mut self) -> Self {
        self.faces.iter_mut().for_each(|face| face[1..].reverse());
        self
    }

    /// The same with corners, and so edges, of its own for each face.
    fn loose(self) -> Self {
        let corners: Vec<[f64; 3]> = self.faces.iter().flatten().map(|&k| self.corners[k]).collect();
        let mut first = 0;
        let own = |face: &Vec<usize>| {
            first += face.len();
            (first - face.len()..first).collect::<Vec<_>>()
        };
        Self { corners, faces: self.faces.iter().map(own).collect() }
    }
}

/// Writes all faces of bodies as the one shell of a solid.
fn text_of(bodies: &[Body]) -> String {
    let mut all = Body { corners: Vec::new(), faces: Vec::new() };
    for body in bodies {
        let first = all.corners.len();
        all.faces.extend(body.faces.iter().map(|face| face.iter().map(|k| k + first).collect::<Vec<_>>()));
        all.corners.extend(&body.corners);
    }
    let faces: Vec<&[usize]> = all.faces.iter().map(Vec::as_slice).collect();
    solid_text(&all.corners, &faces, &vec![".T."; faces.len()], None)
}

/// The same as a sheet that calls itself closed.
fn sheet_text_of(bodies: &[Body]) -> String {
    text_of(bodies).replace("#5=MANIFOLD_SOLID_BREP('',#4);", "#5=SHELL_BASED_SURFACE_MODEL('',(#4));")
}

/// Numbers of shells of each solid of the first part.
fn shells_of_solids(import: &Import) -> Vec<usize> {
    import.model.parts[0].solids().into_iter().map(|shells| shells.len()).collect()
}

fn repairs_with(import: &Import, text: &str) -> usize {
    import.report.repairs.iter().filter(|r| r.reason.contains(text)).count()
}

fn volume(import: &Import) -> f64 {
    tessellate(&import.model, &tessellate::Settings::uniform(0.1)).report.volume_mm3.expect("closed")
}

/// A plate and two bars below it that touch it in a plane, in one shell.
#[test]
fn bodies_without_a_common_edge_are_solids_of_their_own() {
    let bar = |x: f64| Body::block([x, 0.0, -3.0], [x + 2.0, 8.0, 0.0]);
    let bodies = [Body::block([0.0; 3], [10.0, 10.0, 5.0]), bar(1.0), bar(7.0)];
    for text in [text_of(&bodies), sheet_text_of(&bodies)] {
        let import = read(&text);
        assert_eq!(shells_of_solids(&import), [1, 1, 1]);
        assert_eq!(repairs_with(&import, "3 closed pieces without a common edge: taken as 3 solids"), 1);
        assert_eq!(import.report.repairs.len(), 1, "{:?}", import.report.repairs);
        let found = volume(&import);
        assert!((found - 596.0).abs() < 1e-6, "{found}");
    }
}

/// A body between the legs of another one lies in its box, but looks as it does.
#[test]
fn a_body_between_the_legs_of_another_is_a_solid() {
    let u = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [7.0, 10.0], [7.0, 3.0], [3.0, 3.0], [3.0, 10.0], [0.0, 10.0]];
    let import = read(&text_of(&[Body::block([4.0, 4.0, 2.0], [6.0, 6.0, 8.0]), Body::prism(&u, 10.0)]));
    assert_eq!(shells_of_solids(&import), [1, 1]);
    // 100 − 4·7 times 10, and 2·2·6.
    let found = volume(&import);
    assert!((found - 744.0).abs() < 1e-6, "{found}");
}

/// A hollow block and a block beside it in one shell; and the same turned inside out, which the solids' volumes show.
#[test]
fn a_turned_piece_within_another_is_its_void() {
    let hollow = || Body::block([3.0; 3], [7.0; 3]).turned();
    let outer = || Body::block([0.0; 3], [10.0; 3]);
    let beside = || Body::block([20.0, 0.0, 0.0], [30.0, 10.0, 10.0]);
    let bodies = [hollow(), beside(), outer()];
    let turned = [hollow().turned(), beside().turned(), outer().turned()];
    for (bodies, inside_out) in [(bodies, 0), (turned, 3)] {
        let import = read(&text_of(&bodies));
        assert_eq!(shells_of_solids(&import), [1, 2]);
        assert_eq!(
            repairs_with(&import, "3 closed pieces without a common edge: taken as 2 solids with 1 void"),
            1
        );
        assert_eq!(repairs_with(&import, "was inside out"), inside_out);
        let found = volume(&import);
        assert!((found - 1936.0).abs() < 1e-6, "{found}");
    }
}

/// Faces with edges of their own, and a body that lacks a face, do not show where one body ends.
#[test]
fn a_shell_whose_edges_do_not_close_it_stays_one() {
    let blocks = || [Body::block([0.0; 3], [10.0; 3]), Body::block([20.0, 0.0, 0.0], [30.0, 10.0, 10.0])];
    let mut open = blocks();
    open[1].faces.pop();
    for bodies in [blocks().map(Body::loose), open] {
        let import = read(&text_of(&bodies));
        let part = &import.model.parts[0];
        assert_eq!((part.shells.len(), part.shells[0].closed), (1, true));
        assert_eq!(import.report.repairs.len(), 0, "{:?}", import.report.repairs);
    }
}

/// Sheets that call themselves closed: one face, a box without lid, and boxes whose faces meet, by their edges or only in place.
#[test]
fn a_sheet_with_a_border_is_open_whatever_it_calls_itself() {
    let block = || Body::block([0.0; 3], [200.0, 10.0, 1.0]);
    let first = |count: usize| {
        let mut body = block();
        body.faces.truncate(count);
        body
    };
    for (body, closed) in [(first(1), false), (first(5), false), (block(), true), (block().loose(), true)] {
        let import = read(&sheet_text_of(&[body]));
        let part = &import.model.parts[0];
        assert_eq!((part.shells.len(), part.shells[0].closed), (1, closed));
        assert_eq!(repairs_with(&import, "taken as open"), usize::from(!closed));
    }
    // A round one of 12 sides whose faces have edges of their own, without any one of them.
    let at = |k: usize| [0, 1].map(|i| 100.0 * (std::f64::consts::PI / 6.0 * (k as f64 - 3.0 * i as f64)).cos());
    let outline: Vec<[f64; 2]> = (0..12).map(at).collect();
    for lacking in [None, Some(0), Some(2), Some(7), Some(13)] {
        let mut body = Body::prism(&outline, 10.0);
        if let Some(k) = lacking {
            body.faces.remove(k);
        }
        let import = read(&sheet_text_of(&[body.loose()]));
        assert_eq!(import.model.parts[0].shells[0].closed, lacking.is_none(), "{lacking:?}");
    }
    // A solid without its last face has a gap, and an inside all the same.
    assert!(read(&text_of(&[first(5)])).model.parts[0].shells[0].closed);
}
