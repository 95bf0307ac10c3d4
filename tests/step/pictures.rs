//! Meshes beside exact bodies: which of them are pictures of what stands, and which are all that there is.

use crate::assemblies::read;
use crate::products::product;
use lampyris::step::Import;

/// A part whose exact body is `exact`, and a mesh #71 of one triangle with these corners, which names what it shows. The only face #29 of
/// the solid #27 has no surface.
fn with_mesh(exact: &str, corners: &str, shown: &str) -> Import {
    read(&format!(
        "{}#110=SHAPE_REPRESENTATION('',(#20),#1);\n#111=ADVANCED_BREP_SHAPE_REPRESENTATION('',({exact}#20),#1);\n\
         #112=TESSELLATED_SHAPE_REPRESENTATION('',(#71),#1);\n#120=SHAPE_REPRESENTATION_RELATIONSHIP('','',#110,#111);\n\
         #121=SHAPE_REPRESENTATION_RELATIONSHIP('','',#110,#112);\n#26=CSG_SOLID('',#25);\n\
         #70=COORDINATES_LIST('',3,({corners}));\n#71=TESSELLATED_SOLID('',(#72),{shown});\n\
         #72=TRIANGULATED_FACE('',#70,3,((0.,0.,1.)),$,(),((1,2,3)));\n\
         #27=MANIFOLD_SOLID_BREP('',#28);\n#28=CLOSED_SHELL('',(#29));\n#29=ADVANCED_FACE('',(),$,.T.);\n",
        product(100, "part", 110)
    ))
}

const HALF_A_SIDE: &str = "(0.,0.,0.),(1.,0.,0.),(0.,1.,0.)";

#[test]
fn an_unlinked_mesh_of_the_body_is_its_picture() {
    let picture = with_mesh("#24,", HALF_A_SIDE, "$");
    assert_eq!((picture.model.placed_face_count(), picture.report.by_surface.tessellated), (6, 0));
    let left_out = &picture.report.left_out;
    assert_eq!(left_out.len(), 1);
    assert!(
        left_out[0].id == 112 && left_out[0].reason.starts_with("its mesh #71 TESSELLATED_SOLID"),
        "{left_out:?}"
    );
    for (exact, corners, faces) in [
        ("", HALF_A_SIDE, 1),
        // Beside the body, and a small one in it.
        ("#24,", "(2.,0.,0.),(3.,0.,0.),(2.,1.,0.)", 7),
        ("#24,", "(0.4,0.4,0.5),(0.6,0.4,0.5),(0.4,0.6,0.5)", 7),
    ] {
        let import = with_mesh(exact, corners, "$");
        assert_eq!((import.model.placed_face_count(), import.report.left_out.len()), (faces, 0), "{corners}");
    }
}

/// The solid #26 stands nowhere: its mesh is all that there is of it.
#[test]
fn a_linked_mesh_is_left_out_where_what_it_shows_stands() {
    for (shown, faces) in [("#24", 6), ("#26", 7)] {
        let import = with_mesh("#24,", HALF_A_SIDE, shown);
        assert_eq!((import.model.placed_face_count(), import.report.left_out.len()), (faces, 0), "{shown}");
    }
}

/// The mesh of a solid without a face that can be converted is all that there is of it; what is refused is reported once.
#[test]
fn a_mesh_of_what_is_refused_stands_in_its_place() {
    for (exact, faces) in [("#27,", 1), ("#24,#27,", 7)] {
        for shown in ["#27", "#29"] {
            let import = with_mesh(exact, HALF_A_SIDE, shown);
            let report = &import.report;
            assert_eq!(
                (import.model.placed_face_count(), report.by_surface.tessellated),
                (faces, 1),
                "{exact} {shown}"
            );
            let refused: Vec<u64> = report.refusals.iter().map(|r| r.id).collect();
            assert_eq!((refused, report.faces.refused, report.left_out.len()), (vec![29], 1, 0), "{exact} {shown}");
        }
    }
}
