//! Drawing facets into the squares of a light buffer.
//!
//! A square is a pyramid, or a prism, in space; a facet is put into it unless all its corners lie beyond one of its
//! sides, or, where the facet is wholly in front, its two triangles as the source sees them pass the square by. Squares are wider than
//! they are by far more than a ray's place can be wrong.

use super::buffer_facet::BufferFacet;
use super::squares::{DIVIDED, DIVISIONS, Entry, LightBuffer, Square};
use super::view::{PLANE_ROOM, View};
use crate::intersect::facet::is_usable;
use crate::math::{Point, run_on_threads};
use crate::mesh::FacetMesh;
use rustc_hash::FxHashMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Room around a square, in units of the half side of the buffer.
const ROOM: f64 = 1e-8;
/// Least depth of the corners of a facet that is projected, relative to its farthest corner: nearer to the plane of the source its
/// place would be wrong by more than the room around squares.
const LEAST_DEPTH: f64 = 1e-6;
/// How far beyond a side of a window all corners must lie, relative to the farthest of them, to be beyond it whatever the rounding of f64.
const BEHIND: f64 = 1e-12;
/// Facets in a square that is not divided further: four meet at a corner of a grid of quads, however small the squares.
const MOST_ENTRIES: usize = 6;
/// How often a square of the buffer may be divided.
const MOST_DIVISIONS: u32 = 3;
/// Tiles along a side of a buffer that are drawn at the same time.
const TILES: usize = 4;
/// Squares of the whole buffer for each facet before any is divided.
const SQUARES: usize = 16;
/// Squares and entries for each facet at which dividing ends.
const MOST_PER_FACET: usize = 64;

/// A square of the buffer with the room around it, in units of the half side of the buffer.
#[derive(Clone, Copy, Debug)]
struct Window {
    low: [f64; 2],
    high: [f64; 2],
}

impl Window {
    const WHOLE: Self = Self { low: [-1.0 - ROOM; 2], high: [1.0 + ROOM; 2] };

    /// Whether the two have no point in common.
    fn is_apart(&self, o: &Self) -> bool {
        (self.low[0] > o.high[0])
            | (self.low[1] > o.high[1])
            | (o.low[0] > self.high[0])
            | (o.low[1] > self.high[1])
    }

    /// The part at column `i` and row `j` of `n` × `n`, with room of its own.
    fn part(&self, n: usize, [i, j]: [usize; 2]) -> Self {
        let edge = |a: usize, k: usize| {
            let (low, high) = (self.low[a] + ROOM, self.high[a] - ROOM);
            // Parts share their border to the bit, and each gets its own room.
            low + (high - low) * (k as f64 / n as f64)
        };
        Self { low: [edge(0, i) - ROOM, edge(1, j) - ROOM], high: [edge(0, i + 1) + ROOM, edge(1, j + 1) + ROOM] }
    }
}

/// A facet as the source sees it.
#[derive(Clone, Copy, Debug)]
struct Projection {
    facet: u32,
    /// Homogeneous places of the corners: `[x, y, w]` stands at `[x/w, y/w]`.
    corners: [[f64; 3]; 4],
    /// Their places, for facets wholly in front of the source; else `None`.
    places: Option<[[f64; 2]; 4]>,
    /// A window around the places.
    bounds: Window,
    /// Depths between which it lies.
    near: f64,
    far: f64,
    /// Whether all rays start before it, so that it can hide what lies behind.
    whole: bool,
}

impl Projection {
    /// Projects a facet of these corners, mm, to one side of the view; `None` where no ray of that side can meet it.
    fn new(facet: u32, corners: [Point; 4], view: &View, side: usize) -> Option<Self> {
        let mut depths = [0.0; 4];
        // Homogeneous: a corner beside the source or behind it has no place to divide for, but still lies on one
        // side of a pyramid.
        let corners: [[f64; 3]; 4] = std::array::from_fn(|k| {
            let p = corners[k];
            match view {
                View::Point(origin) => {
                    let kz = side / 2;
                    let [kx, ky] = [[1, 2], [2, 0], [0, 1]][kz];
                    let p = p.to_array();
                    let sign = if side.is_multiple_of(2) { 1.0 } else { -1.0 };
                    let w = sign * (p[kz] - origin[kz]);
                    depths[k] = w;
                    [p[kx] - origin[kx], p[ky] - origin[ky], w]
                }
                View::Along { direction, across, middle, .. } => {
                    depths[k] = p.dot(*direction);
                    [p.dot(across[0]) - middle[0], p.dot(across[1]) - middle[1], 1.0]
                }
            }
        });
        // Too near to the plane of the source a place is more rounding than place; such a facet is judged by the
        // pyramid's sides.
        let size = corners.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let front = corners.iter().all(|c| c[2] > LEAST_DEPTH * size);
        let places = front.then(|| corners.map(|[x, y, w]| [x / w, y / w]));
        let (near, far) =
            depths.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(*d), h.max(*d)));
        let (start, stray) = match view {
            View::Point(_) => (0.0, PLANE_ROOM * far.abs()),
            View::Along { start, stray, .. } => (*start, *stray),
        };
        let bounds = places.map_or(Window::WHOLE, |places| Window {
            low: [0, 1].map(|a| places.iter().fold(f64::INFINITY, |m, p| m.min(p[a]))),
            high: [0, 1].map(|a| places.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[a]))),
        });
        // Room for the rounding of depths.
        let (near, far) = (near - 2.0 * stray, far + 2.0 * stray);
        let projection = Self { facet, corners, places, bounds, near, far, whole: near > start };
        // Behind all starts, or beside the whole side of the cube: no ray of this side meets it.
        (far >= start && projection.overlaps(&Window::WHOLE)).then_some(projection)
    }

    /// Whether a ray through the window may meet it; `true` says nothing.
    fn overlaps(&self, window: &Window) -> bool {
        if self.bounds.is_apart(window) {
            return false;
        }
        let Some([a, b, c, d]) = self.places else { return self.is_around(window) };
        triangle_overlaps([a, b, c], window) || (c != d && triangle_overlaps([a, c, d], window))
    }

    /// Whether its corners do not all lie beyond one side of the window, nor behind.
    fn is_around(&self, window: &Window) -> bool {
        // What rounds is relative to the farthest corner, and one of them decides for all.
        let size = self.corners.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let beyond = |value: &dyn Fn(&[f64; 3]) -> f64| self.corners.iter().all(|c| value(c) < -BEHIND * size);
        let out = |a: usize| beyond(&|c| c[a] - window.low[a] * c[2]) || beyond(&|c| window.high[a] * c[2] - c[a]);
        !(out(0) || out(1) || beyond(&|c| c[2]))
    }

    /// Whether every ray through the window surely meets it; `false` says nothing.
    fn fills(&self, window: &Window) -> bool {
        let Some(p) = self.places.filter(|_| self.whole) else { return false };
        let turn = |[a, b, c]: [usize; 3]| {
            (p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0])
        };
        let (first, second) = (turn([0, 1, 2]), turn([0, 2, 3]));
        let triangle = p[2] == p[3];
        // Both triangles must lie side by side: then the half-planes of the outline share only what the facet fills.
        // A triangle seen edge on fills nothing.
        if first == 0.0 || (!triangle && first * second <= 0.0) {
            return false;
        }
        let edges: &[[usize; 2]] =
            if triangle { &[[0, 1], [1, 2], [2, 0]] } else { &[[0, 1], [1, 2], [2, 3], [3, 0]] };
        edges.iter().all(|&[i, j]| least_edge(p[i], p[j], first.signum(), window) > 0.0)
    }
}

/// The least value, over the window, of `sign` times the edge function of the line from `p` to `q`, which is positive to its left.
fn least_edge(p: [f64; 2], q: [f64; 2], sign: f64, window: &Window) -> f64 {
    let [dx, dy] = [sign * (q[0] - p[0]), sign * (q[1] - p[1])];
    // A linear function is least at the corner that lies farthest against its gradient.
    let x = if dy > 0.0 { window.high[0] } else { window.low[0] };
    let y = if dx > 0.0 { window.low[1] } else { window.high[1] };
    dx * (y - p[1]) - dy * (x - p[0])
}

/// Whether a triangle and a window may have a point in common: `false` is certain; a triangle seen edge on is tested by its box alone.
fn triangle_overlaps(t: [[f64; 2]; 3], window: &Window) -> bool {
    for a in 0..2 {
        let beyond = |past: &dyn Fn(f64) -> bool| t.iter().all(|p| past(p[a]));
        if beyond(&|x| x < window.low[a]) || beyond(&|x| x > window.high[a]) {
            return false;
        }
    }
    // Seen edge on it has no inside, but a line may still cross the window.
    let turn = (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
    // The greatest of an edge function is the least of its negative.
    turn == 0.0
        || [[0, 1], [1, 2], [2, 0]].iter().all(|&[i, j]| least_edge(t[i], t[j], -turn.signum(), window) <= 0.0)
}

/// Draws all facets of a mesh, with so many threads; the buffer does not depend on their number.
pub(super) fn draw(mesh: &FacetMesh, view: View, threads: usize) -> LightBuffer {
    let facets = mesh.facets.len();
    let squares = (SQUARES * facets) as f64 / view.sides() as f64;
    // A power of two, so that tiles and halvings end on squares.
    let side = (squares.sqrt() as usize).next_power_of_two().clamp(8, 1024);
    let projections = in_parallel(view.sides(), threads, |face| projections(mesh, &view, face));
    let room = MOST_PER_FACET * facets.max(64) / 8;
    let tiles = in_parallel(view.sides() * TILES * TILES, threads, |k| {
        let window = Window::WHOLE.part(TILES, [k % TILES, k / TILES % TILES]);
        Tile::draw(&projections[k / (TILES * TILES)], &window, side / TILES, room)
    });
    let squares = vec![Square::default(); view.sides() * side * side];
    let facets: Vec<Vec<u32>> = projections.iter().map(|s| s.iter().map(|s| s.facet).collect()).collect();
    let shown = BufferFacet::on_all_sides(mesh, &view, &facets);
    let mut buffer = LightBuffer { view, side, squares, entries: Vec::new(), facets: shown };
    for (k, tile) in tiles.into_iter().enumerate() {
        // Facets stand side after side in the order of the projections.
        let first: usize = facets[..k / (TILES * TILES)].iter().map(Vec::len).sum();
        tile.copy_into(&mut buffer, k, first as u32);
    }
    buffer
}

/// The values of a function at 0 to `n − 1`, in order, worked out on `threads` threads, or as many as the system gives.
fn in_parallel<T: Send + Sync>(n: usize, threads: usize, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let values: Vec<OnceLock<T>> = (0..n).map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        // Threads take the next place that is free, so that a slow side of the cube holds up no other; values stay
        // in their places.
        while let Some((k, place)) = values.iter().enumerate().nth(next.fetch_add(1, Ordering::Relaxed)) {
            place.get_or_init(|| value(k));
        }
    };
    run_on_threads(threads, work);
    values.into_iter().filter_map(OnceLock::into_inner).collect()
}

/// All usable facets that the side `face` of a buffer shows, the nearest first.
fn projections(mesh: &FacetMesh, view: &View, face: usize) -> Vec<Projection> {
    let projection = |f: usize| {
        let corners = mesh.corners(f);
        corners.iter().all(|p| is_usable(*p)).then(|| Projection::new(f as u32, corners, view, face)).flatten()
    };
    let mut projections: Vec<Projection> = (0..mesh.facets.len()).filter_map(projection).collect();
    // Sorted by depth once: all lists below are taken from this one and keep its order.
    projections.sort_by(|a, b| a.near.total_cmp(&b.near).then(a.facet.cmp(&b.facet)));
    projections
}

/// A part of a buffer, drawn by itself: its squares row by row, then those of divided squares.
struct Tile {
    side: usize,
    squares: Vec<Square>,
    entries: Vec<Entry>,
}

impl Tile {
    /// Draws a window of `side` × `side` squares, a power of two; beyond `room` squares and entries none is divided any more.
    fn draw(projections: &[Projection], window: &Window, side: usize, room: usize) -> Self {
        let tile = Self { side, squares: vec![Square::default(); side * side], entries: Vec::new() };
        let mut rasterizer = Rasterizer { tile, written: FxHashMap::default(), projections, room };
        let all: Vec<u32> = (0..projections.len() as u32).collect();
        rasterizer.divide_tile(rasterizer.visible(&all, window), window, [0, 0], side);
        rasterizer.tile
    }

    /// Copies it into the buffer as tile `k`, counted face by face, row by row; its facets begin at `first_facet` in `buffer.facets`.
    fn copy_into(self, buffer: &mut LightBuffer, k: usize, first_facet: u32) {
        let (face, i, j) = (k / (TILES * TILES), k % TILES, k / TILES % TILES);
        let own = self.side * self.side;
        let (squares, entries) = (buffer.squares.len(), buffer.entries.len());
        // Within the tile's own arrays; now shifted to where they come to stand in the buffer.
        let moved = |s: &Square| {
            let first = s.first as usize;
            let first = if s.count & DIVIDED != 0 { first - own + squares } else { first + entries };
            Square { first: first as u32, ..*s }
        };
        for (row, own) in self.squares[..own].chunks(self.side).enumerate() {
            let at = (face * buffer.side + j * self.side + row) * buffer.side + i * self.side;
            buffer.squares[at..at + self.side].iter_mut().zip(own).for_each(|(to, from)| *to = moved(from));
        }
        buffer.squares.extend(self.squares[own..].iter().map(moved));
        buffer.entries.extend(self.entries.into_iter().map(|e| Entry { facet: e.facet + first_facet, ..e }));
    }
}

/// Draws one tile, square by square.
struct Rasterizer<'a> {
    /// The nearest first.
    projections: &'a [Projection],
    tile: Tile,
    /// Where lists of facets stand, which several squares share.
    written: FxHashMap<Vec<u32>, u32>,
    /// Squares and entries at which dividing ends.
    room: usize,
}

impl Rasterizer<'_> {
    /// Those of `list`, indices of projections, that a ray through the window may meet first, in their order.
    fn visible(&self, list: &[u32], window: &Window) -> Vec<u32> {
        let mut visible = Vec::new();
        let mut end = f64::INFINITY;
        for &k in list {
            let projection = &self.projections[k as usize];
            // In order of depth: all that follow begin behind a facet that fills the window.
            if projection.near > end {
                break;
            }
            if projection.overlaps(window) {
                visible.push(k);
                if projection.fills(window) {
                    end = end.min(projection.far);
                }
            }
        }
        // A facet that fills may come after some that begin nearer, and ends those that were taken between.
        visible.retain(|&k| self.projections[k as usize].near <= end);
        visible
    }

    /// Writes all squares of this window, `side` × `side` from column and row `at` of the tile on; `list` holds what it may see.
    fn divide_tile(&mut self, list: Vec<u32>, window: &Window, at: [usize; 2], side: usize) {
        if list.is_empty() {
            return;
        }
        if side == 1 {
            return self.write_square(list, window, at[1] * self.tile.side + at[0], 0);
        }
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let part = window.part(2, [i, j]);
            self.divide_tile(
                self.visible(&list, &part),
                &part,
                [at[0] + i * side / 2, at[1] + j * side / 2],
                side / 2,
            );
        }
    }

    /// Writes the facets of the square at index `place`, or divides it where they are more than [`MOST_ENTRIES`]; not after
    /// [`MOST_DIVISIONS`], of which `depth` are above, nor beyond `room`. `list` holds the projections that the window may see, by index,
    /// the nearest first.
    fn write_square(&mut self, list: Vec<u32>, window: &Window, place: usize, depth: u32) {
        let tile = &mut self.tile;
        if list.len() <= MOST_ENTRIES
            || depth == MOST_DIVISIONS
            || tile.squares.len() + tile.entries.len() > self.room
        {
            let count = list.len() as u32;
            // Neighbouring squares mostly see the same facets, so that many share one list.
            let first = *self.written.entry(list).or_insert_with_key(|list| {
                let first = tile.entries.len() as u32;
                tile.entries.extend(list.iter().map(|&k| {
                    let projection = &self.projections[k as usize];
                    // Downward, so that rounding to `f32` never skips an entry.
                    Entry { near: (projection.near as f32).next_down(), facet: k }
                }));
                first
            });
            tile.squares[place] = Square { first, count };
            return;
        }
        let first = tile.squares.len();
        tile.squares[place] = Square { first: first as u32, count: DIVIDED };
        tile.squares.resize(first + DIVISIONS * DIVISIONS, Square::default());
        for j in 0..DIVISIONS {
            for i in 0..DIVISIONS {
                let part = window.part(DIVISIONS, [i, j]);
                let visible = self.visible(&list, &part);
                self.write_square(visible, &part, first + j * DIVISIONS + i, depth + 1);
            }
        }
    }
}
