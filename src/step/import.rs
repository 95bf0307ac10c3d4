//! The reading of a file from its bytes to the model and its account.

use super::geometry::Refusal;
use super::geometry::units::{Units, contexts};
use super::part21::{File, in_capitals, parse};
use super::product::asides::{HiddenItems, absent_shapes, external_files, faces_in_sets, void_directions};
use super::product::assembly::{Assembly, PlacedRepresentation};
use super::product::conversion::convert;
use super::product::numbering::ConvertedPart;
use super::product::shared_items::SharedItems;
use super::product::styles::Styles;
use super::product::topology::ShapeItems;
use super::report::{ImportReport, Note};
use super::{Error, ErrorKind, Settings};
use crate::formats;
use crate::math::Aabb;
use crate::model::{Instance, Model, PartId, are_shared};
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use std::hash::Hasher;
use std::path::Path;
use std::time::Instant;

/// A model and the account of how it was read.
#[derive(Clone, Debug)]
pub struct Import {
    /// The shapes, mm.
    pub model: Model,
    /// What was found, converted, repaired and refused.
    pub report: ImportReport,
}

/// Reads a STEP file.
///
/// # Errors
/// When the file cannot be read or is no Part 21 text. Faces that cannot be converted are no error, see
/// [`ImportReport::refusals`].
pub fn read(path: &Path, settings: &Settings) -> Result<Import, Error> {
    let (name, bytes) = read_file(path)?;
    read_bytes(&name, &bytes, settings)
}

/// Reads a file without looking at what it holds; returns the name that messages and the model bear, and the bytes.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn read_file(path: &Path) -> Result<(String, Vec<u8>), Error> {
    let bytes = formats::read_bytes(path)
        .map_err(|source| Error::new(ErrorKind::Io { path: path.to_path_buf(), source }))?;
    Ok((formats::file_name(path), bytes))
}

/// A hash that identifies files, the same on every machine.
pub(super) fn hash_bytes(bytes: &[u8]) -> u64 {
    let mut hasher = FxHasher::default();
    hasher.write(bytes);
    hasher.finish()
}

/// Reads the bytes of a STEP file; `name` is for messages and the model's name.
///
/// ```
/// use lampyris::step::{Settings, read_bytes};
/// assert!(read_bytes("letter.txt", b"Dear Sir or Madam,", &Settings::default()).is_err());
/// ```
///
/// # Errors
/// When the bytes are no Part 21 text, or when its assemblies place more than [`Settings::max_placed`].
pub fn read_bytes(name: &str, bytes: &[u8], settings: &Settings) -> Result<Import, Error> {
    let start = Instant::now();
    let capitals;
    let mut file = parse(name, bytes)?;
    if file.has_small_names() {
        capitals = in_capitals(bytes);
        file = parse(name, &capitals)?;
    }
    let parsed = start.elapsed().as_secs_f64();
    let mut report = ImportReport {
        file: name.to_string(),
        bytes: bytes.len() as u64,
        hash: hash_bytes(bytes),
        ..ImportReport::default()
    };
    report.schema = schema_names(&file);
    for fault in &file.faults {
        let id = fault.id.map_or_else(String::new, |id| format!(" #{id}:"));
        report.problems.push(format!("{name}: line {}:{id} {}", fault.line, fault.what));
    }
    if file.fault_count > file.faults.len() {
        report.problems.push(format!("{} further statements were skipped", file.fault_count - file.faults.len()));
    }
    report.cut_off = !file.is_ended;
    if report.cut_off {
        report.problems.push(format!(
            "{name}: the file ends without END-ISO-10303-21, as one that was cut off does; what is missing is not known: get it whole"
        ));
    }
    let missing = file.missing_ids();
    if let Some(first) = missing.first() {
        // A statement that was skipped stands in the file all the same.
        let is_skipped = file.faults.iter().any(|fault| fault.id == Some(*first));
        let why = if is_skipped { "could not be read" } else { "is not in the file" };
        let others = match missing.len() {
            1 => String::new(),
            count => format!("; there are {count} such"),
        };
        report.problems.push(format!("{name}: #{first} is referred to but {why}{others}"));
    }
    let model = convert_assembly(&file, name, settings, &mut report)?;
    let bounds = if settings.measure_box { model.bounds() } else { Aabb::EMPTY };
    if !bounds.is_empty() {
        report.bbox_mm = Some([bounds.min.to_array(), bounds.max.to_array()]);
    }
    report.seconds.parse = parsed;
    report.seconds.convert = start.elapsed().as_secs_f64() - parsed;
    report.peak_bytes = peak_bytes();
    Ok(Import { model, report })
}

/// Returns the schemas that the file names, in its order; empty without a header.
fn schema_names(file: &File<'_>) -> Vec<String> {
    let Some(args) = file.header("FILE_SCHEMA") else { return Vec::new() };
    let list = args.list(0);
    (0..list.len()).filter_map(|i| list.text(i)).collect()
}

/// Reads the units of all contexts; their names, and units that cannot be read, go into `report`. Returns those by context, and those for a
/// representation without one: the first that name a length, else mm. [`Settings::length_unit_mm`] replaces all lengths.
fn read_units(file: &File<'_>, settings: &Settings, report: &mut ImportReport) -> (FxHashMap<u64, Units>, Units) {
    let ImportReport { units: names, problems, file: name, .. } = report;
    let mut units: FxHashMap<u64, Units> = FxHashMap::default();
    let mut fallback = None;
    let add = |list: &mut Vec<String>, name: Option<String>| {
        list.extend(name.filter(|n| !list.contains(n)));
    };
    for (id, mut assigned) in contexts(file) {
        if let Some(length) = settings.length_unit_mm {
            // The stated uncertainty is in the file's unit of length, and goes with it.
            let accuracy = assigned.units.accuracy.map(|a| a / assigned.units.length * length);
            assigned.units = Units { length, accuracy, ..assigned.units };
        }
        units.insert(id, assigned.units);
        if assigned.length_name.is_some() {
            // A shape without a context of its own is taken to be in the unit that the file names first.
            fallback.get_or_insert(assigned.units);
        }
        for id in assigned.unreadable {
            let unit = format!("{name}: #{id} {}", file.entity_name(id));
            problems.push(format!(
                "{unit} gives no size that a unit could have: mm or radians are taken. unit_mm of a scene's model sets the length"
            ));
        }
        for unit in assigned.contradictory {
            let unit = format!("#{unit} {}", file.entity_name(unit));
            problems.push(format!("{name}: {unit} contradicts an earlier unit of context #{id}, which is used"));
        }
        add(&mut names.length, assigned.length_name);
        add(&mut names.angle, assigned.angle_name);
    }
    if names.length.is_empty() && settings.length_unit_mm.is_none() {
        problems.push(format!(
            "{name}: no unit of length is named: lengths are taken to be in mm. unit_mm of a scene's model sets another"
        ));
    }
    let length = settings.length_unit_mm.unwrap_or(Units::DEFAULT.length);
    (units, fallback.unwrap_or(Units { length, ..Units::DEFAULT }))
}

/// Reads a parsed file's assembly and converts what it places, with all counts and notes in `report`. Fails only where more is placed than
/// [`Settings::max_placed`].
fn convert_assembly(
    file: &File<'_>,
    name: &str,
    settings: &Settings,
    report: &mut ImportReport,
) -> Result<Model, Error> {
    let (units, fallback) = read_units(file, settings, report);
    let assembly = Assembly::read(file, units, fallback);
    // Thirty kilobytes can place a part 2⁴⁰ times: what is counted first need not be expanded.
    let limit = settings.max_placed;
    let too_many = |count: u64| Error::new(ErrorKind::TooManyPlaced { file: name.into(), count, limit });
    let count = assembly.count();
    if count > limit {
        return Err(too_many(count));
    }
    let (placed, mut assembly) = assembly.walk(limit).map_err(too_many)?;
    for (id, reason) in &assembly.left_out {
        // Those without shapes would have given nothing.
        let mut items = ShapeItems::default();
        assembly.items(*id).into_iter().for_each(|item| items.add(file, item));
        if !items.is_empty() {
            report.left_out.push(Note { id: *id, entity: file.entity_name(*id), reason: reason.clone() });
        }
    }
    report.problems.extend(void_directions(file, name));
    report.left_out.extend(external_files(file, name));
    report.problems.extend(assembly.problems.iter().map(|problem| format!("{name}: {problem}")));
    // Whether what pictures show can be converted is known only afterwards.
    let before = assembly.has_pictures().then(|| (placed.clone(), report.clone()));
    let mut model = convert_placed(file, settings, &assembly, placed, report);
    if let Some((placed, before)) = before {
        let refused: FxHashSet<u64> = report.refusals.iter().map(|refusal| refusal.id).collect();
        if !refused.is_empty() && assembly.bring_back_pictures(&placed, &refused) {
            *report = before;
            model = convert_placed(file, settings, &assembly, placed, report);
        }
    }
    count_model(&model, report);
    if report.faces.found == 0 {
        report.problems.push(format!("{name}: {}", absent_shapes(file)));
    }
    Ok(model)
}

/// Converts representations where they are placed, with all counts and notes in `report`.
fn convert_placed(
    file: &File<'_>,
    settings: &Settings,
    assembly: &Assembly<'_, '_>,
    placed: Vec<PlacedRepresentation>,
    report: &mut ImportReport,
) -> Model {
    let mut reader = Reader {
        file,
        styles: Styles::read(file),
        settings,
        model: Model { name: report.file.clone(), ..Model::default() },
        report,
    };
    let mut shared = SharedItems::new(file, assembly, &placed);
    let mut hidden = HiddenItems::new(file);
    // What a representation adds becomes a part where it is placed first; it adds less where another has brought the same.
    let mut parts: FxHashMap<(u64, Vec<u64>), Option<PartFaces>> = FxHashMap::default();
    for p in placed {
        hidden.find_among(p.owners.iter().chain([&p.representation]));
        let key = (p.representation, shared.place(&p));
        let entry = match parts.get(&key) {
            Some(known) => *known,
            None => {
                let items = shared.items(key.0, &key.1);
                let made = reader.convert_representation(assembly.units_of(p.representation), &p, &items);
                hidden.find_among(&items);
                parts.insert(key, made);
                made
            }
        };
        if let Some(part) = entry {
            reader.add_instance(part, p);
        }
    }
    let Reader { mut model, report, .. } = reader;
    number_alike_paths(&mut model.instances);
    let faces = model.parts.iter().flat_map(|p| &p.shells).flat_map(|s| &s.faces);
    let faces = faces.filter_map(|f| f.entity.as_ref());
    let items = parts.keys().flat_map(|(representation, left_out)| shared.items(*representation, left_out));
    report.left_out.extend(faces_in_sets(file, items));
    hidden.find_among(faces);
    report.hidden = hidden.notes(file);
    model
}

/// Numbers instances whose paths are alike from 2 on, as `left/led:2`, in the file's order, so that each path means one.
fn number_alike_paths(instances: &mut [Instance]) {
    let is_shared = are_shared(instances.iter().map(|i| i.path.as_str()));
    if !is_shared.contains(&true) {
        return;
    }
    let mut taken: FxHashSet<String> = instances.iter().map(|i| i.path.clone()).collect();
    let mut uses: FxHashMap<String, u32> = FxHashMap::default();
    for (instance, _) in instances.iter_mut().zip(is_shared).filter(|(_, is_shared)| *is_shared) {
        let count = uses.entry(instance.path.clone()).or_insert(0);
        *count += 1;
        while *count > 1 {
            let numbered = format!("{}:{count}", instance.path);
            // A file may have such a name of its own.
            if taken.insert(numbered.clone()) {
                instance.path = numbered;
                break;
            }
            *count += 1;
        }
    }
}

/// Fills in the report's counts of parts with a face, instances, shells and converted placed faces, and adds the names, each once.
fn count_model(model: &Model, report: &mut ImportReport) {
    report.parts = model.parts.iter().filter(|p| p.face_count() > 0).count();
    report.instances = model.instances.len();
    report.shells = model.parts.iter().map(|p| p.shells.len()).sum();
    report.faces_placed.converted = model.placed_face_count();
    let mut seen: FxHashSet<&str> = FxHashSet::default();
    for name in model.parts.iter().map(|p| &p.name).chain(model.instances.iter().map(|i| &i.name)) {
        if !name.is_empty() && seen.insert(name) {
            report.names.push(name.clone());
        }
    }
}

/// A part of the model, and the number of faces that the file has in it.
#[derive(Clone, Copy)]
struct PartFaces {
    part: PartId,
    found: usize,
}

/// A model under construction, with its account.
struct Reader<'f, 'a, 'r> {
    file: &'f File<'a>,
    styles: Styles,
    settings: &'f Settings,
    model: Model,
    report: &'r mut ImportReport,
}

impl Reader<'_, '_, '_> {
    /// Converts a representation that holds shapes, and adds the part to the model and its counts to the report; `None` when it holds none.
    fn convert_representation(
        &mut self,
        units: Units,
        placed: &PlacedRepresentation,
        ids: &[u64],
    ) -> Option<PartFaces> {
        let mut items = ShapeItems::default();
        for &id in ids {
            items.add(self.file, id);
        }
        if items.is_empty() {
            return None;
        }
        let converted = convert(self.file, units, &items, &self.styles, self.settings);
        let ConvertedPart { mut part, found, refused, repaired } = converted;
        part.name = if placed.product.is_empty() { placed.name.clone() } else { placed.product.clone() };
        part.colour = self.styles.colour(placed.representation);
        // The colour of an occurrence overrides only the part's: where some have one, that of all its shells is the part's.
        let mut owners =
            items.shells.iter().flat_map(|plan| &plan.owners).chain(ids).chain([&placed.representation]);
        let of_first = part.shells.first().and_then(|shell| shell.colour);
        if owners.any(|owner| self.styles.is_overridden(*owner))
            && part.shells.iter().all(|shell| shell.colour == of_first)
        {
            part.colour = of_first.or(part.colour);
            for shell in &mut part.shells {
                shell.colour = None;
                // Faces of a recipe, which have no entities, hold its colour themselves.
                shell.faces.iter_mut().filter(|face| face.entity.is_none()).for_each(|face| face.colour = None);
            }
        }

        let report = &mut *self.report;
        report.faces.found += found;
        report.faces.refused += refused.len();
        report.faces.converted += found - refused.len().min(found);
        let repaired_ids: FxHashSet<u64> = repaired.iter().map(|r| r.id).collect();
        let note = |r: Refusal| Note { id: r.id, entity: r.entity, reason: r.reason };
        report.refusals.extend(refused.into_iter().map(note));
        report.repairs.extend(repaired.into_iter().map(note));
        // A face may stand in several shells; by its #id it counts once.
        let mut counted = FxHashSet::default();
        for face in part.shells.iter().flat_map(|s| &s.faces).filter(|f| f.entity.is_none_or(|e| counted.insert(e)))
        {
            report.by_surface.count(face.analytic.kind());
            // Shells are repaired too, and a face may be in more than one way.
            report.faces.repaired += usize::from(face.entity.is_some_and(|id| repaired_ids.contains(&id)));
            report.gap_max_mm = report.gap_max_mm.max(face.gap);
        }
        report.by_surface.tessellated += part.tessellated.len();
        self.model.parts.push(part);
        Some(PartFaces { part: PartId(self.model.parts.len() as u32 - 1), found })
    }

    /// Places a part and counts its faces; one without a converted face gets no instance.
    fn add_instance(&mut self, PartFaces { part, found }: PartFaces, p: PlacedRepresentation) {
        self.report.faces_placed.found += found;
        // A part of which no face was converted has nothing to place.
        if self.model.part(part).face_count() == 0 {
            return;
        }
        let name = if p.name.is_empty() { self.model.part(part).name.clone() } else { p.name };
        let colour = self.styles.occurrence_colour(&p.owners);
        let path = if p.path.is_empty() { name.clone() } else { p.path };
        self.model.instances.push(Instance { name, path, part, placement: p.placement, colour });
    }
}

/// Returns the largest resident size of this process so far, bytes; `None` where the system does not report it.
pub(crate) fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|kb| kb * 1024)
}
