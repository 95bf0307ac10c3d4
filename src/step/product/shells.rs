//! Faces into shells, and shells into solids, as their plans say; what cannot be as a plan says is repaired and reported.

use super::numbering::{ConvertedPart, repair_note};
use super::orientation::{FaceBoxes, faces_against_neighbours, is_inside_out};
use super::repeated_faces::{RepeatedFace, remove_repeated_faces};
use super::shell_pieces::{SolidFaces, has_border, separate_solids};
use super::styles::Styles;
use super::topology::{ShapeItems, ShellPlan};
use crate::model::{Face, Part, Shell};
use crate::step::geometry::GeometryReader;
use crate::text::count_of;
use rustc_hash::{FxHashMap, FxHashSet};

/// Puts the faces into shells of the part; faces that contradict their neighbours, and shells of a solid that are inside out, are turned
/// and listed as repaired, as are faces that stand where another one of their shell does. Closed shells of several pieces become several,
/// and what only calls itself closed is open. Shells without a face are left out.
pub(super) fn add_shells(
    geometry: &GeometryReader<'_, '_>,
    items: &ShapeItems,
    mut faces: FxHashMap<u64, Face>,
    styles: &Styles,
    part: &mut Part,
    out: &mut ConvertedPart,
) {
    // A face moves into the last shell that has it, and is copied into those before.
    let mut left: FxHashMap<u64, usize> = FxHashMap::default();
    items.shells.iter().flat_map(|s| &s.faces).for_each(|f| *left.entry(f.0).or_default() += 1);
    let mut removed: FxHashSet<u64> = FxHashSet::default();
    let mut solids = SolidShells {
        geometry,
        styles,
        solids: Vec::new(),
        boxes: Vec::new(),
        beside: Vec::new(),
        is_whole: false,
    };
    for plan in &items.shells {
        let layer = plan.owners.iter().find_map(|o| styles.layer(*o));
        let mut own: Vec<Face> = Vec::with_capacity(plan.faces.len());
        for (id, flip) in &plan.faces {
            let uses = left.entry(*id).or_default();
            *uses = uses.saturating_sub(1);
            let face = if *uses == 0 { faces.remove(id) } else { faces.get(id).cloned() };
            let Some(mut face) = face else { continue };
            face.reversed ^= flip;
            face.layer = face.layer.or_else(|| layer.clone());
            own.push(face);
        }
        // Only for a whole shell does the volume decide which way it faces.
        let is_whole = plan.whole && own.len() == plan.faces.len();
        removed.extend(mend_faces(geometry, &mut own, part, out));
        if plan.void {
            solids.add_void(plan, own, is_whole, out);
        } else {
            solids.finish(part);
            solids.add_outer(plan, own, is_whole, part, out);
        }
    }
    solids.finish(part);
    // One that stands in another shell counts all the same.
    let standing = part.shells.iter().flat_map(|shell| &shell.faces).filter_map(|face| face.entity);
    for id in standing {
        removed.remove(&id);
    }
    out.found = out.found.saturating_sub(removed.len());
}

/// Shells of the solid whose voids are still to come, or of the solids that its faces are.
struct SolidShells<'r, 'f, 'a> {
    geometry: &'r GeometryReader<'f, 'a>,
    styles: &'r Styles,
    /// Of each solid its outer shell, and those of its voids.
    solids: Vec<Vec<Shell>>,
    /// Boxes of their outer shells, once a void asks for them.
    boxes: Vec<FaceBoxes>,
    /// Shells that are voids by the file's word and lie beside these solids, or have none around them.
    beside: Vec<Shell>,
    /// Whether the file's outer shell has all its faces.
    is_whole: bool,
}

impl SolidShells<'_, '_, '_> {
    /// Moves all shells into the part, each void behind its solid.
    fn finish(&mut self, part: &mut Part) {
        part.shells.extend(self.solids.drain(..).flatten());
        self.boxes.clear();
        part.shells.append(&mut self.beside);
    }

    /// Adds a shell that is no void: a solid, or as many as its faces are, or a sheet.
    fn add_outer(
        &mut self,
        plan: &ShellPlan,
        faces: Vec<Face>,
        is_whole: bool,
        part: &Part,
        out: &mut ConvertedPart,
    ) {
        self.is_whole = is_whole;
        if faces.is_empty() {
            return;
        }
        // A solid is closed whatever its edges say; a sheet in a shell of that name would be a body without an inside.
        let is_open = plan.closed && !plan.outer && is_whole && has_border(&faces, part);
        if is_open {
            self.note(plan, "it is called closed but has a border: it is taken as open", out);
        }
        let closed = plan.closed && !is_open;
        if !(closed && is_whole) {
            self.solids.push(vec![self.shell(plan, faces, closed, false)]);
            return;
        }
        let solids = separate_solids(faces);
        let voids = solids.iter().map(|solid| solid.voids.len()).sum::<usize>();
        if solids.len() + voids > 1 {
            let count = |number: usize, noun: &str| count_of(number as u64, noun);
            let pieces = count(solids.len() + voids, "closed piece");
            let with_voids = if voids > 0 { format!(" with {}", count(voids, "void")) } else { String::new() };
            let solids = count(solids.len(), "solid");
            let reason = format!("its faces are {pieces} without a common edge: taken as {solids}{with_voids}");
            self.note(plan, &reason, out);
        }
        for SolidFaces { outer, voids } in solids {
            let outer = std::iter::once((outer, false));
            let mut shells = Vec::with_capacity(1 + voids.len());
            for (mut faces, void) in outer.chain(voids.into_iter().map(|faces| (faces, true))) {
                if plan.outer {
                    self.turn_if_inside_out(plan, &mut faces, void, out);
                }
                shells.push(self.shell(plan, faces, closed, void));
            }
            self.solids.push(shells);
        }
    }

    /// Adds a shell that is a void by the file's word: to the solid around it, or as one of its own.
    fn add_void(&mut self, plan: &ShellPlan, mut faces: Vec<Face>, is_whole: bool, out: &mut ConvertedPart) {
        if faces.is_empty() {
            return;
        }
        // A void without the shell around it stands alone.
        if self.solids.is_empty() {
            let shell = self.shell(plan, faces, plan.closed, false);
            self.beside.push(shell);
            return;
        }
        // Below a dome that was refused a void is outside of what is left.
        if self.boxes.is_empty() {
            self.boxes = self.solids.iter().map(|shells| FaceBoxes::new(&shells[0].faces)).collect();
        }
        let own = FaceBoxes::new(&faces);
        let may_hold = |k: &usize| !self.is_whole || self.boxes[*k].may_enclose(&own);
        let size = |k: &usize| self.boxes[*k].diagonal();
        let holder = (0..self.solids.len()).filter(may_hold).min_by(|a, b| size(a).total_cmp(&size(b)));
        if holder.is_none() {
            // Of four pipes in a row, three of them voids of the first, light lost a fifth.
            let reason = "a void lies outside of the shell that it is in: it is taken as a solid of its own";
            self.note(plan, reason, out);
        }
        if is_whole {
            self.turn_if_inside_out(plan, &mut faces, holder.is_some(), out);
        }
        let shell = self.shell(plan, faces, plan.closed, holder.is_some());
        match holder {
            Some(k) => self.solids[k].push(shell),
            None => self.beside.push(shell),
        }
    }

    /// Turns the faces of a whole shell of a solid that certainly looks the wrong way, and reports it.
    fn turn_if_inside_out(&self, plan: &ShellPlan, faces: &mut [Face], void: bool, out: &mut ConvertedPart) {
        if is_inside_out(faces, void) {
            faces.iter_mut().for_each(|face| face.reversed ^= true);
            // Rays would enter where they should leave: one such file lost 857 of 50,000, one with a void 465 of 100,000.
            let reason =
                if void { "the shell of a void was inside out" } else { "the shell of a solid was inside out" };
            self.note(plan, reason, out);
        }
    }

    /// Tells a repair of a plan's shell.
    fn note(&self, plan: &ShellPlan, reason: &str, out: &mut ConvertedPart) {
        let note = |owner: &u64| repair_note(self.geometry.file, *owner, reason.into());
        out.repaired.extend(plan.owners.first().map(note));
    }

    /// Makes a shell with the name and the colour of its plan.
    fn shell(&self, plan: &ShellPlan, faces: Vec<Face>, closed: bool, void: bool) -> Shell {
        let colour = plan.owners.iter().find_map(|o| self.styles.colour(*o));
        Shell { faces, closed, void, colour, name: plan.name.clone() }
    }
}

/// Leaves out the faces of a shell that stand where others do, turns those that contradict their neighbours, and notes both in `out`.
/// Returns the entities that it leaves out.
fn mend_faces(
    geometry: &GeometryReader<'_, '_>,
    faces: &mut Vec<Face>,
    part: &Part,
    out: &mut ConvertedPart,
) -> Vec<u64> {
    let file = geometry.file;
    let mut removed = Vec::new();
    for RepeatedFace { id, standing } in remove_repeated_faces(faces, part, geometry.units) {
        let (Some(id), Some(standing)) = (id, standing) else { continue };
        let reason = format!("it stands where #{standing} does: it is left out");
        out.repaired.push(repair_note(file, id, reason));
        removed.push(id);
    }
    for k in faces_against_neighbours(faces) {
        faces[k].reversed ^= true;
        let reason = "its sense contradicts its edges, which run against those of its neighbours: the edges decide";
        out.repaired.extend(faces[k].entity.map(|id| repair_note(file, id, reason.into())));
    }
    removed
}
