//! What an octree looks like, for people: its statistics as text and in the report, its boxes as files to turn around.

use crate::cli::failure::Failure;
use crate::formats::{Facets, Group, Polylines, write_atomic, write_facets};
use crate::intersect::octree::{Octree, Statistics};
use crate::intersect::{Cost, Intersector};
use crate::math::{Aabb, FaceId, Point, Uv, Vector};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::report::{AxisStyle, Chart, Content, Section, Table, View};
use crate::text::{figures, grouped};
use std::path::Path;

/// Most boxes written to files; deeper levels are left out beyond it.
const MOST_BOXES: usize = 50_000;

/// Most boxes drawn in the report: 16 corners each are half a megabyte.
const MOST_DRAWN: usize = 2_000;

/// The shape of an octree, and what a benchmark's rays cost on it.
pub(crate) struct OctreeShape {
    facets: usize,
    bytes: usize,
    statistics: Statistics,
    boxes: Vec<(usize, Aabb)>,
    /// Kind of rays, and what the octree did for them.
    pub(crate) costs: Vec<(String, Cost)>,
}

impl OctreeShape {
    /// Takes statistics, size and boxes of an octree; costs are for the caller to add.
    pub(crate) fn new(octree: &Octree) -> Self {
        let footprint = octree.footprint();
        Self {
            facets: footprint.primitives,
            bytes: footprint.bytes,
            statistics: octree.statistics().clone(),
            boxes: octree.boxes(),
            costs: Vec::new(),
        }
    }

    /// Returns how often a facet is listed, on average.
    fn listings_per_facet(&self) -> f64 {
        self.statistics.references as f64 / self.facets.max(1) as f64
    }

    /// Describes the octree in several lines, with bars of its depths, and the cost of each kind of rays.
    fn summary(&self) -> String {
        let mut text = format!(
            "{} facets, each listed {} times, {} bytes a facet\n",
            grouped(self.facets as u64),
            figures(self.listings_per_facet(), 3),
            figures(self.bytes as f64 / self.facets.max(1) as f64, 3)
        );
        text += &self.statistics.to_string();
        for (kind, cost) in &self.costs {
            let per_ray = |n: u64| figures(n as f64 / cost.rays.max(1) as f64, 3);
            text +=
                &format!("{kind} rays: {} nodes and {} tests a ray\n", per_ray(cost.nodes), per_ray(cost.tests));
        }
        text
    }
}

/// Writes the statistics of all trees to `octree.txt`, and the boxes of the first, that of the coarsest facets, to `octree.vtu` and
/// `octree.glb`: at most [`MOST_BOXES`], without the deepest. The folder must be there; files in it are replaced.
pub(crate) fn write_octree_files(folder: &Path, shapes: &[OctreeShape]) -> Result<(), Failure> {
    let text: Vec<String> = shapes.iter().map(OctreeShape::summary).collect();
    write_atomic(&folder.join("octree.txt"), |w| w.write_all(text.join("\n").as_bytes()))?;
    // The first is that of the coarsest facets, which can still be looked at.
    let Some(first) = shapes.first() else { return Ok(()) };
    let mut boxes = first.boxes.clone();
    // Upper levels first: what is cut off are leaves.
    boxes.sort_by_key(|(depth, _)| *depth);
    boxes.truncate(MOST_BOXES);
    let mesh = box_facets(&boxes);
    let depths = boxes.last().map_or(0, |(depth, _)| *depth);
    let groups = (0..=depths)
        .map(|depth| Group {
            opacity: 0.15,
            ..Group::solid(&format!("depth {depth}"), depth_colour(depth, depths))
        })
        .collect();
    let facets = Facets { groups, group_of_face: (0..=depths as u32).collect(), ..Facets::plain(&mesh, "octree") };
    write_facets(&folder.join("octree.vtu"), &facets)?;
    write_facets(&folder.join("octree.glb"), &facets)?;
    Ok(())
}

/// Returns a colour from blue at the root (0) to orange at the deepest level.
fn depth_colour(depth: usize, deepest: usize) -> [f64; 3] {
    let s = depth as f64 / deepest.max(1) as f64;
    [0.20 + 0.70 * s, 0.45 + 0.10 * s, 0.85 - 0.65 * s]
}

/// Returns six quads a box (depth, box), outward; the face of a quad is the depth of its box. Bounds are as given, without uv.
fn box_facets(boxes: &[(usize, Aabb)]) -> FacetMesh {
    let mut mesh = FacetMesh::default();
    for (depth, b) in boxes {
        let first = mesh.positions.len() as u32;
        let ends = [b.min, b.max];
        for k in 0..8 {
            mesh.positions.push(Point::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z));
        }
        for axis in 0..3 {
            let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for side in [0, 1] {
                let base = side << axis;
                // Counter-clockwise as seen from outside.
                let ring = if side == 1 { [0, u, u | v, v] } else { [0, v, u | v, u] };
                let mut normal = Vector::ZERO;
                normal[axis] = if side == 1 { 1.0 } else { -1.0 };
                let corner = mesh.vertices.len() as u32;
                let vertex = |k: u32| MeshVertex { position: first + (base | k), normal, uv: Uv::ZERO };
                mesh.vertices.extend(ring.map(vertex));
                let vertices = [0, 1, 2, 3].map(|k| corner + k);
                mesh.facets.push(Facet { vertices, face: FaceId(*depth as u32) });
            }
        }
    }
    mesh
}

/// Draws cells of an octree as lines in the colours of their depth: all of the upper levels, the last shown thinned out evenly,
/// [`MOST_DRAWN`] in all.
pub(crate) fn octree_view(shape: &OctreeShape) -> View {
    let mut boxes = shape.boxes.clone();
    boxes.sort_by_key(|(depth, _)| *depth);
    let total = boxes.len();
    let deepest = boxes.last().map_or(0, |(depth, _)| *depth);
    let mut view = View {
        name: "octree-cells".into(),
        title: "Cells of the octree".into(),
        caption: String::new(),
        shapes: Vec::new(),
    };
    let (mut left, mut shown) = (MOST_DRAWN, 0);
    for depth in 0..=deepest {
        let level: Vec<Aabb> = boxes.iter().filter(|(d, _)| *d == depth).map(|(_, b)| *b).collect();
        if level.is_empty() || left == 0 {
            continue;
        }
        let mut lines = Polylines::default();
        // Evenly over the level, so that what is left shows where leaves crowd.
        for b in level.iter().step_by(level.len().div_ceil(left)) {
            lines.push(box_edges(b));
            (left, shown) = (left - 1, shown + 1);
        }
        view = view.lines(&format!("depth {depth}"), &lines, depth_colour(depth, deepest));
    }
    view.caption(&format!(
        "{} of the {} boxes into which the octree sorts the {} facets, from blue at the root to orange at the leaves: small where facets \
         crowd. Click a depth in the legend to hide or show it.",
        grouped(shown),
        grouped(total as u64),
        grouped(shape.facets as u64)
    ))
}

/// Returns the corners along the edges of a box in one stroke; three edges are passed twice.
fn box_edges(b: &Aabb) -> [Point; 16] {
    let ends = [b.min, b.max];
    [0, 1, 3, 2, 0, 4, 5, 1, 5, 7, 3, 7, 6, 2, 6, 4]
        .map(|k: usize| Point::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z))
}

/// Returns the section of the report: depths of all trees, the cells of the first, and a table of shape and cost.
pub(crate) fn octree_section(shapes: &[OctreeShape]) -> Section {
    let deepest = shapes.iter().map(|s| s.statistics.depths.len()).fold(0, usize::max);
    let layer = |s: &OctreeShape| {
        let share = |depth: usize| {
            let blocks = s.statistics.depths.get(depth)?;
            Some(100.0 * *blocks as f64 / s.statistics.blocks.max(1) as f64)
        };
        (format!("{} facets", grouped(s.facets as u64)), (0..deepest).map(share).collect())
    };
    let content = Content::Bars {
        categories: (0..deepest).map(|d| d.to_string()).collect(),
        layers: shapes.iter().map(layer).collect(),
        stacked: false,
    };
    let axes = [AxisStyle::linear("depth in nodes", ""), AxisStyle::linear("blocks", "%")];
    let caption = "At which depth the blocks of up to four facets lie.";
    let chart =
        Chart { content, ..Chart::series("octree-depths", "Depth of the octree", caption, axes, Vec::new()) };
    let columns = [
        ("facets", ""),
        ("nodes", ""),
        ("blocks", ""),
        ("listed a facet", "×"),
        ("facets a block", ""),
        ("bytes a facet", "B"),
        ("rays", ""),
        ("nodes a ray", ""),
        ("tests a ray", ""),
    ];
    let mut table = Table::new("octree", "Shape of the octree", &columns);
    for s in shapes {
        for (kind, cost) in &s.costs {
            let rays = cost.rays.max(1) as f64;
            table.row([
                (s.facets as u64).into(),
                (s.statistics.nodes as u64).into(),
                (s.statistics.blocks as u64).into(),
                s.listings_per_facet().into(),
                (s.statistics.references as f64 / s.statistics.blocks.max(1) as f64).into(),
                (s.bytes as f64 / s.facets.max(1) as f64).into(),
                kind.as_str().into(),
                (cost.nodes as f64 / rays).into(),
                (cost.tests as f64 / rays).into(),
            ]);
        }
    }
    let section = Section::new("The octree").with_block(chart);
    let files = "octree.vtu and octree.glb hold up to 50 000 of them.";
    let view = |shape| {
        let view = octree_view(shape);
        View { caption: format!("{} {files}", view.caption), ..view }
    };
    let section = shapes.first().into_iter().fold(section, |s, shape| s.with_block(view(shape)));
    section.with_block(table)
}
