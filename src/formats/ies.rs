//! Luminous intensity in the format of IES LM-63: editions of 1986 to 2019 are read, that of 2002 is written.

use super::input::read_bytes;
use super::{Error, ErrorKind, PhotometricType, Photometry, write_atomic};
use std::path::Path;

/// Millimetres in a foot.
const FOOT: f64 = 304.8;
/// Longest line the format allows, its end not counted.
const LONGEST_LINE: usize = 130;
/// Longest number without an exponent, characters: with one none is longer.
const LONGEST_NUMBER: usize = 24;

/// Reads an IES LM-63 file.
///
/// All multipliers are applied: candela multiplier, ballast factor and, before the edition of 2019, ballast-lamp factor. A tilt table is
/// read and left out: it holds for tilted lamps alone.
///
/// # Errors
/// When the file cannot be read or is not LM-63; the message names the line.
pub fn read_ies(path: &Path) -> Result<Photometry, Error> {
    let bytes = read_bytes(path).map_err(|e| Error::new(path, ErrorKind::Read(e)))?;
    parse_ies(path, &String::from_utf8_lossy(&bytes))
}

/// Reads LM-63 text; `path` is for messages alone.
///
/// # Errors
/// As [`read_ies`].
pub fn parse_ies(path: &Path, text: &str) -> Result<Photometry, Error> {
    let mut keywords: Vec<(String, String)> = Vec::new();
    // Old files end their lines by a carriage return alone.
    let text = if text.contains('\n') { text.to_owned() } else { text.replace('\r', "\n") };
    let mut lines = text.lines().enumerate();
    let (tilt_line, tilt) = loop {
        let Some((n, line)) = lines.next() else {
            return Err(Error::at_line(path, 1, "no line starts with TILT=; this is not an IES LM-63 file"));
        };
        let line = line.trim();
        let tilt = line.split_once('=').filter(|(key, _)| key.trim().eq_ignore_ascii_case("TILT"));
        if let Some((_, tilt)) = tilt {
            break (n + 1, tilt.trim());
        }
        if let Some((name, value)) = line.strip_prefix('[').and_then(|l| l.split_once(']')) {
            match keywords.last_mut() {
                // MORE goes on with the keyword before; without one it is kept as it stands.
                Some((_, before)) if name.eq_ignore_ascii_case("MORE") => {
                    before.push('\n');
                    before.push_str(value.trim());
                }
                _ => keywords.push((name.trim().to_uppercase(), value.trim().to_owned())),
            }
        }
    };
    // Behind TILT line breaks mean nothing: numbers follow each other as they come.
    let rest: Vec<(usize, &str)> = lines
        .flat_map(|(n, l)| l.split([' ', '\t', ',', '\r']).filter(|w| !w.is_empty()).map(move |w| (n + 1, w)))
        .collect();
    let mut numbers = Numbers { path, words: &rest, at: 0, last_line: tilt_line };
    numbers.skip_tilt_table(tilt)?;
    let lamps = numbers.read_number("number of lamps")?;
    let lumens_per_lamp = numbers.read_number("lumens per lamp")?;
    let multiplier = numbers.read_number("candela multiplier")?;
    let rows = numbers.read_count("number of vertical angles")?;
    let planes = numbers.read_count("number of horizontal angles")?;
    let kind = match numbers.read_number("photometric type")? {
        1.0 => PhotometricType::C,
        2.0 => PhotometricType::B,
        3.0 => PhotometricType::A,
        other => return Err(numbers.error(format!("photometric type {other}: must be 1 (C), 2 (B) or 3 (A)"))),
    };
    let unit = match numbers.read_number("unit type")? {
        1.0 => FOOT,
        2.0 => 1000.0,
        other => return Err(numbers.error(format!("unit type {other}: must be 1 (feet) or 2 (metres)"))),
    };
    let opening = numbers.read_list(3, "width, length and height")?;
    let ballast = numbers.read_number("ballast factor")?;
    let lamp_factor = numbers.read_number("ballast-lamp photometric factor")?;
    // Some editors put a byte order mark before the first line.
    let header = text.trim_start_matches('\u{feff}').trim_start();
    // LM-63-2019 keeps a code for how the file was made in the field that held the ballast-lamp factor.
    let factor = if header.starts_with("IES:LM-63-2019") { ballast } else { ballast * lamp_factor };
    let watts = numbers.read_number("input watts")?;
    let vertical_deg = numbers.read_ascending(rows, "vertical angles")?;
    let horizontal_deg = numbers.read_ascending(planes, "horizontal angles")?;
    let mut candela = numbers.read_list(rows.saturating_mul(planes), "candela values")?;
    numbers.expect_end()?;
    candela.iter_mut().for_each(|c| *c *= multiplier * factor);
    if let Some(bad) = candela.iter().find(|c| !(**c >= 0.0 && c.is_finite())) {
        return Err(numbers.error(format!("an intensity of {bad} cd; intensities must be zero or more")));
    }
    Ok(Photometry {
        kind,
        horizontal_deg,
        vertical_deg,
        candela,
        lamp_lumens: (lumens_per_lamp > 0.0).then_some(lamps * lumens_per_lamp),
        watts,
        opening_mm: [opening[0] * unit, opening[1] * unit, opening[2] * unit],
        keywords,
    })
}

/// The free-format numbers after the TILT line, each with its line.
struct Numbers<'a> {
    path: &'a Path,
    /// Each word with the number of its line.
    words: &'a [(usize, &'a str)],
    /// Index of the next word.
    at: usize,
    /// Line of the word read last, or of TILT before any.
    last_line: usize,
}

impl Numbers<'_> {
    /// Reads over the table that a TILT line announces; an error where it refers to another file.
    fn skip_tilt_table(&mut self, tilt: &str) -> Result<(), Error> {
        match tilt.to_uppercase().as_str() {
            "NONE" => Ok(()),
            "INCLUDE" => {
                self.read_number("lamp-to-luminaire geometry")?;
                let count = self.read_count("number of tilt angles")?;
                self.read_list(count.saturating_mul(2), "tilt table").map(|_| ())
            }
            _ => Err(self.error(format!(
                "TILT={tilt} refers to another file; write TILT=NONE, or TILT=INCLUDE with its table"
            ))),
        }
    }

    /// An error at the line of the number read last.
    fn error(&self, message: String) -> Error {
        Error::at_line(self.path, self.last_line, message)
    }

    /// Reads the next number, which must be finite; `what` names it in the error.
    fn read_number(&mut self, what: &str) -> Result<f64, Error> {
        let Some(&(line, word)) = self.words.get(self.at) else {
            return Err(self.error(format!("the file ends where the {what} should follow")));
        };
        self.at += 1;
        self.last_line = line;
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(self.error(format!("'{word}' is not a number ({what})"))),
        }
    }

    /// Reads the next number, which must be whole, at least 1 and no more than the file has numbers.
    fn read_count(&mut self, what: &str) -> Result<usize, Error> {
        let (x, most) = (self.read_number(what)?, self.words.len());
        // No count can exceed the numbers that are there: a lie about it costs no memory.
        if x >= 1.0 && x.fract() == 0.0 && x <= most as f64 {
            Ok(x as usize)
        } else {
            Err(self.error(format!("{what} is {x}, not a whole number from 1 to {most}, the numbers of the file")))
        }
    }

    /// Reads `count` numbers; an error where fewer are left.
    fn read_list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Error> {
        // Asked before the loop, so that the message names what the file promises.
        let left = self.words.len() - self.at;
        if count > left {
            return Err(self.error(format!("{count} numbers should follow ({what}), but only {left} do")));
        }
        (0..count).map(|_| self.read_number(what)).collect()
    }

    /// Refuses numbers behind the last that the file promises: others may have been taken for them. Words that are none are left alone.
    fn expect_end(&self) -> Result<(), Error> {
        let mut left = self.words[self.at..].iter();
        let Some((line, word)) = left.find(|(_, word)| word.parse::<f64>().is_ok()) else { return Ok(()) };
        let message = format!(
            "'{word}' stands behind the last candela value; a comma parts two numbers, decimals have a point"
        );
        Err(Error::at_line(self.path, *line, message))
    }

    /// Reads `count` numbers, each above the one before.
    fn read_ascending(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Error> {
        let list = self.read_list(count, what)?;
        // Interpolation divides by the steps.
        match list.windows(2).find(|p| p[1] <= p[0]) {
            Some(p) => Err(self.error(format!("{what} must ascend, but {} follows {}", p[1], p[0]))),
            None => Ok(list),
        }
    }
}

/// Writes an IES LM-63-2002 file. Angles and candela are written so that they read back bit for bit.
///
/// # Errors
/// When the shape of the data is inconsistent or the file cannot be written.
pub fn write_ies(path: &Path, p: &Photometry) -> Result<(), Error> {
    let text = ies_text(p).map_err(|m| Error::new(path, ErrorKind::Malformed(m)))?;
    write_atomic(path, |w| w.write_all(text.as_bytes()))
}

/// The text of an LM-63-2002 file, with absolute photometry where the lamp's lumens are not known; an error, for people, where intensities
/// do not fill their planes.
fn ies_text(p: &Photometry) -> Result<String, String> {
    let (planes, rows) = (p.horizontal_deg.len(), p.vertical_deg.len());
    if planes == 0 || rows == 0 || p.candela.len() != planes * rows {
        return Err(format!("{} intensities do not fill {planes} planes of {rows} angles", p.candela.len()));
    }
    // A reader would take `NaN` or `inf` for the end of the numbers.
    let numbers = p.vertical_deg.iter().chain(&p.horizontal_deg).chain(&p.candela);
    let head = p.opening_mm.iter().chain([&p.watts]).chain(&p.lamp_lumens);
    if let Some(bad) = numbers.chain(head).find(|x| !x.is_finite()) {
        return Err(format!(
            "{bad} among the intensities, angles, lumens, watts or lengths; LM-63 holds finite numbers alone"
        ));
    }
    let mut out = Lines::default();
    out.line("IESNA:LM-63-2002");
    for (name, value) in &p.keywords {
        // A bracket would end the name. A keyword is one line; what follows stands under MORE.
        let name = name.replace(['[', ']'], "");
        for (i, part) in value.split('\n').enumerate() {
            let line = format!("[{}] {part}", if i == 0 { &name } else { "MORE" });
            out.line(&line.replace(char::is_control, ""));
        }
    }
    out.line("TILT=NONE");
    let kind = match p.kind {
        PhotometricType::C => 1,
        PhotometricType::B => 2,
        PhotometricType::A => 3,
    };
    // −1 lumens stand for absolute photometry.
    let lumens = p.lamp_lumens.map_or("-1".to_owned(), number_word);
    let [width, length, height] = p.opening_mm.map(|x| number_word(x / 1000.0));
    out.line(&format!("1 {lumens} 1 {rows} {planes} {kind} 2 {width} {length} {height}"));
    out.line(&format!("1 1 {}", number_word(p.watts)));
    out.numbers(&p.vertical_deg);
    out.numbers(&p.horizontal_deg);
    p.candela.chunks(rows).for_each(|plane| out.numbers(plane));
    Ok(out.0)
}

/// A number in the shortest decimals that read back the same bits, at most 24 characters.
fn number_word(number: f64) -> String {
    let plain = number.to_string();
    // Hundreds of digits are longer than a line: such numbers get an exponent, which Fortran's free format reads too.
    if plain.len() > LONGEST_NUMBER { format!("{number:e}") } else { plain }
}

/// Text with CR LF ends, as the format asks, and lines that are not too long.
#[derive(Default)]
struct Lines(String);

impl Lines {
    /// Adds a line; what is longer than the format allows is cut off.
    fn line(&mut self, text: &str) {
        // Cut rather than broken: the rest of a keyword on a line of its own would be a line of the format.
        self.0.extend(text.chars().take(LONGEST_LINE));
        self.0.push_str("\r\n");
    }

    /// Adds numbers on lines of their own that are not too long.
    fn numbers(&mut self, numbers: &[f64]) {
        let mut line = String::new();
        for number in numbers {
            let word = number_word(*number);
            if !line.is_empty() && line.len() + 1 + word.len() > LONGEST_LINE {
                self.line(&line);
                line.clear();
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(&word);
        }
        self.line(&line);
    }
}

#[cfg(test)]
mod tests {
    use super::super::photometry::tests::{photometry_of, steps};
    use super::*;

    const TEXT: &str = "IESNA:LM-63-1995\n[TEST] 42\n[MANUFAC] A,\n[MORE] and B\nTILT=INCLUDE\n1\n3\n0 45 90\n1.0 .95 .9\n\
        2 1000 2.5 3 2 1 1 0.5 -0.5 0\n0.9 1.0 60\n0 45,90\n0 90\n100 50\n0 200 100 1e0\n";

    fn parse(text: &str) -> Result<Photometry, Error> {
        parse_ies(Path::new("lamp.ies"), text)
    }

    #[test]
    fn a_file_by_hand() {
        let p = parse(TEXT).unwrap();
        assert_eq!((p.kind, p.lamp_lumens, p.watts), (PhotometricType::C, Some(2000.0), 60.0));
        assert_eq!(
            (p.vertical_deg.as_slice(), p.horizontal_deg.as_slice()),
            ([0.0, 45.0, 90.0].as_slice(), [0.0, 90.0].as_slice())
        );
        let expected = [100.0, 50.0, 0.0, 200.0, 100.0, 1.0].map(|c| c * 2.5 * 0.9);
        assert!(p.candela.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
        assert_eq!(p.opening_mm, [152.4, -152.4, 0.0]);
        assert_eq!(p.keywords[1], ("MANUFAC".into(), "A,\nand B".into()));
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        for kind in [PhotometricType::A, PhotometricType::B, PhotometricType::C] {
            let p = photometry_of(kind, &steps(0.0, 90.0, 37), &steps(0.0, 90.0, 41), |h, v| {
                (1.0 + h).sqrt() * 1e3 / (1.0 + v)
            });
            let path = folder.path().join("a.ies");
            write_ies(&path, &p).unwrap();
            assert_eq!(read_ies(&path).unwrap(), p);
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.lines().all(|l| l.len() < 132) && text.ends_with("\r\n"));
        }
    }

    #[test]
    fn numbers_of_hundreds_of_digits_are_not_cut() {
        let extremes = [1e200, f64::MAX, 5e-324, -0.0, f64::MIN_POSITIVE.next_up(), 0.1];
        let mut p = photometry_of(PhotometricType::C, &[0.0], &steps(0.0, 90.0, 5), |_, _| 1.0);
        p.candela = extremes.to_vec();
        (p.lamp_lumens, p.watts) = (Some(1.234_567_890_123_456_7e-200), 2e250);
        let text = ies_text(&p).unwrap();
        assert!(text.lines().all(|l| l.len() <= LONGEST_LINE));
        let back = parse(&text).unwrap();
        assert_eq!((back.candela, back.lamp_lumens, back.watts), (p.candela, p.lamp_lumens, p.watts));
    }

    #[test]
    fn an_independent_reader_finds_the_same_intensities() {
        let p = photometry_of(PhotometricType::C, &steps(0.0, 180.0, 4), &steps(0.0, 90.0, 6), |h, v| {
            10.0 + h + 2.0 * v
        });
        let text = ies_text(&Photometry { lamp_lumens: Some(1000.0), ..p.clone() }).unwrap();
        let other = eulumdat::IesParser::parse(&text).unwrap();
        for (i, plane) in other.intensities.iter().enumerate().take(5) {
            for (j, c) in plane.iter().enumerate() {
                assert!((c - p.candela[i * 7 + j]).abs() < 1e-9, "{i} {j}: {c}");
            }
        }
        assert_eq!(other.g_angles, p.vertical_deg);
    }

    #[test]
    fn headers_may_be_spelt_as_old_programs_did() {
        let whole = parse(TEXT).unwrap();
        for odd in [
            TEXT.replace("TILT=", "TILT = "),
            TEXT.replace("TILT=", "Tilt="),
            TEXT.replace('\r', "").replace('\n', "\r"),
            TEXT.replace('\r', "").replace('\n', "\r\n"),
            format!("\u{feff}{TEXT}\u{1a}"),
        ] {
            assert_eq!(parse(&odd).unwrap().candela, whole.candela, "{odd}");
        }
    }

    #[test]
    fn the_code_of_a_file_of_2019_weighs_nothing() {
        let coded = TEXT.replacen("IESNA:LM-63-1995", "IES:LM-63-2019", 1).replacen("0.9 1.0 60", "0.9 1.1 60", 1);
        let whole = parse(TEXT).unwrap().candela;
        // Some editors put a byte order mark before the first line, which is not yet the end of it.
        for text in [coded.clone(), format!("\u{feff}{coded}")] {
            assert_eq!(parse(&text).unwrap().candela, whole);
        }
    }

    #[test]
    fn refusals_name_the_line() {
        for (wrong, right, message) in [
            ("3 2 1 1", "3 2 7 1", "photometric type 7"),
            ("3 2 1 1", "300000000 2 1 1", "angles is 300000000, not a whole number from 1 to"),
            ("3 2 1 1", "2.5 2 1 1", "number of vertical angles is 2.5, not a whole number"),
            ("1e0", "", "candela values"),
            ("45,90", "45,45", "must ascend"),
            ("TILT=INCLUDE", "TILT=lamp.tlt", "refers to another file"),
            ("TILT=INCLUDE", "", "not an IES LM-63 file"),
            ("200 100", "200 x", "'x' is not a number"),
            ("2.5 3", "-2.5 3", "zero or more"),
        ] {
            let e = parse(&TEXT.replace(wrong, right)).unwrap_err().to_string();
            assert!(e.contains(message) && e.starts_with("lamp.ies:"), "{e}");
        }
    }

    #[test]
    fn damaged_files_are_refused_or_read_but_never_panic() {
        // Every truncation, and every byte replaced by bytes that matter to a parser.
        for cut in 0..TEXT.len() {
            let _ = parse(&TEXT[..cut]);
            for byte in ["-", "9", "e", " ", "\n", "[", "\u{0}"] {
                let _ = parse(&format!("{}{byte}{}", &TEXT[..cut], &TEXT[cut + 1..]));
            }
        }
    }
}
