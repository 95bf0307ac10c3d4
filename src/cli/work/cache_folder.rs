//! The folder in which models, facets and octrees are kept, where one is asked for.

use crate::cli::arguments::options::CacheOption;
use crate::cli::failure::Failure;
use crate::pipeline::Cache;
use std::ffi::OsString;
use std::path::PathBuf;

/// Names the folder where no option does.
pub(crate) const FOLDER_VARIABLE: &str = "LAMPYRIS_CACHE";
/// Says how large it may become.
const LIMIT_VARIABLE: &str = "LAMPYRIS_CACHE_GB";
/// Bytes in a gigabyte, as sizes of disks are given.
const BYTES_IN_GB: f64 = 1e9;

/// Returns the cache that the option or, without it, the environment asks for; `None` where neither names a folder.
///
/// # Errors
/// When its limit is no number.
pub(crate) fn cache(option: &CacheOption) -> Result<Option<Cache>, Failure> {
    // The option overrides the environment.
    let Some(folder) = option.cache.clone().or_else(|| environment_variable(FOLDER_VARIABLE).map(PathBuf::from))
    else {
        return Ok(None);
    };
    let cache = Cache::new(folder);
    let Some(limit) = environment_variable(LIMIT_VARIABLE) else { return Ok(Some(cache)) };
    match limit.to_str().and_then(|text| text.trim().parse::<f64>().ok()) {
        Some(gigabytes) if gigabytes >= 0.0 => Ok(Some(cache.with_limit((gigabytes * BYTES_IN_GB) as u64))),
        _ => Err(Failure::arguments(format!("{LIMIT_VARIABLE}={}: no number of gigabytes", limit.display()))),
    }
}

/// Returns the value of a variable of the environment; `None` if it is not set or empty.
fn environment_variable(name: &str) -> Option<OsString> {
    // An empty variable is none, as shells unset it.
    std::env::var_os(name).filter(|value| !value.is_empty())
}
