//! Parts of a run that are traced by themselves: which one, and where it goes.

use crate::cli::failure::Failure;
use std::path::{Path, PathBuf};

/// More shards than any cluster starts; a typing error beyond it is refused.
const MOST_SHARDS: u32 = 1 << 16;

/// `I/N` as it is typed, both counted from 1; from 0 inside.
pub(crate) fn parse_shard(text: &str) -> Result<[u32; 2], Failure> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((i, n)) if (1..=n).contains(&i) && n <= MOST_SHARDS => Ok([i - 1, n]),
        _ => Err(Failure::arguments(format!("--shard {text}: write I/N with I from 1 to N, as in 2/8"))),
    }
}

/// Where the tally of a shard goes: the file that was asked for, or one in the folder that was.
pub(crate) fn shard_file(output: &Path, [i, n]: [u32; 2]) -> PathBuf {
    if output.extension().is_some_and(|e| e.eq_ignore_ascii_case("tally")) {
        output.to_path_buf()
    } else {
        output.join(format!("shard-{}-of-{n}.tally", i + 1))
    }
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
    fn a_shard_goes_to_its_file_or_into_its_folder() {
        assert_eq!(shard_file(Path::new("a.tally"), [1, 4]), Path::new("a.tally"));
        assert_eq!(shard_file(Path::new("out"), [1, 4]), Path::new("out/shard-2-of-4.tally"));
    }
}
