//! Closed shells whose files have edges or flags of sense that no solid can have: they close all the same.

use crate::files::{MILLIMETRES, part21};
use lampyris::step::{Import, Settings, read_bytes};
use lampyris::tessellate::{self, tessellate};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Length of the side of a cube, mm.
pub(crate) const SIDE: f64 = 10.0;
/// How far apart two vertices stand that the file joins by an edge of nothing, mm.
const APART: f64 = 2e-5;

/// Reads what [`solid_text`] writes.
pub(crate) fn solid(corners: &[[f64; 3]], faces: &[&[usize]], senses: &[&str], tiny: Option<[usize; 2]>) -> Import {
    read(&solid_text(corners, faces, senses, tiny))
}

pub(crate) fn read(text: &str) -> Import {
    read_bytes("solid.stp", text.as_bytes(), &Settings::default()).expect("Part 21")
}

/// A solid with plane faces, given by the corners of each, counter-clockwise from outside. `senses` are the faces' flags; `tiny` is a pair
/// of corners whose edge has a curve that leaves both at one parameter.
pub(crate) fn solid_text(
    corners: &[[f64; 3]],
    faces: &[&[usize]],
    senses: &[&str],
    tiny: Option<[usize; 2]>,
) -> String {
    let mut data = String::new();
    let triple = |p: [f64; 3]| format!("({:?},{:?},{:?})", p[0], p[1], p[2]);
    let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|i| a[i] - b[i]);
    let unit = |a: [f64; 3]| a.map(|x| x / a.iter().map(|x| x * x).sum::<f64>().sqrt());
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    };
    for (k, &p) in corners.iter().enumerate() {
        writeln!(
            data,
            "#{}=CARTESIAN_POINT('',{});#{}=VERTEX_POINT('',#{});",
            100 + k,
            triple(p),
            200 + k,
            100 + k
        )
        .unwrap();
    }
    let mut edges: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let mut next = 1000;
    let mut shell = Vec::new();
    for (f, (face, sense)) in faces.iter().zip(senses).enumerate() {
        let mut uses = Vec::new();
        for (i, &a) in face.iter().enumerate() {
            let b = face[(i + 1) % face.len()];
            let ends = [a.min(b), a.max(b)];
            let edge = *edges.entry(ends).or_insert_with(|| {
                next += 10;
                let [p, q] = ends.map(|k| corners[k]);
                let way = unit(minus(q, p));
                if tiny == Some(ends) {
                    // Across the way from one to the other: both are nearest to its start.
                    let end = [0, 1, 2].map(|i| p[i] + APART * way[(i + 1) % 3]);
                    writeln!(data, "#{next}=CARTESIAN_POINT('',{});#{}=CARTESIAN_POINT('',{});", triple(p), next + 1, triple(end)).unwrap();
                    writeln!(data, "#{}=B_SPLINE_CURVE_WITH_KNOTS('',1,(#{next},#{}),.UNSPECIFIED.,.F.,.F.,(2,2),(0.,1.),.UNSPECIFIED.);", next + 3, next + 1).unwrap();
                } else {
                    writeln!(data, "#{next}=DIRECTION('',{});#{}=VECTOR('',#{next},1.);#{}=LINE('',#{},#{});", triple(way), next + 1, next + 3, 100 + ends[0], next + 1).unwrap();
                }
                writeln!(data, "#{}=EDGE_CURVE('',#{},#{},#{},.T.);", next + 4, 200 + ends[0], 200 + ends[1], next + 3).unwrap();
                next + 4
            });
            next += 10;
            let flag = if a < b { ".T." } else { ".F." };
            writeln!(data, "#{next}=ORIENTED_EDGE('',*,*,#{edge},{flag});").unwrap();
            uses.push(format!("#{next}"));
        }
        let c = face.iter().map(|&k| corners[k]).collect::<Vec<_>>();
        let along = unit(minus(c[1], c[0]));
        let normal = unit(cross(minus(c[1], c[0]), minus(c[c.len() - 1], c[0])));
        let id = 100_000 + 10 * f;
        writeln!(
            data,
            "#{id}=DIRECTION('',{});#{}=DIRECTION('',{});#{}=AXIS2_PLACEMENT_3D('',#{},#{id},#{});#{}=PLANE('',#{});",
            triple(normal), id + 1, triple(along), id + 2, 100 + face[0], id + 1, id + 3, id + 2
        ).unwrap();
        writeln!(
            data,
            "#{}=EDGE_LOOP('',({}));#{}=FACE_OUTER_BOUND('',#{},.T.);#{}=ADVANCED_FACE('',(#{}),#{},{sense});",
            id + 4,
            uses.join(","),
            id + 5,
            id + 4,
            id + 6,
            id + 5,
            id + 3
        )
        .unwrap();
        shell.push(format!("#{}", id + 6));
    }
    part21(&format!(
        "{MILLIMETRES}#4=CLOSED_SHELL('',({}));\n#5=MANIFOLD_SOLID_BREP('',#4);\n#6=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#5),#1);\n{data}",
        shell.join(",")
    ))
}

/// Corners of a cube; the last one stands a little before the one at (0, 10, 10) on the edge from (0, 0, 10).
pub(crate) fn cube_corners() -> Vec<[f64; 3]> {
    let s = SIDE;
    vec![
        [0.0, 0.0, 0.0],
        [s, 0.0, 0.0],
        [s, s, 0.0],
        [0.0, s, 0.0],
        [0.0, 0.0, s],
        [s, 0.0, s],
        [s, s, s],
        [0.0, s, s],
        [0.0, s - APART, s],
    ]
}

pub(crate) const CUBE: [&[usize]; 6] =
    [&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

pub(crate) fn assert_closes(import: &Import) {
    assert_eq!(
        (import.report.faces.converted, import.report.faces.refused),
        (6, 0),
        "{:?}",
        import.report.refusals
    );
    let made = tessellate(&import.model, &tessellate::Settings::uniform(0.1));
    let r = &made.report;
    assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.closed), (0, 0, 1));
    let volume = r.volume_mm3.expect("closed");
    assert!((volume - SIDE.powi(3)).abs() < 0.01, "{volume}");
}

/// An edge whose curve leaves nothing between two vertices is left out; the faces beside it meet in one vertex.
#[test]
fn vertices_at_the_ends_of_an_edge_of_nothing_are_one() {
    let faces: [&[usize]; 6] = [CUBE[0], &[4, 5, 6, 7, 8], CUBE[2], CUBE[3], CUBE[4], &[3, 0, 4, 8, 7]];
    assert_closes(&solid(&cube_corners(), &faces, &[".T."; 6], Some([7, 8])));
}

/// Edges of a closed shell run once in each direction: a face whose flag of sense says that it looks inwards is turned.
#[test]
fn a_face_whose_flag_contradicts_its_edges_looks_outwards() {
    let mut senses = [".T."; 6];
    senses[3] = ".F.";
    let import = solid(&cube_corners(), &CUBE, &senses, None);
    assert_closes(&import);
    let said = import.report.repairs.iter().filter(|r| r.reason.contains("its sense contradicts")).count();
    assert_eq!(said, 1, "{:?}", import.report.repairs);
}

/// Two sides of a cube meet in a face without width, whose short edges have no length: it is left out, and the sides meet in one edge.
#[test]
fn sides_of_a_face_without_width_meet() {
    let width = 1e-10;
    let mut corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).collect();
    corners.extend([[0.0, width, SIDE], [SIDE, width, SIDE]]);
    let faces: [&[usize]; 7] =
        [CUBE[0], &[8, 9, 6, 7], CUBE[2], &[1, 2, 6, 9, 5], CUBE[4], &[3, 0, 4, 8, 7], &[4, 5, 9, 8]];
    let import = solid(&corners, &faces, &[".T."; 7], None);
    assert_closes(&import);
    let said: Vec<u64> =
        import.report.repairs.iter().filter(|r| r.reason.contains("it has no width")).map(|r| r.id).collect();
    assert_eq!(said, [100_066]);
}

/// The lead of an IC: a plate and a wall without thickness on one end of it. The border of the plate's sides runs up the wall by one edge
/// and down by a shorter one, with nothing between.
#[test]
fn a_wall_without_thickness_stands_on_one_edge() {
    let s = SIDE;
    let plate = [[0.0, 0.0], [s, 0.0], [s, s], [0.0, s]].map(|[x, y]| [x, y, 0.0]);
    let corners: Vec<[f64; 3]> =
        plate.into_iter().chain(plate.map(|[x, y, _]| [x, y, 1.0])).chain([[s, 0.0, 5.0], [s, s, 5.0]]).collect();
    let faces: [&[usize]; 7] =
        [CUBE[0], CUBE[1], CUBE[5], &[1, 2, 9, 8], &[5, 8, 9, 6], &[0, 1, 8, 5, 4], &[2, 3, 7, 6, 9]];
    let import = solid(&corners, &faces, &[".T."; 7], None);
    assert_eq!(import.report.faces.converted, 7);
    let r = tessellate(&import.model, &tessellate::Settings::uniform(0.1)).report;
    assert_eq!((r.open_edges, r.nonmanifold_edges, r.shells.closed), (0, 0, 1));
    let volume = r.volume_mm3.expect("closed");
    assert!((volume - s * s).abs() < 1e-9, "{volume}");
    let said: Vec<u64> = import
        .report
        .repairs
        .iter()
        .filter(|r| r.reason.contains("comes back along itself"))
        .map(|r| r.id)
        .collect();
    assert_eq!(said, [100_056, 100_066]);
}

/// A side of a cube has one edge where another has two, and a face without width lies between the one and the two.
#[test]
fn a_face_without_width_between_one_edge_and_two_is_left_out() {
    let mut corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).collect();
    corners.push([0.3 * SIDE, 0.0, SIDE]);
    let faces: [&[usize]; 7] = [CUBE[0], CUBE[1], &[0, 1, 5, 8, 4], CUBE[3], CUBE[4], CUBE[5], &[4, 8, 5]];
    // Its corners in a line give no normal.
    let text = solid_text(&corners, &faces, &[".T."; 7], None).replace("(NaN,NaN,NaN)", "(0.0,1.0,0.0)");
    let import = read(&text);
    assert_closes(&import);
    let said: Vec<u64> =
        import.report.repairs.iter().filter(|r| r.reason.contains("it has no width")).map(|r| r.id).collect();
    assert_eq!(said, [100_066]);
}

/// A cubic void inside of a cube, once as the schema asks for it and once with faces that look into it already below a shell that turns
/// them.
#[test]
fn a_void_that_is_turned_once_too_often_encloses_a_hole() {
    let side = 4.0;
    let inner = cube_corners().into_iter().take(8).map(|p| p.map(|x| 3.0 + x * side / SIDE));
    let corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).chain(inner).collect();
    for turned_once_more in [false, true] {
        let voids = CUBE.map(|face| {
            let mut face: Vec<usize> = face.iter().map(|k| k + 8).collect();
            if turned_once_more {
                face.reverse();
            }
            face
        });
        let faces: Vec<&[usize]> = CUBE.into_iter().chain(voids.iter().map(|f| f.as_slice())).collect();
        let ids = |range: std::ops::Range<usize>| {
            range.map(|f| format!("#{}", 100_006 + 10 * f)).collect::<Vec<_>>().join(",")
        };
        let shells = format!(
            "#5=BREP_WITH_VOIDS('',#7,(#8));#7=CLOSED_SHELL('',({}));#8=ORIENTED_CLOSED_SHELL('',*,#9,.F.);#9=CLOSED_SHELL('',({}));",
            ids(0..6),
            ids(6..12)
        );
        let text = solid_text(&corners, &faces, &[".T."; 12], None);
        let import = read(&text.replace("#5=MANIFOLD_SOLID_BREP('',#4);", &shells));
        let report = tessellate(&import.model, &tessellate::Settings::uniform(0.1)).report;
        let volume = report.volume_mm3.expect("closed");
        assert!((volume - (SIDE.powi(3) - side.powi(3))).abs() < 1e-6, "{turned_once_more}: {volume}");
        let said = import.report.repairs.iter().filter(|r| r.reason.contains("void was inside out")).count();
        assert_eq!(said, usize::from(turned_once_more));
    }
}

/// Two cubes side by side, of which the file says that one is a void in the other.
#[test]
fn a_void_outside_of_its_solid_is_a_solid_of_its_own() {
    let beside = cube_corners().into_iter().take(8).map(|[x, y, z]| [x + 2.0 * SIDE, y, z]);
    let corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).chain(beside).collect();
    let second = CUBE.map(|face| face.iter().map(|k| k + 8).collect::<Vec<_>>());
    let faces: Vec<&[usize]> = CUBE.into_iter().chain(second.iter().map(|f| f.as_slice())).collect();
    let ids = |range: std::ops::Range<usize>| {
        range.map(|f| format!("#{}", 100_006 + 10 * f)).collect::<Vec<_>>().join(",")
    };
    let text = solid_text(&corners, &faces, &[".T."; 12], None);
    let (outer, void) = (ids(0..6), ids(6..12));
    for turn in [".T.", ".F."] {
        let shells = format!(
            "#5=BREP_WITH_VOIDS('',#7,(#8));#7=CLOSED_SHELL('',({outer}));\
             #8=ORIENTED_CLOSED_SHELL('',*,#9,{turn});#9=CLOSED_SHELL('',({void}));"
        );
        let import = read(&text.replace("#5=MANIFOLD_SOLID_BREP('',#4);", &shells));
        let made = tessellate(&import.model, &tessellate::Settings::uniform(0.1)).report;
        let volume = made.volume_mm3.expect("closed");
        assert!((volume - 2.0 * SIDE.powi(3)).abs() < 1e-6, "{turn}: {volume}");
        let said = import.report.repairs.iter().filter(|r| r.reason.contains("a solid of its own")).count();
        assert_eq!((made.shells.closed, said), (2, 1), "{turn}: {:?}", import.report.repairs);
        // For an outer shell that lacks the face on that side this is undecided.
        let open = text
            .replace("#5=MANIFOLD_SOLID_BREP('',#4);", &shells)
            .replace("#100036=ADVANCED_FACE(", "#100036=FACE_SURFACE_OF_NO_KIND(");
        let said = read(&open).report.repairs;
        assert!(said.iter().all(|r| !r.reason.contains("a solid of its own")), "{turn}: {said:?}");
    }
}

/// A solid and a surface of the same shell, as representations of one product: the surface is the solid once more, whichever comes first.
#[test]
fn a_surface_of_the_shell_of_a_solid_is_that_solid() {
    let text = solid_text(&cube_corners(), &CUBE, &[".T."; 6], None);
    let solid = "#6=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#5),#1);";
    assert!(text.contains(solid));
    let surface = "SHELL_BASED_SURFACE_MODEL('',(#4))";
    for (first, second) in [(6, 8), (8, 6)] {
        let both = format!(
            "#{first}=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#5),#1);#7={surface};\
             #{second}=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#7),#1);#9=SHAPE_REPRESENTATION('',(),#1);\
             #900001=SHAPE_REPRESENTATION_RELATIONSHIP('','',#9,#6);#900002=SHAPE_REPRESENTATION_RELATIONSHIP('','',#9,#8);"
        );
        assert_closes(&read(&text.replace(solid, &both)));
    }
    let alone = format!("#6=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#7),#1);#7={surface};");
    assert_eq!(
        read(&text.replace(solid, &alone).replace("#5=MANIFOLD_SOLID_BREP('',#4);", "")).report.faces.converted,
        6
    );
}

/// The void of a solid that the list does not name is reported; so is a face, and without it the volume does not decide the side.
#[test]
fn entries_of_shells_and_solids_that_are_no_references_are_told() {
    let text = solid_text(&cube_corners(), &CUBE, &[".T."; 6], None);
    let solid = "#5=MANIFOLD_SOLID_BREP('',#4);";
    let voids = read(&text.replace(solid, "#5=BREP_WITH_VOIDS('',#4,($));"));
    let inwards = CUBE.map(|face| face.iter().rev().copied().collect::<Vec<_>>());
    let inwards: Vec<&[usize]> = inwards.iter().map(|face| face.as_slice()).collect();
    let text = solid_text(&cube_corners(), &inwards, &[".T."; 6], None);
    assert_eq!(read(&text).report.repairs.len(), 1, "a whole cube is turned");
    let open = read(&text.replace("#100056)", "$)"));
    for (import, faces, entity) in [(voids, 6, "BREP_WITH_VOIDS"), (open, 5, "CLOSED_SHELL")] {
        let said: Vec<&str> = import.report.refusals.iter().map(|r| r.entity.as_str()).collect();
        assert_eq!((import.report.faces.converted, said), (faces, vec![entity]), "{:?}", import.report.refusals);
        assert!(import.report.refusals[0].reason.contains("no reference"), "{:?}", import.report.refusals);
        assert_eq!(import.report.repairs.len(), 0, "{:?}", import.report.repairs);
    }
}

/// A file with short names in place of the long ones is the same solid.
#[test]
fn short_names_are_read_as_the_long_ones() {
    let mut text = solid_text(&cube_corners(), &CUBE, &[".T."; 6], None);
    for (long, short) in [
        ("CARTESIAN_POINT", "CRTPNT"),
        ("VERTEX_POINT", "VRTPNT"),
        ("DIRECTION", "DRCTN"),
        ("EDGE_CURVE", "EDGCRV"),
        ("ORIENTED_EDGE", "ORNEDG"),
        ("AXIS2_PLACEMENT_3D", "A2PL3D"),
        ("EDGE_LOOP", "EDGLP"),
        ("FACE_OUTER_BOUND", "FCOTBN"),
        ("ADVANCED_FACE", "ADVFC"),
        ("CLOSED_SHELL", "CLSSHL"),
        ("MANIFOLD_SOLID_BREP", "MNSLBR"),
        ("ADVANCED_BREP_SHAPE_REPRESENTATION", "ABSR"),
        ("GLOBAL_UNIT_ASSIGNED_CONTEXT", "GUAC"),
        ("LENGTH_UNIT", "LNGUNT"),
        ("PLANE_ANGLE_UNIT", "PLANUN"),
        ("SI_UNIT", "SUNT"),
    ] {
        assert!(text.contains(long));
        text = text.replace(long, short);
    }
    assert_closes(&read(&text));
}

/// A can whose rims, full circles, miss their only vertices: the seam of its side ends at these vertices as the rims do.
#[test]
fn a_seam_ends_at_the_vertex_that_its_edge_misses() {
    let (radius, height, missed) = (2.0, 3.0, 3e-4);
    let point = |id: u32, [x, y, z]: [f64; 3]| format!("#{id}=CARTESIAN_POINT('',({x:?},{y:?},{z:?}));");
    let points: String = [
        (10, [0., 0., 0.]),
        (11, [0., 0., height]),
        (12, [radius + missed, 0., 0.]),
        (13, [radius + missed, 0., height]),
    ]
    .map(|(id, at)| point(id, at))
    .concat();
    let rest = "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n\
          #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=CYLINDRICAL_SURFACE('',#30,2.);\n#32=CIRCLE('',#30,2.);\n\
          #33=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#34=CIRCLE('',#33,2.);\n#35=PLANE('',#30);\n#36=PLANE('',#33);\n\
          #40=VERTEX_POINT('',#12);\n#41=VERTEX_POINT('',#13);\n\
          #50=EDGE_CURVE('',#40,#40,#32,.T.);\n#51=EDGE_CURVE('',#41,#41,#34,.T.);\n\
          #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n\
          #62=ORIENTED_EDGE('',*,*,#50,.F.);\n#63=ORIENTED_EDGE('',*,*,#51,.T.);\n\
          #70=EDGE_LOOP('',(#60));\n#71=EDGE_LOOP('',(#61));\n#72=EDGE_LOOP('',(#62));\n#73=EDGE_LOOP('',(#63));\n\
          #80=FACE_OUTER_BOUND('',#70,.T.);\n#81=FACE_BOUND('',#71,.T.);\n#82=FACE_OUTER_BOUND('',#72,.T.);\n#83=FACE_OUTER_BOUND('',#73,.T.);\n\
          #900=ADVANCED_FACE('',(#80,#81),#31,.T.);\n#901=ADVANCED_FACE('',(#82),#35,.F.);\n#902=ADVANCED_FACE('',(#83),#36,.T.);\n\
          #910=CLOSED_SHELL('',(#900,#901,#902));\n#911=MANIFOLD_SOLID_BREP('',#910);\n#912=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#911),$);";
    let model = read(&part21(&format!("{points}{rest}"))).model;
    let report = tessellate(&model, &tessellate::Settings::uniform(1e-3)).report;
    assert_eq!((report.open_edges, report.shells.closed), (0, 1));
}

/// Two cubes in one shell that touch along an edge, which four faces have: a closed solid all the same.
#[test]
fn a_solid_that_touches_itself_along_an_edge_is_closed() {
    let cube: Vec<[f64; 3]> = cube_corners().into_iter().take(8).collect();
    // The second stands on the edge from (10, 10, 0) to (10, 10, 10): its corners 0 and 4 are the first one's 2 and 6.
    let corners: Vec<[f64; 3]> =
        cube.iter().copied().chain(cube.iter().map(|&[x, y, z]| [x + SIDE, y + SIDE, z])).collect();
    let same = |k: usize| {
        if k == 0 {
            2
        } else if k == 4 {
            6
        } else {
            k + 8
        }
    };
    let second = CUBE.map(|face| face.iter().map(|&k| same(k)).collect::<Vec<_>>());
    let faces: Vec<&[usize]> = CUBE.into_iter().chain(second.iter().map(|f| f.as_slice())).collect();
    let import = solid(&corners, &faces, &[".T."; 12], None);
    let report = tessellate(&import.model, &tessellate::Settings::uniform(0.1)).report;
    assert_eq!((report.open_edges, report.nonmanifold_edges, report.touching_edges), (0, 0, 1));
    assert_eq!((report.shells.closed, report.shells.open), (1, 0));
    let volume = report.volume_mm3.expect("closed");
    assert!((volume - 2.0 * SIDE.powi(3)).abs() < 1e-9, "{volume}");
}

/// A cube whose edge from corner 4 to 5 is two, with a face between them on `surface`, of which the second, #93, has the curve #94 of
/// `curve`; the second face, above, has the first one, and the third, beside, has #93.
fn cube_with_a_doubled_edge(curve: &str, surface: &str) -> String {
    let corners: Vec<[f64; 3]> = cube_corners().into_iter().take(8).collect();
    let faces: [&[usize]; 7] = [CUBE[0], CUBE[1], CUBE[2], CUBE[3], CUBE[4], CUBE[5], &[4, 5]];
    // Its corners in a line give no normal.
    let text = solid_text(&corners, &faces, &[".T."; 7], None)
        .replace("(NaN,NaN,NaN)", "(0.0,1.0,0.0)")
        .replace("#100063=PLANE('',#100062);", surface);
    // The edge from corner 4 to 5 is the first of the second face; the third face and this one get another in its place.
    let first = text.find("=EDGE_CURVE('',#204,#205,").expect("an edge");
    let start = text[..first].rfind('#').expect("its id");
    let edge = text[start..first].to_string();
    let mut parts: Vec<String> = text.split(&format!("*,{edge},")).map(String::from).collect();
    assert_eq!(parts.len(), 5);
    let last = parts.split_off(2);
    let text = [parts.join(&format!("*,{edge},")), last[..2].join("*,#93,"), last[2].clone()];
    let text = [text[0].clone(), format!("*,#93,{}", text[1]), format!("*,{edge},{}", text[2])].concat();
    text.replacen("DATA;\n", &format!("DATA;\n#93=EDGE_CURVE('',#204,#205,#94,.T.);{curve}\n"), 1)
}

/// Returns the faces that were left out for having no width.
fn faces_without_width(import: &Import) -> Vec<u64> {
    import.report.repairs.iter().filter(|r| r.reason.contains("it has no width")).map(|r| r.id).collect()
}

/// A face between two straight edges with the same vertices, of which one is a line that misses them by more than a writer rounds.
#[test]
fn a_face_between_two_straight_edges_is_left_out() {
    let missed = 1.5e-3;
    let line = format!(
        "#90=CARTESIAN_POINT('',(0.,{:?},{SIDE:?}));#91=DIRECTION('',(1.,0.,0.));#92=VECTOR('',#91,1.);#94=LINE('',#90,#92);",
        -missed
    );
    let import = read(&cube_with_a_doubled_edge(&line, "#100063=PLANE('',#100062);"));
    assert_closes(&import);
    assert_eq!(faces_without_width(&import), [100_066]);
}

/// A face between a line and a parabola that leaves it by 4 µm, or by 15, where each may be 10 µm from the truth; on a plane, on a spline
/// with a border, and on one that runs together in a point.
#[test]
fn a_face_thinner_than_the_accuracy_of_its_file_is_left_out() {
    let curve = |width: f64| {
        format!(
            "#90=CARTESIAN_POINT('',({:?},0.,{:?}));#94=B_SPLINE_CURVE_WITH_KNOTS('',2,(#104,#90,#105),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);",
            0.5 * SIDE,
            SIDE + 2.0 * width
        )
    };
    let spline = "#100063=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#81,#82),(#83,#84)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\
                  #81=CARTESIAN_POINT('',(-1.,0.,9.));#82=CARTESIAN_POINT('',(-1.,0.,11.));\
                  #83=CARTESIAN_POINT('',(11.,0.,9.));#84=CARTESIAN_POINT('',(11.,0.,11.));";
    // One side of its net is a point, which does not close it.
    let corner = spline.replace("(11.,0.,9.)", "(11.,0.,10.)").replace("(11.,0.,11.)", "(11.,0.,10.)");
    let coarse = "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#80))GLOBAL_UNIT_ASSIGNED_CONTEXT";
    let accuracy = "DATA;\n#80=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.01),#2,'','');";
    for surface in ["#100063=PLANE('',#100062);", spline, &corner] {
        for (width, has_none) in [(4e-3, true), (15e-3, true), (25e-3, false)] {
            let text = cube_with_a_doubled_edge(&curve(width), surface);
            let stated = text.replacen("GLOBAL_UNIT_ASSIGNED_CONTEXT", coarse, 1).replacen("DATA;\n", accuracy, 1);
            let import = read(&stated);
            if has_none {
                assert_closes(&import);
            }
            assert_eq!(faces_without_width(&import), if has_none { vec![100_066] } else { Vec::new() }, "{width}");
            // Of a file that states nothing it is a face.
            assert!(faces_without_width(&read(&text)).is_empty());
        }
    }
}
