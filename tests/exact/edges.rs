//! Rays through edges and vertices of closed shells: each must cross the shells an even number of times, which it does when
//! at an edge exactly one of two faces is found, or both or none where the surface folds away from the ray.

use crate::files::{corpus, fixture, part21, read_model, step_files};
use crate::support::*;
use lampyris::intersect::exact::{Exact, Passage, Settings};
use lampyris::intersect::{Certainty, Cost};
use lampyris::math::{Aabb, FaceId, Frame, Point, Ray, Uv, Vector};
use lampyris::model::{Edge, Model, Part};
use std::collections::HashSet;

/// Whether a part's shells are closed and its every edge is used exactly twice.
fn is_closed(part: &Part) -> bool {
    let mut uses = vec![0; part.edges.len()];
    let loops = part.shells.iter().flat_map(|s| &s.faces).flat_map(|f| &f.loops);
    loops.flat_map(|l| &l.uses).filter_map(|u| u.edge).for_each(|e| uses[e.0 as usize] += 1);
    part.shells.iter().all(|s| s.closed) && uses.iter().all(|&n| n == 2)
}

/// Edges of the closed parts, with the placements of their instances.
fn closed_edges(model: &Model) -> Vec<(&Edge, &Frame)> {
    let closed = model.instances.iter().map(|i| (&model.parts[i.part.0 as usize], &i.placement));
    closed.filter(|(part, _)| is_closed(part)).flat_map(|(p, f)| p.edges.iter().map(move |e| (e, f))).collect()
}

/// Faces of the closed parts: an open part that lies on a closed one would make every count odd.
fn closed_faces(model: &Model) -> HashSet<FaceId> {
    let closed: Vec<bool> = model.parts.iter().map(is_closed).collect();
    model.placed_faces().filter(|p| closed[p.part.0 as usize]).map(|p| p.id).collect()
}

#[derive(Default, Debug)]
struct Found {
    rays: u32,
    /// Rays that cross closed shells an odd number of times.
    odd: u32,
    /// Of these, the ones without any flag.
    silent: u32,
}

fn bounds(model: &Model) -> Aabb {
    model.placed_faces().filter_map(|p| p.face.map(|f| (f, p.placement))).fold(Aabb::EMPTY, |b, (f, place)| {
        b.union(Aabb::from_points(f.surface.points.iter().map(|p| place.point(p.project()))))
    })
}

/// `ends`: aims at the vertices instead of the curves' insides.
fn through_edges(name: &str, model: &Model, n: usize, ends: bool) -> Found {
    let exact = Exact::build(model, &Settings::default());
    let edges = closed_edges(model);
    let mut found = Found::default();
    if edges.is_empty() {
        return found;
    }
    let show = std::env::var("LAMPYRIS_SHOW").is_ok();
    let mut s = Random(17);
    let reach = 4.0 * bounds(model).diagonal();
    let faces = closed_faces(model);
    for k in 0..n {
        let (edge, placement) = edges[(s.unit() * edges.len() as f64) as usize];
        let [a, b] = edge.curve.domain();
        let at = if ends { a } else { s.within(a, b) };
        let target: Point = placement.point(edge.curve.evaluate(at));
        // Two thirds pass by at distances down to a micrometre's thousandth.
        let off: Vector = if k % 3 == 0 { Vector::ZERO } else { s.direction() * 10f64.powf(s.within(-12.0, -2.5)) };
        let d = s.direction();
        found.rays += 1;
        let ray = Ray::new(target + off - d * reach, d);
        let Passage { mut crossings, near_trims, .. } = exact.passage(&ray, &mut Cost::default());
        crossings.retain(|h| faces.contains(&h.face));
        if crossings.len().is_multiple_of(2) {
            continue;
        }
        found.odd += 1;
        let flagged = crossings.iter().any(|h| h.certainty != Certainty::Certified)
            || near_trims.iter().any(|t| (t - reach).abs() < 0.5);
        found.silent += u32::from(!flagged);
        if show {
            println!(
                "{name}: flagged {flagged} edge #{:?} [{a} {b}] at {at} target {target:?} off {:e} d {d:?} o {:?}",
                edge.entity,
                off.length(),
                ray.origin
            );
            for c in crossings.iter() {
                println!(
                    "   t {:.9} face {:?} uv {:?} n.d {:.4} {:?}",
                    c.t - reach,
                    c.face,
                    c.uv,
                    c.normal.dot(d),
                    c.certainty
                );
            }
        }
    }
    found
}

/// Rays at random: on a shell without border each must cross an even number of times.
fn at_random(model: &Model, n: usize) -> u32 {
    let exact = Exact::build(model, &Settings::default());
    let b = bounds(model);
    let faces = closed_faces(model);
    let mut s = Random(7);
    let mut odd = 0;
    for _ in 0..n {
        let ray = s.ray(b.center(), 0.5 * b.size());
        let crossings = exact.crossings(&ray, &mut Cost::default());
        odd += (crossings.iter().filter(|h| faces.contains(&h.face)).count() % 2) as u32;
    }
    odd
}

#[test]
fn fixtures_find_exactly_one_face_at_an_edge() {
    for path in step_files(&fixture("step")) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let model = read_model(&path).expect("fixtures are readable");
        let inside = through_edges(&name, &model, 3000, false);
        // A ray 3e-10 mm from an edge of the trimmed reflector, which meets one face under a sine of 2e-4 and 3.5e-5 mm before
        // the edge, finds that face alone: a known weakness, flagged. No other ray of the fixtures does.
        println!("{name:34} edges {inside:?}");
        let known = u32::from(name == "reflector_freeform_trimmed.stp");
        assert!(inside.silent == 0 && inside.odd <= known, "{name}: {inside:?}");
        // Where edges meet at a vertex to rounding alone, one ray in a thousand still finds two faces or none, flagged.
        let ends = through_edges(&name, &model, 3000, true);
        println!("{name:34} vertices {ends:?}");
        assert!(ends.silent == 0 && ends.odd * 1000 <= ends.rays, "{name}: {ends:?}");
    }
}

#[test]
fn a_gap_that_only_the_neighbour_knows_of_is_flagged() {
    let path = fixture("step/lens_planoconvex_analytic.stp");
    let mut model = read_model(&path).expect("fixtures are readable");
    // One face of the first part leaves its edges by a micrometre, and says so; its neighbours are exact.
    let face = &mut model.parts[0].shells[0].faces[0];
    let [[u0, u1], [v0, v1]] = face.surface.domain();
    let normal = face.surface.normal(Uv::new(0.5 * (u0 + u1), 0.5 * (v0 + v1))).expect("regular");
    face.surface = face.surface.transformed(|p| p + normal * 1e-3);
    face.gap = 1e-3;
    let torn = face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge).collect::<HashSet<_>>();
    let part = &mut model.parts[0];
    assert!(is_closed(part));
    let exact = Exact::build(&model, &Settings::default());
    let (mut s, mut odd) = (Random(23), 0);
    for edge in torn.iter().cycle().take(40_000) {
        let curve = &model.parts[0].edges[edge.0 as usize].curve;
        let [a, b] = curve.domain();
        let place = &model.instances[0].placement;
        let target: Point =
            place.point(curve.evaluate(s.within(a, b))) + s.direction() * 10f64.powf(s.within(-6.0, -3.0));
        let d = s.direction();
        let Passage { crossings, near_trims, .. } =
            exact.passage(&Ray::new(target - d * 1000.0, d), &mut Cost::default());
        if crossings.len() % 2 == 1 {
            odd += 1;
            // Anywhere along the ray: on a face that it grazes the crossing strays by the gap over the sine.
            assert!(!near_trims.is_empty(), "silent: {target} {d}");
        }
    }
    assert!(odd > 10, "{odd} rays through the gap");
}

#[test]
fn what_passes_within_the_band_of_an_edge_is_told_on_either_side() {
    let path = fixture("step/lens_planoconvex_analytic.stp");
    let mut model = read_model(&path).expect("fixtures are readable");
    // One face alone: what its trims turn away no neighbour takes.
    model.parts[0].shells[0].faces.truncate(1);
    model.parts[0].shells[0].closed = false;
    let uses: Vec<_> = model.parts[0].shells[0].faces[0].loops.iter().flat_map(|l| &l.uses).collect();
    let edges: Vec<&Edge> =
        uses.iter().filter_map(|u| u.edge).map(|e| &model.parts[0].edges[e.0 as usize]).collect();
    let exact = Exact::build(&model, &Settings::default());
    let (mut s, mut turned_away) = (Random(29), 0);
    for edge in edges.iter().cycle().take(600) {
        let [a, b] = edge.curve.domain();
        let target = model.instances[0].placement.point(edge.curve.evaluate(s.within(a, b)));
        let d = s.direction();
        let ray = Ray::new(target + s.direction() * (2e-7 * s.unit()) - d * 1000.0, d);
        let near = |t: &f64| (t - 1000.0).abs() < 1e-3;
        let Passage { crossings, near_trims, .. } = exact.passage(&ray, &mut Cost::default());
        assert!(near_trims.iter().any(near), "not told: {target} {d}, {crossings:?}");
        if !crossings.iter().any(|hit| near(&hit.t)) {
            turned_away += 1;
            assert!(exact.first(&ray, &mut Cost::default()).near_trim, "not told: {target} {d}");
        }
    }
    assert!(turned_away > 100, "{turned_away} turned away");
}

#[test]
#[ignore = "a minute: every corpus model that reads"]
fn corpus_finds_exactly_one_face_at_an_edge() {
    let folder = corpus();
    let only = std::env::var("LAMPYRIS_ONLY").unwrap_or_default();
    let all = step_files(&folder);
    if all.is_empty() {
        println!("no corpus at {}: nothing tested", folder.display());
    }
    let mut bad = Vec::new();
    for path in all.iter().filter(|p| p.to_string_lossy().contains(&only)) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let Some(model) = read_model(path) else { continue };
        let [inside, ends] = [false, true].map(|ends| through_edges(&name, &model, 3000, ends));
        if inside.rays == 0 {
            continue;
        }
        let leaky = at_random(&model, 2000);
        println!("{name:44} edges {inside:?} vertices {ends:?}; away from edges {leaky} odd");
        // Files leave gaps of up to 0.02 mm between faces, which rays that graze them see up to twenty times as wide: that is
        // flagged, always.
        if inside.odd * 50 > inside.rays || inside.silent + ends.silent > 0 {
            bad.push(name);
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}

/// A closed cylinder of radius and height 10 mm that stands on the plane z = 0.
fn cylinder() -> Model {
    let text = part21(
        "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2))REPRESENTATION_CONTEXT('',''));\n\
        #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n#3=SHAPE_REPRESENTATION('',(#4),#1);\n\
        #4=RIGHT_CIRCULAR_CYLINDER('',#5,10.,10.);\n#5=AXIS1_PLACEMENT('',#6,#7);\n#6=CARTESIAN_POINT('',(0.,0.,0.));\n\
        #7=DIRECTION('',(0.,0.,1.));\n",
    );
    let import = lampyris::step::read_bytes("cylinder.stp", text.as_bytes(), &lampyris::step::Settings::default());
    import.expect("Part 21").model
}

/// Depth below the side, mm, from which a ray through the rim is no matter of the band along it, which is half as wide.
const CLEAR_MM: f64 = 2e-6;

/// Rays across the cylinder along its upper cap, a little below: they enter and leave by the side, and nothing is left open.
#[test]
fn rays_along_a_cap_pass_it() {
    let exact = Exact::build(&cylinder(), &Settings::default());
    let mut s = Random(5);
    for k in 0..8000 {
        let (sin, cos) = s.within(0.0, std::f64::consts::TAU).sin_cos();
        let (direction, aside) = (Vector::new(cos, sin, 0.0), Vector::new(-sin, cos, 0.0));
        let offset = s.within(-9.5, 9.5);
        let place = offset * aside + (10.0 - [2e-6, 4e-6, 1e-5][k % 3]) * Vector::Z;
        let ray = Ray::new(place - 30.0 * direction, direction);
        let answer = exact.first(&ray, &mut Cost::default());
        assert_eq!(answer.certainty, Certainty::Certified, "{ray:?}");
        let truth = 30.0 - (100.0 - offset * offset).sqrt();
        assert!(answer.hit.is_some_and(|hit| (hit.t - truth).abs() < 1e-9), "{ray:?} {answer:?}");
    }
}

#[test]
fn rays_that_graze_a_border_meet_both_sheets_of_the_face_beside_it() {
    let exact = Exact::build(&cylinder(), &Settings::default());
    const RAYS: usize = 1000;
    let mut s = Random(11);
    for sine in [0.1, 1e-2, 1e-3, 1e-4] {
        for stray in [0.0, 1e-9, 5e-7] {
            let (mut all_certain, mut passing) = (0, 0);
            for _ in 0..RAYS {
                // Through a point of the upper rim, or beside it, downwards and nearly along the side.
                let (sin, cos) = s.within(0.0, std::f64::consts::TAU).sin_cos();
                let (outward, along) = (Vector::new(cos, sin, 0.0), Vector::new(-sin, cos, 0.0));
                let rim = 10.0 * outward + Vector::new(s.within(-stray, stray), s.within(-stray, stray), 10.0);
                let way =
                    s.within(0.3, 0.9) * along - s.within(0.2, 0.8) * Vector::Z + s.within(-sine, sine) * outward;
                let d = way.normalize();
                let crossings = exact.crossings(&Ray::new(rim - 30.0 * d, d), &mut Cost::default());
                let certain = crossings.iter().all(|h| h.certainty == Certainty::Certified);
                all_certain += usize::from(certain);
                // What goes into a closed solid comes out of it.
                assert!(!certain || crossings.len().is_multiple_of(2), "{rim} {d}: {crossings:?}");
                // By the quadratic of the side: from the rim on, the ray is within it for so long.
                let [radial, tangential] = [d.dot(outward), d.dot(along)];
                let chord = -20.0 * radial / (radial * radial + tangential * tangential);
                let depth = chord.max(0.0).powi(2) * (radial * radial + tangential * tangential) / 80.0;
                if depth > CLEAR_MM {
                    passing += 1;
                    assert_eq!(crossings.len(), 2, "{depth} mm within, {rim} {d}: {crossings:?}");
                }
            }
            assert!(all_certain * 10 > RAYS * 9, "{all_certain} of {RAYS} certain at {sine}, {stray}");
            assert!(sine < 1e-2 || passing * 4 > RAYS, "{passing} of {RAYS} pass through at {sine}");
        }
    }
}
