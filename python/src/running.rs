//! Work of the library on behalf of Python: without the interpreter's lock, on threads of this
//! process, and ended by Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use faircurve::gpu::AdapterSummary;
use faircurve::{Choice, Device, Precision, Stopped, Work, gpu};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// So often is looked whether Ctrl-C was pressed.
const LOOK: Duration = Duration::from_millis(50);

/// The threads of this process, and which process that is. A process that was forked has none of
/// the threads of the one that it came from.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// The number of threads asked for; 0 is one per core.
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// What is called with the number of curves that are done, while fits run.
static WATCHER: Mutex<Option<Py<PyAny>>> = Mutex::new(None);

/// GPUs that are open, by what was asked for.
static OPEN: Mutex<Vec<(Choice, Device)>> = Mutex::new(Vec::new());

/// The process that opened a GPU, or 0.
static OPENED_BY: AtomicU32 = AtomicU32::new(0);

/// Where work is done, as Python's users say it.
pub struct Place {
    choice: Choice,
    precision: Precision,
    /// The number of curves, where they are counted.
    curves: usize,
}

impl Place {
    pub fn new(device: &str, precision: &str) -> PyResult<Self> {
        let choice: Choice = match device.strip_prefix("pci:") {
            Some(address) => at_address(address)?,
            None => device.parse().map_err(PyValueError::new_err)?,
        };
        let precision: Precision = precision.parse().map_err(crate::error)?;
        if (choice, precision) == (Choice::Cpu, Precision::F32) {
            return Err(PyValueError::new_err(
                "precision \"f32\" belongs to a GPU, and the CPU computes in f64: leave it out, or use device=\"gpu\"",
            ));
        }
        Ok(Place { choice, precision, curves: 0 })
    }

    /// The same for work that counts its curves.
    pub fn counting(self, curves: usize) -> Self {
        Place { curves, ..self }
    }
}

/// Does work of this size, and gives it the device.
pub fn run<T: Send>(
    py: Python<'_>,
    place: &Place,
    size: Work,
    work: impl FnOnce(&Device) -> faircurve::Result<T> + Send,
) -> PyResult<T> {
    if place.choice != Choice::Cpu {
        refuse_forked()?;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let counter = Arc::new(AtomicUsize::new(0));
    let count = Count { finished: counter.clone(), of: place.curves };
    let flag = stop.clone();
    let job = move || -> faircurve::Result<T> {
        let device = open(place.choice, size)?.with_precision(place.precision).stopped_by(flag).with_counter(counter);
        work(&device)
    };
    on_the_pool(py, &stop, &count, job)?.map_err(crate::error)
}

/// Does work on the CPU that nothing stops.
pub fn at_once<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    on_the_pool(py, &AtomicBool::new(false), &Count::default(), work)
}

fn on_the_pool<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    count: &Count,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let pool = pool()?;
    let (done, result) = mpsc::channel();
    let result = Mutex::new(result);
    let wait = |longest: Duration| result.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(longest);
    let outcome = thread::scope(|scope| {
        scope.spawn(move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
            // The other end waits until it has it.
            let _ = done.send(outcome);
        });
        loop {
            match py.detach(|| wait(LOOK)) {
                Ok(outcome) => return outcome.map_err(Ended::Panicked),
                Err(_) => {
                    if let Err(interrupt) = py.check_signals().and_then(|()| count.tell(py)) {
                        stop.store(true, Ordering::Relaxed);
                        let _ = py.detach(|| wait(Duration::MAX));
                        return Err(Ended::Interrupted(interrupt));
                    }
                }
            }
        }
    });
    match outcome {
        Ok(value) => Ok(value),
        Err(Ended::Interrupted(interrupt)) => Err(interrupt),
        Err(Ended::Panicked(payload)) if payload.is::<Stopped>() => Err(PyRuntimeError::new_err("the fit was stopped")),
        Err(Ended::Panicked(payload)) => resume_unwind(payload),
    }
}

/// The curves that are done, of how many.
#[derive(Default)]
struct Count {
    finished: Arc<AtomicUsize>,
    of: usize,
}

impl Count {
    /// Calls the watcher, if there is one.
    fn tell(&self, py: Python<'_>) -> PyResult<()> {
        let watcher = WATCHER.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(|one| one.clone_ref(py));
        match watcher {
            Some(watcher) if self.of > 0 => {
                watcher.call1(py, (self.finished.load(Ordering::Relaxed), self.of)).map(drop)
            }
            _ => Ok(()),
        }
    }
}

/// Has a function called with the number of curves that are done and of all, some twenty times a second, or none.
#[pyfunction]
#[pyo3(signature = (watcher))]
pub fn watch(watcher: Option<Py<PyAny>>) {
    *WATCHER.lock().unwrap_or_else(PoisonError::into_inner) = watcher;
}

/// Sets the number of threads of later work; 0 is one per core.
#[pyfunction]
pub fn set_num_threads(threads: usize) {
    THREADS.store(threads, Ordering::Relaxed);
    let old = POOL.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some((process, pool)) = old
        && process != std::process::id()
    {
        std::mem::forget(pool);
    }
}

/// The number of threads that work is done on.
#[pyfunction]
pub fn num_threads() -> PyResult<usize> {
    Ok(pool()?.current_num_threads())
}

enum Ended {
    Interrupted(PyErr),
    Panicked(Box<dyn Any + Send>),
}

fn pool() -> PyResult<Arc<ThreadPool>> {
    let own = std::process::id();
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*pool
        && *process == own
    {
        return Ok(pool.clone());
    }
    let threads = THREADS.load(Ordering::Relaxed);
    let threads = ThreadPoolBuilder::new().num_threads(threads).thread_name(|k| format!("faircurve-{k}")).build();
    let threads = Arc::new(threads.map_err(|error| PyRuntimeError::new_err(format!("no threads: {error}")))?);
    if let Some((_, others)) = pool.replace((own, threads.clone())) {
        // Its threads are those of another process: there is nothing to end.
        std::mem::forget(others);
    }
    Ok(threads)
}

/// Refuses a GPU in a process that was forked from one that has opened it: its driver's threads
/// are gone.
fn refuse_forked() -> PyResult<()> {
    let opened_by = OPENED_BY.load(Ordering::Relaxed);
    if opened_by == 0 || opened_by == std::process::id() {
        return Ok(());
    }
    Err(PyRuntimeError::new_err(
        "a GPU was opened before this process was forked, and cannot be used here: start processes by \
         multiprocessing.get_context(\"spawn\"), or use device=\"cpu\"",
    ))
}

/// The device for some work. A GPU stays open.
fn open(choice: Choice, size: Work) -> faircurve::Result<Device> {
    if choice == Choice::Cpu {
        return Ok(Device::cpu());
    }
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let known = |asked: Choice| open.iter().find(|(other, _)| *other == asked).map(|(_, device)| device.clone());
    if choice != Choice::Auto
        && let Some(device) = known(choice)
    {
        return Ok(device);
    }
    let device = gpu::silently(|| Device::choose(choice, &size))?;
    if device.as_gpu().is_none() {
        return Ok(device);
    }
    // The first choice of `auto` stays the GPU of all later ones.
    if let Some(device) = known(choice) {
        return Ok(device);
    }
    OPENED_BY.store(std::process::id(), Ordering::Relaxed);
    open.push((choice, device.clone()));
    Ok(device)
}

/// The GPU at an address of the PCI bus, such as 0000:65:00.0.
fn at_address(address: &str) -> PyResult<Choice> {
    refuse_forked()?;
    let adapters = gpu::silently(gpu::adapters);
    // Some tools write the domain with more zeros than others.
    let short = |address: &str| address.trim_start_matches('0').to_ascii_lowercase();
    let is_there =
        |adapter: &AdapterSummary| !adapter.pci_bus_id.is_empty() && short(&adapter.pci_bus_id) == short(address);
    adapters.iter().position(is_there).map(Choice::Gpu).ok_or_else(|| {
        let known: Vec<&str> =
            adapters.iter().map(|adapter| &adapter.pci_bus_id[..]).filter(|id| !id.is_empty()).collect();
        let known = if known.is_empty() { "there is none with an address".into() } else { known.join(", ") };
        PyRuntimeError::new_err(format!("no GPU is at the PCI address \"{address}\": {known}"))
    })
}

/// Names, drivers and addresses on the PCI bus of the GPUs that can be opened, in the order of their
/// numbers.
#[pyfunction]
pub fn adapters(py: Python<'_>) -> PyResult<Vec<(String, String, String)>> {
    refuse_forked()?;
    let found = py.detach(|| gpu::silently(gpu::adapters));
    Ok(found.into_iter().map(|adapter| (adapter.name, adapter.driver, adapter.pci_bus_id)).collect())
}
