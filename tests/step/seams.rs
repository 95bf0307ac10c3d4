//! Holes where a seam or a coarse outline would have them, against closed forms.

use crate::faces::{area, close, import, points, read};
use lampyris::tessellate::{Settings, tessellate};
use std::f64::consts::{PI, SQRT_2};

/// A tube of radius 10 and height 20 whose rims have their vertices at angle 0, with a window of `half` rad to both sides of a place.
fn tube_with_window(middle: f64, half: f64) -> String {
    let corner = |angle: f64, z: f64| [10.0 * angle.cos(), 10.0 * angle.sin(), z];
    let (a, b) = (middle - half, middle + half);
    points(&[
        (10, [0., 0., 0.]),
        (11, [0., 0., 20.]),
        (12, [10., 0., 0.]),
        (13, [10., 0., 20.]),
        (14, [0., 0., 7.]),
        (15, [0., 0., 13.]),
        (16, corner(a, 7.)),
        (17, corner(b, 7.)),
        (18, corner(b, 13.)),
        (19, corner(a, 13.)),
    ]) + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n\
          #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=CYLINDRICAL_SURFACE('',#30,10.);\n#32=CIRCLE('',#30,10.);\n\
          #33=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#34=CIRCLE('',#33,10.);\n\
          #35=AXIS2_PLACEMENT_3D('',#14,#20,#21);\n#36=CIRCLE('',#35,10.);\n\
          #37=AXIS2_PLACEMENT_3D('',#15,#20,#21);\n#38=CIRCLE('',#37,10.);\n\
          #40=VERTEX_POINT('',#12);\n#41=VERTEX_POINT('',#13);\n\
          #42=VERTEX_POINT('',#16);\n#43=VERTEX_POINT('',#17);\n#44=VERTEX_POINT('',#18);\n#45=VERTEX_POINT('',#19);\n\
          #50=EDGE_CURVE('',#40,#40,#32,.T.);\n#51=EDGE_CURVE('',#41,#41,#34,.T.);\n\
          #52=EDGE_CURVE('',#42,#43,#36,.T.);\n#53=EDGE_CURVE('',#43,#44,$,.T.);\n\
          #54=EDGE_CURVE('',#45,#44,#38,.T.);\n#55=EDGE_CURVE('',#42,#45,$,.T.);\n\
          #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n\
          #62=ORIENTED_EDGE('',*,*,#55,.T.);\n#63=ORIENTED_EDGE('',*,*,#54,.T.);\n\
          #64=ORIENTED_EDGE('',*,*,#53,.F.);\n#65=ORIENTED_EDGE('',*,*,#52,.F.);\n\
          #70=EDGE_LOOP('',(#60));\n#71=EDGE_LOOP('',(#61));\n#72=EDGE_LOOP('',(#62,#63,#64,#65));\n\
          #80=FACE_OUTER_BOUND('',#70,.T.);\n#81=FACE_BOUND('',#71,.T.);\n#82=FACE_BOUND('',#72,.T.);\n\
          #900=ADVANCED_FACE('',(#80,#81,#82),#31,.T.);\n"
}

#[test]
fn a_tube_is_cut_open_around_a_hole_in_the_way_of_its_only_straight_seam() {
    for (middle, half) in [(0.0, 0.3), (0.1, 0.4), (-0.2, 1.1), (PI, 0.3)] {
        let import = import(&tube_with_window(middle, half));
        close(area(&import), 400.0 * PI - 2.0 * half * 10.0 * 6.0, 1e-5);
        assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
    }
}

#[test]
fn a_hexagon_in_a_circle_a_little_wider_is_a_hole_in_it() {
    // The circle's 16-sided polygon does not hold the corners.
    let (outer, inner) = (1.0414, 1.0265);
    let corners: Vec<(u32, [f64; 3])> = (0..6)
        .map(|k| (100 + k, f64::from(k) * PI / 3.0 + 0.5))
        .map(|(id, a)| (id, [inner * a.cos(), inner * a.sin(), 0.0]))
        .collect();
    let mut d = points(&[(10, [0., 0., 0.]), (11, [outer, 0., 0.])]) + &points(&corners);
    d += &format!(
        "#20=AXIS2_PLACEMENT_3D('',#10,$,$);\n#21=PLANE('',#20);\n#22=CIRCLE('',#20,{outer:?});\n#30=VERTEX_POINT('',#11);\n\
         #40=EDGE_CURVE('',#30,#30,#22,.T.);\n#50=ORIENTED_EDGE('',*,*,#40,.T.);\n#60=EDGE_LOOP('',(#50));\n"
    );
    for k in 0..6 {
        let next = (k + 1) % 6;
        d += &format!("#13{k}=VERTEX_POINT('',#10{k});\n#14{k}=EDGE_CURVE('',#13{k},#13{next},$,.T.);\n");
        d += &format!("#15{k}=ORIENTED_EDGE('',*,*,#14{k},.F.);\n");
    }
    d += "#61=EDGE_LOOP('',(#155,#154,#153,#152,#151,#150));\n#70=FACE_OUTER_BOUND('',#60,.T.);\n#71=FACE_BOUND('',#61,.T.);\n\
          #900=ADVANCED_FACE('',(#70,#71),#21,.T.);\n";
    let import = import(&d);
    close(area(&import), PI * outer * outer - 1.5 * 3f64.sqrt() * inner * inner, 1e-3);
    assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
}

/// A flat disc of radius 10 as a polar spline whose middle is a ring of radius `ring`, trimmed by a circle of radius 3 that passes the
/// middle at `distance`.
fn disc_beside_its_pole(ring: f64, distance: f64) -> String {
    let turn = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)];
    let mut list = Vec::new();
    for (i, r) in [ring, 10.0].iter().enumerate() {
        for (j, (x, y)) in turn.iter().enumerate() {
            list.push((300 + 10 * i as u32 + j as u32, [r * f64::from(*x), r * f64::from(*y), 0.0]));
        }
    }
    let row = |i: u32| (0..9).map(|j| format!("#{}", 300 + 10 * i + j)).collect::<Vec<_>>().join(",");
    let weights =
        (0..9).map(|j| if j % 2 == 0 { "1." } else { "0.7071067811865476" }).collect::<Vec<_>>().join(",");
    let middle = 3.0 + distance;
    points(&list)
        + &points(&[(10, [middle, 0., 0.]), (11, [middle + 3.0, 0., 0.])])
        + &format!(
            "#33=(BOUNDED_SURFACE()B_SPLINE_SURFACE(1,2,(({}),({})),.UNSPECIFIED.,.F.,.T.,.F.)\
             B_SPLINE_SURFACE_WITH_KNOTS((2,2),(3,2,2,2,3),(0.,1.),(0.,1.,2.,3.,4.),.UNSPECIFIED.)\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE((({weights}),({weights})))REPRESENTATION_ITEM('')SURFACE());\n\
             #30=AXIS2_PLACEMENT_3D('',#10,$,$);\n#35=CIRCLE('',#30,3.);\n#40=VERTEX_POINT('',#11);\n\
             #50=EDGE_CURVE('',#40,#40,#35,.T.);\n#60=ORIENTED_EDGE('',*,*,#50,.T.);\n#70=EDGE_LOOP('',(#60));\n\
             #80=FACE_OUTER_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#80),#33,.T.);\n",
            row(0),
            row(1)
        )
}

#[test]
fn an_edge_that_passes_a_pole_closely_does_not_wind_around_it() {
    for ring in [1e-9, 1e-4] {
        for distance in [1.0, 0.1, 0.07, 0.03, 0.01] {
            let import = import(&disc_beside_its_pole(ring, distance));
            close(area(&import), 9.0 * PI, 1e-3);
        }
    }
}

/// A strip of a cylinder of radius 2 between two helices, written as polylines: from height `rise · turn` up by 0.5.
fn flank(turns: u32) -> String {
    let (n, rise) = (64 * turns, 1.5);
    let place = |k: u32, up: f64| {
        let angle = f64::from(k) * PI / 32.0;
        [2.0 * angle.cos(), 2.0 * angle.sin(), rise * angle / (2.0 * PI) + up]
    };
    let mut list = vec![(10, [0., 0., 0.])];
    for k in 0..=n {
        list.push((1000 + k, place(k, 0.0)));
        list.push((50_000 + k, place(k, 0.5)));
    }
    let line = |first: u32| (0..=n).map(|k| format!("#{}", first + k)).collect::<Vec<_>>().join(",");
    points(&list)
        + &format!(
            "#20=AXIS2_PLACEMENT_3D('',#10,$,$);\n#21=CYLINDRICAL_SURFACE('',#20,2.);\n#22=POLYLINE('',({}));\n#23=POLYLINE('',({}));\n\
             #30=VERTEX_POINT('',#1000);\n#31=VERTEX_POINT('',#{});\n#32=VERTEX_POINT('',#{});\n#33=VERTEX_POINT('',#50000);\n\
             #40=EDGE_CURVE('',#30,#31,#22,.T.);\n#41=EDGE_CURVE('',#31,#32,$,.T.);\n#42=EDGE_CURVE('',#33,#32,#23,.T.);\n\
             #43=EDGE_CURVE('',#33,#30,$,.T.);\n#50=ORIENTED_EDGE('',*,*,#40,.T.);\n#51=ORIENTED_EDGE('',*,*,#41,.T.);\n\
             #52=ORIENTED_EDGE('',*,*,#42,.F.);\n#53=ORIENTED_EDGE('',*,*,#43,.T.);\n#60=EDGE_LOOP('',(#50,#51,#52,#53));\n\
             #70=FACE_OUTER_BOUND('',#60,.T.);\n#900=ADVANCED_FACE('',(#70),#21,.T.);\n",
            line(1000),
            line(50_000),
            1000 + n,
            50_000 + n
        )
}

#[test]
fn the_flank_of_a_thread_has_as_many_turns_as_the_thread() {
    for turns in [1, 9] {
        close(area(&import(&flank(turns))), 0.5 * 2.0 * 2.0 * PI * f64::from(turns), 1e-4);
    }
}

/// A tube of radius 2 with a slot of height 0.5 along a helix that rises by 1 a turn, 1 mm from both rims, its curves written as polylines;
/// `way` 1 winds up, −1 down.
fn tube_with_helical_slot(turns: u32, way: f64) -> String {
    let n = 64 * turns;
    let place = |k: u32, up: f64| {
        let angle = way * f64::from(k) * PI / 32.0;
        [2.0 * angle.cos(), 2.0 * angle.sin(), 1.0 + f64::from(k) / 64.0 + up]
    };
    let height = 2.5 + f64::from(turns);
    let mut list = vec![(10, [0., 0., 0.]), (11, [0., 0., height]), (12, [2., 0., 0.]), (13, [2., 0., height])];
    for k in 0..=n {
        list.push((1000 + k, place(k, 0.0)));
        list.push((50_000 + k, place(k, 0.5)));
    }
    let line = |first: u32| (0..=n).map(|k| format!("#{}", first + k)).collect::<Vec<_>>().join(",");
    let sense = if way > 0.0 { "F" } else { "T" };
    points(&list)
        + &format!(
            "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n#22=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n\
             #23=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#24=CYLINDRICAL_SURFACE('',#22,2.);\n#25=CIRCLE('',#22,2.);\n\
             #26=CIRCLE('',#23,2.);\n#27=POLYLINE('',({}));\n#28=POLYLINE('',({}));\n\
             #30=VERTEX_POINT('',#12);\n#31=VERTEX_POINT('',#13);\n#32=VERTEX_POINT('',#1000);\n#33=VERTEX_POINT('',#{last});\n\
             #34=VERTEX_POINT('',#{});\n#35=VERTEX_POINT('',#50000);\n\
             #40=EDGE_CURVE('',#30,#30,#25,.T.);\n#41=EDGE_CURVE('',#31,#31,#26,.T.);\n#42=EDGE_CURVE('',#32,#33,#27,.T.);\n\
             #43=EDGE_CURVE('',#33,#34,$,.T.);\n#44=EDGE_CURVE('',#35,#34,#28,.T.);\n#45=EDGE_CURVE('',#35,#32,$,.T.);\n\
             #50=ORIENTED_EDGE('',*,*,#40,.T.);\n#51=ORIENTED_EDGE('',*,*,#41,.F.);\n#52=ORIENTED_EDGE('',*,*,#42,.T.);\n\
             #53=ORIENTED_EDGE('',*,*,#43,.T.);\n#54=ORIENTED_EDGE('',*,*,#44,.F.);\n#55=ORIENTED_EDGE('',*,*,#45,.T.);\n\
             #60=EDGE_LOOP('',(#50));\n#61=EDGE_LOOP('',(#51));\n#62=EDGE_LOOP('',(#52,#53,#54,#55));\n\
             #70=FACE_OUTER_BOUND('',#60,.T.);\n#71=FACE_BOUND('',#61,.T.);\n#72=FACE_BOUND('',#62,.{sense}.);\n\
             #900=ADVANCED_FACE('',(#70,#71,#72),#24,.T.);\n",
            line(1000),
            line(50_000),
            50_000 + n,
            last = 1000 + n,
        )
}

/// The seam between the rims has to turn as often as the slot: every straight one would cross it.
#[test]
fn a_seam_passes_a_slot_of_many_turns() {
    for (turns, way) in [(1, 1.0), (4, 1.0), (4, -1.0), (9, 1.0)] {
        let import = import(&tube_with_helical_slot(turns, way));
        let expected = 4.0 * PI * (2.5 + f64::from(turns) - 0.5 * f64::from(turns));
        close(area(&import), expected, 1e-4);
        assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
        let report = tessellate(&import.model, &Settings::uniform(0.02)).report;
        assert!(report.repaired.is_empty(), "{:?}", report.repaired);
        assert!((report.area_mm2 / expected - 1.0).abs() < 0.02, "{} mm² for {expected}", report.area_mm2);
    }
}

/// Half of a band of a cylinder of radius 10 between two half circles `width` apart that both stand on the vertices of the first: a file
/// without the band's straight sides.
fn half_band(width: f64) -> String {
    points(&[(10, [0., 0., 0.]), (11, [0., 0., width]), (12, [10., 0., 0.]), (13, [-10., 0., 0.])])
        + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n\
           #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=CYLINDRICAL_SURFACE('',#30,10.);\n#32=CIRCLE('',#30,10.);\n\
           #33=AXIS2_PLACEMENT_3D('',#11,#20,#21);\n#34=CIRCLE('',#33,10.);\n\
           #40=VERTEX_POINT('',#12);\n#41=VERTEX_POINT('',#13);\n\
           #50=EDGE_CURVE('',#40,#41,#32,.T.);\n#51=EDGE_CURVE('',#40,#41,#34,.T.);\n\
           #60=ORIENTED_EDGE('',*,*,#50,.T.);\n#61=ORIENTED_EDGE('',*,*,#51,.F.);\n\
           #70=EDGE_LOOP('',(#60,#61));\n#80=FACE_OUTER_BOUND('',#70,.T.);\n#900=ADVANCED_FACE('',(#80),#31,.T.);\n"
}

#[test]
fn edges_whose_ends_lie_apart_by_the_width_of_their_face_keep_it() {
    for width in [0.9, 3.0] {
        let import = import(&half_band(width));
        close(area(&import), PI * 10.0 * width, 1e-6);
        assert_eq!(import.report.faces.repaired, 1, "{:?}", import.report.repairs);
    }
}

/// A ring of which the outer circle is two arcs and the inner one four, so that as polygons the inner one would be the larger.
#[test]
fn a_ring_narrower_than_the_sag_of_coarse_polygons_keeps_its_hole() {
    let (outer, inner) = (5.0, 4.99);
    let text = points(&[
        (10, [0., 0., 0.]),
        (11, [outer, 0., 0.]),
        (12, [-outer, 0., 0.]),
        (13, [inner, 0., 0.]),
        (14, [0., inner, 0.]),
        (15, [-inner, 0., 0.]),
        (16, [0., -inner, 0.]),
    ]) + "#20=DIRECTION('',(0.,0.,1.));\n#21=DIRECTION('',(1.,0.,0.));\n\
          #30=AXIS2_PLACEMENT_3D('',#10,#20,#21);\n#31=PLANE('',#30);\n#32=CIRCLE('',#30,5.);\n#33=CIRCLE('',#30,4.99);\n\
          #41=VERTEX_POINT('',#11);\n#42=VERTEX_POINT('',#12);\n#43=VERTEX_POINT('',#13);\n\
          #44=VERTEX_POINT('',#14);\n#45=VERTEX_POINT('',#15);\n#46=VERTEX_POINT('',#16);\n\
          #51=EDGE_CURVE('',#41,#42,#32,.T.);\n#52=EDGE_CURVE('',#42,#41,#32,.T.);\n\
          #53=EDGE_CURVE('',#43,#44,#33,.T.);\n#54=EDGE_CURVE('',#44,#45,#33,.T.);\n\
          #55=EDGE_CURVE('',#45,#46,#33,.T.);\n#56=EDGE_CURVE('',#46,#43,#33,.T.);\n\
          #61=ORIENTED_EDGE('',*,*,#51,.T.);\n#62=ORIENTED_EDGE('',*,*,#52,.T.);\n\
          #63=ORIENTED_EDGE('',*,*,#53,.T.);\n#64=ORIENTED_EDGE('',*,*,#54,.T.);\n\
          #65=ORIENTED_EDGE('',*,*,#55,.T.);\n#66=ORIENTED_EDGE('',*,*,#56,.T.);\n\
          #71=EDGE_LOOP('',(#61,#62));\n#72=EDGE_LOOP('',(#63,#64,#65,#66));\n\
          #81=FACE_OUTER_BOUND('',#71,.T.);\n#82=FACE_BOUND('',#72,.F.);\n#900=ADVANCED_FACE('',(#81,#82),#31,.T.);\n";
    let import = import(&text);
    // The measure is of polygons of 400 corners an edge, whose sag is a share of so narrow a ring.
    close(area(&import), PI * (outer * outer - inner * inner), 5e-3);
    assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
}

/// A strip of a cylinder of radius 2, three turns as a rational spline, that rises by its own width of 0.5 in a turn: each turn touches the
/// next. `way` 1 winds up, −1 down; `forward` is the direction of its helices' curves.
fn touching_turns(way: f64, forward: bool) -> String {
    let turn = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
    let (last, width) = (24, 0.5);
    let corner = |k: usize, up: f64| {
        let (x, y) = turn[k % 8];
        [2.0 * f64::from(x), 2.0 * f64::from(y), way * width * (k as f64 / 8.0 + up)]
    };
    let mut list = Vec::new();
    for k in 0..=last {
        list.push((100 + k as u32, corner(k, 0.0)));
        list.push((200 + k as u32, corner(k, 1.0)));
    }
    let all = |each: &dyn Fn(usize) -> String| (0..=last).map(each).collect::<Vec<_>>().join(",");
    let ordered = |k: usize| if forward { k } else { last - k };
    let weight = |k: usize| if k.is_multiple_of(2) { "1." } else { "0.7071067811865476" }.to_string();
    let (weights, pairs) = (all(&weight), all(&|k| format!("({0},{0})", weight(k))));
    let spans = |each: &dyn Fn(usize) -> String| (0..=last / 2).map(each).collect::<Vec<_>>().join(",");
    let multiplicities = spans(&|k| if k % 12 == 0 { "3" } else { "2" }.to_string());
    let knots = spans(&|k| format!("{k}."));
    let helix = |id: u32, first: usize| {
        format!(
            "#{id}=(BOUNDED_CURVE()B_SPLINE_CURVE(2,({}),.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS(({multiplicities}),({knots}),.UNSPECIFIED.)CURVE()\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE(({weights}))REPRESENTATION_ITEM(''));\n",
            all(&|k| format!("#{}", first + ordered(k)))
        )
    };
    let (from, to, sense) = if forward { (30, 31, "T") } else { (31, 30, "F") };
    let against = if forward { "F" } else { "T" };
    points(&list)
        + &helix(22, 100)
        + &helix(23, 200)
        + &format!(
            "#21=(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,1,({}),.UNSPECIFIED.,.F.,.F.,.F.)\
             B_SPLINE_SURFACE_WITH_KNOTS(({multiplicities}),(2,2),({knots}),(0.,1.),.UNSPECIFIED.)\
             GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({pairs}))REPRESENTATION_ITEM('')SURFACE());\n\
             #30=VERTEX_POINT('',#100);\n#31=VERTEX_POINT('',#124);\n#32=VERTEX_POINT('',#200);\n#33=VERTEX_POINT('',#224);\n\
             #40=EDGE_CURVE('',#{from},#{to},#22,.T.);\n#41=EDGE_CURVE('',#31,#33,$,.T.);\n#42=EDGE_CURVE('',#{},#{},#23,.T.);\n\
             #43=EDGE_CURVE('',#30,#32,$,.T.);\n#50=ORIENTED_EDGE('',*,*,#40,.{sense}.);\n#51=ORIENTED_EDGE('',*,*,#41,.T.);\n\
             #52=ORIENTED_EDGE('',*,*,#42,.{against}.);\n#53=ORIENTED_EDGE('',*,*,#43,.F.);\n#60=EDGE_LOOP('',(#50,#51,#52,#53));\n\
             #70=FACE_OUTER_BOUND('',#60,.T.);\n#900=ADVANCED_FACE('',(#70),#21,.T.);\n",
            all(&|k| format!("(#{},#{})", 100 + k, 200 + k)),
            from + 2,
            to + 2
        )
}

#[test]
fn edges_between_turns_that_touch_keep_to_their_own() {
    for (way, forward) in [(1.0, true), (1.0, false), (-1.0, true), (-1.0, false)] {
        let import = import(&touching_turns(way, forward));
        close(area(&import), 3.0 * 4.0 * PI * 0.5, 1e-5);
        assert_eq!(import.report.faces.repaired, 0, "{:?}", import.report.repairs);
    }
}

/// An octant of a sphere of radius 0.2, tilted so that one corner lies 7° from the pole; at another corner two edges end half as far apart.
#[test]
fn a_gap_at_one_corner_moves_no_other_corner_to_the_pole() {
    let (radius, tilt) = (0.2, 7f64.to_radians());
    let (sin, cos) = tilt.sin_cos();
    let (half_sin, half_cos) = (0.5 * tilt).sin_cos();
    let data = format!(
        "#10=CARTESIAN_POINT('',(0.,0.,0.));#11=DIRECTION('',(0.,1.,0.));#12=DIRECTION('',(1.,0.,0.));#13=AXIS2_PLACEMENT_3D('',#10,#11,#12);\n\
         #14=SPHERICAL_SURFACE('',#13,{radius:?});\n\
         #20=CARTESIAN_POINT('',({:?},0.,0.));#21=CARTESIAN_POINT('',(0.,{:?},{:?}));#22=CARTESIAN_POINT('',(0.,{:?},{:?}));\n\
         #23=VERTEX_POINT('',#20);#24=VERTEX_POINT('',#21);#25=VERTEX_POINT('',#22);\n\
         #30=DIRECTION('',(0.,{:?},{:?}));#31=DIRECTION('',(0.,{cos:?},{:?}));#32=AXIS2_PLACEMENT_3D('',#10,#30,#31);\n\
         #33=CIRCLE('',#32,{radius:?});#34=EDGE_CURVE('',#23,#24,#33,.T.);\n\
         #40=DIRECTION('',(-1.,0.,0.));#41=DIRECTION('',(0.,0.,1.));#42=AXIS2_PLACEMENT_3D('',#10,#40,#41);\n\
         #43=CIRCLE('',#42,{radius:?});#44=EDGE_CURVE('',#24,#25,#43,.T.);\n\
         #50=DIRECTION('',(0.,{:?},{sin:?}));#51=DIRECTION('',(0.,{sin:?},{cos:?}));#52=AXIS2_PLACEMENT_3D('',#10,#50,#51);\n\
         #53=CIRCLE('',#52,{radius:?});#54=EDGE_CURVE('',#23,#25,#53,.T.);\n\
         #60=ORIENTED_EDGE('',*,*,#34,.T.);#61=ORIENTED_EDGE('',*,*,#44,.T.);#62=ORIENTED_EDGE('',*,*,#54,.F.);\n\
         #63=EDGE_LOOP('',(#60,#61,#62));#64=FACE_BOUND('',#63,.T.);#900=ADVANCED_FACE('',(#64),#14,.T.);",
        -radius,
        radius * cos,
        -radius * sin,
        -radius * half_sin,
        -radius * half_cos,
        -sin,
        -cos,
        -sin,
        -cos,
    );
    let import = read(&data);
    let face = &import.model.parts[0].shells[0].faces[0];
    // The edges end on a meridian, 3.5° and 7° below the equator, and both come to the middle in parameters: a quarter of a circle is
    // a rational quadratic, of which tan φ = (√2 ρ + ρ²) / (1 + √2 ρ) at the parameter ρ / (1 + ρ).
    let parameter = |angle: f64| {
        let b = SQRT_2 * (1.0 - angle.tan());
        let rho = 0.5 * ((b * b + 4.0 * angle.tan()).sqrt() - b);
        rho / (1.0 + rho)
    };
    let between = 0.5 * (parameter(0.5 * tilt) + parameter(tilt));
    let rho = between / (1.0 - between);
    let middle = ((SQRT_2 * rho + rho * rho) / (1.0 + SQRT_2 * rho)).atan();
    let gap = 2.0 * radius * (0.5 * (middle - 0.5 * tilt).max(tilt - middle)).sin();
    assert!((face.gap / gap - 1.0).abs() < 1e-3, "{} for {gap}", face.gap);
    assert_eq!(face.loops[0].uses.len(), 3, "a side along a pole");
}
