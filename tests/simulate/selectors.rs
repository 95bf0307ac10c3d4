//! Rules of a scene find the faces that they mean: by solid, layer, kind, radius and `#id` beside names and places; and every face has a
//! selector of its own.

use crate::files::{corpus, read_model, step_files};
use crate::support::{Shape, World};
use lampyris::math::{Frame, Point, Vector};
use lampyris::mesh::FacetMesh;
use lampyris::model::{Analytic, EdgeUse, Model, PlacedFace, TessellatedFace, TrimLoop};
use lampyris::nurbs::{ControlPoint, UvCurve, conic};
use lampyris::simulate::{BoundScene, Error, RuleFaces, Scene, face_selectors};
use std::collections::HashSet;
use std::f64::consts::TAU;
use std::path::Path;

/// Two spheres of one part, each a solid of one face called NONE, as CAD systems write them; the second is larger and on a layer.
fn twins() -> Model {
    let mut world = World::default();
    for (x, radius) in [(0.0, 1.0), (10.0, 2.0)] {
        world.sphere("pair", Point::new(x, 0.0, 0.0), radius);
    }
    let mut model = world.model;
    let mut second = model.parts.pop().unwrap().shells.pop().unwrap();
    model.instances.pop();
    second.name = "big".into();
    let part = &mut model.parts[0];
    part.shells.push(second);
    for (shell, (radius, layer)) in part.shells.iter_mut().zip([(1.0, None), (2.0, Some("optics".into()))]) {
        let face = &mut shell.faces[0];
        face.name = "NONE".into();
        face.entity = Some(7);
        face.analytic = Analytic::Sphere { frame: Frame::IDENTITY, radius };
        face.layer = layer;
    }
    model
}

fn bound(model: &Model, materials: &str) -> Result<BoundScene, Error> {
    let text = format!("[[source]]\nkind = 'point'\nat = [50, 0, 0]\n{materials}");
    Scene::parse(&text, "s.toml", Path::new("."))?.bind(model)
}

fn rules(model: &Model, materials: &str) -> Result<Vec<RuleFaces>, Error> {
    bound(model, materials).map(|bound| bound.rules().to_vec())
}

/// A text that is no colour would else select by nothing, and so mean every face.
#[test]
fn what_is_no_colour_is_refused_in_rules_sources_and_receivers() {
    let model = twins();
    for table in [
        "[[material]]\non = { colour = 'red' }\nsurface = 'mirror'",
        "[[material]]\non = { colour = [200, 20, 20] }\nsurface = 'mirror'",
        "[[source]]\nkind = 'lambertian'\non = { colour = 'red' }",
        "[[receiver]]\nname = 'lit'\nkind = 'absorbed'\non = { colour = 'red' }",
    ] {
        let error = bound(&model, table).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("not a colour") && error.contains("s.toml:"), "{table}: {error}");
    }
}

/// An empty list of points would mean no face, and the rule nothing, without a word.
#[test]
fn an_empty_list_of_points_is_refused_in_rules_sources_receivers_and_models() {
    let model = twins();
    let refused = |error: Option<Error>, table: &str| {
        let error = error.map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains("an empty list of points") && error.contains("s.toml:"), "{table}: {error}");
    };
    for table in [
        "[[material]]\non = { at = [] }\nsurface = 'mirror'",
        "[[material]]\npart = 'pair'\nat = []\nsurface = 'mirror'",
        "[[source]]\nkind = 'lambertian'\non = { at = [] }",
        "[[receiver]]\nname = 'lit'\nkind = 'absorbed'\non = { at = [] }",
    ] {
        refused(bound(&model, table).err(), table);
    }
    let text = "[[model]]\nfile = 'a.stp'\nwithout = [{ at = [] }]\n";
    refused(Scene::parse(text, "s.toml", Path::new(".")).unwrap().left_out(0, &model).err(), text);
}

/// Beside one that fits, a number that nothing has would be lost without a word; a part that is placed nowhere has nothing to select.
#[test]
fn what_nothing_in_the_model_has_is_refused_beside_what_something_has() {
    let mut model = twins();
    let mut spare = model.parts[0].clone();
    spare.name = "spare".into();
    spare.shells[1].name = "spare solid".into();
    spare.shells[1].faces[0].layer = Some("spare layer".into());
    model.parts.push(spare);
    for (selector, message) in [
        ("entity = [7, 99]", "no face is #99"),
        ("solid = [0, 2]", "no part has a solid 2"),
        ("radius_mm = [1, 3]", "no face has a radius of 3 mm"),
        ("solid = ['big', 'spare solid']", "no solid is called 'spare solid'"),
        ("layer = ['optics', 'spare layer']", "no layer is called 'spare layer'"),
    ] {
        let error =
            rules(&model, &format!("[[material]]\non = {{ {selector} }}\nsurface = 'mirror'\n")).unwrap_err();
        assert!(error.to_string().contains(message), "{selector}: {error}");
    }
}

#[test]
fn two_solids_of_one_part_are_told_apart() {
    let model = twins();
    for (selector, face) in [
        ("solid = 0", 0),
        ("solid = 1", 1),
        ("solid = 'big'", 1),
        ("layer = 'opt*'", 1),
        ("radius_mm = 1", 0),
        ("kind = 'sphere', radius_mm = 2.0001", 1),
        ("part = 'pair', at = [9, 0, 0]", 1),
    ] {
        let table = rules(&model, &format!("[[material]]\non = {{ {selector} }}\nsurface = 'mirror'\n")).unwrap();
        assert_eq!(table[0].faces, [face], "{selector}");
        assert_eq!(table[1].rule, None);
        assert_eq!(table[1].faces, [1 - face], "{selector}");
        assert!(table[1].gives.contains("absorber"), "{}", table[1].gives);
    }
}

/// A part that stands twice under one name, in two assemblies: the path identifies one, the name means both.
#[test]
fn places_of_one_name_are_told_apart_by_their_paths() {
    let mut world = World::default();
    world.sphere("b1", Point::ZERO, 1.0);
    let mut model = world.model;
    let mut second = model.instances[0].clone();
    second.placement = Frame::translation(Vector::X * 10.0);
    model.instances.push(second);
    model.instances.iter_mut().zip(["A/b1", "B/b1"]).for_each(|(instance, path)| instance.path = path.into());
    for (instance, faces) in [("A/b1", &[0][..]), ("B/*", &[1]), ("b1", &[0, 1])] {
        let table = rules(&model, &format!("[[material]]\ninstance = '{instance}'\nsurface = 'mirror'\n")).unwrap();
        assert_eq!(table[0].faces, faces, "{instance}");
    }
    let error = rules(&model, "[[material]]\ninstance = 'C/b1'\nsurface = 'mirror'\n").unwrap_err();
    assert!(error.to_string().contains("/b1'"), "{error}");
    // The selector of a face, names in results, and the frame of a source say the path.
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    let selectors: Vec<String> = face_selectors(&model, &faces).iter().map(|s| s.to_string()).collect();
    assert!(selectors[1].contains("instance = \"B/b1\"") && !selectors[1].contains("at ="), "{selectors:?}");
    assert_eq!(model.labels(), ["A/b1", "B/b1"]);
    let text = |frame: &str| format!("[[source]]\nkind = 'point'\nframe = '{frame}'\nat = [5, 0, 0]\n");
    let bind = |frame: &str| Scene::parse(&text(frame), "s.toml", Path::new(".")).unwrap().bind(&model);
    assert!(bind("B/b1").is_ok());
    let error = bind("b1").unwrap_err().to_string();
    assert!(error.contains("placed 2 times") && error.contains("'A/b1'"), "{error}");
}

#[test]
fn the_last_rule_decides_and_the_table_says_so() {
    let materials = "[[material]]\nsurface = 'mirror'\n[[material]]\nsolid = [0, 1]\nsurface = 'diffuse'\n";
    let table = rules(&twins(), materials).unwrap();
    assert_eq!(table.len(), 2, "every face is named");
    assert_eq!((table[0].faces.as_slice(), table[0].gives.as_str()), (&[][..], "surface mirror"));
    assert_eq!((table[1].faces.as_slice(), table[1].selects.as_str()), (&[0, 1][..], "solid = [0,1]"));
    let notes = bound(&twins(), materials).unwrap().notes().join("; ");
    assert!(notes.contains("[[material]] 1 (all faces) decides no face"), "{notes}");
    // A surface above a medium leaves the medium.
    let both = "[[material]]\nmedium = 'N-BK7'\n[[material]]\nsurface = 'interface'\n";
    let notes = bound(&twins(), both).unwrap().notes().join("; ");
    assert!(!notes.contains("decides no face"), "{notes}");
}

/// A mirror on all faces of a glass body leaves it a mirror, for media and surfaces are given apart: easily overlooked, so it is said.
#[test]
fn a_body_without_a_clear_face_is_named() {
    let notes = |materials: &str| bound(&twins(), materials).unwrap().notes().join("; ");
    let mirrors = "[[material]]\nsurface = 'mirror'\n[[material]]\nmedium = 'N-BK7'\n";
    let note = notes(mirrors);
    assert!(note.contains("no light gets into or out of") && note.contains("opaque by [[material]] 1"), "{note}");
    // Who gives a surface last means it.
    let silvered = notes("[[material]]\nmedium = 'N-BK7'\n[[material]]\nsurface = 'mirror'\n");
    assert!(!silvered.contains("no light gets into"), "{silvered}");
    let clear = notes(&mirrors.replace("medium", "surface = 'interface'\nmedium"));
    assert!(!clear.contains("no light gets into"), "{clear}");
    let glass = notes("[[material]]\nmedium = 'N-BK7'\n");
    assert!(!glass.contains("no light gets into"), "{glass}");
}

#[test]
fn what_selects_nothing_is_refused_with_what_there_is() {
    for (selector, says) in [
        ("kind = 'spere'", "did you mean 'sphere'?"),
        ("layer = 'lens'", "there are: optics"),
        ("solid = 'bigg'", "did you mean 'big'?"),
        ("solid = 5", "no part has a solid 5"),
        ("radius_mm = 1.5", "no face has a radius of 1.5 mm"),
        ("solid = 0\nradius_mm = 2", "matches no face"),
        ("at = [nan, 0, 0]", "[NaN, 0.0, 0.0] is no point"),
        ("at = [[0, 0, 1], [0, 1e200, 0]]", "[0.0, 1e200, 0.0] is no point"),
    ] {
        let error = rules(&twins(), &format!("[[material]]\n{selector}\nsurface = 'mirror'\n")).unwrap_err();
        assert!(error.to_string().contains(says), "{error}");
    }
}

/// Where a model has no names of a kind, what to give in their place is said; and where there is no model, that.
#[test]
fn what_no_model_has_is_refused_with_what_to_give() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let empty = World::default().model;
    let file = "[[model]]\nfile = 'a.stp'\n";
    for (model, head, selector, says) in [
        (&world.model, "", "solid = 'xx'", "its solids have no names: give the number, as in `solid = 0`"),
        (&world.model, "", "layer = 'L1'", "the model has no layers"),
        (&empty, "", "part = 'cover*'", "the scene has no model: add a [[model]] with its `file`"),
        (&empty, file, "part = 'cover*'", "the model has no faces"),
        (
            &empty,
            "[[model]]\nfile = 'a.stp'\nwithout = [{ part = '*' }]\n",
            "part = 'cover*'",
            "`without` leaves out all its faces",
        ),
    ] {
        let text = format!("{head}[[material]]\n{selector}\nsurface = 'mirror'\n");
        let error = bound(model, &text).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(says), "{selector}: {error}");
    }
}

/// Ready meshes bear names as surfaces do.
#[test]
fn faces_that_are_meshes_are_named_too() {
    let mut model = twins();
    let mesh = FacetMesh::default();
    let face = TessellatedFace { name: "net".into(), entity: None, colour: None, layer: None, mesh };
    model.parts[0].tessellated.push(face);
    let table = rules(&model, "[[material]]\nface = 'net'\nsurface = 'mirror'\n").unwrap();
    assert_eq!(table[0].faces, [2]);
}

/// Receivers count what single faces absorb.
#[test]
fn absorbed_power_is_counted_by_face() {
    let mut world = World::default();
    world.cuboid("box", Point::new(-1.0, -1.0, 0.0), Point::new(1.0, 1.0, 1.0));
    let text = "[[source]]\nkind = 'collimated'\nat = [0, 0, 9]\ndirection = [0, 0, -1]\nradius = 0.5\n\
        [[receiver]]\nname = 'top'\nkind = 'absorbed'\non = { face = 'z1' }\n\
        [[receiver]]\nname = 'side'\nkind = 'absorbed'\non = { face = ['x0', 'x1'] }\n";
    let results = world.run(&format!("[run]\nrays = 2000\n{text}"), |_| ());
    assert_eq!([results.receivers[0].power, results.receivers[1].power], [1.0, 0.0]);
}

/// Every selector, put into a rule, selects its face and no other.
fn assert_each_selects_its_own(model: &Model, step: usize) -> usize {
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    let selectors = face_selectors(model, &faces);
    let distinct: HashSet<String> = selectors.iter().map(ToString::to_string).collect();
    assert_eq!(distinct.len(), faces.len(), "two faces with one selector");
    for (k, selector) in selectors.iter().enumerate().step_by(step) {
        let table = rules(model, &format!("[[material]]\n{}\nsurface = 'mirror'\n", selector.as_key()));
        let table = table.unwrap_or_else(|e| panic!("{selector}: {e}"));
        assert_eq!(table[0].faces, [k as u32], "{selector}");
    }
    faces.len()
}

#[test]
fn every_face_has_a_selector_of_its_own() {
    assert_eq!(assert_each_selects_its_own(&twins(), 1), 2);
    // Copies of one part under one name: only their place distinguishes them.
    let mut model = twins();
    for k in 1..4 {
        let mut copy = model.instances[0].clone();
        copy.placement = Frame::translation(Vector::Y * (20.0 * f64::from(k)));
        model.instances.push(copy);
    }
    assert_eq!(assert_each_selects_its_own(&model, 1), 8);
    let mut world = World::default();
    world.cuboid("a", Point::ZERO, Point::ONE).cuboid("b *", Point::ZERO, Point::ONE);
    world.part("", false, &[("", Shape::Rectangle { frame: Frame::IDENTITY, half: [1.0; 2] })]);
    let faces: Vec<PlacedFace<'_>> = world.model.placed_faces().collect();
    let selectors = face_selectors(&world.model, &faces);
    assert_eq!(selectors[0].to_string(), r#"part = "a", face = "x0""#);
}

/// Over real files: all faces, of which some hundred a file are tried in a scene.
#[test]
#[ignore = "reads the corpus of real files; minutes"]
fn every_face_of_the_corpus_has_a_selector_of_its_own() {
    let mut total = 0;
    for path in step_files(&corpus()) {
        let Some(model) = read_model(&path) else { continue };
        let count = model.placed_face_count();
        total += assert_each_selects_its_own(&model, count.div_ceil(100).max(1));
        println!("{}: {count} faces", path.display());
    }
    println!("{total} faces, each with a selector of its own");
}

/// A medium that no rule names is a slip, and lumens of light that nobody sees are none.
#[test]
fn what_the_scene_describes_in_vain_is_told() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let notes = |text: &str| bound(&world.model, text).unwrap().notes().join("\n");
    let media = "[[medium]]\nname = 'a'\nindex = 1.5\n[[medium]]\nname = 'b'\nindex = 1.6\n";
    let unused = notes(&format!("{media}[[material]]\nmedium = 'a'\n"));
    assert_eq!(unused, "[[medium]] 'b' is not used: no [[material]] has `medium = \"b\"`");
    let both = notes(&format!("{media}[[material]]\nmedium = 'a'\n[[material]]\npart = 'plate'\nmedium = 'b'\n"));
    assert!(!both.contains("[[medium]]"), "{both}");
    for (run, told) in [("", false), ("unit = 'lm'\n", false), ("unit = 'lm'\nwavelength_nm = 1000\n", true)] {
        let said = notes(&format!("[run]\n{run}[[material]]\nsurface = 'absorber'\n"));
        assert_eq!(said.contains("in lumens, but the eye sees nothing of light of 1000 nm"), told, "{run}: {said}");
    }
}

/// A receiver in the face of a plate counts what rounding leaves on either side of it: a note says so, and none where it stands off or lies
/// beside the plate.
#[test]
fn a_receiver_in_a_face_is_named() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let mut model = world.model;
    let top = &mut model.parts[0].shells[0].faces[5];
    top.analytic = Analytic::Plane { frame: Frame::translation(Vector::Z * 3.0) };
    let notes = |receiver: &str| {
        let text = format!("[[receiver]]\nname = 'r'\nsize = [2, 2]\nabsorbs = false\n{receiver}\n");
        bound(&model, &text).unwrap().notes().join("\n")
    };
    // One that absorbs takes light of a body that had not left it yet; on what is opaque it takes what would have met that.
    let absorbing = |material: &str, receiver: &str| {
        let text = format!("[[material]]\n{material}\n[[receiver]]\nname = 'r'\nsize = [2, 2]\n{receiver}\n");
        bound(&model, &text).unwrap().notes().join("\n")
    };
    let inside = absorbing("medium = 'PMMA'", "at = [1, 2, 3]");
    assert!(inside.contains("'r' lies in face 5 of 'plate': light from inside ends on it"), "{inside}");
    assert_eq!(absorbing("medium = 'PMMA'", "at = [1, 2, 3.01]"), "");
    // Against its normal comes the light from outside, or that from inside.
    assert_eq!(absorbing("medium = 'PMMA'", "at = [1, 2, 3]\none_sided = true"), "");
    assert!(
        absorbing("medium = 'PMMA'", "at = [1, 2, 3]\nnormal = [0, 0, -1]\none_sided = true").contains("lies in")
    );
    for opaque in ["surface = 'absorber'", "surface = 'mirror'\nreflectance = 0.9"] {
        assert_eq!(absorbing(opaque, "at = [1, 2, 3]"), "", "{opaque}");
    }
    assert!(notes("at = [1, 2, 3]").contains("'r' lies in face 5 of 'plate'"), "{}", notes("at = [1, 2, 3]"));
    assert!(notes("at = [1, 2, 3]\nnormal = [0, 0, -1]").contains("lies in"));
    for off in ["at = [1, 2, 3.001]", "at = [7, 2, 3]", "at = [1, 2, 3]\nnormal = [1, 0, 1]"] {
        assert_eq!(notes(off), "", "{off}");
    }
}

/// A receiver that stands in an opening of a face, or fills it, as one in the port of an integrating sphere does, has none of the face in
/// it; one that reaches over the rim has.
#[test]
fn a_receiver_in_an_opening_is_in_no_face() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let mut model = world.model;
    let top = &mut model.parts[0].shells[0].faces[5];
    top.analytic = Analytic::Plane { frame: Frame::translation(Vector::Z * 3.0) };
    // A hole of radius 2 about (1, 1).
    let rim = conic::arc(&Frame::translation(Vector::new(1.0, 1.0, 0.0)), 2.0, [0.0, TAU]);
    let points = rim.points.iter().map(|p| ControlPoint::weighted(p.position().truncate(), p.w)).collect();
    let uv = UvCurve { degree: rim.degree, knots: rim.knots, points };
    top.loops = vec![TrimLoop { uses: vec![EdgeUse { edge: None, reversed: true, uv }] }];
    let notes = |receiver: &str| {
        let text = format!("[[receiver]]\nname = 'r'\nabsorbs = false\n{receiver}\n");
        bound(&model, &text).unwrap().notes().join("\n")
    };
    for free in [
        "at = [1, 1, 3]\nkind = 'disc'\nradius = 1.9",
        "at = [1, 1, 3]\nkind = 'disc'\nradius = 2",
        "at = [2.2, 1.6, 3]\nkind = 'disc'\nradius = 0.5",
        "at = [1, 1, 3]\nsize = [2.8, 2.8]",
        "at = [6, 0, 3]\nsize = [2, 2]",
    ] {
        assert_eq!(notes(free), "", "{free}");
    }
    for flush in [
        "at = [1, 1, 3]\nkind = 'disc'\nradius = 2.1",
        "at = [3, 1, 3]\nkind = 'disc'\nradius = 0.5",
        "at = [1, 1, 3]\nsize = [2.9, 2.9]",
        "at = [-3, -3, 3]\nsize = [1, 1]",
        "at = [0, 0, 3]\nsize = [12, 12]",
    ] {
        assert!(notes(flush).contains("'r' lies in face 5 of 'plate'"), "{flush}: {}", notes(flush));
    }
}

/// Of two receivers that overlap in one plane one takes the light of both: a note says so, and none where they touch along a border, stand
/// off, look away from each other or let light pass.
#[test]
fn receivers_that_overlap_in_one_plane_are_named() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let notes = |common: &str, second: &str| {
        let text = format!(
            "[[receiver]]\nname = 'a'\nat = [0, 0, 20]\nsize = [4, 4]\n{common}\n[[receiver]]\nname = 'b'\nsize = [2, 6]\n{common}\n{second}\n"
        );
        bound(&world.model, &text).unwrap().notes().join("\n")
    };
    for overlapping in ["at = [0, 0, 20]", "at = [2.9, 4.9, 20]", "at = [0, 0, 20]\nnormal = [0, 0, -1]"] {
        assert!(notes("", overlapping).contains("'a' and 'b' lie in one plane"), "{overlapping}");
        assert_eq!(notes("absorbs = false", overlapping), "", "{overlapping}");
        // One that lets light pass counts it on its way to the other.
        assert_eq!(notes("", &format!("{overlapping}\nabsorbs = false")), "", "{overlapping}");
    }
    for apart in ["at = [3, 0, 20]", "at = [0, 0, 20.01]", "at = [0, 0, 20]\nnormal = [0, 1, 1]"] {
        assert_eq!(notes("", apart), "", "{apart}");
    }
    // To the last digits one plane, whichever way it stands.
    for (normal, second) in [("[1, 0, 0]", "at = [1e-9, 1, 20]"), ("[0, 1, 0]", "at = [1, 1e-9, 20]")] {
        assert!(notes(&format!("normal = {normal}"), second).contains("'a' and 'b' lie in one plane"), "{second}");
    }
    let back_to_back = notes("one_sided = true", "at = [0, 0, 20]\nnormal = [0, 0, -1]");
    assert_eq!(back_to_back, "");
}

/// Of 1030 receivers whose boxes all meet there are more pairs than are compared: 530 thousand.
#[test]
fn receivers_that_are_too_many_to_be_compared_are_told() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let told = |keys: fn(usize) -> String| {
        let receiver =
            |k: usize| format!("[[receiver]]\nname = 'r{k}'\ncells = [1, 1]\nat = [0, 0, 20]\n{}\n", keys(k));
        bound(&world.model, &(0..1030).map(receiver).collect::<String>()).unwrap().notes().join("\n")
    };
    let crossing = told(|k| format!("size = [2, 2]\nnormal = [1, 0, {}]", k as f64 / 500.0));
    assert!(crossing.contains("others may lie in one plane and overlap"), "{crossing}");
    assert!(!crossing.contains("at least"), "{crossing}");
    // Those that let light pass are no rivals of any.
    assert_eq!(told(|_| "size = [2, 2]\nabsorbs = false".into()), "");
    // The first five lie in one plane: ten pairs, and others may come behind what is compared.
    let late = told(|k| format!("size = [2, 2]\nnormal = [1, 0, {}]", if k > 4 { k as f64 / 500.0 } else { 0.0 }));
    assert!(late.contains("for at least 7 more pairs of receivers"), "{late}");
}

/// Of many receivers in one plane, or in one face, three notes name some and one counts the others: of `n` that all overlap there are
/// n (n − 1)/2 pairs, of which a thousand are counted.
#[test]
fn receivers_that_are_alike_are_named_three_times_and_counted() {
    let mut world = World::default();
    world.cuboid("plate", Point::new(-5.0, -5.0, 0.0), Point::new(5.0, 5.0, 3.0));
    let mut model = world.model;
    model.parts[0].shells[0].faces[5].analytic = Analytic::Plane { frame: Frame::translation(Vector::Z * 3.0) };
    let notes = |count: usize, keys: &str| {
        let receiver = |k: usize| format!("[[receiver]]\nname = 'r{k}'\ncells = [1, 1]\nsize = [2, 2]\n{keys}\n");
        bound(&model, &(0..count).map(receiver).collect::<String>()).unwrap().notes().to_vec()
    };
    for (count, rest) in [(3, None), (5, Some("for 7 more pairs")), (50, Some("for at least 997 more pairs"))] {
        let told = notes(count, "at = [0, 0, 20]");
        assert_eq!(told.iter().filter(|note| note.contains("lie in one plane")).count(), 3, "{count}");
        assert_eq!(told.len(), 3 + rest.iter().count(), "{told:?}");
        assert!(rest.is_none_or(|rest| told[3].contains(rest)), "{told:?}");
    }
    let flush = notes(5, "at = [1, 2, 3]\nabsorbs = false");
    assert_eq!(flush.iter().filter(|note| note.contains("lies in face 5 of 'plate'")).count(), 3, "{flush:?}");
    assert!(flush.len() == 4 && flush[3].contains("for 2 more receivers"), "{flush:?}");
}
