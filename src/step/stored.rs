//! A model and its account as bytes and back, to be kept from one run to the next: most of reading a file is the fitting of its trims.

use super::import::{Import, hash_bytes, peak_bytes};
use super::report::{ImportReport, Seconds};
use super::{Error, Settings, read_bytes};
use crate::mesh::arrays::{ArrayReader, invalid, write_array};
use crate::model::Model;
use std::io::{self, Write};
use std::time::Instant;

/// The text of a file whose model is wanted, before it is read.
pub(crate) struct StepText<'s> {
    name: &'s str,
    bytes: &'s [u8],
    settings: &'s Settings,
    hash: u64,
    start: Instant,
}

impl<'s> StepText<'s> {
    /// Takes the bytes of a STEP file; `name` is for messages and the model's name, as in [`read_bytes`].
    pub(crate) fn new(name: &'s str, bytes: &'s [u8], settings: &'s Settings) -> Self {
        Self { name, bytes, settings, hash: hash_bytes(bytes), start: Instant::now() }
    }

    /// Returns all that decides its model and account, the program left out.
    pub(crate) fn key(&self) -> String {
        let Self { name, bytes, settings, hash, .. } = self;
        format!("{name} {} {hash:016x} {settings:?}", bytes.len())
    }

    /// Reads the model from the text.
    ///
    /// # Errors
    /// Those of [`read_bytes`].
    pub(crate) fn import(&self) -> Result<Import, Error> {
        read_bytes(self.name, self.bytes, self.settings)
    }

    /// Writes what [`Self::import`] returned; the same bytes each time.
    ///
    /// # Errors
    /// When `to` cannot be written.
    pub(crate) fn write(&self, import: &Import, to: &mut dyn Write) -> io::Result<()> {
        // What is of that one reading is left out.
        let report = ImportReport { seconds: Seconds::default(), peak_bytes: None, ..import.report.clone() };
        let bytes = postcard::to_allocvec(&(&import.model, &report)).map_err(io::Error::other)?;
        write_array(to, &bytes)
    }

    /// Reads what [`Self::write`] wrote, as if from the text.
    ///
    /// # Errors
    /// When it cannot be read, or is no model. That numbers of the model fit each other is not checked.
    pub(crate) fn read(&self, from: &mut ArrayReader) -> io::Result<Import> {
        let bytes: Vec<u8> = from.array()?;
        let (model, report): (Model, ImportReport) =
            postcard::from_bytes(&bytes).map_err(|_| invalid("no model"))?;
        let seconds = Seconds { parse: self.start.elapsed().as_secs_f64(), convert: 0.0 };
        let report = ImportReport { hash: self.hash, seconds, peak_bytes: peak_bytes(), ..report };
        Ok(Import { model, report })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// All that is read from text comes back to the bit: names, colours, layers, curves, trims, ready meshes, remarks.
    #[test]
    fn a_stored_model_is_that_of_the_text() {
        let settings = Settings::default();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/step");
        let mut files = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "stp") {
                continue;
            }
            let bytes = std::fs::read(&path).unwrap();
            let source = StepText::new("part.stp", &bytes, &settings);
            let Ok(Import { model, report }) = source.import() else { continue };
            let import = Import { model, report: ImportReport { peak_bytes: Some(7), ..report } };
            let mut kept = Vec::new();
            source.write(&import, &mut kept).unwrap();
            let mut from = &kept[..];
            let again = source.read(&mut ArrayReader::new(&mut from, kept.len() as u64)).unwrap();
            let timeless = |report: &ImportReport| {
                format!("{:?}", ImportReport { seconds: Seconds::default(), peak_bytes: None, ..report.clone() })
            };
            assert_eq!(format!("{:?}", again.model), format!("{:?}", import.model), "{path:?}");
            assert_eq!(timeless(&again.report), timeless(&import.report), "{path:?}");
            // Bytes that are cut or bent are refused or read to an end.
            for place in (0..kept.len()).step_by((kept.len() / 150).max(1)) {
                let mut bent = kept[..kept.len() - place % 2].to_vec();
                bent[place] ^= 0x85;
                let mut from = &bent[..];
                let _ = source.read(&mut ArrayReader::new(&mut from, bent.len() as u64));
            }
            files += 1;
        }
        assert!(files > 5, "{files}");
    }
}
