//! What compilers of hardware say of every kernel: registers, spills, scratch memory, waves.
//!
//! A process of its own compiles for a family, and goes on behind a form at which the compiler ends it.
//! `benches/runs/kernels.rs` prints what is said of single forms.

mod compiler;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use compiler::{Compiled, Compiler};
use faircurve::gpu::KernelKey;
use faircurve::kernels;

/// Set for a process that compiles: the number of the first form.
const FIRST: &str = "FAIRCURVE_COMPILE_FROM";

/// The test that such a process runs.
const WORKER: &str = "compilers::compiles_for_the_process_that_asks";

/// The driver file of AMD's cards, beside that of the driver the tests run on.
fn radv() -> Option<PathBuf> {
    let own = std::env::var_os("VK_DRIVER_FILES").map(PathBuf::from);
    let folder = own.as_deref().and_then(|file| file.parent()).unwrap_or("/usr/share/vulkan/icd.d".as_ref()).to_owned();
    let file = folder.join(format!("radeon_icd.{}.json", std::env::consts::ARCH));
    file.exists().then_some(file)
}

/// Compiles all forms from the one whose number the environment says, a line each. It is a test for this program to be
/// able to start itself; alone it does nothing.
#[test]
fn compiles_for_the_process_that_asks() {
    let Some(first) = std::env::var(FIRST).ok().and_then(|number| number.parse::<usize>().ok()) else { return };
    println!();
    let Some(compiler) = Compiler::open() else { return println!("NO DEVICE") };
    for (k, key) in kernels().iter().enumerate().skip(first) {
        // Before the compiler is asked: it may not return.
        println!("FORM {k}");
        match compiler.compile(key) {
            Ok(found) => found.statistics.iter().for_each(|(name, number)| println!("STAT {number} {name}")),
            Err(error) => println!("REFUSED {error}"),
        }
    }
}

/// What a family's compiler says of all forms: statistics, or why there are none. `None` if it opens no device.
fn compiled_for(family: &str, icd: &PathBuf) -> Option<Vec<Result<Compiled, String>>> {
    let forms = kernels().len();
    let mut found: Vec<Result<Compiled, String>> = Vec::with_capacity(forms);
    while found.len() < forms {
        let before = found.len();
        let ended = Command::new(std::env::current_exe().unwrap())
            .args([WORKER, "--exact", "--nocapture"])
            .env("VK_DRIVER_FILES", icd)
            .env("RADV_FORCE_FAMILY", family)
            .env(FIRST, before.to_string())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&ended.stdout);
        for line in said.lines() {
            if line == "NO DEVICE" {
                return None;
            } else if line.starts_with("FORM ") {
                found.push(Ok(Compiled::default()));
            } else if let Some((number, name)) = line.strip_prefix("STAT ").and_then(|own| own.split_once(' ')) {
                if let Some(Ok(last)) = found.last_mut() {
                    last.statistics.insert(name.to_string(), number.parse().unwrap());
                }
            } else if let Some(why) = line.strip_prefix("REFUSED ") {
                *found.last_mut().expect("a form before its refusal") = Err(why.to_string());
            }
        }
        let why = String::from_utf8_lossy(&ended.stderr);
        assert!(found.len() > before, "{family}: {WORKER} compiled nothing: {}: {said}{why}", ended.status);
        if !ended.status.success() {
            *found.last_mut().expect("a form") = Err(format!("the compiler ended its process: {}", ended.status));
        }
    }
    Some(found)
}

/// The worst of a kernel's forms.
#[derive(Default)]
struct Worst {
    forms: usize,
    registers: u64,
    spilled: u64,
    scratch: u64,
    waves: Option<u64>,
    refused: Vec<String>,
}

/// A row a kernel, its users and its precision.
fn table(found: &[Result<Compiled, String>]) -> BTreeMap<(String, String), Worst> {
    let mut rows = BTreeMap::<(String, String), Worst>::new();
    for (key, found) in kernels().iter().zip(found) {
        let row = rows.entry((kernel(key), format!("{:?}", key.precision))).or_default();
        row.forms += 1;
        match found {
            Ok(own) => {
                row.registers = row.registers.max(own.of("VGPRs"));
                row.spilled = row.spilled.max(own.of("Spilled VGPRs"));
                row.scratch = row.scratch.max(own.of("Scratch size"));
                let waves = own.of("Subgroups per SIMD");
                row.waves = Some(row.waves.map_or(waves, |least| least.min(waves)));
            }
            Err(why) => row.refused.push(format!("{}: {why}", key.name())),
        }
    }
    rows
}

/// The name of a kernel in the table. Descents are several: with a thread or lanes a curve, by Newton's method or by
/// Sobolev gradients.
fn kernel(key: &KernelKey) -> String {
    let has = |name: &str| key.definitions.contains_key(name);
    let way = match (has("SOBOLEV"), has("LANES")) {
        _ if key.path != "discrete/descent.wgsl" => "",
        (true, true) => " Sobolev, lanes",
        (true, false) if has("SPATIAL") => " Sobolev, thread, spatial",
        (true, false) => " Sobolev, thread, planar",
        (false, true) if has("THIRD") && has("SPATIAL") => " Newton, lanes, order 3, spatial",
        (false, true) if has("THIRD") => " Newton, lanes, order 3, planar",
        (false, true) if has("SURFACE") => " Newton, lanes, in a surface",
        (false, true) => " Newton, lanes",
        (false, false) if LIMITED.iter().any(|name| has(name)) => " Newton, thread, with_limits",
        (false, false) if has("SPATIAL") => " Newton, thread, spatial",
        (false, false) => " Newton, thread, planar",
    };
    format!("{}:{}{way}", key.path, key.entry)
}

/// The cards that Mesa compiles for. The first takes kernels in f64 with the fewest registers; the others are compiled for where
/// `FAIRCURVE_ALL_FAMILIES` is set, since all forms take minutes.
const FAMILIES: [&str; 2] = ["vega20", "navi21"];

/// Registers of a thread in f32 with which two waves share what executes them, on 64 lanes.
const REGISTERS_F32: u64 = 128;

/// What kernels of curves with limits are defined with.
const LIMITED: [&str; 2] = ["PENALTIES", "REGIONS"];

/// Kernels that spill, need scratch memory or too many registers in some form, and why. All others must not.
const BEYOND: [(&str, &str); 7] = [
    ("discrete/evaluate.wgsl:hessian", "second derivatives of variation and torsion are 87 numbers a window in space"),
    (
        "discrete/descent.wgsl:descend Newton, lanes, order 3, spatial",
        "in f64 alone, blocks of three vertices in space, and the second derivatives of a window",
    ),
    (
        "discrete/descent.wgsl:descend Newton, lanes, order 3, planar",
        "in f64 alone, nine registers: the way between curvatures beside short edges, and the half edges at free ends",
    ),
    (
        "discrete/descent.wgsl:descend Newton, lanes, in a surface",
        "second derivatives by places besides those by tangents, and the frames of three vertices",
    ),
    (
        "discrete/descent.wgsl:descend Newton, thread, spatial",
        "for software alone: hardware takes lanes (src/discrete/descent_gpu/lanes.rs)",
    ),
    ("discrete/descent.wgsl:descend Sobolev, thread, spatial", "for software alone too"),
    ("discrete/descent.wgsl:descend Newton, thread, with_limits", "for software alone too"),
];

#[test]
fn compilers_of_cards_that_are_not_here_take_every_kernel() {
    let Some(icd) = radv() else {
        let required = std::env::var_os("FAIRCURVE_REQUIRE_GPU").is_some();
        assert!(!required, "Mesa's driver of AMD's cards is missing: install mesa-vulkan-drivers");
        return eprintln!("skipped: there is no driver of AMD's cards");
    };
    let families = match std::env::var_os("FAIRCURVE_ALL_FAMILIES") {
        Some(_) => &FAMILIES[..],
        None => &FAMILIES[..1],
    };
    let found: Vec<_> = std::thread::scope(|scope| {
        let runs: Vec<_> = families.iter().map(|family| scope.spawn(|| compiled_for(family, &icd))).collect();
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    let mut faults = Vec::new();
    for (family, found) in families.iter().zip(found) {
        let found = found.unwrap_or_else(|| panic!("{}: no device of family {family}", icd.display()));
        println!("{family}: kernel, precision, forms, registers, spilled, scratch bytes a wave, waves");
        for ((kernel, precision), row) in table(&found) {
            let Worst { forms, registers, spilled, scratch, waves, refused } = row;
            println!("{kernel} {precision} {forms} {registers} {spilled} {scratch} {}", waves.unwrap_or(0));
            let is_known = BEYOND.iter().any(|(name, _)| *name == kernel);
            let is_wide = precision == "F32" && registers > REGISTERS_F32;
            if !is_known && (is_wide || spilled > 0 || scratch > 0) {
                faults.push(format!("{family}: {kernel} {precision}: {registers} registers, {spilled} spilled, {scratch} bytes of scratch"));
            }
            if !refused.is_empty() {
                faults.push(format!("{family}: {refused:?}"));
            }
        }
    }
    assert!(faults.is_empty(), "beyond the budget, and not in the list of those that are known to be: {faults:#?}");
}
