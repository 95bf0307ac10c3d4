//! Units of a representation context: one file may mix several.

use super::tolerances::{ACCURACY_MM, BRIDGE_SHARE, STATED_BRIDGE_SHARE};
use crate::math::units::{DEGREE, INCH, METRE, si_prefix};
use crate::step::part21::{Args, Entity, File};

/// Deepest chain of conversion-based units.
const MAX_DEPTH: usize = 8;

/// Least and largest unit, mm or radians: an attometre, an exametre. A damaged definition of 1e-300 took facets a minute.
const SIZES: [f64; 2] = [1e-15, 1e21];

/// Share by which two definitions of one unit differ at most, as a degree of seven digits.
const ONE_UNIT: f64 = 1e-6;

/// Share of a face's size above which it would merge the face's own edges.
const ACCURACY_SHARE: f64 = 1e-3;
/// Faces smaller than this count as this large there, mm.
const SMALLEST_FACE_MM: f64 = 1e-3;

/// Factors from a context's units to mm and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    /// Millimetres per unit of length.
    pub(crate) length: f64,
    /// Radians per unit of plane angle.
    pub(crate) angle: f64,
    /// The file's own distance accuracy in mm; `None` when it states none.
    pub(crate) accuracy: Option<f64>,
}

impl Units {
    /// Millimetres and radians.
    pub(crate) const DEFAULT: Self = Self { length: 1.0, angle: 1.0, accuracy: None };

    /// Returns the distance, mm, within which points of a face of this size, mm, are one: what the file states, less on small faces.
    pub(crate) fn accuracy_on_face(&self, size: f64) -> f64 {
        let stated = self.accuracy.unwrap_or(ACCURACY_MM[0]).clamp(ACCURACY_MM[0], ACCURACY_MM[1]);
        stated.min(ACCURACY_SHARE * size.max(SMALLEST_FACE_MM)).max(ACCURACY_MM[0])
    }

    /// Returns the widest gap, mm, between segments of a composite curve of this size, mm, that may be bridged: what the file states, less
    /// on small curves, or a share of the size where that is more.
    pub(crate) fn widest_bridge(&self, size: f64) -> f64 {
        let stated = self.accuracy.unwrap_or(0.0).min(STATED_BRIDGE_SHARE * size);
        stated.max(BRIDGE_SHARE * size).max(ACCURACY_MM[1])
    }
}

/// Units that a context assigns, with their names for the report; `None` for a name that it does not assign.
#[derive(Clone, Debug)]
pub(crate) struct Assigned {
    pub(crate) units: Units,
    pub(crate) length_name: Option<String>,
    pub(crate) angle_name: Option<String>,
    /// Units of length and angle, by their ids, that the file gives no size which a unit could have.
    pub(crate) unreadable: Vec<u64>,
    /// Units of length and angle, by their ids, of other sizes than the first ones, which count.
    pub(crate) contradictory: Vec<u64>,
}

/// Reads the units of a representation context; what it does not assign is mm and radians. The accuracy is the smallest uncertainty of all.
pub(crate) fn read_context(context: Entity<'_, '_>) -> Assigned {
    let mut assigned = Assigned {
        units: Units::DEFAULT,
        length_name: None,
        angle_name: None,
        unreadable: Vec::new(),
        contradictory: Vec::new(),
    };
    if let Some(args) = context.attributes("GLOBAL_UNIT_ASSIGNED_CONTEXT", 2) {
        let units = args.list(0);
        for i in 0..units.len() {
            let Some(unit) = units.entity(i) else { continue };
            match unit_factor(unit, 0) {
                Some((Kind::Length, factor, name)) if assigned.length_name.is_none() => {
                    assigned.units.length = factor;
                    assigned.length_name = Some(name);
                }
                Some((Kind::Angle, factor, name)) if assigned.angle_name.is_none() => {
                    assigned.units.angle = factor;
                    assigned.angle_name = Some(name);
                }
                Some((kind, factor, _)) => {
                    let known = if kind == Kind::Length { assigned.units.length } else { assigned.units.angle };
                    if (factor / known - 1.0).abs() > ONE_UNIT {
                        assigned.contradictory.push(unit.id);
                    }
                }
                None if unit.is_one_of(&["LENGTH_UNIT", "PLANE_ANGLE_UNIT"]) => assigned.unreadable.push(unit.id),
                _ => {}
            }
        }
    }
    if let Some(args) = context.attributes("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT", 2) {
        let list = args.list(0);
        let measures = (0..list.len()).filter_map(|i| list.entity(i));
        // The smallest of several is the one that all shapes keep.
        let lengths = measures.filter_map(|m| uncertain_length(m, assigned.units.length)).filter(|&x| x > 0.0);
        assigned.units.accuracy = lengths.reduce(f64::min);
    }
    assigned
}

/// Returns the length of an uncertainty, mm, in its own unit or, where it has none, in the context's of `unit` mm; `None` for angles and
/// other quantities.
fn uncertain_length(uncertainty: Entity<'_, '_>, unit: f64) -> Option<f64> {
    let args = uncertainty.all_args().find(|a| a.real(0).is_some())?;
    let factor = match args.entity(1).and_then(|u| unit_factor(u, 0)) {
        Some((kind, factor, _)) => (kind == Kind::Length).then_some(factor)?,
        // The name of the value says what it measures where the unit does not.
        None => args.typed(0).is_none_or(|(name, _)| name.ends_with("LENGTH_MEASURE")).then_some(unit)?,
    };
    Some(args.real(0)? * factor)
}

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Length,
    Angle,
}

/// Returns kind, factor to mm or rad, and name of a unit; `None` for other quantities and for definitions that do not fit their kind.
fn unit_factor(unit: Entity<'_, '_>, depth: usize) -> Option<(Kind, f64, String)> {
    if depth > MAX_DEPTH {
        return None;
    }
    if let Some(si) = unit.attributes("SI_UNIT", 1) {
        return si_unit(si);
    }
    let conversion = unit.attributes("CONVERSION_BASED_UNIT", 1)?;
    let name = conversion.name(0);
    let declared = if unit.is_a("LENGTH_UNIT") {
        Some(Kind::Length)
    } else if unit.is_a("PLANE_ANGLE_UNIT") {
        Some(Kind::Angle)
    } else {
        None
    };
    // The file's own definition counts; a name is used only where it has none.
    let by_measure = || {
        let with_unit = conversion.entity(1)?;
        let args = with_unit
            .attributes("MEASURE_WITH_UNIT", 0)
            .or_else(|| Some(with_unit.args()))
            .filter(|a| a.real(0).is_some())?;
        let (kind, factor, _) = unit_factor(args.entity(1)?, depth + 1)?;
        let size = args.real(0)? * factor;
        (SIZES[0]..=SIZES[1]).contains(&size).then_some((kind, size))
    };
    let by_name = || conventional_unit(&name);
    let (kind, factor) = by_measure().or_else(by_name)?;
    // A definition of another kind than it declares is none.
    (declared.is_none_or(|d| d == kind)).then_some((kind, factor, name))
}

/// Returns kind, size in mm or rad, and name of an SI_UNIT with these attributes; `None` for anything but metres and radians.
fn si_unit(args: Args<'_, '_>) -> Option<(Kind, f64, String)> {
    let prefix = args.word(0);
    let factor = prefix.as_deref().map_or(Some(1.0), si_prefix)?;
    let base = args.word(1)?;
    let name = prefix.map_or_else(|| base.to_string(), |p| format!("{p} {base}"));
    match &*base {
        "METRE" => Some((Kind::Length, factor * METRE, name)),
        "RADIAN" => Some((Kind::Angle, factor, name)),
        _ => None,
    }
}

/// Returns kind and factor to mm or rad of a unit by its usual name, in any case or plural; `None` for others. For broken definitions.
fn conventional_unit(name: &str) -> Option<(Kind, f64)> {
    Some(match name.to_ascii_uppercase().trim_end_matches('S') {
        "INCH" | "INCHE" => (Kind::Length, INCH),
        "FOOT" | "FEET" => (Kind::Length, 12.0 * INCH),
        "MILLIMETRE" | "MILLIMETER" => (Kind::Length, 1.0),
        "CENTIMETRE" | "CENTIMETER" => (Kind::Length, 10.0),
        "METRE" | "METER" => (Kind::Length, METRE),
        "DEGREE" => (Kind::Angle, DEGREE),
        "RADIAN" => (Kind::Angle, 1.0),
        _ => return None,
    })
}

/// Returns all contexts of a file that assign units, by their ids.
pub(crate) fn contexts<'f, 'a>(file: &'f File<'a>) -> impl Iterator<Item = (u64, Assigned)> + use<'f, 'a> {
    file.entities_named(&["GLOBAL_UNIT_ASSIGNED_CONTEXT"]).map(|e| (e.id, read_context(e)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::part21;

    #[test]
    fn an_uncertainty_is_a_length_in_its_own_unit() {
        // A context in metres with an accuracy of 0.02 mm, one of an angle that is smaller, and one without a unit.
        for (list, expected) in [("#5,#6", Some(0.02)), ("#6", None), ("#7", Some(3.0))] {
            let text = format!(
                "ISO-10303-21;\nDATA;\n#1=(GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({list}))\
                 GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
                 #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));\n#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n\
                 #4=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
                 #5=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.02),#4,'','');\n\
                 #6=UNCERTAINTY_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(1E-9),#3,'','');\n\
                 #7=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.003),$,'','');\nENDSEC;\n"
            );
            let file = part21::parse("units.stp", text.as_bytes()).unwrap();
            assert_eq!(read_context(file.entity(1).unwrap()).units.accuracy, expected, "{list}");
        }
    }

    #[test]
    fn a_unit_in_small_letters_keeps_its_size() {
        for (unit, expected) in [("$,.metre.", 1000.0), (".centi.,.Metre.", 10.0)] {
            let text = format!(
                "ISO-10303-21;\nDATA;\n#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2))REPRESENTATION_CONTEXT('',''));\n\
                 #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({unit}));\n#3=ORIENTED_EDGE(.t.,.False.,.u.,$);\nENDSEC;\n"
            );
            let file = part21::parse("units.stp", text.as_bytes()).unwrap();
            let assigned = read_context(file.entity(1).unwrap());
            assert_eq!((assigned.units.length, assigned.unreadable), (expected, vec![]), "{unit}");
            let flags = file.entity(3).unwrap().args();
            assert_eq!([0, 1, 2, 3].map(|i| flags.flag(i)), [Some(true), Some(false), None, None]);
        }
    }

    #[test]
    fn a_unit_of_no_possible_size_is_unreadable() {
        for (value, expected, unreadable) in
            [("25.4", 25.4, vec![]), ("0.", 1.0, vec![2]), ("1E-300", 1.0, vec![2])]
        {
            let text = format!(
                "ISO-10303-21;\nDATA;\n#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2))REPRESENTATION_CONTEXT('',''));\n\
                 #2=(CONVERSION_BASED_UNIT('own',#3)LENGTH_UNIT()NAMED_UNIT(*));\n\
                 #3=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({value}),#4);\n\
                 #4=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\nENDSEC;\n"
            );
            let file = part21::parse("units.stp", text.as_bytes()).unwrap();
            let assigned = read_context(file.entity(1).unwrap());
            assert_eq!((assigned.units.length, assigned.unreadable), (expected, unreadable), "{value}");
        }
    }

    /// A degree of seven digits beside that of a double is no other one; an inch beside a millimetre is.
    #[test]
    fn the_first_of_several_units_counts() {
        let text = "ISO-10303-21;\nDATA;\n#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3,#4,#5))REPRESENTATION_CONTEXT('',''));\n\
                    #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n\
                    #3=(CONVERSION_BASED_UNIT('INCH',$)LENGTH_UNIT()NAMED_UNIT(*));\n\
                    #4=(CONVERSION_BASED_UNIT('DEGREE',$)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
                    #5=(CONVERSION_BASED_UNIT('DEGREE',#6)NAMED_UNIT(*)PLANE_ANGLE_UNIT());\n\
                    #6=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.01745329),#7);\n\
                    #7=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\nENDSEC;\n";
        let file = part21::parse("units.stp", text.as_bytes()).unwrap();
        let assigned = read_context(file.entity(1).unwrap());
        assert_eq!((assigned.units.length, assigned.units.angle), (1.0, 1f64.to_radians()));
        assert_eq!(assigned.contradictory, [3]);
    }
}
