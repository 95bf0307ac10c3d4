//! Faces of two solids that lie on each other are faceted once: a cemented doublet, a rod in its hole, a ring in its groove, a ball in
//! its cup. Faceted apart, they overlap and gap by the sag of both, and light is lost between them.
//!
//! Where a face (the guest) lies on another (the carrier) within [`Settings::glue_mm`], whatever their parametrisations, the guest's border
//! is imprinted on the carrier: its corners become nodes there, its chords edges that no facet crosses. The guest then takes over the
//! carrier's facets inside its border, turned around, and each is proved anew on the guest's own surface. Where only a part of the guest
//! lies there, the carrier's border is imprinted on the guest too, which keeps facets of its own outside of it. Edges that run together get
//! the samples of both, so that neighbours of either face still meet it, and those that run inside the other face chords short enough for
//! it.
//!
//! Guarantee: where they touch, a guest has the carrier's facets exactly, but for its own border's corners, which may lie off the carrier
//! by the glue distance; shells stay closed, as a guest whose facets do not fill its border side on side keeps its own. Known weakness: a
//! face has one carrier, so of three that touch in turn two are faceted apart.

mod closure;
mod detection;
mod guest;
mod projector;
mod samples;
mod shared_part;
mod trimmed;

use super::assemble::{PartMesh, Renumbering, face_with_surface, mesh_face, with_coincident_vertices_joined};
use super::border::edges;
use super::border::polygons::{self, ImprintedPoints};
use super::face::{FaceInput, mesh_with_imprint};
use super::face_mesh::FaceMesh;
use super::imprint::{CarrierFacets, Imprint};
use super::placed_part::PlacedPart;
use super::settings::Settings;
use super::taken_chords::TakenChords;
use crate::math::Point;
use crate::model::{Face, Model};
use closure::SideCounts;
use detection::{Contact, Extent};
use guest::Guest;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use samples::{ContactSamples, EdgeSamples};
use trimmed::{FaceKey, TrimmedFace};

/// Meshes anew, by index, the instances with faces in contact; all others have the mesh of their part. Empty at a glue distance of 0 or
/// less.
pub(super) fn mesh_contacts(
    model: &Model,
    places: &[PlacedPart<'_>],
    settings: &Settings,
    parts: &[Option<PartMesh>],
) -> FxHashMap<usize, PartMesh> {
    if settings.glue_mm <= 0.0 {
        return FxHashMap::default();
    }
    let (contacts, faces) = detection::contacts(model, places, settings, parts);
    if contacts.is_empty() {
        return FxHashMap::default();
    }
    let joiner = Joiner { model, places, settings, parts, contacts: &contacts, faces: &faces };
    let samples = joiner.contact_samples();
    let mut meshes = joiner.divided_anew(&samples);
    joiner.mesh_carriers_and_guests(&mut meshes);
    meshes.into_iter().map(|(i, mesh)| (i, with_coincident_vertices_joined(mesh))).collect()
}

/// The parts with the faces that touch.
struct Joiner<'j, 'm> {
    model: &'m Model,
    /// By part.
    places: &'j [PlacedPart<'m>],
    settings: &'j Settings,
    parts: &'j [Option<PartMesh>],
    contacts: &'j [Contact],
    faces: &'j FxHashMap<FaceKey, TrimmedFace<'m>>,
}

/// A guest among those of one carrier.
struct Member<'f, 'm> {
    guest: Guest<'f, 'm>,
    extent: Extent,
    /// Number of its first corner in the carrier's imprint.
    first: usize,
}

impl<'j, 'm> Joiner<'j, 'm> {
    /// Returns the mesh of an instance's part before contacts; `None` if it was not meshed.
    fn mesh_of(&self, instance: usize) -> Option<&'j PartMesh> {
        self.parts[self.model.instances[instance].part.0 as usize].as_ref()
    }

    /// Returns the edges of a face with the divisions before contacts; `None` for a face that is in no contact.
    fn edge_samples(&self, key: FaceKey) -> Option<EdgeSamples<'j, 'm>> {
        Some(EdgeSamples { face: self.faces.get(&key)?, divisions: &self.mesh_of(key.instance)?.divisions })
    }

    /// Returns the parameters that edges must have: their own, where they cross seams or borders of the other face, where their chords are
    /// too long for its facets, and the samples of edges that run together.
    fn contact_samples(&self) -> ContactSamples {
        let glue = self.settings.glue_mm;
        let mut samples = ContactSamples::default();
        for c in self.contacts {
            let (Some(carrier), Some(guest)) = (self.edge_samples(c.carrier), self.edge_samples(c.guest)) else {
                continue;
            };
            guest.shorten_chords(carrier.face, glue, &mut samples);
            guest.cross_seams(carrier.face, glue, &mut samples);
            if c.extent == Extent::Part {
                carrier.shorten_chords(guest.face, glue, &mut samples);
                carrier.cross_seams(guest.face, glue, &mut samples);
                guest.cross_edges(&carrier, glue, &mut samples);
                carrier.cross_edges(&guest, glue, &mut samples);
            }
            // Both ways: after this both edges have the samples of either.
            carrier.take_over(&guest, glue, &mut samples);
            guest.take_over(&carrier, glue, &mut samples);
        }
        samples
    }

    /// Returns the meshes of all instances in contact, by instance, with their edges divided at `samples`. Faces beside changed edges are
    /// meshed anew; those in contact keep the old mesh, renumbered, until their turn.
    fn divided_anew(&self, samples: &ContactSamples) -> FxHashMap<usize, PartMesh> {
        let mut instances: Vec<usize> =
            self.contacts.iter().flat_map(|c| [c.carrier.instance, c.guest.instance]).collect();
        instances.sort_unstable();
        instances.dedup();
        let divide = |&i: &usize| {
            let part = self.model.part(self.model.instances[i].part);
            let before = self.mesh_of(i)?;
            let own = || before.divisions.iter().map(|d| d.t.clone()).collect();
            let (divisions, shared) = edges::sample_positions(part, samples.get(&i).cloned().unwrap_or_else(own));
            let renumbering = Renumbering::new(part, (&before.divisions, before.shared.len()), &divisions);
            let faces: Vec<&Face> = part.shells.iter().flat_map(|s| &s.faces).collect();
            let taken: Vec<TakenChords> = before.taken.iter().map(|t| renumbering.renumbered_chords(t)).collect();
            let renew = |(k, old): (usize, &Option<FaceMesh>)| {
                let key = FaceKey { instance: i, face: k };
                let changed = faces[k].loops.iter().flat_map(|l| &l.uses).any(|u| renumbering.has_changed(u.edge));
                // Carriers and guests are meshed later.
                if !changed || self.faces.contains_key(&key) {
                    return old.clone().map(|m| renumbering.renumbered(m));
                }
                let placed = &self.places[self.model.instances[i].part.0 as usize];
                let (face, surface) = face_with_surface(placed, self.settings, k)?;
                mesh_face(&FaceInput {
                    part,
                    face,
                    surface: &surface,
                    divisions: &divisions,
                    shared: &shared,
                    settings: self.settings,
                    taken: &taken[k],
                })
            };
            let meshes = before.faces.par_iter().enumerate().map(renew).collect();
            let causes = before.causes.clone();
            Some((i, PartMesh { divisions, shared, faces: meshes, causes, taken }))
        };
        // Instances, not parts: another instance of the same part may touch nothing.
        instances.par_iter().filter_map(divide).collect()
    }

    /// Makes the input for meshing a face on the edge divisions of `mesh`, its part, without the chords that it has given up to others
    /// there.
    fn input<'i>(&'i self, face: &'i TrimmedFace<'m>, mesh: &'i PartMesh) -> FaceInput<'i, 'm> {
        FaceInput {
            part: face.part,
            face: face.face,
            surface: &face.surface,
            divisions: &mesh.divisions,
            shared: &mesh.shared,
            settings: self.settings,
            taken: &mesh.taken[face.key.face],
        }
    }

    /// Replaces, in `meshes`, the faces in contact: each carrier with its guests is one group, and groups run in parallel.
    fn mesh_carriers_and_guests(&self, meshes: &mut FxHashMap<usize, PartMesh>) {
        let groups: Vec<&[Contact]> = self.contacts.chunk_by(|a, b| a.carrier == b.carrier).collect();
        let now = &*meshes;
        let made: Vec<Vec<(FaceKey, Option<FaceMesh>)>> =
            groups.par_iter().map(|group| self.mesh_group(group, now)).collect();
        for (key, mesh) in made.into_iter().flatten() {
            if let Some(part) = meshes.get_mut(&key.instance) {
                part.faces[key.face] = mesh;
            }
        }
    }

    /// Meshes a carrier with its guests' borders imprinted, and then its guests with its facets. A face for which that fails is meshed as
    /// without a contact; `None` where that fails too. The contacts of `group` have one carrier.
    fn mesh_group(
        &self,
        group: &[Contact],
        meshes: &FxHashMap<usize, PartMesh>,
    ) -> Vec<(FaceKey, Option<FaceMesh>)> {
        let carrier = &self.faces[&group[0].carrier];
        let carrier_mesh = &meshes[&carrier.key.instance];
        let mut imprint = Imprint { segments: Vec::new(), near: self.settings.glue_mm };
        let mut members: Vec<Member<'_, '_>> = Vec::new();
        let mut first = 0;
        for c in group {
            let face = &self.faces[&c.guest];
            let guest = self.guest(face, carrier, &meshes[&face.key.instance]);
            guest.imprint(carrier, c.extent, first, &mut imprint);
            let next = first + guest.len();
            members.push(Member { guest, extent: c.extent, first });
            first = next;
        }
        let made = mesh_with_imprint(&self.input(carrier, carrier_mesh), &imprint);
        let (mesh, facets) = match made {
            Ok((mut mesh, facets)) if facets.holds_imprint => {
                // The facets were made tighter for the guests' sake; what was asked of this face is what they are
                // measured by.
                for f in &mut mesh.facets {
                    f.tolerance = carrier.asked_tolerance(f, &mesh.corners);
                }
                (Some(mesh), facets)
            }
            // Each by itself, as without a contact.
            _ => (mesh_face(&self.input(carrier, carrier_mesh)), CarrierFacets::default()),
        };
        let mut out = vec![(carrier.key, mesh)];
        for member in &members {
            let face = member.guest.face;
            let taken = self.guest_mesh(member, carrier, &facets, meshes);
            let made = taken.or_else(|| mesh_face(&self.input(face, &meshes[&face.key.instance])));
            out.push((face.key, made));
        }
        out
    }

    /// Meshes a guest with its carrier's facets and, of a contact in part, its own elsewhere; `None` where they do not fill its border, and
    /// where its own are repaired.
    fn guest_mesh(
        &self,
        member: &Member<'_, 'm>,
        carrier: &TrimmedFace<'m>,
        facets: &CarrierFacets,
        meshes: &FxHashMap<usize, PartMesh>,
    ) -> Option<FaceMesh> {
        let Member { guest, extent, first } = member;
        let mesh = &meshes[&guest.face.key.instance];
        let (taken, border) = guest::taken_facets(guest, carrier, facets, *first, mesh, self.settings);
        if *extent == Extent::Whole {
            return SideCounts::of_facets(&taken).fill(&border).then_some(taken);
        }
        let near = self.settings.glue_mm;
        let carrier = self.guest(carrier, guest.face, &meshes[&carrier.key.instance]);
        let mut imprint = Imprint { segments: Vec::new(), near };
        carrier.imprint(guest.face, Extent::Part, 0, &mut imprint);
        let (own, lines) = mesh_with_imprint(&self.input(guest.face, mesh), &imprint).ok()?;
        // What was repaired has no facets that others could meet.
        let is_sound = lines.holds_imprint && own.repaired.is_none() && !taken.facets.is_empty();
        if is_sound { shared_part::joined(guest, &carrier, &own, &taken, mesh, near) } else { None }
    }

    /// Builds the border of a face on the divisions of `mesh`, its part, with corners where its seams cross the carrier's.
    fn guest<'f>(&self, face: &'f TrimmedFace<'m>, carrier: &TrimmedFace<'_>, mesh: &PartMesh) -> Guest<'f, 'm> {
        let near = self.settings.glue_mm;
        let build = |points: &[Point]| {
            let imprinted = ImprintedPoints { points, near };
            polygons::build(face.part, &face.loops, &face.surface, &mesh.divisions, &imprinted)
        };
        // First without: only the border's corners tell where its seams run.
        let polygons = build(&[]);
        let mut points = Vec::new();
        for p in &polygons.polygons {
            for k in (0..p.len()).filter(|&k| p[k].side == polygons::BorderSide::Seam) {
                let (a, b) = (p[k].uv, p[(k + 1) % p.len()].uv);
                let place = |f: f64| face.surface.point(a.lerp(b, f));
                let on_carrier = |f: f64| carrier.project(face.frame.point(place(f))).0;
                for d in (0..2).filter(|&d| carrier.surface.closed[d]) {
                    points.extend(samples::seam_crossing(carrier, d, [0.0, 1.0], on_carrier).map(place));
                }
            }
        }
        let polygons = if points.is_empty() { polygons } else { build(&points) };
        Guest::new(face, polygons, mesh)
    }
}
