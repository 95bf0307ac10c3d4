//! Tubes of hundreds of windows, of which none leaves a straight seam, against the closed form of their area.

use crate::faces::{close, import};
use crate::support::polygon;
use lampyris::math::Point;
use lampyris::model::Face;
use std::f64::consts::TAU;
use std::fmt::Write;

const RADIUS: f64 = 10.0;
/// Half of a window, as a share of the pitch both along and around.
const HALF: f64 = 0.3;

/// Entities of a file.
struct Entities {
    text: String,
    /// The number of the last one.
    last: usize,
}

impl Entities {
    /// Adds an entity and returns its number.
    fn add(&mut self, entity: &str) -> usize {
        self.last += 1;
        writeln!(self.text, "#{}={entity};", self.last).unwrap();
        self.last
    }

    /// Adds a vertex of the tube.
    fn add_vertex(&mut self, angle: f64, z: f64) -> usize {
        let (sin, cos) = angle.sin_cos();
        let point = self.add(&format!("CARTESIAN_POINT('',({:?},{:?},{z:?}))", RADIUS * cos, RADIUS * sin));
        self.add(&format!("VERTEX_POINT('',#{point})"))
    }

    /// Adds a circle around the tube.
    fn add_circle(&mut self, z: f64) -> usize {
        let point = self.add(&format!("CARTESIAN_POINT('',(0.,0.,{z:?}))"));
        let placement = self.add(&format!("AXIS2_PLACEMENT_3D('',#{point},#901,#902)"));
        self.add(&format!("CIRCLE('',#{placement},{RADIUS:?})"))
    }

    /// Adds an edge on a curve, straight without one.
    fn add_edge(&mut self, from: usize, to: usize, curve: Option<usize>) -> usize {
        let curve = curve.map_or_else(|| "$".to_owned(), |id| format!("#{id}"));
        self.add(&format!("EDGE_CURVE('',#{from},#{to},{curve},.T.)"))
    }

    /// Adds a bound of these edges, each with whether it is run forward.
    fn add_bound(&mut self, kind: &str, edges: &[(usize, bool)]) -> usize {
        let mut uses = Vec::new();
        for &(edge, forward) in edges {
            let sense = if forward { 'T' } else { 'F' };
            uses.push(format!("#{}", self.add(&format!("ORIENTED_EDGE('',*,*,#{edge},.{sense}.)"))));
        }
        let edge_loop = self.add(&format!("EDGE_LOOP('',({}))", uses.join(",")));
        self.add(&format!("{kind}('',#{edge_loop},.T.)"))
    }
}

/// A tube of `rows` rows of `across` square windows, every other row half a pitch on; its rims have their vertices at angle 0, in the middle
/// of windows.
fn perforated_tube(across: u32, rows: u32) -> String {
    let pitch = TAU / f64::from(across);
    let height = RADIUS * pitch;
    let axis = "#901=DIRECTION('',(0.,0.,1.));\n#902=DIRECTION('',(1.,0.,0.));\n#903=CARTESIAN_POINT('',(0.,0.,0.));\n\
                #904=AXIS2_PLACEMENT_3D('',#903,#901,#902);\n";
    let surface = format!("#905=CYLINDRICAL_SURFACE('',#904,{RADIUS:?});\n");
    let mut out = Entities { text: axis.to_owned() + &surface, last: 1000 };
    let mut bounds = Vec::new();
    for (z, forward) in [(0.0, true), (height * f64::from(rows), false)] {
        let (circle, vertex) = (out.add_circle(z), out.add_vertex(0.0, z));
        let edge = out.add_edge(vertex, vertex, Some(circle));
        bounds.push(out.add_bound(if forward { "FACE_OUTER_BOUND" } else { "FACE_BOUND" }, &[(edge, forward)]));
    }
    for row in 0..rows {
        let middle = height * (f64::from(row) + 0.5);
        let (low, high) = (middle - HALF * height, middle + HALF * height);
        let (below, above) = (out.add_circle(low), out.add_circle(high));
        for column in 0..across {
            let angle = pitch * (f64::from(column) + 0.5 * f64::from(row % 2));
            let (left, right) = (angle - HALF * pitch, angle + HALF * pitch);
            let [a, b, c, d] =
                [(left, low), (right, low), (right, high), (left, high)].map(|(angle, z)| out.add_vertex(angle, z));
            let bottom = out.add_edge(a, b, Some(below));
            let top = out.add_edge(d, c, Some(above));
            let (first, last) = (out.add_edge(a, d, None), out.add_edge(b, c, None));
            let uses = [(first, true), (top, true), (last, false), (bottom, false)];
            bounds.push(out.add_bound("FACE_BOUND", &uses));
        }
    }
    let list = bounds.iter().map(|id| format!("#{id}")).collect::<Vec<_>>().join(",");
    writeln!(out.text, "#900=ADVANCED_FACE('',({list}),#905,.T.);").unwrap();
    out.text
}

/// The area that the loops of a face enclose on the tube: height over angle, what is on the left of them.
fn area_on_tube(face: &Face) -> f64 {
    let mut area = 0.0;
    for trim in &face.loops {
        let places: Vec<Point> = polygon(&trim.uses).into_iter().map(|uv| face.surface.evaluate(uv)).collect();
        for k in 0..places.len() {
            let (p, q) = (places[k], places[(k + 1) % places.len()]);
            let turn = (p.x * q.y - p.y * q.x).atan2(p.x * q.x + p.y * q.y);
            area -= RADIUS * 0.5 * (p.z + q.z) * turn;
        }
    }
    area
}

#[test]
fn a_tube_of_hundreds_of_staggered_windows_is_cut_open_between_them() {
    let count = 24;
    let import = import(&perforated_tube(count, count));
    let faces = import.report.faces;
    assert_eq!((faces.converted, faces.refused), (1, 0), "{:?}", import.report.refusals);
    assert_eq!(faces.repaired, 0, "{:?}", import.report.repairs);
    let face = &import.model.parts[0].shells[0].faces[0];
    assert_eq!(face.loops.len() as u32, 1 + count * count, "windows beside the border");
    // Of each square of the pitch a window of 0.6 by 0.6 is missing.
    let whole = (TAU * RADIUS).powi(2);
    close(area_on_tube(face), whole * (1.0 - 4.0 * HALF * HALF), 1e-6);
}
