//! Finding a regulation by its name, as people write it.

use super::error::{Error, ErrorKind};
use super::table::Regulation;
use crate::text::nearest_name;

/// Names that a message lists.
const MOST_NAMED: usize = 12;
/// Examples for a message where no name is near.
const EXAMPLES: [&str; 4] = ["UN R112 B passing", "UN R149-01 C passing", "UN R148-01 stop-S1", "FMVSS 108 LB2V"];

/// A name in small letters, without spaces and dashes, which are written in many ways.
pub(crate) fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

impl Regulation {
    /// Finds a function by its name; upper and lower case, spaces and dashes do not matter. The beginning of a name is enough where only
    /// one begins so, or where those that do differ in the number of lighted sections alone: then one section is meant (`FMVSS 108 stop`).
    ///
    /// # Errors
    /// When there is none or more than one; the message names the nearest, and up to twelve that begin alike.
    pub fn find(id: &str) -> Result<Self, Error> {
        let wanted = plain(id);
        let all = Self::all();
        if let Some(exact) = all.iter().find(|r| plain(&r.id) == wanted) {
            return Ok(exact.clone());
        }
        let begin_so: Vec<&Self> =
            all.iter().filter(|r| !wanted.is_empty() && plain(&r.id).starts_with(&wanted)).collect();
        if let [first, others @ ..] = &begin_so[..]
            && (others.is_empty() || begin_so.iter().all(|r| r.differs_in_sections(&wanted)))
        {
            return Ok((*first).clone());
        }
        let named = |found: &[&Self]| -> String {
            let more = if found.len() > MOST_NAMED { " …" } else { "" };
            let ids: Vec<&str> = found.iter().take(MOST_NAMED).map(|r| r.id.as_str()).collect();
            format!("{}{more} (`assess --list` shows all)", ids.join(", "))
        };
        if !begin_so.is_empty() {
            let message = format!("'{id}' is the beginning of several regulations, name one: {}", named(&begin_so));
            return Err(Error::new(ErrorKind::AmbiguousName, message));
        }
        // A part of a name, as `r112`, or else five letters, which name a family: `unr11`, `fmvss`.
        let holds = |r: &&Self| !wanted.is_empty() && plain(&r.id).contains(&wanted);
        let mut near: Vec<&Self> = all.iter().filter(holds).collect();
        if near.is_empty() {
            near = all.iter().filter(|r| plain(&r.id).chars().take(5).eq(wanted.chars().take(5))).collect();
        }
        if near.is_empty() {
            near = all.iter().filter(|r| EXAMPLES.contains(&r.id.as_str())).collect();
        }
        // What people leave out or spell otherwise must not count.
        let plain_ids: Vec<String> = all.iter().map(|r| plain(&r.id)).collect();
        let meant = nearest_name(&wanted, plain_ids.iter().map(String::as_str));
        let meant = meant.and_then(|meant| all.iter().find(|r| plain(&r.id) == meant));
        let did_you_mean = meant.map(|r| format!("did you mean '{}'? ", r.id)).unwrap_or_default();
        let message = format!("no regulation is called '{id}'; {did_you_mean}there are {}", named(&near));
        Err(Error::new(ErrorKind::UnknownName, message))
    }

    /// Whether its name is `stem`, as [`plain`] has it, and a number of lighted sections.
    fn differs_in_sections(&self, stem: &str) -> bool {
        let parts = self.id.rsplit_once('-');
        parts.is_some_and(|(own, sections)| plain(own) == stem && sections.parse::<u8>().is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_as_people_write_them() {
        for (asked, found) in [
            ("UN R149-01 C passing", "UN R149-01 C passing"),
            ("un r112 b passing", "UN R112 B passing"),
            ("FMVSS 108 stop", "FMVSS 108 stop-1"),
            ("fmvss108 LB2V", "FMVSS 108 LB2V"),
            ("UN R148-01 stop-S1", "UN R148-01 stop-S1"),
            ("fmvss 108 rear turn red", "FMVSS 108 rear-turn-red-1"),
            ("FMVSS 108 drl", "FMVSS 108 drl"),
            ("un r148-01 rear fog f2", "UN R148-01 rear-fog-F2"),
            ("FMVSS 108 backup-s", "FMVSS 108 backup-single"),
        ] {
            assert_eq!(Regulation::find(asked).unwrap().id, found);
        }
        // A wrong class would be judged without a word.
        for (asked, named) in [
            ("UN", "UN R112 A passing"),
            ("UN R112", "UN R112 B passing"),
            ("FMVSS 108 UB", "FMVSS 108 UB2"),
            ("UN R148-01 indicator", "UN R148-01 indicator-11"),
            ("FMVSS 108 rear-turn-amber", "FMVSS 108 rear-turn-amber-1-wide"),
            ("FMVSS 108 front-turn-1", "FMVSS 108 front-turn-1-x1.5"),
        ] {
            let error = Regulation::find(asked).unwrap_err();
            let message = error.to_string();
            assert!(message.contains("several regulations") && message.contains(named), "{message}");
            assert_eq!(error.kind(), ErrorKind::AmbiguousName);
        }
        for asked in ["UN R112 X passing", "r112"] {
            let error = Regulation::find(asked).unwrap_err();
            assert!(error.to_string().contains("UN R112 B passing"), "{error}");
            assert_eq!(error.kind(), ErrorKind::UnknownName);
        }
        assert!(Regulation::find("").is_err());
    }
}
