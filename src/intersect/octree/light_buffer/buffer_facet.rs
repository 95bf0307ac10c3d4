//! Facets as the rays of a source are tested against them.

use super::view::View;
use crate::intersect::facet::{FacetRay, Line, Nearest};
use crate::intersect::octree::facet_pair::Corners;
use crate::math::{Point, Ray, huge_pages};
use crate::mesh::FacetMesh;

/// A facet with its corners, axis by axis in the order of the rays' axes: two lines of the cache hold all that a test needs, where
/// its corners in the mesh are four places behind four indices.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct BufferFacet {
    pub(super) corners: Corners,
    pub(super) facet: u32,
    /// One bit for each triangle.
    triangles: u32,
}

impl BufferFacet {
    /// A facet as the rays on one side of the buffer are tested against it, of which it needs no more than their axes.
    fn new(mesh: &FacetMesh, facet: u32, view: &View, side: usize) -> Self {
        let axes = view.axes(side);
        let positions = mesh.corner_positions(facet as usize);
        let corners = mesh.corners(facet as usize).map(|p| p.to_array());
        let triangles = if positions[2] == positions[3] { 1 } else { 3 };
        Self { corners: axes.map(|a| corners.map(|p| p[a])), facet, triangles }
    }

    /// Makes one for each of the facets listed for each side, side after side.
    pub(super) fn on_all_sides(mesh: &FacetMesh, view: &View, facets: &[Vec<u32>]) -> Vec<Self> {
        let mut shown = huge_pages::with_capacity(facets.iter().map(Vec::len).sum());
        for (side, facets) in facets.iter().enumerate() {
            shown.extend(facets.iter().map(|f| Self::new(mesh, *f, view, side)));
        }
        shown
    }

    /// Bit 0 for the first triangle, bit 2 for the second where there is one.
    #[inline(always)]
    pub(super) fn triangle_bits(&self) -> u8 {
        // Two apart, so that shifts by one turn sides into triangles for both facets of a pair at once.
        (self.triangles & 1 | (self.triangles & 2) << 1) as u8
    }

    /// Tests all triangles of the facet and offers hits to `best`; `line` must have the axes of the facet's side.
    #[inline(always)]
    pub(super) fn test(&self, line: &Line, best: &mut Nearest) {
        line.test_quad((self.facet, self.triangles), &self.corners, best);
    }
}

impl View {
    /// The axes that [`FacetRay`] chooses for the rays on a side of the buffer, the main one last.
    pub(super) fn axes(&self, side: usize) -> [usize; 3] {
        match self {
            Self::Point(_) => [[1, 2, 0], [2, 0, 1], [0, 1, 2]][side / 2 % 3],
            Self::Along { direction, .. } => FacetRay::new(&Ray::new(Point::ZERO, *direction)).axes(),
        }
    }
}
