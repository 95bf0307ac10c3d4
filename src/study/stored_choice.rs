//! A choice with everything that its pilot found as words of 64 bits, to the last bit, and back: parts of a run take it from each other in
//! place of a pilot of their own.
//!
//! One function goes through all that is kept, for writing and for reading alike, so that neither can leave out what the other has. Each
//! `exchange_` function appends its value's words to a `Writer`, or replaces the value by what the next words of a `Reader` say; `None`
//! where they end too early or say nothing that the value can be.

use super::default_accuracy::{Alternative, TracingChoice};
use super::geometric_error::{
    AbsorbedError, ChannelError, EndErrors, FaceError, GeometricError, MapError, Paired, ReceiverError, Statistical,
};
use crate::intersect::NormalMode;

/// The first word; what begins with another is of another version.
const FORM: u64 = 6;
/// What a choice can name, by its number.
const INTERSECTORS: [&str; 2] = ["octree", "exact"];
/// What positions on a receiver are counted in, by its number.
const UNITS: [&str; 3] = ["", "mm", "deg"];

impl TracingChoice {
    /// Returns everything about the choice, what its pilot found among it, as words.
    pub fn to_words(&self) -> Vec<u64> {
        let mut writer = Writer(vec![FORM]);
        let written = exchange_choice(&mut writer, &mut self.clone());
        debug_assert!(written.is_some(), "{self:?}");
        writer.0
    }

    /// Returns the choice that was written as these words; `None` where they are of another version or are no choice.
    pub fn from_words(words: &[u64]) -> Option<Self> {
        let mut reader = Reader(words.strip_prefix(&[FORM])?);
        let mut choice = Self {
            tolerance_mm: [0.0; 2],
            normals: NormalMode::default(),
            intersector: INTERSECTORS[0],
            because: String::new(),
            has_no_surface: false,
            pilot_rays: 0,
            pilot_seconds: 0.0,
            alternatives: Vec::new(),
            geometric: None,
        };
        exchange_choice(&mut reader, &mut choice)?;
        // What follows was not written by this program.
        reader.0.is_empty().then_some(choice)
    }
}

/// Where words go to, or come from.
trait Words {
    /// Writes the word, or puts the next one in its place; `None` where there is none left.
    fn word(&mut self, word: &mut u64) -> Option<()>;

    /// Returns the number of words that are left, the most items that a list can have: memory is not asked for more. No limit for a writer.
    fn longest_list(&self) -> usize;
}

struct Writer(Vec<u64>);

impl Words for Writer {
    fn word(&mut self, word: &mut u64) -> Option<()> {
        self.0.push(*word);
        Some(())
    }

    fn longest_list(&self) -> usize {
        usize::MAX
    }
}

struct Reader<'a>(&'a [u64]);

impl Words for Reader<'_> {
    fn word(&mut self, word: &mut u64) -> Option<()> {
        let (first, rest) = self.0.split_first()?;
        (*word, self.0) = (*first, rest);
        Some(())
    }

    fn longest_list(&self) -> usize {
        self.0.len()
    }
}

/// Writes or reads a choice.
fn exchange_choice(words: &mut dyn Words, choice: &mut TracingChoice) -> Option<()> {
    // Taken apart, here and below, so that a new field is not forgotten.
    let TracingChoice {
        tolerance_mm,
        normals,
        intersector,
        because,
        has_no_surface,
        pilot_rays,
        pilot_seconds,
        alternatives,
        geometric,
    } = choice;
    exchange_numbers(words, tolerance_mm)?;
    exchange_name(words, normals, &NormalMode::ALL)?;
    exchange_name(words, intersector, &INTERSECTORS)?;
    exchange_text(words, because)?;
    exchange_name(words, has_no_surface, &[false, true])?;
    words.word(pilot_rays)?;
    exchange_number(words, pilot_seconds)?;
    let blank = Alternative {
        tolerance_mm: [0.0; 2],
        normals: NormalMode::default(),
        intersector: INTERSECTORS[0],
        seconds: 0.0,
        geometric_share: None,
        geometric_to_statistical: 0.0,
        figure: String::new(),
    };
    exchange_list(words, alternatives, &blank, exchange_alternative)?;
    exchange_option(words, geometric, &GeometricError::default(), exchange_error)
}

/// Writes or reads one way to trace a run.
fn exchange_alternative(words: &mut dyn Words, alternative: &mut Alternative) -> Option<()> {
    let Alternative {
        tolerance_mm,
        normals,
        intersector,
        seconds,
        geometric_share,
        geometric_to_statistical,
        figure,
    } = alternative;
    exchange_numbers(words, tolerance_mm)?;
    exchange_name(words, normals, &NormalMode::ALL)?;
    exchange_name(words, intersector, &INTERSECTORS)?;
    exchange_number(words, seconds)?;
    exchange_option(words, geometric_share, &0.0, exchange_number)?;
    exchange_number(words, geometric_to_statistical)?;
    exchange_text(words, figure)
}

/// Writes or reads what facets change of a run.
fn exchange_error(words: &mut dyn Words, error: &mut GeometricError) -> Option<()> {
    let GeometricError { rays, lost, segments_per_ray, seconds, power, receivers, absorbed, faces } = error;
    words.word(rays)?;
    exchange_numbers(words, lost)?;
    exchange_number(words, segments_per_ray)?;
    exchange_numbers(words, seconds)?;
    let EndErrors { received, absorbed: all_absorbed, escaped, cut_off } = power;
    for end in [received, all_absorbed, escaped, cut_off] {
        exchange_paired(words, end)?;
    }
    exchange_list(words, receivers, &ReceiverError::default(), exchange_receiver)?;
    exchange_list(words, absorbed, &AbsorbedError::default(), exchange_absorbed)?;
    exchange_list(words, faces, &FaceError::default(), exchange_face)
}

/// Writes or reads what facets change of the power that a body or medium took.
fn exchange_absorbed(words: &mut dyn Words, absorbed: &mut AbsorbedError) -> Option<()> {
    let AbsorbedError { name, r#in, power, statistical, index } = absorbed;
    exchange_text(words, name)?;
    exchange_text(words, r#in)?;
    exchange_paired(words, power)?;
    exchange_number(words, statistical)?;
    exchange_count(words, index)
}

/// Writes or reads what facets change of the power at a face.
fn exchange_face(words: &mut dyn Words, error: &mut FaceError) -> Option<()> {
    let FaceError { face, absorbed, entered, left, statistical } = error;
    let mut word = u64::from(*face);
    words.word(&mut word)?;
    *face = u32::try_from(word).ok()?;
    [absorbed, entered, left].into_iter().try_for_each(|paired| exchange_paired(words, paired))?;
    exchange_numbers(words, statistical)
}

/// Writes or reads what facets change of a receiver.
fn exchange_receiver(words: &mut dyn Words, receiver: &mut ReceiverError) -> Option<()> {
    let ReceiverError {
        name,
        unit,
        power,
        centroid,
        rms,
        width,
        peak,
        peak_cells,
        map,
        pooled_cells,
        statistical,
        cells,
        channels,
    } = receiver;
    exchange_text(words, name)?;
    exchange_name(words, unit, &UNITS)?;
    for paired in [power, peak].into_iter().chain(centroid).chain(rms).chain(width) {
        exchange_paired(words, paired)?;
    }
    exchange_count(words, peak_cells)?;
    exchange_count(words, pooled_cells)?;
    let MapError { geometric, noise, statistical: of_map } = map;
    exchange_numbers(words, [geometric, noise, of_map])?;
    let Statistical { power, centroid, rms, peak, map } = statistical;
    exchange_numbers(words, [power, peak, map].into_iter().chain(centroid).chain(rms))?;
    exchange_list(words, cells, &0.0, exchange_number)?;
    exchange_list(words, channels, &ChannelError::default(), exchange_channel)
}

/// Writes or reads what facets change of a channel.
fn exchange_channel(words: &mut dyn Words, channel: &mut ChannelError) -> Option<()> {
    let ChannelError { name, total, statistical, cells } = channel;
    exchange_text(words, name)?;
    exchange_paired(words, total)?;
    exchange_number(words, statistical)?;
    exchange_list(words, cells, &0.0, exchange_number)
}

/// Writes or reads a figure on facets and on the spline.
fn exchange_paired(words: &mut dyn Words, paired: &mut Paired) -> Option<()> {
    let Paired { facets, spline, error } = paired;
    exchange_numbers(words, [facets, spline, error])
}

/// Writes or reads a number by its bits: text would round the last one.
fn exchange_number(words: &mut dyn Words, number: &mut f64) -> Option<()> {
    let mut bits = number.to_bits();
    words.word(&mut bits)?;
    *number = f64::from_bits(bits);
    Some(())
}

/// Writes or reads numbers in their order.
fn exchange_numbers<'n>(words: &mut dyn Words, numbers: impl IntoIterator<Item = &'n mut f64>) -> Option<()> {
    numbers.into_iter().try_for_each(|number| exchange_number(words, number))
}

/// Writes or reads a number of items.
fn exchange_count(words: &mut dyn Words, count: &mut usize) -> Option<()> {
    let mut word = *count as u64;
    words.word(&mut word)?;
    *count = usize::try_from(word).ok()?;
    Some(())
}

/// Writes or reads one of `all`, as its index among them; `None` where it is none of them.
fn exchange_name<T: Copy + PartialEq>(words: &mut dyn Words, value: &mut T, all: &[T]) -> Option<()> {
    let mut number = all.iter().position(|one| one == value)?;
    exchange_count(words, &mut number)?;
    *value = *all.get(number)?;
    Some(())
}

/// Writes or reads a text, a word for each letter.
fn exchange_text(words: &mut dyn Words, text: &mut String) -> Option<()> {
    let mut letters: Vec<char> = text.chars().collect();
    exchange_list(words, &mut letters, &' ', |words, letter| {
        let mut word = u64::from(*letter);
        words.word(&mut word)?;
        *letter = u32::try_from(word).ok().and_then(char::from_u32)?;
        Some(())
    })?;
    *text = letters.into_iter().collect();
    Some(())
}

/// Writes or reads the number of items, then each; `blank` is what an item is read into.
fn exchange_list<T: Clone>(
    words: &mut dyn Words,
    items: &mut Vec<T>,
    blank: &T,
    exchange: impl Fn(&mut dyn Words, &mut T) -> Option<()>,
) -> Option<()> {
    let mut count = items.len();
    exchange_count(words, &mut count)?;
    if count > words.longest_list() {
        return None;
    }
    items.resize(count, blank.clone());
    items.iter_mut().try_for_each(|item| exchange(words, item))
}

/// Writes or reads one item or none, as a list.
fn exchange_option<T: Clone>(
    words: &mut dyn Words,
    value: &mut Option<T>,
    blank: &T,
    exchange: impl Fn(&mut dyn Words, &mut T) -> Option<()>,
) -> Option<()> {
    let mut items: Vec<T> = value.take().into_iter().collect();
    exchange_list(words, &mut items, blank, exchange)?;
    *value = items.pop();
    items.is_empty().then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A choice none of whose numbers is another's, with some that no text holds.
    fn choice() -> TracingChoice {
        let paired = |k: f64| Paired { facets: k, spline: k + 0.1, error: f64::MIN_POSITIVE * k };
        let receiver = ReceiverError {
            name: "Wand – süd".into(),
            unit: "deg",
            power: paired(1.0),
            centroid: [paired(2.0), paired(3.0)],
            rms: [paired(4.0), paired(5.0)],
            width: [paired(6.0), paired(7.0)],
            peak: paired(8.0),
            peak_cells: 3,
            map: MapError { geometric: 0.3, noise: 0.7, statistical: f64::INFINITY },
            pooled_cells: 4,
            statistical: Statistical {
                power: 0.1,
                centroid: [0.2, 0.4],
                rms: [0.5, 0.6],
                peak: 0.8,
                map: 1.0 / 3.0,
            },
            cells: vec![0.0, 1.0 / 7.0, -0.0],
            channels: vec![ChannelError {
                name: "X".into(),
                total: paired(9.0),
                statistical: 0.9,
                cells: vec![2.0 / 7.0],
            }],
        };
        let alternative = Alternative {
            tolerance_mm: [0.01, 0.02],
            normals: NormalMode::Exact,
            intersector: "exact",
            seconds: 1.0 / 9.0,
            geometric_share: Some(1e-300),
            geometric_to_statistical: 11.0,
            figure: "wall: max".into(),
        };
        let error = GeometricError {
            rays: 77,
            lost: [1e-9, 2e-9],
            segments_per_ray: 4.5,
            seconds: [0.25, 0.5],
            power: EndErrors {
                received: paired(14.0),
                absorbed: paired(15.0),
                escaped: paired(16.0),
                cut_off: paired(17.0),
            },
            receivers: vec![receiver, ReceiverError::default()],
            absorbed: vec![AbsorbedError {
                name: "Körper".into(),
                r#in: "faces".into(),
                power: paired(13.0),
                statistical: 0.01,
                index: 5,
            }],
            faces: vec![FaceError {
                face: 12,
                absorbed: paired(10.0),
                entered: paired(11.0),
                left: paired(12.0),
                statistical: [13.0, 14.0, 15.0],
            }],
        };
        TracingChoice {
            tolerance_mm: [0.1 + 0.2, 0.7],
            normals: NormalMode::Bilinear,
            intersector: "octree",
            because: "facets change nothing".into(),
            has_no_surface: true,
            pilot_rays: 4096,
            pilot_seconds: 1.0 / 3.0,
            alternatives: vec![Alternative { geometric_share: None, ..alternative.clone() }, alternative],
            geometric: Some(error),
        }
    }

    #[test]
    fn a_choice_comes_back_to_the_bit() {
        for kept in [choice(), TracingChoice { geometric: None, ..choice() }] {
            let words = kept.to_words();
            let back = TracingChoice::from_words(&words).unwrap();
            assert_eq!(back, kept);
            // Zeros of either sign are equal as numbers.
            assert_eq!(back.to_words(), words);
        }
    }

    #[test]
    fn other_words_are_no_choice() {
        let words = choice().to_words();
        let cut = (0..words.len()).filter_map(|end| TracingChoice::from_words(&words[..end])).count();
        let changed = |k: usize, word: u64| {
            let mut words = words.clone();
            words[k] = word;
            TracingChoice::from_words(&words)
        };
        assert_eq!(cut, 0);
        assert!(changed(0, 1).is_none() && changed(3, 99).is_none() && changed(5, u64::MAX).is_none());
        assert!(TracingChoice::from_words(&[&words[..], &[0]].concat()).is_none());
    }
}
