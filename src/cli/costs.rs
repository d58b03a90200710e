//! What `doctor` measured of this machine's adapters, kept in the cache folder for `--device auto`.

use std::fs;
use std::path::PathBuf;

use faircurve::Costs;
use faircurve::gpu::AdapterSummary;
use serde::{Deserialize, Serialize};

use super::machine::threads;

/// What was measured of an adapter, in seconds.
#[derive(Deserialize, Serialize)]
struct Kept {
    faircurve: String,
    adapter: String,
    driver: String,
    /// Threads of the CPU.
    threads: usize,
    open: f64,
    cpu: f64,
    transfer: f64,
    kernels: f64,
    #[serde(default)]
    f64_rate: f64,
}

impl Kept {
    /// Whether these are the costs of an adapter on this machine, by this program.
    fn is_of(&self, adapter: &AdapterSummary) -> bool {
        let own = (self.faircurve.as_str(), self.adapter.as_str(), self.driver.as_str(), self.threads);
        own == (env!("CARGO_PKG_VERSION"), &adapter.name, &adapter.driver, threads())
    }
}

/// The file that holds them, if this system has a cache folder.
fn file() -> Option<PathBuf> {
    Some(dirs::cache_dir()?.join("faircurve").join("devices.json"))
}

/// All that is kept. A file that cannot be read holds nothing.
fn all() -> Vec<Kept> {
    let text = file().and_then(|file| fs::read_to_string(file).ok());
    text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}

/// The costs of an adapter: as measured, or else as estimated.
pub fn of(adapter: &AdapterSummary) -> Costs {
    let usable =
        |kept: &Kept| [kept.open, kept.cpu, kept.transfer, kept.kernels].iter().all(|s| s.is_finite() && *s >= 0.0);
    match all().into_iter().find(|kept| kept.is_of(adapter) && usable(kept)) {
        Some(Kept { open, cpu, transfer, kernels, f64_rate, .. }) => {
            Costs { open, cpu, transfer, kernels, f64_rate, measured: true }
        }
        None => Costs::estimated(adapter),
    }
}

/// Keeps the costs of an adapter, and returns where; or says why not.
pub fn keep(adapter: &AdapterSummary, costs: &Costs) -> Result<PathBuf, String> {
    let file = file().ok_or("this system has no cache folder")?;
    let mut kept = all();
    kept.retain(|kept| !kept.is_of(adapter));
    let Costs { open, cpu, transfer, kernels, f64_rate, .. } = *costs;
    let (name, driver) = (adapter.name.clone(), adapter.driver.clone());
    let faircurve = env!("CARGO_PKG_VERSION").into();
    kept.push(Kept { faircurve, adapter: name, driver, threads: threads(), open, cpu, transfer, kernels, f64_rate });
    let text = serde_json::to_string_pretty(&kept).map_err(|error| error.to_string())?;
    let write = || -> std::io::Result<()> {
        let folder = file.parent().expect("the file is in a folder");
        fs::create_dir_all(folder)?;
        let mut temporary = tempfile::NamedTempFile::new_in(folder)?;
        std::io::Write::write_all(&mut temporary, text.as_bytes())?;
        temporary.persist(&file)?;
        Ok(())
    };
    write().map_err(|error| format!("{}: {error}", file.display()))?;
    Ok(file)
}
