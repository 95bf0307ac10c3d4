//! Work that threads share, on as many as the system gives.

use std::thread;

/// Runs `work` on so many threads at once, this one among them, waits for all, and returns their number: fewer where the system gives no
/// more, as under a limit of processes or memory. `work` must take its share from what is left, so that fewer threads do all of it.
pub(crate) fn run_on_threads(threads: usize, work: impl Fn() + Sync) -> usize {
    run_on_built(threads, thread::Builder::new, work)
}

/// Does what [`run_on_threads`] does, each further thread as `builder` says.
fn run_on_built(threads: usize, builder: impl Fn() -> thread::Builder, work: impl Fn() + Sync) -> usize {
    let work = &work;
    thread::scope(|scope| {
        // Where one is refused the next would be, too.
        let further = (1..threads).take_while(|_| builder().spawn_scoped(scope, work).is_ok()).count();
        work();
        1 + further
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Returns the number of threads, and the sum of the squares below 100, taken one at a time.
    fn sum_of_squares(threads: usize, builder: impl Fn() -> thread::Builder) -> (usize, usize) {
        let (next, sum) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let given = run_on_built(threads, builder, || {
            while let Some(k) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|k| *k < 100) {
                sum.fetch_add(k * k, Ordering::Relaxed);
            }
        });
        (given, sum.into_inner())
    }

    /// An eighth of all that can be addressed is a stack that no system gives.
    #[test]
    fn all_work_is_done_where_no_thread_can_be_had() {
        let refused = || thread::Builder::new().stack_size(1 << (usize::BITS - 3));
        assert_eq!(sum_of_squares(4, refused), (1, 328_350));
        assert_eq!(sum_of_squares(4, thread::Builder::new), (4, 328_350));
        assert_eq!(sum_of_squares(0, thread::Builder::new), (1, 328_350));
    }
}
