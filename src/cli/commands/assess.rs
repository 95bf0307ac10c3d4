//! `lampyris assess`: a far field judged by the tables of a lamp regulation.

use crate::cli::console::{Console, print};
use crate::cli::output::json::json_text;
use crate::cli::output::verdict::summary;
use crate::cli::work::output_place::folder_of;
use crate::cli::{completion::Completion, failure::Failure};
use crate::formats::read_text;
use crate::regulation::{Assumptions, IntensityMap, RaySample, Regulation, Traffic, assess};
use crate::text::nearest_or_listed;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What `assess` was asked for; `None` for what was not given.
pub(crate) struct AssessCommand<'a> {
    pub(crate) result: Option<&'a Path>,
    pub(crate) regulation: Option<&'a str>,
    pub(crate) receiver: Option<&'a str>,
    pub(crate) left_hand: bool,
    pub(crate) as_placed: bool,
}

/// Prints the regulations that there are tables of, with `--json` as a list of objects.
pub(crate) fn list(console: &Console) -> Result<Completion, Failure> {
    let all = Regulation::all();
    if console.json {
        let rows = all.iter().map(
            |r| json!({"id": r.id, "name": r.function.name, "rows": r.function.rows.len(), "checked": r.checked()}),
        );
        print(&json_text(&rows.collect::<Vec<_>>())?)?;
    } else {
        let width = all.iter().map(|r| r.id.len()).fold(0, usize::max);
        print(&all.iter().map(|r| format!("{:<width$}  {}\n", r.id, r.function.name)).collect::<String>())?;
    }
    Ok(Completion::Complete)
}

/// Judges a far field by a regulation and prints the verdict, or with `--json` its document. It is complete whatever the verdict; it fails
/// on unknown regulations, results that cannot be read, and far fields that the tables do not apply to.
pub(crate) fn run(command: &AssessCommand, console: &Console) -> Result<Completion, Failure> {
    let given = command.result.ok_or_else(|| {
        let failure = Failure::arguments("assess: no results are given");
        failure.with_help(
            "give the folder that `lampyris trace` wrote; `lampyris assess --list` lists the regulations",
        )
    })?;
    // A wrong name is said before anything is read.
    let named = command.regulation.map(Regulation::find).transpose()?;
    let run = ResultsFile::read(given)?;
    let regulation = match named {
        Some(regulation) => regulation,
        None => run.regulation()?,
    };
    let receiver = run.far_field(command.receiver)?;
    let map = run.intensities(receiver)?;
    let assumptions = Assumptions {
        traffic: if command.left_hand { Traffic::Left } else { Traffic::Right },
        as_placed: command.as_placed,
        rays: run.rays()?,
        tolerance_mm: run.tolerance_mm(),
    };
    let assessment = assess(&map, &regulation, &assumptions).map_err(|e| {
        Failure::from(e).with_help("set `cells`, `h_deg` and `v_deg` of the far field and trace again")
    })?;
    let document = assessment.document();
    if console.json {
        print(&json_text(&document)?)?;
    } else {
        // Data: whether stdout is a terminal does not matter.
        print(&summary(&assessment, console.width(), str::to_owned))?;
    }
    Ok(Completion::Complete)
}

/// The results of a run and where they lie.
struct ResultsFile {
    folder: PathBuf,
    path: PathBuf,
    results: Value,
}

impl ResultsFile {
    /// Reads `results.json`, given by its path or its folder.
    fn read(given: &Path) -> Result<Self, Failure> {
        let path = if given.is_dir() { given.join("results.json") } else { given.to_owned() };
        let help = "give the folder that `lampyris trace` wrote, or its results.json";
        let failure = |what: String| Failure::input(format!("{}: {what}", path.display())).with_help(help);
        let text = read_text(&path).map_err(|e| failure(format!("cannot read: {e}")))?;
        let results: Value =
            serde_json::from_str(&text).map_err(|e| failure(format!("not the results of a run: {e}")))?;
        let folder = folder_of(&path);
        Ok(Self { folder, path, results })
    }

    /// Returns the one far field in candela over H and V, of that name if one is given. Fails where there is none, or several.
    fn far_field(&self, name: Option<&str>) -> Result<&Value, Failure> {
        let fits = |r: &&Value| r["kind"] == "far_field" && r["angles"] == "A" && r["unit"] == "cd";
        let named = |r: &&Value| name.is_none_or(|n| r["name"] == n);
        let mut found = self.results["receivers"].as_array().into_iter().flatten().filter(fits).filter(named);
        let failure = |what: &str| {
            let help = "a verdict needs a receiver of kind \"far_field\" with angles \"A\" in a run that counts lm";
            Failure::arguments(format!("{}: {what}", self.path.display())).with_help(help)
        };
        // The second one decides whether there is a choice to make.
        match (found.next(), found.next()) {
            (Some(one), None) => Ok(one),
            (None, _) => {
                let Some(name) = name else { return Err(failure("no far field in candela over H and V")) };
                let failure = failure(&format!("no far field '{name}' in candela over H and V"));
                let receivers = self.results["receivers"].as_array().into_iter().flatten().filter(fits);
                let advice = nearest_or_listed(name, receivers.filter_map(|r| r["name"].as_str()));
                Err(match advice {
                    Some(advice) => failure.with_help(advice),
                    None => failure,
                })
            }
            (Some(a), Some(b)) => Err(failure(&format!(
                "several far fields: choose one by --receiver {} or {}",
                a["name"], b["name"]
            ))),
        }
    }

    /// Returns the regulation that the results were judged by; fails where there is none, or several.
    fn regulation(&self) -> Result<Regulation, Failure> {
        let judged = self.results["regulations"].as_array().into_iter().flatten();
        let mut names: Vec<&str> = judged.filter_map(|r| r["regulation"].as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let failure = match &names[..] {
            [name] => return Ok(Regulation::find(name)?),
            [] => Failure::arguments(format!("{}: judged by no regulation yet", self.path.display())),
            several => {
                let judged = format!("{}: judged by {}", self.path.display(), several.join(", "));
                Failure::arguments(judged)
            }
        };
        Err(failure.with_help("name one with --regulation ID; `lampyris assess --list` lists them"))
    }

    /// Returns how many rays were traced, on which the prediction of errors for more rays rests; fails where the results do not say.
    fn rays(&self) -> Result<u64, Failure> {
        let rays = self.results["rays"].as_u64();
        rays.ok_or_else(|| {
            Failure::input(format!("{}: it does not say how many `rays` were traced", self.path.display()))
        })
    }

    /// Returns the intensities of a far field, cd, from the CSV file that the results name for it.
    fn intensities(&self, receiver: &Value) -> Result<IntensityMap, Failure> {
        let files = receiver["files"].as_array().into_iter().flatten();
        let csv = files.filter_map(Value::as_str).find(|f| f.ends_with(".csv"));
        let csv = csv.ok_or_else(|| {
            Failure::input(format!("{}: no CSV file of {}", self.path.display(), receiver["name"]))
        })?;
        let path = self.folder.join(csv);
        let failure = |what: String| Failure::input(format!("{}: {what}", path.display()));
        let text = read_text(&path).map_err(|e| failure(format!("cannot read: {e}")))?;
        // Results of earlier versions do not say.
        let heaviest = self.results["heaviest_ray"].as_f64();
        let replicates = self.results["replicates"].as_u64().and_then(|n| u32::try_from(n).ok());
        let rays = heaviest.zip(replicates);
        let rays = rays.map(|(heaviest_flux, replicates)| RaySample { heaviest_flux, replicates });
        let axis = |k: usize| Some([receiver["middle"][k].as_f64()?, receiver["half"][k].as_f64()?]);
        let map = IntensityMap::from_csv_over(&text, axis(0).zip(axis(1)).map(Into::into), rays)
            .map_err(|e| failure(e.to_string()))?;
        // A run on facets writes what they change of every cell, unless the cells were too many to compare; one on the spline has none.
        Ok(if self.results["faceting"].is_null() { map.of_spline() } else { map })
    }

    /// Returns the looser end of the tolerance of the run's facets, mm; `None` where it traced none.
    fn tolerance_mm(&self) -> Option<f64> {
        self.results["tolerance_mm"][1].as_f64()
    }
}
