//! The fuzz targets, driven without a fuzzer: seeds of the corpus, mutated at random, for ten
//! seconds a target (FAIRCURVE_FUZZ_SECONDS asks for more). What is found here by chance
//! `fuzz/run.sh` searches for by coverage.

use std::collections::BTreeMap;
use std::fs;
use std::panic::{catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, LazyLock, Mutex, Weak};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rand::rngs::StdRng;
use rand::{Rng, RngExt, SeedableRng};
use tempfile::TempDir;

#[path = "../fuzz/src/lib.rs"]
mod targets;

/// Inputs grow to this many bytes.
const MOST_BYTES: usize = 4096;

/// No input takes this long; one that takes three times as long is taken to hang, and ends the test.
const TOO_LONG: Duration = Duration::from_secs(20);

/// How long a target runs.
fn most_time() -> Duration {
    let asked: Option<f64> = std::env::var("FAIRCURVE_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok());
    Duration::from_secs_f64(asked.unwrap_or(10.0))
}

fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut files: Vec<PathBuf> =
        fs::read_dir(&folder).expect("every target has a corpus").map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|path| fs::read(path).unwrap()).collect()
}

/// One of the seeds with some bytes changed, cut out, doubled, or taken from another seed.
fn mutated(seeds: &[Vec<u8>], rng: &mut StdRng) -> Vec<u8> {
    const PIECES: [&[u8]; 14] = [
        b"0",
        b"-1",
        b"1e308",
        b"nan",
        b"inf",
        b"\"",
        b",",
        b"\n",
        b"null",
        b"[",
        b"]",
        b"1e-320",
        b"<",
        b"\xff\xff\xff\x7f",
    ];
    let mut data = seeds[rng.random_range(0..seeds.len())].clone();
    for _ in 0..rng.random_range(0..8) {
        let at = rng.random_range(0..=data.len());
        let end = (at + rng.random_range(0..16)).min(data.len());
        match rng.random_range(0..7) {
            0 => drop(data.drain(at..end)),
            1 => data[at..end].iter_mut().for_each(|byte| *byte = rng.random()),
            2 => drop(data.splice(at..at, PIECES[rng.random_range(0..PIECES.len())].iter().copied())),
            3 => drop(data.splice(at..end, PIECES[rng.random_range(0..PIECES.len())].iter().copied())),
            4 => {
                let piece = data[at..end].to_vec();
                drop(data.splice(at..at, piece));
            }
            5 => {
                let other = &seeds[rng.random_range(0..seeds.len())];
                let from = rng.random_range(0..=other.len());
                data.truncate(at);
                data.extend_from_slice(&other[from..]);
            }
            _ if at < data.len() => data[at] ^= 1 << rng.random_range(0..8),
            _ => data.push(rng.random()),
        }
    }
    // Beyond the seeds: nothing but noise, now and then.
    if rng.random_ratio(1, 16) {
        data = vec![0; rng.random_range(0..512)];
        rng.fill_bytes(&mut data);
    }
    data.truncate(MOST_BYTES);
    data
}

/// Runs a target on its seeds and what becomes of them; the input that broke it is left in a file.
fn drive(name: &str, run: impl Fn(&[u8]) + std::panic::RefUnwindSafe) {
    let (seed, most_time) = (2026, most_time());
    let (seeds, mut rng, started) = (corpus(name), StdRng::seed_from_u64(seed), Instant::now());
    assert!(!seeds.is_empty(), "{name} has no corpus");
    let mut executions = 0;
    let running = Arc::new(Mutex::new((Instant::now(), Vec::new())));
    watch(name, Arc::downgrade(&running));
    let mut next = seeds.clone().into_iter();
    while next.len() > 0 || started.elapsed() < most_time {
        let data = next.next().unwrap_or_else(|| mutated(&seeds, &mut rng));
        let began = Instant::now();
        *running.lock().unwrap() = (began, data.clone());
        let sound = catch_unwind(|| run(&data)).is_ok() && began.elapsed() < TOO_LONG;
        if !sound {
            let (path, took) = (left_behind(name, &data), began.elapsed());
            panic!("{name} broke on execution {executions} after {took:?} (seed {seed}): {}", path.display());
        }
        executions += 1;
    }
    println!("{name}: {executions} executions, seed {seed}");
}

/// The file that holds the input that broke a target.
fn left_behind(name: &str, data: &[u8]) -> PathBuf {
    let path = std::env::temp_dir().join(format!("faircurve-fuzz-{name}"));
    fs::write(&path, data).unwrap();
    path
}

/// Ends the test, and leaves the input behind, where one takes so long that nothing else would end
/// it.
fn watch(name: &str, running: Weak<Mutex<(Instant, Vec<u8>)>>) {
    let name = name.to_string();
    thread::spawn(move || {
        while let Some(shared) = running.upgrade() {
            let (began, data) = shared.lock().unwrap().clone();
            drop(shared);
            if began.elapsed() > 3 * TOO_LONG {
                eprintln!("{name} hangs: {}", left_behind(&name, &data).display());
                std::process::exit(1);
            }
            thread::sleep(Duration::from_secs(1));
        }
    });
}

/// Waits for the target of this name. The first test starts all of them, side by side.
fn target(name: &str) {
    static RUNS: LazyLock<Mutex<BTreeMap<&str, JoinHandle<()>>>> = LazyLock::new(|| {
        let mut runs = BTreeMap::from([("command_line", thread::spawn(drive_command_line))]);
        for (name, run) in targets::TARGETS {
            runs.insert(name, thread::spawn(move || drive(name, run)));
        }
        Mutex::new(runs)
    });
    let run = RUNS.lock().unwrap().remove(name).expect("a target of the list");
    if let Err(panic) = run.join() {
        resume_unwind(panic);
    }
}

#[test]
fn arbitrary_csv_is_read_or_refused() {
    target("csv");
}

#[test]
fn arbitrary_geojson_is_read_or_refused() {
    target("geojson");
}

#[test]
fn arbitrary_svg_is_read_or_refused() {
    target("svg");
}

#[test]
fn arbitrary_npz_is_read_or_refused() {
    target("npz");
}

#[test]
fn arbitrary_tracts_are_read_or_refused() {
    target("tracts");
}

#[test]
fn arbitrary_grids_are_read_or_refused() {
    target("grids");
}

#[test]
fn whatever_was_read_and_written_is_read_again_as_it_was() {
    target("round_trip");
}

#[test]
fn every_method_gives_every_curve_of_an_arbitrary_batch_a_status() {
    target("methods");
}

#[test]
fn arbitrary_arguments_end_in_an_exit_status() {
    target("command_line");
}

fn drive_command_line() {
    let folder = TempDir::new().unwrap();
    drive("command_line", |data| {
        let Some(arguments) = targets::arguments(data, folder.path()) else { return };
        let mut program = Command::new(env!("CARGO_BIN_EXE_faircurve"));
        program.current_dir(folder.path()).args(&arguments[1..]).stdin(Stdio::null());
        let output = program.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(matches!(output.status.code(), Some(0..=2)), "{arguments:?}: {:?}\n{said}", output.status);
        assert!(!said.contains("panicked"), "{arguments:?}\n{said}");
    });
}

#[test]
fn every_target_has_a_fuzzer_and_a_test() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let this = fs::read_to_string(folder.join("tests/fuzz.rs")).unwrap();
    for name in targets::TARGETS.iter().map(|(name, _)| *name).chain(["command_line"]) {
        assert!(folder.join(format!("fuzz/fuzz_targets/{name}.rs")).is_file(), "{name} has no fuzzer");
        assert!(this.contains(&format!("(\"{name}\"")), "{name} has no test");
    }
}
