//! The mesher of truck-meshalgo as the baseline: triangles of one tolerance everywhere.

use super::export::{TruckFace, faces_to_truck};
use super::geometry::{point, vector};
use super::modeling::{Shell as TruckShell, Surface};
use crate::math::{FaceId, Point, Uv};
use crate::mesh::{Facet, FacetMesh, MeshVertex};
use crate::model::Model;
use rustc_hash::FxHashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};
use truck_meshalgo::prelude::{Invertible, MeshableShape, PolygonMesh, RobustMeshableShape, StandardVertex};

/// Tolerance below which truck's mesher refuses to work, mm.
const SMALLEST: f64 = 1e-6;

/// Time that truck may take for a whole shell. It does not come to an end on some poles: of the biconvex lens of the fixtures, at 0.05 mm,
/// there was nothing after 100 s.
const SHELL: Duration = Duration::from_secs(20);
/// Time that truck may take for one face.
const FACE: Duration = Duration::from_secs(2);
/// Time that truck may take for a model.
const MODEL: Duration = Duration::from_secs(60);

/// Name of the threads that truck's mesher runs in: a panic there is a face without triangles and no more.
pub const THREAD: &str = "truck";

/// Result of truck's mesher on a model.
#[derive(Clone, Debug)]
pub struct Baseline {
    /// Triangles with truck's normals; [`FacetMesh::sag`] is empty.
    pub mesh: FacetMesh,
    /// Seconds of meshing alone, conversion left out.
    pub seconds: f64,
    /// Placed faces without a triangle, and why.
    pub failed: Vec<(FaceId, String)>,
}

/// Meshes the surfaces of a model by `truck_meshalgo` with one chordal tolerance in mm, at least 1e-6, in the scene's coordinates. Faces
/// that are meshes already are left out.
///
/// A face that makes truck panic is caught and listed in [`Baseline::failed`]; the panic's message goes to the panic hook, in a thread
/// named [`THREAD`]. So is one on which truck takes too long; the thread that works on it cannot be stopped and goes on until the
/// process ends.
pub fn mesh(model: &Model, tolerance: f64) -> Baseline {
    let mut out = Baseline { mesh: FacetMesh::default(), seconds: 0.0, failed: Vec::new() };
    let mut positions = FxHashMap::default();
    let begun = Instant::now();
    for (instance, FaceId(first)) in model.instances.iter().zip(model.first_faces()) {
        let part = model.part(instance.part);
        // Where the faces of each shell start among those of the part.
        let starts: Vec<u32> = part
            .shells
            .iter()
            .scan(first, |next, s| {
                let start = *next;
                *next += s.faces.len() as u32;
                Some(start)
            })
            .collect();
        let id = |shell: usize, face: usize| FaceId(starts[shell] + face as u32);
        let (faces, refused) = faces_to_truck(part, &instance.placement);
        out.failed.extend(refused.into_iter().map(|r| (id(r.shell, r.face), r.reason)));
        // All at once, as truck is meant to be used: its faces then share the points of their edges.
        let start = Instant::now();
        let shell: TruckShell = faces.iter().map(|f| f.truck.clone()).collect();
        // What is left of the model's time, so that a hundred bad shells do not take a hundred times a shell's.
        let left = || MODEL.saturating_sub(begun.elapsed());
        let meshes = triangulate_faces(shell, tolerance, SHELL.min(left())).unwrap_or_else(|| {
            // Each face alone where all together fail: one bad face should not cost the rest.
            let alone = |f: &TruckFace| {
                triangulate_faces([f.truck.clone()].into_iter().collect(), tolerance, FACE.min(left()))?.pop()?
            };
            faces.iter().map(alone).collect()
        });
        out.seconds += start.elapsed().as_secs_f64();
        for (f, mesh) in faces.iter().zip(meshes) {
            let face = id(f.shell, f.face);
            match mesh {
                Some(m) if !m.tri_faces().is_empty() || !m.quad_faces().is_empty() => {
                    append_face(&mut out.mesh, &mut positions, &m, face);
                }
                _ => out.failed.push((face, "truck's mesher gives no triangles, or takes too long".into())),
            }
        }
    }
    out
}

/// Meshes faces together, in mm, within the time limit; a face truck gives up on is `None`, and so is the whole when truck panics or takes
/// too long.
///
/// Faces that truck's standard mesher gives up on (poles of rational B-splines, edges that lie a little off their surface) are
/// tried with its robust one.
fn triangulate_faces(shell: TruckShell, tolerance: f64, limit: Duration) -> Option<Vec<Option<PolygonMesh>>> {
    if limit.is_zero() {
        return None;
    }
    let tolerance = tolerance.max(SMALLEST);
    let work = move || {
        let mut meshes: Vec<Option<PolygonMesh>> = shell
            .triangulation(tolerance)
            .face_iter()
            .map(|f| oriented_mesh(f.surface(), f.orientation()))
            .collect();
        if meshes.iter().any(Option::is_none) {
            // Faces from `faces_to_truck` are rational B-splines, all of them.
            let Some(plain) = shell.try_mapped(
                |p| Some(*p),
                |c| Some(c.clone()),
                |s| if let Surface::NurbsSurface(s) = s { Some(s.clone()) } else { None },
            ) else {
                return meshes;
            };
            for (mesh, f) in meshes.iter_mut().zip(plain.robust_triangulation(tolerance).face_iter()) {
                if mesh.is_none() {
                    *mesh = oriented_mesh(f.surface(), f.orientation());
                }
            }
        }
        meshes
    };
    // Threads of its own: work that does not end would keep those of the process for ever.
    let pool =
        rayon::ThreadPoolBuilder::new().num_threads(rayon::current_num_threads()).thread_name(|_| THREAD.into());
    let pool = pool.build().ok()?;
    let (send, receive) = channel();
    let waiting = move || {
        // The receiver may be gone.
        let _ = send.send(catch_unwind(AssertUnwindSafe(|| pool.install(work))).ok());
    };
    std::thread::Builder::new().name(THREAD.into()).spawn(waiting).ok()?;
    receive.recv_timeout(limit).ok()?
}

/// Returns the mesh as it is, or turned around where its face looks against its surface (`orientation` false).
fn oriented_mesh(mesh: Option<PolygonMesh>, orientation: bool) -> Option<PolygonMesh> {
    mesh.map(|mut m| {
        if !orientation {
            m.invert();
        }
        m
    })
}

/// Appends a face's triangles, and quads as they are. Points with the same bits are one: truck gives those of a common edge with both
/// faces.
fn append_face(out: &mut FacetMesh, known: &mut FxHashMap<[u64; 3], u32>, m: &PolygonMesh, face: FaceId) {
    let mut corner = |v: &StandardVertex| {
        let p = point(m.positions()[v.pos]);
        let position = *known.entry(point_bits(p)).or_insert_with(|| {
            out.positions.push(p);
            out.positions.len() as u32 - 1
        });
        let uv = v.uv.map_or(Uv::ZERO, |i| Uv::new(m.uv_coords()[i].x, m.uv_coords()[i].y));
        // A vertex that truck gave no normal keeps none, as everything truck made is shown as it was made.
        let normal = v.nor.map(|i| vector(m.normals()[i])).unwrap_or_default();
        out.vertices.push(MeshVertex { position, normal, uv });
        out.vertices.len() as u32 - 1
    };
    let mut facets = Vec::new();
    for t in m.tri_faces() {
        // A triangle is a facet whose last corner stands twice.
        let [a, b, c] = [0, 1, 2].map(|i| corner(&t[i]));
        facets.push([a, b, c, c]);
    }
    for q in m.quad_faces() {
        facets.push([0, 1, 2, 3].map(|i| corner(&q[i])));
    }
    out.facets.extend(facets.into_iter().map(|vertices| Facet { vertices, face }));
}

/// Returns the bits of a point, the same for both zeros.
fn point_bits(p: Point) -> [u64; 3] {
    // Adding zero makes one zero of both.
    p.to_array().map(|x| (x + 0.0).to_bits())
}
