use super::geometry::units::{Units, contexts};
use super::part21::{File, parse};
use super::product::assembly::{Assembly, PlacedRepresentation};
use super::product::conversion::{ConvertedPart, convert};
use super::product::styles::Styles;
use super::product::topology::ShapeItems;
use super::report::{ImportReport, Note, SurfaceCounts};
use super::{Error, ErrorKind, Settings};
use crate::math::Frame;
use crate::model::{Analytic, Instance, Model, PartId};
use rustc_hash::{FxHashMap, FxHashSet};
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
    let bytes =
        std::fs::read(path).map_err(|source| Error::new(ErrorKind::Io { path: path.to_path_buf(), source }))?;
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    read_bytes(&name, &bytes, settings)
}

/// Reads the bytes of a STEP file; `name` is for messages and the model's name.
///
/// # Errors
/// When the bytes are no Part 21 text.
pub fn read_bytes(name: &str, bytes: &[u8], settings: &Settings) -> Result<Import, Error> {
    let start = Instant::now();
    let file = parse(name, bytes)?;
    let parsed = start.elapsed().as_secs_f64();
    let mut report = ImportReport { file: name.to_string(), bytes: bytes.len() as u64, ..ImportReport::default() };
    report.schema = schema(&file);
    for fault in &file.faults {
        let id = fault.id.map(|id| format!(" #{id}")).unwrap_or_default();
        report.problems.push(format!("{name}: line {}:{id} {}", fault.line, fault.what));
    }
    if file.fault_count > file.faults.len() {
        report.problems.push(format!("{} further statements were skipped", file.fault_count - file.faults.len()));
    }
    let model = assemble(&file, name, settings, &mut report);
    let bounds = model.bounds();
    if !bounds.is_empty() {
        report.bbox_mm = Some([bounds.min.to_array(), bounds.max.to_array()]);
    }
    report.seconds.parse = parsed;
    report.seconds.convert = start.elapsed().as_secs_f64() - parsed;
    report.peak_bytes = peak_bytes();
    Ok(Import { model, report })
}

fn schema(file: &File<'_>) -> Vec<String> {
    let Some(args) = file.header("FILE_SCHEMA") else { return Vec::new() };
    let list = args.list(0);
    (0..list.len()).filter_map(|i| list.text(i)).collect()
}

fn assemble(file: &File<'_>, name: &str, settings: &Settings, report: &mut ImportReport) -> Model {
    let mut units: FxHashMap<u64, Units> = FxHashMap::default();
    let mut fallback = None;
    for (id, mut assigned) in contexts(file) {
        if let Some(length) = settings.length_unit_mm {
            let accuracy = assigned.units.accuracy.map(|a| a / assigned.units.length * length);
            assigned.units = Units { length, accuracy, ..assigned.units };
        }
        units.insert(id, assigned.units);
        if assigned.length_name.is_some() {
            fallback.get_or_insert(assigned.units);
        }
        for (list, name) in
            [(&mut report.units.length, assigned.length_name), (&mut report.units.angle, assigned.angle_name)]
        {
            if let Some(name) = name.filter(|n| !list.contains(n)) {
                list.push(name);
            }
        }
    }
    let common = SharedInput { file, styles: Styles::read(file), settings };
    let assembly = Assembly::read(
        file,
        units,
        fallback.unwrap_or(Units {
            length: settings.length_unit_mm.unwrap_or(Units::DEFAULT.length),
            ..Units::DEFAULT
        }),
    );
    let (placed, assembly) = assembly.walk();
    report.problems.extend(assembly.problems.iter().cloned());
    let mut model = Model { name: name.to_string(), ..Model::default() };
    let mut parts: FxHashMap<u64, Option<(PartId, usize)>> = FxHashMap::default();
    let mut items_placed: FxHashMap<u64, Frame> = FxHashMap::default();
    for p in placed {
        let known = parts.get(&p.representation).copied();
        let entry = known.unwrap_or_else(|| {
            let mut items = assembly.items(p.representation);
            // Linked representations often name the same shapes; each is meant once in a place.
            let again = |item: &u64| items_placed.get(item).is_some_and(|at| p.orphan || *at == p.placement);
            items.retain(|item| !again(item));
            for item in &items {
                items_placed.entry(*item).or_insert(p.placement);
                // Shells of models and elements of sets stand with them.
                let mut inner = Vec::new();
                file.entity(*item).into_iter().flat_map(|e| e.all_args()).for_each(|a| a.deep_ids(&mut inner));
                for id in inner {
                    items_placed.entry(id).or_insert(p.placement);
                }
            }
            let units = assembly.units_of(p.representation);
            let made = convert_representation(&common, units, &p, &items, &mut model, report);
            parts.insert(p.representation, made);
            made
        });
        let Some((part, found)) = entry else { continue };
        report.faces_placed.found += found;
        if model.part(part).face_count() == 0 {
            continue;
        }
        let named = if p.name.is_empty() { model.part(part).name.clone() } else { p.name.clone() };
        let colour = p.owners.iter().rev().find_map(|o| common.styles.colour(*o));
        model.instances.push(Instance { name: named, part, placement: p.placement, colour });
    }
    report.parts = model.parts.iter().filter(|p| p.face_count() > 0).count();
    report.instances = model.instances.len();
    report.shells = model.parts.iter().map(|p| p.shells.len()).sum();
    report.faces_placed.converted = model.placed_face_count();
    for name in model.parts.iter().map(|p| &p.name).chain(model.instances.iter().map(|i| &i.name)) {
        if !name.is_empty() && !report.names.contains(name) {
            report.names.push(name.clone());
        }
    }
    model
}

/// What all parts of a file share.
struct SharedInput<'f, 'a> {
    file: &'f File<'a>,
    styles: Styles,
    settings: &'f Settings,
}

/// Converts a representation that holds shapes; `None` when it holds none.
fn convert_representation(
    common: &SharedInput<'_, '_>,
    units: Units,
    placed: &PlacedRepresentation,
    ids: &[u64],
    model: &mut Model,
    report: &mut ImportReport,
) -> Option<(PartId, usize)> {
    let SharedInput { file, styles, settings } = common;
    let mut items = ShapeItems::default();
    for &id in ids {
        items.add(file, id);
    }
    if items.is_empty() {
        return None;
    }
    let ConvertedPart { mut part, found, refused, repaired } = convert(file, units, &items, styles, settings);
    part.name = if placed.product.is_empty() { placed.name.clone() } else { placed.product.clone() };
    part.colour = styles.colour(placed.representation);
    report.faces.found += found;
    report.faces.refused += refused.len();
    report.faces.converted += found - refused.len().min(found);
    report.faces.repaired += repaired.len();
    let note = |r: super::geometry::Refusal| Note { id: r.id, entity: r.entity, reason: r.reason };
    report.refusals.extend(refused.into_iter().map(note));
    report.repairs.extend(repaired.into_iter().map(note));
    let mut counted = FxHashSet::default();
    for face in part.shells.iter().flat_map(|s| &s.faces).filter(|f| f.entity.is_none_or(|e| counted.insert(e))) {
        count_surface(&mut report.by_surface, &face.analytic);
        report.gap_max_mm = report.gap_max_mm.max(face.gap);
    }
    report.by_surface.tessellated += part.tessellated.len();
    model.parts.push(part);
    Some((PartId(model.parts.len() as u32 - 1), found))
}

fn count_surface(counts: &mut SurfaceCounts, analytic: &Analytic) {
    let slot = match analytic {
        Analytic::Plane { .. } => &mut counts.plane,
        Analytic::Cylinder { .. } => &mut counts.cylinder,
        Analytic::Cone { .. } => &mut counts.cone,
        Analytic::Sphere { .. } => &mut counts.sphere,
        Analytic::Torus { .. } => &mut counts.torus,
        Analytic::Revolution => &mut counts.revolution,
        Analytic::Extrusion => &mut counts.extrusion,
        Analytic::Offset => &mut counts.offset,
        Analytic::Bspline => &mut counts.bspline,
        Analytic::Rational => &mut counts.rational,
        _ => &mut counts.other,
    };
    *slot += 1;
}

/// Largest resident size of this process; 0 where the system does not tell.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}
