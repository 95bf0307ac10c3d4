//! The media that lamps and lenses are made of, each index with its source.
//!
//! Coefficients and ranges as given by the refractiveindex.info database (CC0), with which each was compared as it stood on 2026-06-14;
//! those of B 270 are also on Schott's page. All are clear: how much a plastic absorbs depends on grade, colour and age, so a scene has
//! to say it. Indices of glasses are against air, as their makers give them: surroundings of
//! vacuum stand for air, which is therefore not listed.

use super::media::{Index, Medium};
use super::table::Table;

/// A medium of the catalogue.
struct Entry {
    name: &'static str,
    /// Other spellings, lower case.
    aliases: &'static [&'static str],
    source: &'static str,
    range_nm: [f64; 2],
    index: Listed,
}

/// An index as its source lists it.
enum Listed {
    /// Terms `[B, C]` of Sellmeier's formula, C in µm².
    Sellmeier(&'static [[f64; 2]]),
    /// Points `[nm, n]`.
    Points(&'static [[f64; 2]]),
}

/// Where the coefficients of Schott's glasses come from.
const SCHOTT: &str = "Schott, Zemax catalogue 2017-01-20b";
/// Where those of the plastics come from.
const SULTANOVA: &str =
    "Sultanova, Kasarova, Nikolov, Acta Phys. Pol. A 116, 585 (2009), 20 °C, fit of refractiveindex.info";

/// A glass of Schott's, from its shortest wavelength, nm, to 2500 nm.
const fn schott(
    name: &'static str,
    aliases: &'static [&'static str],
    from: f64,
    terms: &'static [[f64; 2]; 3],
) -> Entry {
    Entry { name, aliases, source: SCHOTT, range_nm: [from, 2500.0], index: Listed::Sellmeier(terms) }
}

/// A plastic that Sultanova and others measured, of one term.
const fn plastic(name: &'static str, aliases: &'static [&'static str], term: &'static [[f64; 2]; 1]) -> Entry {
    Entry { name, aliases, source: SULTANOVA, range_nm: [436.8, 1052.0], index: Listed::Sellmeier(term) }
}

const ENTRIES: &[Entry] = &[
    schott(
        "N-BK7",
        &["bk7", "nbk7"],
        300.0,
        &[[1.03961212, 0.00600069867], [0.231792344, 0.0200179144], [1.01046945, 103.560653]],
    ),
    schott(
        "N-K5",
        &[],
        310.0,
        &[[1.08511833, 0.00661099503], [0.199562005, 0.024110866], [0.930511663, 111.982777]],
    ),
    schott(
        "N-BAK4",
        &["bak4"],
        334.0,
        &[[1.28834642, 0.00779980626], [0.132817724, 0.0315631177], [0.945395373, 105.965875]],
    ),
    schott(
        "N-SK2",
        &[],
        310.0,
        &[[1.28189012, 0.0072719164], [0.257738258, 0.0242823527], [0.96818604, 110.377773]],
    ),
    schott(
        "N-FK51A",
        &[],
        290.0,
        &[[0.971247817, 0.00472301995], [0.216901417, 0.0153575612], [0.904651666, 168.68133]],
    ),
    schott(
        "N-LAK8",
        &[],
        310.0,
        &[[1.33183167, 0.00620023871], [0.546623206, 0.0216465439], [1.19084015, 82.5827736]],
    ),
    schott(
        "N-LAK22",
        &[],
        310.0,
        &[[1.14229781, 0.00585778594], [0.535138441, 0.0198546147], [1.04088385, 100.834017]],
    ),
    schott(
        "N-BAF10",
        &["baf10"],
        350.0,
        &[[1.5851495, 0.00926681282], [0.143559385, 0.0424489805], [1.08521269, 105.613573]],
    ),
    schott(
        "F2",
        &[],
        320.0,
        &[[1.34533359, 0.00997743871], [0.209073176, 0.0470450767], [0.937357162, 111.886764]],
    ),
    schott(
        "N-F2",
        &[],
        365.0,
        &[[1.39757037, 0.00995906143], [0.159201403, 0.0546931752], [1.2686543, 119.248346]],
    ),
    schott(
        "N-SF5",
        &[],
        370.0,
        &[[1.52481889, 0.011254756], [0.187085527, 0.0588995392], [1.42729015, 129.141675]],
    ),
    schott(
        "N-SF10",
        &[],
        380.0,
        &[[1.62153902, 0.0122241457], [0.256287842, 0.0595736775], [1.64447552, 147.468793]],
    ),
    schott(
        "N-SF11",
        &[],
        370.0,
        &[[1.73759695, 0.013188707], [0.313747346, 0.0623068142], [1.89878101, 155.23629]],
    ),
    schott(
        "N-SF6",
        &[],
        370.0,
        &[[1.77931763, 0.0133714182], [0.338149866, 0.0617533621], [2.08734474, 174.01759]],
    ),
    schott(
        "N-SF57",
        &[],
        370.0,
        &[[1.87543831, 0.0141749518], [0.37375749, 0.0640509927], [2.30001797, 177.389795]],
    ),
    schott(
        "N-LASF9",
        &[],
        365.0,
        &[[2.00029547, 0.0121426017], [0.298926886, 0.0538736236], [1.80691843, 156.530829]],
    ),
    Entry {
        name: "B270",
        aliases: &["b 270", "schott b 270"],
        source: "Schott, data sheet B 270, August 1993, 20 °C",
        range_nm: [435.83, 656.27],
        index: Listed::Points(&[
            [435.83, 1.5341],
            [479.99, 1.5297],
            [486.13, 1.5292],
            [546.07, 1.5251],
            [587.56, 1.5230],
            [589.29, 1.5229],
            [643.85, 1.5207],
            [656.27, 1.5203],
        ]),
    },
    Entry {
        name: "D263",
        aliases: &["d263t eco", "d 263"],
        source: SCHOTT,
        range_nm: [334.0, 2325.0],
        index: Listed::Sellmeier(&[
            [1.23795755, 0.00863080926],
            [0.0466468888, 0.0469074501],
            [2.46700556, 264.146296],
        ]),
    },
    plastic("PMMA", &["acrylic"], &[[1.1819, 0.011313]]),
    plastic("PC", &["polycarbonate"], &[[1.4182, 0.021304]]),
    plastic("PS", &["polystyrene"], &[[1.4435, 0.020216]]),
    plastic("SMMA", &["nas-21", "styrene methyl methacrylate"], &[[1.3912, 0.018282]]),
    plastic("COP", &["zeonex e48r", "cyclo olefin polymer"], &[[1.2969, 0.011721]]),
    Entry {
        name: "fused silica",
        aliases: &["silica", "sio2", "fused_silica"],
        source: "Malitson, J. Opt. Soc. Am. 55, 1205 (1965), 20 °C",
        range_nm: [210.0, 3710.0],
        index: Listed::Sellmeier(&[
            [0.6961663, 0.0684043 * 0.0684043],
            [0.4079426, 0.1162414 * 0.1162414],
            [0.8974794, 9.896161 * 9.896161],
        ]),
    },
    Entry {
        name: "CaF2",
        aliases: &["calcium fluoride", "fluorite"],
        source: "Malitson, Appl. Opt. 2, 1103 (1963), 24 °C",
        range_nm: [230.0, 9700.0],
        index: Listed::Sellmeier(&[
            [0.5675888, 0.050263605 * 0.050263605],
            [0.4710914, 0.1003909 * 0.1003909],
            [3.8484723, 34.649040 * 34.649040],
        ]),
    },
    Entry {
        name: "silicone",
        aliases: &["pdms", "sylgard 184"],
        source: "Schneider, Draheim, Kamberger, Wallrabe, Sens. Actuators A 151, 95 (2009), Sylgard 184",
        range_nm: [350.0, 700.0],
        index: Listed::Sellmeier(&[[1.0093, 0.013185]]),
    },
    Entry {
        name: "water",
        aliases: &["h2o"],
        source: "Daimon, Masumura, Appl. Opt. 46, 3811 (2007), 20.0 °C",
        range_nm: [182.0, 1129.0],
        index: Listed::Sellmeier(&[
            [5.684027565e-1, 5.101829712e-3],
            [1.726177391e-1, 1.821153936e-2],
            [2.086189578e-2, 2.620722293e-2],
            [1.130748688e-1, 1.069792721e1],
        ]),
    },
];

/// The entry with this name or alias, in any case, blanks around it passed over.
fn entry(name: &str) -> Option<&'static Entry> {
    let wanted = name.trim().to_lowercase();
    ENTRIES.iter().find(|e| e.name.to_lowercase() == wanted || e.aliases.contains(&wanted.as_str()))
}

/// The clear medium of that name or alias, in any case, blanks around it passed over; it has the catalogue's name. `None` where the
/// catalogue has none. Its formula is evaluated beyond [`range_nm`] too.
///
/// ```
/// use lampyris::optics::{catalogue, line};
/// assert!((catalogue::medium("N-BK7").unwrap().index.value(line::D) - 1.516800).abs() < 1e-6);
/// ```
pub fn medium(name: &str) -> Option<Medium> {
    let entry = entry(name)?;
    let index = match entry.index {
        Listed::Sellmeier(terms) => Index::Sellmeier(terms.to_vec()),
        Listed::Points(points) => Index::Table(Table::new("index", points.iter().map(|p| (p[0], p[1]))).ok()?),
    };
    Some(Medium::clear(entry.name, index))
}

/// Names of all media, without aliases.
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|e| e.name)
}

/// Where a medium's index comes from, for people; `None` where the catalogue has no such medium.
pub fn source(name: &str) -> Option<&'static str> {
    entry(name).map(|e| e.source)
}

/// First and last vacuum wavelength that the source vouches for, nm; `None` where the catalogue has no such medium.
pub fn range_nm(name: &str) -> Option<[f64; 2]> {
    entry(name).map(|e| e.range_nm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::line;

    #[test]
    fn indices_at_the_lines() {
        let lines = [line::F, line::E, line::D, line::HE_NE, line::C];
        for (name, expected) in [
            ("N-BK7", [1.522376, 1.518722, 1.516800, 1.515089, 1.514322]),
            ("PMMA", [1.497105, 1.492819, 1.490618, 1.488711, 1.487878]),
            ("PC", [1.599598, 1.589753, 1.584763, 1.580472, 1.578607]),
        ] {
            let index = medium(name).unwrap().index;
            for (nm, n) in lines.into_iter().zip(expected) {
                assert!((index.value(nm) - n).abs() < 1e-6, "{name} at {nm}: {}", index.value(nm));
            }
        }
        assert!((medium("bk7").unwrap().index.abbe_number() - 64.17).abs() < 5e-3);
    }

    /// n_d and V_d as Schott's data sheets print them.
    #[test]
    fn glasses_are_those_of_the_data_sheets() {
        for (name, n, v) in [
            ("N-BK7", 1.5168, 64.17),
            ("N-K5", 1.52249, 59.48),
            ("N-BAK4", 1.56883, 55.98),
            ("N-SK2", 1.60738, 56.65),
            ("N-FK51A", 1.48656, 84.47),
            ("N-LAK8", 1.713, 53.83),
            ("N-LAK22", 1.65113, 55.89),
            ("N-BAF10", 1.67003, 47.11),
            ("F2", 1.62004, 36.37),
            ("N-F2", 1.62005, 36.43),
            ("N-SF5", 1.67271, 32.25),
            ("N-SF10", 1.72828, 28.53),
            ("N-SF11", 1.78472, 25.68),
            ("N-SF6", 1.80518, 25.36),
            ("N-SF57", 1.84666, 23.78),
            ("N-LASF9", 1.85025, 32.17),
            ("D263", 1.523303, 54.5172),
            ("B270", 1.5230, 58.5),
        ] {
            let index = medium(name).unwrap().index;
            let (found, abbe) = (index.value(line::D), index.abbe_number());
            // The sheet of B 270 has four digits.
            let (within, within_abbe) = if name == "B270" { (5e-5, 0.3) } else { (6e-6, 6e-3) };
            assert!((found - n).abs() < within && (abbe - v).abs() < within_abbe, "{name}: {found} {abbe}");
        }
    }

    #[test]
    fn indices_printed_by_their_sources() {
        // Malitson's table: 1.45846 at the helium d line. Daimon and Masumura: 1.33336 to 1.33344 at d, 20 °C,
        // against vacuum.
        for (name, nm, n, within) in [
            ("fused silica", line::D, 1.45846, 1e-5),
            ("water", line::D, 1.3334, 1.5e-4),
            // What refractiveindex.info shows for Sylgard 184; RTV 615, of the same paper, has 1.43025.
            ("silicone", 589.3, 1.43148, 1e-5),
            // Malitson's own table for calcium fluoride; Zeon's data sheet of E48R; Sultanova's table for styrene plastics.
            ("CaF2", line::D, 1.43384, 2e-5),
            ("COP", line::D, 1.5305, 1e-3),
            ("PS", line::D, 1.5917, 1e-3),
            ("SMMA", line::D, 1.5715, 2e-3),
        ] {
            let index = medium(name).unwrap().index;
            assert!((index.value(nm) - n).abs() < within, "{name}: {}", index.value(nm));
        }
    }

    #[test]
    fn every_entry_has_a_source_and_is_real_over_its_range() {
        for name in names() {
            let [a, b] = range_nm(name).unwrap();
            assert!(!source(name).unwrap().is_empty());
            assert!(medium(name).unwrap().index.checked(&[a, 0.5 * (a + b), b]).is_ok(), "{name}");
        }
        assert!(medium("unobtainium").is_none());
    }
}
