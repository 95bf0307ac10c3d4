//! Faces of two solids that lie on each other are faceted once: a cemented doublet, a rod in its hole, a ring in its groove, a ball in
//! its cup. Faceted apart, they overlap and gap by the sag of both, and light is lost between them.
//!
//! Where a face (the guest) lies on another (the carrier) within [`Settings::glue_mm`], whatever their parametrisations, the guest's border
//! is imprinted on the carrier: its corners become nodes there, its chords edges that no facet crosses. The guest then takes over the
//! carrier's facets inside its border, turned around, and each is proved anew on the guest's own surface. Where only a part of the guest
//! lies there, the carrier's border is imprinted on the guest too, which keeps facets of its own outside of it. Edges that run together get
//! the samples of both, so that neighbours of either face still meet it, and those that run inside the other face chords short enough for
//! it. Of a chain of faces, where each touches the next, every other one carries, and a guest may have several carriers.
//!
//! Guarantee: where they touch, a guest has the carrier's facets exactly, but for its own border's corners, which may lie off the carrier
//! by the glue distance; shells stay closed, as a guest whose facets do not fill its border side on side keeps its own. Known weakness:
//! where faces touch in a circle of odd length, as where bodies overlap, two of them are faceted apart.

mod closure;
mod detection;
mod guest;
mod projector;
mod samples;
mod shared_part;
mod trimmed;

use super::assemble::{PartMesh, face_with_surface, mesh_face, with_coincident_vertices_joined};
use super::border::edges;
use super::border::polygons::{self, ImprintedPoints};
use super::face::{FaceInput, mesh_with_imprint};
use super::face_mesh::FaceMesh;
use super::imprint::{CarrierFacets, Imprint};
use super::placed_part::PlacedPart;
use super::previous_round::Renumbering;
use super::settings::Settings;
use super::taken_chords::TakenChords;
use crate::math::{Aabb, Point};
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

/// A meshed carrier.
struct Carrier {
    key: FaceKey,
    mesh: Option<FaceMesh>,
    facets: CarrierFacets,
    /// Its guests, and the number of the first corner of each in the carrier's imprint.
    guests: Vec<(FaceKey, usize)>,
}

/// A carrier as one of its guests sees it.
struct Share<'s, 'm> {
    carrier: &'s TrimmedFace<'m>,
    facets: &'s CarrierFacets,
    extent: Extent,
    /// Number of the guest's first corner in the carrier's imprint.
    first: usize,
}

/// Rounds in which faces take samples over from each other: what comes from the one goes on to the next.
const ROUNDS: usize = 4;

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
        }
        let pairs = self.neighbours();
        // A pair that meets no other is done after one round.
        let rounds = if pairs.len() > self.contacts.len() { ROUNDS } else { 1 };
        for _ in 0..rounds {
            let before = samples.clone();
            for &[a, b] in &pairs {
                let (Some(a), Some(b)) = (self.edge_samples(a), self.edge_samples(b)) else { continue };
                // Both ways: after this both edges have the samples of either.
                a.take_over(&b, glue, &mut samples);
                b.take_over(&a, glue, &mut samples);
            }
            if samples == before {
                break;
            }
        }
        samples
    }

    /// Returns the pairs of faces whose edges may run together: those in contact, and those with a partner in common whose boxes meet.
    fn neighbours(&self) -> Vec<[FaceKey; 2]> {
        let mut partners: FxHashMap<FaceKey, Vec<FaceKey>> = FxHashMap::default();
        for c in self.contacts {
            partners.entry(c.carrier).or_default().push(c.guest);
            partners.entry(c.guest).or_default().push(c.carrier);
        }
        let bounds = |key: &FaceKey| Aabb::from_points(self.faces[key].samples.iter().copied());
        let mut siblings: Vec<[FaceKey; 2]> = Vec::new();
        for around in partners.values().filter(|around| around.len() > 1) {
            let boxes: Vec<Aabb> = around.iter().map(|key| bounds(key).grown(self.settings.glue_mm)).collect();
            for (i, a) in around.iter().enumerate() {
                let meeting = (i + 1..around.len()).filter(|&j| !boxes[i].intersection(boxes[j]).is_empty());
                siblings.extend(meeting.map(|j| [*a.min(&around[j]), *a.max(&around[j])]));
            }
        }
        siblings.sort_unstable();
        siblings.dedup();
        self.contacts.iter().map(|c| [c.carrier, c.guest]).chain(siblings).collect()
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
                    meetings: &before.meetings,
                    untangles: false,
                })
            };
            let meshes = before.faces.par_iter().enumerate().map(renew).collect();
            let (causes, meetings) = (before.causes.clone(), before.meetings.clone());
            Some((i, PartMesh { divisions, shared, faces: meshes, causes, taken, meetings }))
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
            meetings: &mesh.meetings,
            untangles: false,
        }
    }

    /// Replaces, in `meshes`, the faces in contact: first carriers, then guests, in parallel.
    fn mesh_carriers_and_guests(&self, meshes: &mut FxHashMap<usize, PartMesh>) {
        let now = &*meshes;
        let mut guests: FxHashMap<FaceKey, Vec<&Contact>> = FxHashMap::default();
        self.contacts.iter().for_each(|c| guests.entry(c.guest).or_default().push(c));
        let border = |(&key, contacts): (&FaceKey, &Vec<&Contact>)| {
            let carriers: Vec<&TrimmedFace<'_>> = contacts.iter().map(|c| &self.faces[&c.carrier]).collect();
            (key, self.guest(&self.faces[&key], &carriers, &now[&key.instance]))
        };
        let borders: FxHashMap<FaceKey, Guest<'_, '_>> = guests.par_iter().map(border).collect();
        let groups: Vec<&[Contact]> = self.contacts.chunk_by(|a, b| a.carrier == b.carrier).collect();
        let carriers: Vec<Carrier> =
            groups.par_iter().map(|group| self.mesh_carrier(group, &borders, now)).collect();
        let share = |c: &Contact| {
            let found = carriers.binary_search_by_key(&c.carrier, |carrier| carrier.key).ok()?;
            let Carrier { facets, guests, .. } = &carriers[found];
            let (_, first) = *guests.iter().find(|(key, _)| *key == c.guest)?;
            Some(Share { carrier: &self.faces[&c.carrier], facets, extent: c.extent, first })
        };
        let made = |(key, contacts): (&FaceKey, &Vec<&Contact>)| {
            let shares: Vec<Share<'_, '_>> = contacts.iter().filter_map(|c| share(c)).collect();
            let guest = &borders[key];
            let taken = self.guest_mesh(guest, &shares, now);
            // Where not all fit together, the first may.
            let taken =
                taken.or_else(|| self.guest_mesh(guest, shares.get(..1).filter(|_| shares.len() > 1)?, now));
            (*key, taken.or_else(|| mesh_face(&self.input(guest.face, &now[&key.instance]))))
        };
        let made: Vec<(FaceKey, Option<FaceMesh>)> = guests.par_iter().map(made).collect();
        let carriers = carriers.into_iter().map(|c| (c.key, c.mesh));
        for (key, mesh) in carriers.chain(made) {
            if let Some(part) = meshes.get_mut(&key.instance) {
                part.faces[key.face] = mesh;
            }
        }
    }

    /// Meshes a carrier with its guests' borders imprinted; one for which that fails as without a contact, without facets for its guests.
    /// The contacts of `group` have one carrier.
    fn mesh_carrier(
        &self,
        group: &[Contact],
        borders: &FxHashMap<FaceKey, Guest<'_, '_>>,
        meshes: &FxHashMap<usize, PartMesh>,
    ) -> Carrier {
        let carrier = &self.faces[&group[0].carrier];
        let carrier_mesh = &meshes[&carrier.key.instance];
        let mut imprint = Imprint { segments: Vec::new(), near: self.settings.glue_mm };
        let mut guests: Vec<(FaceKey, usize)> = Vec::new();
        let mut first = 0;
        for c in group {
            let guest = &borders[&c.guest];
            guest.imprint(carrier, c.extent, first, &mut imprint);
            guests.push((c.guest, first));
            first += guest.places.len();
        }
        let made = mesh_with_imprint(&self.input(carrier, carrier_mesh), &imprint);
        let (mesh, facets) = match made {
            Ok((mut mesh, facets)) if facets.holds_imprint => {
                // The facets were made tighter for the guests' sake; they are measured
                // by the tolerance requested for this face.
                for f in &mut mesh.facets {
                    f.tolerance = carrier.asked_tolerance(f, &mesh.corners);
                }
                (Some(mesh), facets)
            }
            // Each by itself, as without a contact.
            _ => (mesh_face(&self.input(carrier, carrier_mesh)), CarrierFacets::default()),
        };
        Carrier { key: carrier.key, mesh, facets, guests }
    }

    /// Meshes a guest with its carriers' facets and, of a contact in part, its own elsewhere; `None` where they do not fill its border, and
    /// where its own are repaired.
    fn guest_mesh(
        &self,
        guest: &Guest<'_, 'm>,
        shares: &[Share<'_, 'm>],
        meshes: &FxHashMap<usize, PartMesh>,
    ) -> Option<FaceMesh> {
        let mesh = &meshes[&guest.face.key.instance];
        let takes =
            shares.iter().map(|s| guest::taken_facets(guest, s.carrier, s.facets, s.first, mesh, self.settings));
        let mut takes: Vec<(FaceMesh, SideCounts)> = takes.collect();
        if shares.iter().any(|s| s.extent == Extent::Whole) {
            let (taken, border) = takes.pop()?;
            return SideCounts::of_facets(&taken).fill(&border).then_some(taken);
        }
        let near = self.settings.glue_mm;
        let carriers: Vec<Guest<'_, '_>> =
            shares.iter().map(|s| self.guest(s.carrier, &[guest.face], &meshes[&s.carrier.key.instance])).collect();
        let mut imprint = Imprint { segments: Vec::new(), near };
        let mut first = 0;
        for carrier in &carriers {
            carrier.imprint(guest.face, Extent::Part, first, &mut imprint);
            first += carrier.places.len();
        }
        let (own, lines) = mesh_with_imprint(&self.input(guest.face, mesh), &imprint).ok()?;
        let taken: Vec<FaceMesh> = takes.into_iter().map(|(taken, _)| taken).collect();
        // What was repaired has no facets that others could meet.
        let is_sound =
            lines.holds_imprint && own.repaired.is_none() && taken.iter().all(|taken| !taken.facets.is_empty());
        if is_sound { shared_part::joined(guest, &carriers, &own, &taken, mesh, near) } else { None }
    }

    /// Builds the border of a face on the divisions of `mesh`, its part, with corners where its seams cross those of its carriers.
    fn guest<'f>(
        &self,
        face: &'f TrimmedFace<'m>,
        carriers: &[&TrimmedFace<'_>],
        mesh: &PartMesh,
    ) -> Guest<'f, 'm> {
        let near = self.settings.glue_mm;
        let build = |points: &[Point]| {
            let imprinted = ImprintedPoints { points, near };
            polygons::build(face.part, &face.loops, &face.surface, &mesh.divisions, &imprinted)
        };
        // First without: only the border's corners show where its seams run.
        let polygons = build(&[]);
        let mut points = Vec::new();
        for p in &polygons.polygons {
            for k in (0..p.len()).filter(|&k| p[k].side == polygons::BorderSide::Seam) {
                let (a, b) = (p[k].uv, p[(k + 1) % p.len()].uv);
                let place = |f: f64| face.surface.point(a.lerp(b, f));
                for carrier in carriers {
                    let on_carrier = |f: f64| carrier.project(face.frame.point(place(f))).0;
                    for d in (0..2).filter(|&d| carrier.surface.closed[d]) {
                        points.extend(samples::seam_crossing(carrier, d, [0.0, 1.0], on_carrier).map(place));
                    }
                }
            }
        }
        let polygons = if points.is_empty() { polygons } else { build(&points) };
        Guest::new(face, polygons, mesh)
    }
}
