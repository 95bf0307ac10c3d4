//! Shapes without a product that stand in each other: each is placed where its relationships say, whatever the order of the file.

use crate::assemblies::{assert_places, read};
use crate::faces::{import, square};
use crate::products::relation;

/// A representation #`id` of a block of its own, the solid #`id` + 1.
fn block(id: u32) -> String {
    let solid = id + 1;
    format!("#{solid}=CSG_SOLID('',#25);\n#{id}=SHAPE_REPRESENTATION('',(#{solid},#20,#21,#22),#1);\n")
}

/// A representation without a shape.
fn empty(id: u32) -> String {
    format!("#{id}=SHAPE_REPRESENTATION('',(#20,#21,#22),#1);\n")
}

#[test]
fn the_order_of_ids_places_nothing_twice() {
    for [child, parent] in [[110, 120], [120, 110]] {
        let placed = relation(410, [child, parent], [20, 21]);
        let case = format!("#{child} in #{parent}");
        assert_places(&read(&(block(child) + &empty(parent) + &placed)), &[10.0], &case);
        assert_places(&read(&(block(child) + &block(parent) + &placed)), &[0.0, 10.0], &case);
        // Another shape of the child stands with it.
        let plain = "#430=SHAPE_REPRESENTATION_RELATIONSHIP('','',#100,#";
        let data = block(100) + &empty(child) + &empty(parent) + &placed + &format!("{plain}{child});\n");
        assert_places(&read(&data), &[10.0], &case);
    }
}

/// The innermost stands at x = 10 in the middle one, which stands at x = 20 in the outermost.
#[test]
fn each_of_a_chain_stands_once() {
    for [inner, middle, outer] in
        [[110, 120, 130], [110, 130, 120], [120, 110, 130], [120, 130, 110], [130, 110, 120], [130, 120, 110]]
    {
        let placed = relation(410, [inner, middle], [20, 21]) + &relation(420, [middle, outer], [20, 22]);
        let case = format!("#{inner} in #{middle} in #{outer}");
        assert_places(&read(&(block(inner) + &empty(middle) + &empty(outer) + &placed)), &[30.0], &case);
        let blocks = block(inner) + &block(middle) + &block(outer);
        assert_places(&read(&(blocks + &placed)), &[0.0, 20.0, 30.0], &case);
    }
}

/// Of two that stand in each other the first is the outermost.
#[test]
fn shapes_in_a_circle_stand_all_the_same() {
    let placed = relation(410, [110, 120], [20, 21]) + &relation(420, [120, 110], [20, 22]);
    assert_places(&read(&(block(110) + &block(120) + &placed)), &[0.0, 20.0], "a circle");
}

/// What is there for mapped items stands where these do; without any it is reported, once.
#[test]
fn a_shape_that_no_mapped_item_shows_is_told() {
    let mapped = block(110) + "#30=REPRESENTATION_MAP(#20,#110);\n#31=REPRESENTATION_MAP(#21,#110);\n";
    let shown = mapped.clone() + "#32=MAPPED_ITEM('',#30,#21);\n#120=SHAPE_REPRESENTATION('',(#32,#20),#1);\n";
    for (data, expected, told) in [(&shown, &[10.0][..], 0), (&(mapped + &block(130)), &[0.0], 1)] {
        let import = read(data);
        assert_places(&import, expected, data);
        let left_out: Vec<(u64, &str)> =
            import.report.left_out.iter().map(|note| (note.id, note.reason.as_str())).collect();
        assert_eq!(left_out.len(), told, "{left_out:?}");
        assert!(left_out.iter().all(|(id, reason)| *id == 110 && reason.contains("#30 REPRESENTATION_MAP")));
    }
}

/// A map, as captures of product data have it, whose representation lists the solid of #110 once more, with a curve; one with a solid of
/// its own besides is reported.
#[test]
fn a_map_of_what_stands_already_is_not_told() {
    let capture = |items: &str| {
        format!("#120=SHAPE_REPRESENTATION('01',(#111,#33{items}),#1);\n#30=REPRESENTATION_MAP(#20,#120);\n")
    };
    let curve = "#33=POLYLINE('',(#10,#11));\n#34=CSG_SOLID('',#25);\n";
    for (items, told) in [("", vec![]), (",#34", vec![120])] {
        let import = read(&(block(110) + &capture(items) + curve));
        assert_places(&import, &[0.0], items);
        let left_out: Vec<u64> = import.report.left_out.iter().map(|note| note.id).collect();
        assert_eq!(left_out, told, "{items}");
    }
}

/// A map whose representation lists the shell or the face of what stands, or another shell of the same face; one with a face of its own is
/// told.
#[test]
fn a_map_of_a_part_of_what_stands_is_not_told() {
    let text = square([".T."; 4], [0, 1, 2, 3]);
    let face = text.lines().find_map(|line| line.strip_prefix("#900=")).expect("the face");
    for (items, told) in [
        ("#4", vec![]),
        ("#900", vec![]),
        ("#102", vec![]),
        ("#103", vec![]),
        ("#4,#901", vec![120]),
        ("#104", vec![120]),
    ] {
        let import = import(&format!(
            "{text}#901={face}\n#102=OPEN_SHELL('',(#900));\n#103=SHELL_BASED_SURFACE_MODEL('',(#102));\n\
             #104=OPEN_SHELL('',(#900,#901));\n#120=SHAPE_REPRESENTATION('01',({items}),#1);\n\
             #121=AXIS2_PLACEMENT_3D('',#10,$,$);\n#122=REPRESENTATION_MAP(#121,#120);\n"
        ));
        let left_out: Vec<u64> = import.report.left_out.iter().map(|note| note.id).collect();
        assert_eq!((import.model.placed_face_count(), left_out), (1, told), "{items}");
    }
}
