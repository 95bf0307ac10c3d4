//! `lampyris cache`: what is built once and kept.

use crate::cli::arguments::options::CacheOption;
use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::json::json_text;
use crate::cli::work::cache_folder::{self, FOLDER_VARIABLE};
use crate::report::bytes;
use crate::text::count_of;
use serde_json::json;

/// Prints what the folder of the cache holds, after emptying it if `clear`; fails where no cache is named or it is a file, or the option
/// names a folder that does not exist and is not to be emptied. The environment may name one that no run has needed yet: it is empty.
pub(crate) fn run(option: &CacheOption, clear: bool, console: &Console) -> Result<Completion, Failure> {
    let Some(cache) = cache_folder::cache(option)? else {
        let failure = Failure::arguments("there is no cache: nothing is kept from one run to the next");
        return Err(failure
            .with_help(format!("--cache DIR or the variable {FOLDER_VARIABLE} names the folder to keep it in")));
    };
    if let Some(folder) = option.cache.as_deref().filter(|folder| !clear && !folder.try_exists().unwrap_or(true)) {
        let failure = Failure::input(format!("{}: there is no such folder", folder.display()));
        return Err(
            failure.with_help("check the path; a run with --cache makes the folder when it first keeps something")
        );
    }
    if cache.folder().is_file() {
        let failure = Failure::input(format!("{}: it is a file, and a folder is needed", cache.folder().display()));
        return Err(failure.with_help("give the folder in which runs keep their cache"));
    }
    let unreadable = |e: std::io::Error| Failure::running(format!("{}: {e}", cache.folder().display()));
    // Removed first: what is then listed is what is left.
    let removed = if clear { cache.clear().map_err(unreadable)? } else { 0 };
    let entries = cache.entries().map_err(unreadable)?;
    let total: u64 = entries.iter().map(|e| e.bytes).sum();
    if console.json {
        let entries: Vec<_> = (entries.iter())
            .map(|e| {
                // A clock that was set back makes an age negative.
                let unused = e.used.elapsed().map_or(0.0, |age| age.as_secs_f64());
                json!({"file": e.file.display().to_string(), "bytes": e.bytes, "seconds_since_use": unused})
            })
            .collect();
        let document = json!({"folder": cache.folder().display().to_string(), "bytes": total,
            "limit_bytes": cache.limit(), "removed": removed, "entries": entries});
        print(&json_text(&document)?)?;
        return Ok(Completion::Complete);
    }
    if clear {
        console.say(format_args!("removed {}", count_of(removed as u64, "file")));
    }
    print(&format!(
        "{}: {} of models, facets and octrees, {} of at most {}\n",
        cache.folder().display(),
        count_of(entries.len() as u64, "file"),
        bytes(total),
        bytes(cache.limit())
    ))?;
    Ok(Completion::Complete)
}
