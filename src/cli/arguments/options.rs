//! Options shared by commands, and the small grammars of their values. Signs are let through the argument parser so that a
//! negative number gets an answer about the number, not about an unknown option.

use crate::intersect::NormalMode;
use crate::pipeline::{IntersectorKind, MeshingSettings, RayRange, TracingSettings};
use crate::simulate::MOST_RAYS;
use crate::tessellate::LEAST_TOLERANCE_MM;
use clap::ValueEnum;
use clap::builder::PossibleValue;
use std::path::PathBuf;

/// A direction error asked for in place of a tolerance.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct AccuracyOption {
    /// Ask for a direction error (99th percentile at curved faces) in place of a tolerance, such as 0.05deg
    #[arg(
        long,
        help_heading = "Facets",
        value_name = "Xdeg",
        conflicts_with = "tolerance",
        value_parser = parse_accuracy,
        allow_hyphen_values = true
    )]
    pub(crate) accuracy: Option<f64>,
}

/// Options of everything that tessellates.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct MeshingOptions {
    /// Distance from facets to the surface in mm: tight where curved, loose where flat; one number for uniform; 0.05..0.2
    /// by default; a traced scene that asks for no tolerance, accuracy, normals or intersector chooses facets or spline by a pilot
    #[arg(long, help_heading = "Facets", value_name = "MIN..MAX", value_parser = parse_tolerance, allow_hyphen_values = true)]
    pub(crate) tolerance: Option<[f64; 2]>,
    /// Largest angle between facet and surface normal, degrees; off by default
    #[arg(long, help_heading = "Facets", value_name = "DEG", value_parser = parse_angle, allow_hyphen_values = true)]
    pub(crate) angle: Option<f64>,
    /// Tolerance of one part, by name; may be given several times
    #[arg(long, help_heading = "Facets", value_name = "NAME=MIN..MAX", value_parser = parse_part)]
    pub(crate) part: Vec<(String, [f64; 2])>,
    /// Tolerance of one face, by its name or the number of its entity in the file; may be given several times, and wins over that of its
    /// part
    #[arg(long, help_heading = "Facets", value_name = "NAME=MIN..MAX", value_parser = parse_face)]
    pub(crate) face: Vec<(String, [f64; 2])>,
    /// Tolerance of all faces of one optical role in the scene: mirror, interface, coated or absorber; may be given several times
    #[arg(long, help_heading = "Facets", value_name = "ROLE=MIN..MAX", value_parser = parse_role)]
    pub(crate) role: Vec<(String, [f64; 2])>,
}

impl MeshingOptions {
    /// Returns what the options ask for, unset ones left open; no plan of tolerances.
    pub(crate) fn settings(&self) -> MeshingSettings {
        MeshingSettings {
            tolerance: self.tolerance,
            angle_deg: self.angle,
            part: self.part.clone(),
            face: self.face.clone(),
            role: self.role.clone(),
            plan: None,
        }
    }
}

/// Where models, facets and octrees are kept from one run to the next.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct CacheOption {
    /// Keep model, facets and octree in this folder, which runs and machines may share, and take them from there; by default what the
    /// variable LAMPYRIS_CACHE names, else nothing is kept. At most 20 GB, or what LAMPYRIS_CACHE_GB says
    #[arg(long, help_heading = "Facets", value_name = "DIR")]
    pub(crate) cache: Option<PathBuf>,
}

/// Options of everything that traces.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct TracingOptions {
    /// Number of rays, such as 10k, 5M, 2G, 1_000_000 or 1e6; by default what the scene says, or what suits the command; sources with
    /// `rays` of their own keep them
    #[arg(long = "rays", help_heading = "Rays", value_name = "N", value_parser = parse_ray_range, allow_hyphen_values = true)]
    pub(crate) ray_range: Option<RayRange>,
    /// Seed of all random numbers
    #[arg(long, help_heading = "Rays", value_name = "S", value_parser = parse_seed, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Number of threads; as many as there are cores by default, and never more than 16 for each core, however many are asked for
    #[arg(long, help_heading = "Rays", value_name = "N", value_parser = parse_threads, allow_negative_numbers = true)]
    pub(crate) threads: Option<usize>,
    /// What finds the hits; octree by default, in a traced scene chosen by a pilot
    #[arg(long, help_heading = "Rays", value_name = "NAME")]
    pub(crate) intersector: Option<IntersectorKind>,
    /// How the normal at a hit is computed: bilinear by default, in a traced scene chosen by a pilot; exact moves the hit to the spline
    #[arg(long, help_heading = "Rays", value_name = "NAME")]
    pub(crate) normals: Option<NormalMode>,
}

impl TracingOptions {
    /// Returns what the options ask for, unset ones left open.
    pub(crate) fn settings(&self) -> TracingSettings {
        TracingSettings {
            ray_range: self.ray_range,
            seed: self.seed,
            threads: self.threads,
            intersector: self.intersector,
            normals: self.normals,
        }
    }
}

impl ValueEnum for IntersectorKind {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
}

impl ValueEnum for NormalMode {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
}

/// Reads a positive length in mm, with or without the unit.
fn parse_length(text: &str) -> Result<f64, String> {
    let value: f64 =
        // The unit may be written; it is always mm.
        text.trim().trim_end_matches("mm").trim().parse().map_err(|_| format!("'{text}' is no number of mm"))?;
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(format!("a tolerance is a positive length in mm, not {text}; the default is 0.05..0.2"))
    }
}

/// Reads a tolerance in mm, `MIN..MAX` or one number for both.
fn parse_tolerance(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once("..").unwrap_or((text, text));
    let (low, high) = (parse_length(low)?, parse_length(high)?);
    if low < LEAST_TOLERANCE_MM {
        return Err(format!(
            "a tolerance is at least {LEAST_TOLERANCE_MM:e} mm, not {low}: coordinates are rounded by more"
        ));
    }
    if low <= high {
        Ok([low, high])
    } else {
        Err(format!("{low} is larger than {high}; write the tighter tolerance first, as in {high}..{low}"))
    }
}

/// Reads an angle above 0 and below 90 degrees, with or without `deg`.
fn parse_angle(text: &str) -> Result<f64, String> {
    let value = text.trim_end_matches("deg").trim().parse::<f64>().ok();
    value
        .filter(|v| *v > 0.0 && *v < 90.0)
        .ok_or_else(|| format!("an angle is a number of degrees above 0 and below 90, not '{text}'"))
}

/// Reads the name of a part and its tolerances in mm, NAME=MIN..MAX.
fn parse_part(text: &str) -> Result<(String, [f64; 2]), String> {
    parse_place(text, "the name of the part", "NAME=MIN..MAX, as in cover=0.01..0.05")
}

/// Reads the name of a face, or the number of its entity, and its tolerances in mm.
fn parse_face(text: &str) -> Result<(String, [f64; 2]), String> {
    parse_place(text, "the name of the face or its number", "NAME=MIN..MAX or ID=MIN..MAX, as in 17=0.01..0.05")
}

/// Reads an optical role and its tolerances in mm, ROLE=MIN..MAX.
fn parse_role(text: &str) -> Result<(String, [f64; 2]), String> {
    parse_place(text, "the role", "ROLE=MIN..MAX, as in mirror=0.01..0.05")
}

/// Reads a name and its tolerances in mm; messages call the name `what`, and show its `form`.
fn parse_place(text: &str, what: &str, form: &str) -> Result<(String, [f64; 2]), String> {
    // The last '=' parts the two, since names of parts may contain it.
    let (name, range) = text.rsplit_once('=').ok_or_else(|| format!("write {form}"))?;
    if name.trim().is_empty() {
        return Err(format!("{what} is missing; write {form}"));
    }
    Ok((name.trim().to_owned(), parse_tolerance(range)?))
}

/// Reads a whole number from `least` to `most`.
fn parse_whole(text: &str, least: u64, most: u64) -> Result<u64, String> {
    let value = text.trim().parse::<u64>().ok().filter(|value| (least..=most).contains(value));
    value.ok_or_else(|| format!("a whole number from {least} to {most} is wanted, not '{text}'"))
}

/// Reads the seed of random numbers.
fn parse_seed(text: &str) -> Result<u64, String> {
    parse_whole(text, 0, u64::MAX)
}

/// Reads a number of threads, 1 or more; how many of so many are of use is decided where they are started.
pub(crate) fn parse_threads(text: &str) -> Result<usize, String> {
    parse_whole(text, 1, u64::MAX).map(|threads| usize::try_from(threads).unwrap_or(usize::MAX))
}

/// Reads how many there are to be of something that is listed.
pub(crate) fn parse_listed(text: &str) -> Result<u32, String> {
    parse_whole(text, 0, u64::from(u32::MAX)).map(|count| count as u32)
}

/// Reads a number of parts, 1 or more.
pub(crate) fn parse_parts(text: &str) -> Result<u32, String> {
    parse_whole(text, 1, u64::from(u32::MAX)).map(|count| count as u32)
}

/// Reads a limit of how many of something there may be.
pub(crate) fn parse_limit(text: &str) -> Result<u64, String> {
    parse_whole(text, 0, u64::MAX)
}

/// Reads a number of seconds, 0 or more, `inf` for ever.
pub(crate) fn parse_seconds(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|seconds| *seconds >= 0.0);
    value.ok_or_else(|| format!("a number of seconds, 0 or more, is wanted, as in 30, not '{text}'"))
}

/// Reads a number of rays, `N`, or the half-open range `A..B` from ray A up to B.
fn parse_ray_range(text: &str) -> Result<RayRange, String> {
    let Some((first, end)) = text.split_once("..") else {
        return Ok(RayRange { first: None, end: parse_count(text)? });
    };
    // `parse_count` takes nothing below 1, but ranges begin at ray 0.
    let first = if first.trim() == "0" { 0 } else { parse_count(first.trim())? };
    let end = parse_count(end.trim())?;
    if first >= end {
        return Err(format!("the rays of A..B rise, not as in {text}"));
    }
    Ok(RayRange { first: Some(first), end })
}

/// Relative error of a decimal number times a power of ten: half a unit in the last place of each factor and of the product.
const PRODUCT_ROUNDING: f64 = 1.5 * f64::EPSILON;

/// Reads a whole number from 1 to [`MOST_RAYS`]; `1e6`, `1_000_000`, `10k`, `10M` and `10G` are understood.
pub(crate) fn parse_count(text: &str) -> Result<u64, String> {
    let plain = text.replace('_', "");
    let (digits, factor) = match plain.chars().last() {
        Some('k') => (&plain[..plain.len() - 1], 1000.0),
        // Letters of one byte: the cut is at a character.
        Some('M') => (&plain[..plain.len() - 1], 1_000_000.0),
        Some('G') => (&plain[..plain.len() - 1], 1_000_000_000.0),
        _ => (plain.as_str(), 1.0),
    };
    let value = digits
        .parse::<f64>()
        .map_err(|_| format!("a number of rays is wanted, as in 10k, 5M or 1e6, not '{text}'"))?
        * factor;
    let whole = value.round();
    if (1.0..=MOST_RAYS as f64).contains(&whole) && (value - whole).abs() <= PRODUCT_ROUNDING * whole {
        Ok(whole as u64)
    } else {
        Err(format!("a number of rays is whole, from 1 to {:e}, not {text}", MOST_RAYS as f64))
    }
}

/// Reads a share, from 0 to 1.
pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    // Compared with no number, every share would be within it, or none.
    let value = text.trim().parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    value.ok_or_else(|| format!("a share is a number from 0 to 1, as in 0.01, not '{text}'"))
}

/// Reads a direction error above 0 and below 90 degrees, with or without `deg`.
fn parse_accuracy(text: &str) -> Result<f64, String> {
    // A bare number is taken for degrees.
    let number = text.strip_suffix("deg").or_else(|| text.strip_suffix('°')).unwrap_or(text);
    let value = number.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && *v < 90.0);
    value.ok_or_else(|| format!("an accuracy is an angle above 0, as in 0.05deg, not '{text}'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances() {
        assert_eq!(parse_tolerance("0.05..0.2"), Ok([0.05, 0.2]));
        assert_eq!(parse_tolerance("0.1mm"), Ok([0.1, 0.1]));
        for (wrong, says) in [
            ("-0.1", "positive"),
            ("0..0.2", "positive"),
            ("1e-160", "at least 1e-7"),
            ("0.2..0.05", "0.05..0.2"),
            ("a", "number"),
            ("nan", "positive"),
        ] {
            assert!(parse_tolerance(wrong).unwrap_err().contains(says), "{wrong}");
        }
    }

    #[test]
    fn counts() {
        assert_eq!(
            (parse_count("1e6"), parse_count("10M"), parse_count("1_000")),
            (Ok(1_000_000), Ok(10_000_000), Ok(1000))
        );
        // 4.1 and 2.01 are no doubles: their products fall short of the whole number.
        assert_eq!(
            (parse_count("4.1M"), parse_count("2.01k"), parse_count("2G")),
            (Ok(4_100_000), Ok(2010), Ok(2_000_000_000))
        );
        assert!(
            parse_count("-5").is_err()
                && parse_count("0").is_err()
                && parse_count("1.5").is_err()
                && parse_count("").is_err()
        );
        assert!(parse_count("2e13").is_ok() && parse_count("20000000000001").unwrap_err().contains("2e13"));
    }

    #[test]
    fn shares() {
        assert_eq!((parse_share("0"), parse_share("1e-6")), (Ok(0.0), Ok(1e-6)));
        assert!(["nan", "-0.1", "1.5", "inf", "x", ""].iter().all(|text| parse_share(text).is_err()));
    }

    #[test]
    fn whole_numbers_and_seconds() {
        assert_eq!((parse_seed("0"), parse_threads("4"), parse_seconds("0.5")), (Ok(0), Ok(4), Ok(0.5)));
        assert_eq!(parse_seed("18446744073709551615"), Ok(u64::MAX));
        assert!(parse_seed("-1").unwrap_err().contains("from 0 to 18446744073709551615"));
        let beyond = "18446744073709551616";
        let is_told = |text: &&str| parse_threads(text).unwrap_err().contains("from 1 to 18446744073709551615");
        assert!(["x", "0", "1.5", "-1", beyond].iter().all(is_told));
        assert!(parse_threads("5000000000").is_ok());
        assert!(["nan", "-1", "soon"].iter().all(|text| parse_seconds(text).is_err()));
    }

    #[test]
    fn parts_and_angles() {
        assert_eq!(parse_part("a=b=0.1"), Ok(("a=b".into(), [0.1, 0.1])));
        assert!(parse_part("=0.1").unwrap_err().contains("name of the part"));
        assert!(parse_face("x").unwrap_err().contains("17=") && parse_role("=1").unwrap_err().contains("the role"));
        assert_eq!((parse_angle("5deg"), parse_accuracy("0.05deg")), (Ok(5.0), Ok(0.05)));
        assert!(parse_angle("90").is_err() && parse_accuracy("-1deg").is_err());
    }
}
