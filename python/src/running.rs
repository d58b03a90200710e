//! Work of the library on behalf of Python: without the interpreter's lock, on threads of this
//! process, and ended by Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use faircurve::gpu::AdapterSummary;
use faircurve::{Choice, Device, Precision, Stopped, Work};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// So often is looked whether Ctrl-C was pressed.
const LOOK: Duration = Duration::from_millis(50);

/// The threads of this process, and which process that is. A process that was forked has none of
/// the threads of the one that it came from.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// GPUs that are open, by what was asked for.
static OPEN: Mutex<Vec<(Choice, Device)>> = Mutex::new(Vec::new());

/// The process that opened a GPU, or 0.
static OPENED_BY: AtomicU32 = AtomicU32::new(0);

/// Where work is done, as Python's users say it.
pub struct Place {
    choice: Choice,
    precision: Precision,
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
        Ok(Place { choice, precision })
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
    let flag = stop.clone();
    let job = move || -> faircurve::Result<T> {
        let device = open(place.choice, size)?.with_precision(place.precision).stopped_by(flag);
        work(&device)
    };
    on_the_pool(py, &stop, job)?.map_err(crate::error)
}

/// Does work on the CPU that nothing stops.
pub fn at_once<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    on_the_pool(py, &AtomicBool::new(false), work)
}

fn on_the_pool<T: Send>(py: Python<'_>, stop: &AtomicBool, work: impl FnOnce() -> T + Send) -> PyResult<T> {
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
                    if let Err(interrupt) = py.check_signals() {
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
    let threads = ThreadPoolBuilder::new().thread_name(|k| format!("faircurve-{k}")).build();
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
    let device = Device::choose(choice, &size)?;
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
    let adapters = faircurve::gpu::adapters();
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
    let found = py.detach(faircurve::gpu::adapters);
    Ok(found.into_iter().map(|adapter| (adapter.name, adapter.driver, adapter.pci_bus_id)).collect())
}
