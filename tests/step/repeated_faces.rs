//! Faces that a shell has once more, each as an entity of its own: one stands.

use crate::shells::{CUBE, assert_closes, cube_corners, solid};
use lampyris::step::Import;

/// Corners of a cube, and once more those of its first face.
fn corners() -> Vec<[f64; 3]> {
    let mut corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).collect();
    let again = CUBE[0].iter().map(|&k| corners[k]).collect::<Vec<_>>();
    corners.extend(again);
    corners
}

/// Returns the faces that were left out for standing where others do, and what is reported of them.
fn repeated(import: &Import) -> Vec<(u64, &str)> {
    let repairs = import.report.repairs.iter().filter(|r| r.reason.contains("it stands where"));
    repairs.map(|r| (r.id, r.reason.as_str())).collect()
}

#[test]
fn a_face_that_stands_in_its_shell_twice_is_one() {
    // With the edges of the first, from another corner on, and with edges and vertices of its own.
    for again in [[0usize, 3, 2, 1], [2, 1, 0, 3], [8, 9, 10, 11], [10, 11, 8, 9]] {
        let mut faces: Vec<&[usize]> = CUBE.to_vec();
        faces.push(&again);
        let import = solid(&corners(), &faces, &[".T."; 7], None);
        assert_eq!(repeated(&import), [(100_066, "it stands where #100006 does: it is left out")], "{again:?}");
        assert_closes(&import);
    }
    // The one that shares its vertices with the others stands, though it comes later.
    let again: [usize; 4] = [8, 9, 10, 11];
    let mut faces: Vec<&[usize]> = vec![&again[..]];
    faces.extend(CUBE);
    let import = solid(&corners(), &faces, &[".T."; 7], None);
    assert_eq!(repeated(&import), [(100_006, "it stands where #100016 does: it is left out")]);
    assert_closes(&import);
}

#[test]
fn both_sides_of_a_sheet_stand() {
    let sides: [&[usize]; 2] = [&[0, 3, 2, 1], &[0, 1, 2, 3]];
    let import = solid(&corners(), &sides, &[".T."; 2], None);
    assert_eq!((import.report.faces.converted, repeated(&import).len()), (2, 0));
}
