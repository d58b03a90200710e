//! What faircurve's sides of `benches/peers/compare.sh` share: how they are timed, and their lines.

use std::error::Error;
use std::time::Instant;

use serde_json::{Value, json};

/// The number of runs asked for on the command line, `[--runs N]`; 7 without.
pub fn runs() -> Result<usize, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Ok(7),
        ["--runs", number] => {
            Ok(number.parse().ok().filter(|&runs: &usize| runs > 0).ok_or("--runs wants 1 or more")?)
        }
        _ => Err("the only option is --runs N".into()),
    }
}

/// Microseconds an item of `count`, sorted; one run comes before those that count.
pub fn times(
    runs: usize,
    count: usize,
    mut work: impl FnMut() -> Result<(), Box<dyn Error>>,
) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut times = Vec::with_capacity(runs);
    for run in 0..=runs {
        let start = Instant::now();
        work()?;
        if run > 0 {
            times.push(1e6 * start.elapsed().as_secs_f64() / count as f64);
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}

/// The line of a case, as `benches/peers/README.md` lays it down.
pub fn line(case: &str, times: &[f64], curves: usize, points: usize) -> Value {
    let runs = times.len();
    json!({
        "case": case,
        "peer": "faircurve",
        "versions": {"faircurve": env!("CARGO_PKG_VERSION")},
        "threads": rayon::current_num_threads(),
        "curves": curves,
        "points": points,
        // The mean of the middle two where their number is even, as Python's statistics.median.
        "us_per_curve": (times[(runs - 1) / 2] + times[runs / 2]) / 2.0,
        "timed_curves": curves,
        "runs": runs,
        "spread": [times[0], times[runs - 1]],
        "load": load(),
    })
}

/// The load average of the last minute, where the system tells.
fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}
