//! Parts of a run that are traced by themselves: which one, and where it goes.

use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::formats::lower_extension;
use crate::pipeline::RayRange;
use crate::simulate::{PartialRun, shard_replicates};
use crate::text::grouped;
use serde_json::json;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// More shards than any cluster starts; a typing error beyond it is refused.
const MOST_SHARDS: u32 = 1 << 16;

/// Reads `I/N` as it is typed, I from 1 to N; returns the index from 0 and the count.
pub(crate) fn parse_shard(text: &str) -> Result<[u32; 2], Failure> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((i, n)) if (1..=n).contains(&i) && n <= MOST_SHARDS => Ok([i - 1, n]),
        _ => Err(Failure::arguments(format!("--shard {text}: write I/N with I from 1 to N, as in 2/8"))),
    }
}

/// Returns the part that is asked for, as index from 0 and count: `I/N`, or `auto` for that of the launcher, which is said. `count` is
/// `--shards`.
///
/// # Errors
/// When it is neither, or no launcher says which part this is.
pub(crate) fn requested_shard(text: &str, count: Option<u32>, console: &Console) -> Result<[u32; 2], Failure> {
    if text.trim() != "auto" {
        if count.is_some() {
            return Err(Failure::arguments("--shards says how many parts `--shard auto` has, not those of I/N"));
        }
        return parse_shard(text);
    }
    let from_launcher = launcher_shard(&|name| std::env::var(name).ok(), count)?;
    let [index, count] = from_launcher.shard;
    console.say(format_args!("shard {} of {count}, from {}", index + 1, from_launcher.launcher));
    Ok(from_launcher.shard)
}

/// The part that a launcher said, as index from 0 and count.
#[derive(Debug, PartialEq)]
struct LauncherShard {
    launcher: &'static str,
    shard: [u32; 2],
}

/// Variables in which a launcher says which part a process is, and of how many.
struct Launcher {
    /// Counted from 0, or from the value of `first`.
    index: &'static str,
    /// The number of parts, where the launcher says it.
    count: Option<&'static str>,
    /// The smallest index and the step from one to the next, where these are free to choose.
    first: Option<&'static str>,
    step: Option<&'static str>,
}

/// Arrays before ranks: a task of an array may hold ranks of its own, whose number is 1 then.
const LAUNCHERS: [Launcher; 6] = [
    Launcher {
        index: "SLURM_ARRAY_TASK_ID",
        count: Some("SLURM_ARRAY_TASK_COUNT"),
        first: Some("SLURM_ARRAY_TASK_MIN"),
        step: Some("SLURM_ARRAY_TASK_STEP"),
    },
    Launcher { index: "PBS_ARRAY_INDEX", count: None, first: None, step: None },
    Launcher { index: "JOB_COMPLETION_INDEX", count: None, first: None, step: None },
    Launcher { index: "OMPI_COMM_WORLD_RANK", count: Some("OMPI_COMM_WORLD_SIZE"), first: None, step: None },
    Launcher { index: "PMI_RANK", count: Some("PMI_SIZE"), first: None, step: None },
    Launcher { index: "SLURM_PROCID", count: Some("SLURM_NTASKS"), first: None, step: None },
];

/// Returns the part that the environment names; `parts` is `--shards N`, which wins over the launcher's own number. Fails where no launcher
/// is known, or what it says is no part.
fn launcher_shard(variable: &dyn Fn(&str) -> Option<String>, parts: Option<u32>) -> Result<LauncherShard, Failure> {
    let number = |name: &str| -> Result<Option<u32>, Failure> {
        let Some(text) = variable(name).filter(|text| !text.trim().is_empty()) else { return Ok(None) };
        let wrong = |_| Failure::arguments(format!("--shard auto: {name}={text} is no number of a part"));
        text.trim().parse().map(Some).map_err(wrong)
    };
    for launcher in &LAUNCHERS {
        // The first that is there: an array before the ranks within it.
        let Some(index) = number(launcher.index)? else { continue };
        let stated = launcher.count.map(number).transpose()?.flatten();
        let Some(count) = parts.or(stated) else {
            let failure = Failure::arguments(format!("--shard auto: {} says no number of parts", launcher.index));
            return Err(failure.with_help("add --shards N"));
        };
        // PBS arrays may begin anywhere; from 1 to N is their custom, and without a 0 nothing else is known.
        let is_from_one = launcher.index == "PBS_ARRAY_INDEX";
        let first = launcher.first.map(number).transpose()?.flatten().unwrap_or(u32::from(is_from_one));
        let step = launcher.step.map(number).transpose()?.flatten().unwrap_or(1).max(1);
        // An index off the steps is of another array.
        let place = index.checked_sub(first).filter(|offset| offset % step == 0).map(|offset| offset / step);
        return match place {
            Some(place) if place < count && count <= MOST_SHARDS => {
                Ok(LauncherShard { launcher: launcher.index, shard: [place, count] })
            }
            _ => Err(Failure::arguments(format!(
                "--shard auto: {}={index} is no part of {count} (counted from {first} in steps of {step})",
                launcher.index
            ))),
        };
    }
    let known: Vec<&str> = LAUNCHERS.iter().map(|l| l.index).collect();
    Err(Failure::arguments("--shard auto: no launcher says which part this is")
        .with_help(format!("it takes {}; else write --shard I/N", known.join(", "))))
}

/// Whether a part holds every replicate that its shard (index from 0, count) has of all replicates.
pub(crate) fn is_shard_done(partial: &PartialRun, all: Range<u32>, shard: [u32; 2]) -> bool {
    shard_replicates(all, shard).all(|r| partial.done.binary_search(&r).is_ok())
}

/// Returns where the tally of a shard (index from 0, count) goes: the file that was asked for, or one in the folder that was, named after
/// shard and rays.
pub(crate) fn shard_file(output: &Path, [i, n]: [u32; 2], rays: Option<RayRange>) -> PathBuf {
    if is_tally(output) {
        return output.to_path_buf();
    }
    let shard = format!("shard-{}-of-{n}", i + 1);
    let name = match rays {
        Some(RayRange { first: Some(first), end }) if n == 1 => format!("rays-{first}-{end}"),
        Some(RayRange { first: Some(first), end }) => format!("rays-{first}-{end}-{shard}"),
        _ => shard,
    };
    output.join(name + ".tally")
}

/// Says, or with `--json` prints, what a finished shard (index from 0, count) holds.
pub(crate) fn say_shard(
    file: &Path,
    partial: &PartialRun,
    [index, count]: [u32; 2],
    console: &Console,
) -> Result<(), Failure> {
    let counts = &partial.tallies.counts;
    if console.json {
        let document = json!({"shard": [index + 1, count], "replicates": partial.done.len(),
            "of": partial.replicates, "rays": counts.rays, "segments": counts.segments, "lost_rays": counts.lost,
            "seconds": {"trace": partial.seconds}, "file": file.display().to_string()});
        return Ok(print(&json_text(&document)?)?);
    }
    let (rays, file) = (grouped(counts.rays), file.display());
    match count {
        // A range of the rays of a run that grows.
        1 => {
            console.say(format_args!("{rays} rays in {file}; `lampyris merge` adds them to those of other ranges"))
        }
        _ => console.say(format_args!(
            "shard {} of {count}: {rays} rays in {file}; `lampyris merge` puts all {count} together",
            index + 1
        )),
    }
    Ok(())
}

/// Whether a path names a tally file, by its extension.
pub(crate) fn is_tally(path: &Path) -> bool {
    lower_extension(path) == "tally"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(parse_shard("2/8").unwrap(), [1, 8]);
        assert_eq!(parse_shard("1/1").unwrap(), [0, 1]);
        for wrong in ["0/8", "9/8", "8", "a/b", "-1/2", "1/0", "1/70000"] {
            assert!(parse_shard(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_launcher_is_understood() {
        let shard = |pairs: &[(&str, &str)], parts: Option<u32>| {
            let find = |name: &str| pairs.iter().find(|(k, _)| *k == name).map(|(_, v)| (*v).to_owned());
            launcher_shard(&find, parts).map(|s| s.shard).map_err(|e| e.to_string())
        };
        let array = [
            ("SLURM_ARRAY_TASK_ID", "7"),
            ("SLURM_ARRAY_TASK_COUNT", "4"),
            ("SLURM_ARRAY_TASK_MIN", "1"),
            ("SLURM_ARRAY_TASK_STEP", "2"),
            ("SLURM_PROCID", "0"),
            ("SLURM_NTASKS", "1"),
        ];
        assert_eq!(shard(&array, None), Ok([3, 4]));
        assert_eq!(shard(&array[4..], None), Ok([0, 1]));
        assert_eq!(shard(&[("OMPI_COMM_WORLD_RANK", "2"), ("OMPI_COMM_WORLD_SIZE", "3")], None), Ok([2, 3]));
        assert_eq!(shard(&[("PMI_RANK", "0"), ("PMI_SIZE", "3")], None), Ok([0, 3]));
        assert_eq!(shard(&[("PBS_ARRAY_INDEX", "8")], Some(8)), Ok([7, 8]));
        assert_eq!(shard(&[("JOB_COMPLETION_INDEX", "0")], Some(8)), Ok([0, 8]));
        for (pairs, parts, says) in [
            (&[][..], None, "no launcher"),
            (&[("JOB_COMPLETION_INDEX", "0")][..], None, "no number of parts"),
            (&[("JOB_COMPLETION_INDEX", "8")][..], Some(8), "no part of 8"),
            (&[("PMI_RANK", "x"), ("PMI_SIZE", "3")][..], None, "PMI_RANK=x"),
            (
                &[("SLURM_ARRAY_TASK_ID", "4"), ("SLURM_ARRAY_TASK_MIN", "1"), ("SLURM_ARRAY_TASK_STEP", "2")],
                Some(9),
                "no part",
            ),
        ] {
            let refused = shard(pairs, parts).unwrap_err();
            assert!(refused.contains(says), "{refused}");
        }
    }

    #[test]
    fn a_shard_goes_to_its_file_or_into_its_folder() {
        assert_eq!(shard_file(Path::new("a.tally"), [1, 4], None), Path::new("a.tally"));
        assert_eq!(shard_file(Path::new("out"), [1, 4], None), Path::new("out/shard-2-of-4.tally"));
        let range = Some(RayRange { first: Some(5_000), end: 10_000 });
        assert_eq!(shard_file(Path::new("out"), [0, 1], range), Path::new("out/rays-5000-10000.tally"));
        assert_eq!(shard_file(Path::new("o"), [1, 4], range), Path::new("o/rays-5000-10000-shard-2-of-4.tally"));
    }
}
