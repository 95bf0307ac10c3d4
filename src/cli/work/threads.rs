//! The number of threads of everything that runs in parallel.

use crate::cli::failure::Failure;
use crate::pipeline::TracingSettings;

/// Sets the number of threads of everything that runs in parallel, all cores for `None`, and returns it. The first call in a process
/// counts: later ones return their number, but change nothing.
pub(crate) fn set_threads(requested: Option<usize>) -> Result<usize, Failure> {
    let threads = TracingSettings { threads: requested, ..TracingSettings::default() }.thread_count()?;
    // The pool can be set once in a process; a second command in the same process keeps the first. This thread is one of it, as it is of
    // those that trace: each further thread has memory of its own, which it keeps after it has passed its results on.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).use_current_thread().build_global();
    Ok(threads)
}
