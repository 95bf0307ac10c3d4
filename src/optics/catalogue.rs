//! A few media every lamp uses, each index with its source.
//!
//! Coefficients as given by the refractiveindex.info database (CC0). All are clear: how much a plastic absorbs depends on
//! grade, colour and age, so a scene has to say it.

use super::media::{Index, Medium};

/// A medium of the catalogue.
struct Entry {
    name: &'static str,
    /// Other spellings, lower case.
    aliases: &'static [&'static str],
    source: &'static str,
    range_nm: [f64; 2],
    sellmeier: &'static [[f64; 2]],
}

const ENTRIES: &[Entry] = &[
    Entry {
        name: "N-BK7",
        aliases: &["bk7", "nbk7"],
        source: "Schott zemax catalogue 2017-01-20",
        range_nm: [300.0, 2500.0],
        sellmeier: &[[1.03961212, 0.00600069867], [0.231792344, 0.0200179144], [1.01046945, 103.560653]],
    },
    Entry {
        name: "PMMA",
        aliases: &["acrylic"],
        source: "Sultanova, Kasarova, Nikolov, Acta Phys. Pol. A 116, 585 (2009), 20 °C",
        range_nm: [436.8, 1052.0],
        sellmeier: &[[1.1819, 0.011313]],
    },
    Entry {
        name: "PC",
        aliases: &["polycarbonate"],
        source: "Sultanova, Kasarova, Nikolov, Acta Phys. Pol. A 116, 585 (2009), 20 °C",
        range_nm: [436.8, 1052.0],
        sellmeier: &[[1.4182, 0.021304]],
    },
    Entry {
        name: "fused silica",
        aliases: &["silica", "sio2", "fused_silica"],
        source: "Malitson, J. Opt. Soc. Am. 55, 1205 (1965), 20 °C",
        range_nm: [210.0, 3710.0],
        sellmeier: &[
            [0.6961663, 0.0684043 * 0.0684043],
            [0.4079426, 0.1162414 * 0.1162414],
            [0.8974794, 9.896161 * 9.896161],
        ],
    },
    Entry {
        name: "silicone",
        aliases: &["pdms", "sylgard 184"],
        source: "Schneider, Draheim, Kamberger, Wallrabe, Sens. Actuators A 151, 95 (2009), Sylgard 184",
        range_nm: [400.0, 1000.0],
        sellmeier: &[[1.0057, 0.013217]],
    },
    Entry {
        name: "water",
        aliases: &["h2o"],
        source: "Daimon, Masumura, Appl. Opt. 46, 3811 (2007), 20.0 °C",
        range_nm: [182.0, 1129.0],
        sellmeier: &[
            [5.684027565e-1, 5.101829712e-3],
            [1.726177391e-1, 1.821153936e-2],
            [2.086189578e-2, 2.620722293e-2],
            [1.130748688e-1, 1.069792721e1],
        ],
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
    entry(name).map(|e| Medium::clear(e.name, Index::Sellmeier(e.sellmeier.to_vec())))
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

    #[test]
    fn indices_printed_by_their_sources() {
        // Malitson's table: 1.45846 at the helium d line. Daimon and Masumura: 1.33336 to 1.33344 at d, 20 °C,
        // against vacuum. Data sheet of Sylgard 184: 1.430 at the sodium line.
        for (name, nm, n, within) in [
            ("fused silica", line::D, 1.45846, 1e-5),
            ("water", line::D, 1.3334, 1.5e-4),
            ("silicone", 589.3, 1.430, 1e-3),
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
