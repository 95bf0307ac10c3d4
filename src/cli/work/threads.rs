//! The number of threads of everything that runs in parallel.

use crate::cli::failure::Failure;

/// More threads than any machine has; a typing error beyond it is cut here.
const MOST_THREADS: usize = 4096;

/// Sets the number of threads of everything that runs in parallel; all cores when nothing is asked. Gives the number.
pub(crate) fn set_threads(requested: Option<usize>) -> Result<usize, Failure> {
    let all = std::thread::available_parallelism().map_or(1, |n| n.get());
    let threads = match requested {
        None => all,
        Some(0) => return Err(Failure::arguments("--threads 0: at least one thread is needed")),
        Some(n) => n.min(MOST_THREADS),
    };
    // The pool can be set once in a process; a second command in the same process keeps the first.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    Ok(threads)
}
