//! Work that runs without the GIL on a thread of its own, while this one tells how far it is and listens for Ctrl-C.

use crate::errors::Defect;
use lampyris::intersect::NormalMode;
use lampyris::pipeline::{Monitor, Stage, TracingSettings};
use lampyris::study;
use lampyris::study::default_accuracy::TracingChoice;
use lampyris::text::figures;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::backtrace::{Backtrace, BacktraceStatus};
use std::ffi::CString;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::thread;
use std::time::Duration;

/// How often to look for signals and to tell how far the work is: below what a person notices.
const LOOK_EVERY: Duration = Duration::from_millis(40);
/// The total of work that is no number of rays: what is done of it is told in thousandths.
const SHARES: u64 = 1000;
/// Significant digits of a tolerance in a message.
const TOLERANCE_DIGITS: usize = 4;
/// The caller of the Python function that called the extension: warnings are shown with its line.
const CALLER: i32 = 2;

/// How far the work is, written by its threads and read by the one that waits.
#[derive(Default)]
pub(crate) struct SharedProgress {
    stage: Mutex<&'static str>,
    messages: Mutex<Vec<String>>,
    /// What went wrong that changes no result: warnings of Python when the work ends.
    warnings: Mutex<Vec<String>>,
    done: AtomicU64,
    total: AtomicU64,
    stops: AtomicBool,
    /// Whether what runs is tracing, which stops when asked and keeps what it has done.
    is_tracing: AtomicBool,
}

impl SharedProgress {
    fn say(&self, message: String) {
        locked(&self.messages).push(message);
    }

    /// Begins a stage of so many rays, or of a total that is not known yet: 0.
    pub(crate) fn begin_stage(&self, name: &'static str, total: u64) {
        // Held until the numbers are those of the stage: whoever tells of it reads all three.
        let mut stage = locked(&self.stage);
        *stage = name;
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

impl Monitor for SharedProgress {
    fn begin(&self, stage: Stage<'_>) {
        let (name, total) = match stage {
            Stage::Reading(_) => ("reading", 0),
            Stage::Tessellating => ("making facets", 0),
            Stage::Choosing => ("choosing facets or spline", 0),
            Stage::Aiming => ("aiming", 0),
            Stage::Building(_) => ("building", 0),
            Stage::BuildingCheck(_) => ("building the cross-check", 0),
            Stage::Tracing(rays) => ("tracing", rays),
            Stage::Checking(rays) => ("checking", rays),
            _ => ("working", 0),
        };
        self.begin_stage(name, total);
        self.is_tracing.store(matches!(stage, Stage::Tracing(_)), Ordering::SeqCst);
    }

    fn advance(&self, done: u64, total: u64) -> bool {
        self.done.fetch_max(done, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        !self.stops.load(Ordering::SeqCst)
    }

    fn study_progress(&self, progress: &study::Progress) {
        let done = (SHARES as f64 * progress.done.clamp(0.0, 1.0)) as u64;
        if done == 0 {
            // Nothing is known yet: a bar would stand at its beginning.
            return;
        }
        // Forecasts that grow do not take back what is done.
        self.done.fetch_max(done, Ordering::Relaxed);
        self.total.store(SHARES, Ordering::Relaxed);
    }

    fn end(&self) {
        self.is_tracing.store(false, Ordering::SeqCst);
    }

    fn warns(&self, message: &str) {
        locked(&self.warnings).push(message.to_owned());
    }

    fn chosen(&self, chosen: &TracingChoice) {
        // In the words of the command.
        if chosen.has_no_surface {
            return self.say(format!("{}, and nothing is met", chosen.because));
        }
        let [low, high] = chosen.tolerance_mm.map(|tolerance| figures(tolerance, TOLERANCE_DIGITS));
        let tolerance = if low == high { low } else { format!("{low}..{high}") };
        let how = match (chosen.intersector, chosen.normals) {
            ("exact", _) => "on the spline".to_owned(),
            (_, NormalMode::Exact) => format!("on facets of {tolerance} mm with hits moved to the spline"),
            _ => format!("on facets of {tolerance} mm with {} normals", chosen.normals),
        };
        self.say(format!("tracing {how}: {}", chosen.because));
    }

    fn aimed(&self, answer: &str) {
        self.say(answer.to_owned());
    }

    fn unsettled(&self, rows: usize, rays: u64) {
        let rows = if rows == 1 { "1 row is".to_owned() } else { format!("{rows} rows are") };
        self.say(format!("{rows} unsure: going on with {rays} rays"));
    }

    fn grows(&self, found_percent: Option<f64>, rays: u64) {
        let found = found_percent.map_or("nothing arrives".to_owned(), |e| format!("{e:.2} %"));
        self.say(format!("{found}: going on with {rays} rays"));
    }
}

/// What came of the work, and the exception that asked it to stop.
pub(crate) struct Outcome<T> {
    pub(crate) made: T,
    pub(crate) stopped: Option<PyErr>,
}

/// Does the work; `progress(stage, done, total, messages)` is called now and then, and stops the work by raising. What the work warns of
/// are warnings of Python at its end; one that is an exception by the caller's filters stops like a signal that comes then.
///
/// # Errors
/// The exception of a signal or of `progress` where the work cannot be stopped: it is left to end by itself. [`Defect`] where it panics.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    threads: Option<usize>,
    work: impl FnOnce(&SharedProgress) -> T + Send + 'static,
) -> PyResult<Outcome<T>> {
    let shared = Arc::new(SharedProgress::default());
    let (sender, receiver) = mpsc::channel();
    let for_work = shared.clone();
    thread::spawn(move || {
        let made = catch_unwind(AssertUnwindSafe(|| on_threads(threads, || work(&for_work))));
        // Nobody waits any more where the work was left to itself.
        let _ = sender.send(made);
    });
    let receiver = Mutex::new(receiver);
    let mut stopped = None;
    loop {
        let received = py.detach(|| locked(&receiver).recv_timeout(LOOK_EVERY));
        match received {
            Ok(Ok(made)) => {
                // What was said at the end is said too, and a signal that came at the end is heard here rather than by the caller, who
                // would lose what was made.
                let last = || py.check_signals().and_then(|()| tell(py, &shared, progress)).err();
                let stopped = stopped.or_else(last);
                let warned = warn(py, &shared).err();
                return Ok(Outcome { made, stopped: stopped.or(warned) });
            }
            Ok(Err(panic)) => return Err(defect(panic.as_ref())),
            Err(RecvTimeoutError::Disconnected) => return Err(Defect::new_err("the work ended without a result")),
            Err(RecvTimeoutError::Timeout) if stopped.is_some() => {
                // A second Ctrl-C must not cost what the first one keeps.
                let _ = py.check_signals();
            }
            Err(RecvTimeoutError::Timeout) => {
                if let Err(e) = py.check_signals().and_then(|()| tell(py, &shared, progress)) {
                    shared.stops.store(true, Ordering::SeqCst);
                    if !shared.is_tracing.load(Ordering::SeqCst) {
                        return Err(e);
                    }
                    stopped = Some(e);
                }
            }
        }
    }
}

/// Does the work on so many threads without the GIL; a signal sets the flag, at which the work is to end soon.
///
/// # Errors
/// The exception of a signal, or [`Defect`] where the work panics.
pub(crate) fn stoppable<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let stops = AtomicBool::new(false);
    let listen = |receiver: mpsc::Receiver<thread::Result<T>>| {
        let mut stopped = None;
        loop {
            match receiver.recv_timeout(LOOK_EVERY) {
                Ok(Ok(made)) => return stopped.map_or(Ok(made), Err),
                Ok(Err(panic)) => return Err(defect(panic.as_ref())),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Defect::new_err("the work ended without a result"));
                }
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(e) = Python::attach(|py| py.check_signals()) {
                        stops.store(true, Ordering::Relaxed);
                        stopped = Some(e);
                    }
                }
            }
        }
    };
    py.detach(|| {
        thread::scope(|scope| {
            let (sender, receiver) = mpsc::channel();
            let stops = &stops;
            scope.spawn(move || {
                let made = catch_unwind(AssertUnwindSafe(|| on_threads(threads, || work(stops))));
                // The other end waits for it.
                let _ = sender.send(made);
            });
            listen(receiver)
        })
    })
}

/// In a pool of so many threads, as [`TracingSettings::thread_count`] bounds them, or in the one that all share.
pub(crate) fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> T {
    let asked = threads.is_some() || is_forked();
    let settings = TracingSettings { threads: threads.map(|n| n.max(1)), ..TracingSettings::default() };
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(settings.thread_count().ok()?).build().ok();
    match asked.then(pool).flatten() {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// The process that loaded the module.
static LOADED_BY: OnceLock<u32> = OnceLock::new();

/// Remembers this process as the one whose shared pool has threads.
pub(crate) fn remember_process() {
    LOADED_BY.get_or_init(process::id);
}

/// Whether this process was forked from the one that loaded the module: the threads of the shared pool stayed there.
fn is_forked() -> bool {
    LOADED_BY.get().is_some_and(|id| *id != process::id())
}

fn tell(py: Python<'_>, shared: &SharedProgress, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    let Some(progress) = progress else { return Ok(()) };
    let messages = std::mem::take(&mut *locked(&shared.messages));
    let (stage, [done, total]) = {
        let stage = locked(&shared.stage);
        (*stage, [&shared.done, &shared.total].map(|n| n.load(Ordering::Relaxed)))
    };
    progress.call1(py, (stage, done, total, messages)).map(|_| ())
}

fn warn(py: Python<'_>, shared: &SharedProgress) -> PyResult<()> {
    let warnings = std::mem::take(&mut *locked(&shared.warnings));
    warnings.into_iter().try_for_each(|message| {
        // The C interface of Python ends a text at its first zero byte.
        let text = CString::new(message.replace('\0', " "))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, CALLER)
    })
}

/// Where the last panic was: its exception says it, and nothing is printed before that.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Lets panics tell their place to [`defect`] instead of the terminal, with a backtrace where `RUST_BACKTRACE` asks for one.
pub(crate) fn keep_panics_from_terminal() {
    panic::set_hook(Box::new(|info| {
        let place =
            info.location().map(|place| format!(" ({}:{})", place.file(), place.line())).unwrap_or_default();
        let trace = Backtrace::capture();
        let trace = if trace.status() == BacktraceStatus::Captured { format!("\n{trace}") } else { String::new() };
        *locked(&PANIC) = place + &trace;
    }));
}

fn defect(panic: &(dyn std::any::Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    let place = std::mem::take(&mut *locked(&PANIC));
    Defect::new_err(format!("a defect of lampyris: {text}; please report it with the file and the scene{place}"))
}
