//! How long does every method take on a GPU, and how long on the CPU beside it?
//!
//! A Markdown table, and with `FAIRCURVE_JSON` a file of the same rows. A row has the first call,
//! which opens nothing but compiles; the best of the calls after it; the device's own time in
//! kernels; what the host takes around them, a curve; and the CPU's time for the same curves. What
//! is on its way to the device and back is counted.
//!
//! f64 comes first, then f32, then numbers of lanes that share a fair curve where the cost model is
//! in doubt. `FAIRCURVE_SECONDS` bounds the whole (150 if it is not set): a batch that no time is
//! left for is left out, and so are larger ones of what took seconds.

use std::time::Instant;

use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::gpu::Gpu;
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, Deviation, Device, Fit, Precision, Result, Sampling};
use serde_json::{Value, json};

/// The most numbers of a result: they and what is made of them fit into a few GB.
const MOST_NUMBERS: usize = 1 << 27;

/// A batch that took this long is the largest of its kind, in seconds.
const LONG: f64 = 2.0;

/// Calls after the first.
const CALLS: usize = 3;

/// Edges of a fair curve, and lanes that share one.
const EDGES: [usize; 3] = [16, 64, 256];
const LANES: [usize; 5] = [1, 4, 8, 16, 32];

type Fitting = dyn Fn(&CurveBatch, &Device) -> Result<Fit>;

/// A method on curves of a kind.
struct Case {
    name: String,
    /// Numbers of a curve's result.
    numbers: usize,
    batch: Box<dyn Fn(usize) -> CurveBatch>,
    fit: Box<Fitting>,
}

impl Case {
    fn new(
        name: impl Into<String>,
        numbers: usize,
        batch: impl Fn(usize) -> CurveBatch + 'static,
        fit: impl Fn(&CurveBatch, &Device) -> Result<Fit> + 'static,
    ) -> Self {
        Case { name: name.into(), numbers, batch: Box::new(batch), fit: Box::new(fit) }
    }

    /// Gentle fair curves of four spans.
    fn gentle(edges: usize) -> Self {
        let segments = Segments::PerSpan(edges / 4);
        let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments, ..Fair::default() };
        let name = format!("fair, gentle, {edges} edges");
        Case::new(name, 2 * edges, |n| gentle(n, 5), move |batch, device| fair.fit(batch, device))
    }
}

fn cases() -> Vec<Case> {
    let sampled = |batch: &CurveBatch, device: &Device| {
        Natural::default().fit_sampled(batch, Sampling::Count(80), device).map(|(fit, _)| fit)
    };
    let smoothing = Smoothing { target: SmoothingTarget::Deviation(Deviation::Units(0.3)), ..Smoothing::default() };
    let near = Fair { deviation: Some(Deviation::Units(0.1)), ..Fair::default() };
    let taut = Smooth { tension: 1.0, ..Smooth::default() };
    vec![
        Case::gentle(64),
        Case::new("fair, default, walks", 2 * 7 * 16, |n| walks(n, 8), |b, device| Fair::default().fit(b, device)),
        Case::new("natural + 80 samples", 160, |n| walks(n, 10), sampled),
        Case::new("natural", 20, |n| walks(n, 10), |b, device| Natural::default().fit(b, device)),
        Case::new("smoothing by deviation", 40, |n| walks(n, 20), move |b, device| smoothing.fit(b, device)),
        Case::new("fair within a deviation", 2 * 7 * 16, |n| walks(n, 8), move |b, device| near.fit(b, device)),
        Case::new("scf", 20, |n| gentle(n, 10), |b, device| Smooth::default().fit(b, device)),
        Case::new("scf under tension", 20, |n| walks(n, 10), move |b, device| taut.fit(b, device)),
    ]
}

fn main() {
    let is_measuring = std::env::args().any(|argument| argument == "--bench");
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let adapter = number("FAIRCURVE_ADAPTER").unwrap_or(0.0) as usize;
    let summary = match Gpu::open(adapter) {
        Ok(gpu) => gpu.summary().clone(),
        Err(error) => return println!("no GPU to measure: {error}"),
    };
    println!("{} ({}), {}, {}", summary.name, summary.driver, summary.backend, summary.kind);
    println!();
    println!(
        "| method | type | lanes | curves | first call, ms | later, ms | kernels, ms | host, µs a curve | CPU, ms | CPU / GPU | \
         submissions | dispatches | bytes up | down, a curve |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let seconds = number("FAIRCURVE_SECONDS").unwrap_or(150.0);
    let curves: &[usize] = if is_measuring { &[100_000, 10_000, 1_000_000] } else { &[20] };
    let mut table = Table { adapter, start: Instant::now(), seconds, curves, rows: vec![] };
    let precisions = [Precision::F64, Precision::F32];
    for precision in precisions.into_iter().filter(|own| *own == Precision::F32 || summary.has_f64) {
        for case in cases() {
            table.case(&case, precision, None);
        }
    }
    for edges in EDGES {
        for &lanes in LANES.iter().filter(|&&lanes| 2 * lanes <= edges) {
            table.case(&Case::gentle(edges), Precision::F32, Some(lanes));
        }
    }
    if let Ok(path) = std::env::var("FAIRCURVE_JSON") {
        let all = json!({
            "adapter": summary.name, "driver": summary.driver, "kind": summary.kind, "rows": table.rows,
        });
        std::fs::write(&path, format!("{all:#}\n")).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
}

/// Numbers without a pattern from 0 to 1: the fractional parts of multiples of the golden ratio.
fn part(k: usize) -> f64 {
    (k as f64 * 0.618_033_988_749_894_9).fract()
}

fn batch(curves: usize, points: usize, point: impl FnMut(usize) -> [f64; 2]) -> CurveBatch {
    let coords = (0..curves * points).flat_map(point).collect();
    CurveBatch::from_ragged(2, coords, (0..=curves).map(|i| i * points).collect()).expect("they fit together")
}

/// Points at unit steps, with heights of up to a third of one.
fn gentle(curves: usize, points: usize) -> CurveBatch {
    batch(curves, points, |k| [(k % points) as f64, 0.33 * part(k)])
}

/// Unit steps in all directions.
fn walks(curves: usize, points: usize) -> CurveBatch {
    let mut at = [0.0, 0.0];
    batch(curves, points, |k| {
        let (sin, cos) = (std::f64::consts::TAU * part(k)).sin_cos();
        let from = if k % points == 0 { [0.0, 0.0] } else { at };
        at = [from[0] + cos, from[1] + sin];
        at
    })
}

struct Table {
    adapter: usize,
    start: Instant,
    seconds: f64,
    curves: &'static [usize],
    rows: Vec<Value>,
}

impl Table {
    fn case(&mut self, case: &Case, precision: Precision, lanes: Option<usize>) {
        let gpu = Gpu::open(self.adapter).expect("it opened before");
        let device = Device::from_gpu(lanes.into_iter().fold(gpu, Gpu::with_lanes)).with_precision(precision);
        let mut longest = 0.0_f64;
        for &curves in self.curves.iter().filter(|&&curves| curves * case.numbers <= MOST_NUMBERS) {
            let is_larger = self.rows.last().is_some_and(|row| row["curves"].as_u64() < Some(curves as u64));
            if longest > LONG && is_larger {
                continue;
            }
            if self.start.elapsed().as_secs_f64() > self.seconds {
                return eprintln!("no time is left for {} of {curves} curves in {precision}", case.name);
            }
            longest = longest.max(self.row(case, precision, lanes, &device, curves));
        }
    }

    /// Measures a batch. Returns the longest call.
    fn row(&mut self, case: &Case, precision: Precision, lanes: Option<usize>, device: &Device, curves: usize) -> f64 {
        let batch = (case.batch)(curves);
        let timed = |device: &Device| {
            let start = Instant::now();
            let fit = (case.fit)(&batch, device).expect("a right problem");
            (start.elapsed().as_secs_f64(), fit)
        };
        let gpu = device.as_gpu().expect("it is one");
        let (first, fit) = timed(device);
        let lost = curves - fit.usable();
        let on_cpu = fit.device().finished_on_cpu;
        drop(fit);
        let calls = if first > LONG { 1 } else { CALLS };
        let (mut whole, mut kernels) = (f64::INFINITY, 0.0);
        gpu.take_kernel_seconds();
        gpu.take_traffic();
        for _ in 0..calls {
            let call = timed(device).0;
            let own = gpu.take_kernel_seconds();
            (whole, kernels) = if call < whole { (call, own) } else { (whole, kernels) };
        }
        let traffic = gpu.take_traffic();
        // The numbers of lanes are beside each other, and the CPU is beside them all.
        let cpu = if lanes.is_none() { timed(&Device::cpu()).0.min(timed(&Device::cpu()).0) } else { f64::NAN };
        let each = |bytes: u64| bytes as f64 / (calls * curves) as f64;
        let host = 1e6 * (whole - kernels) / curves as f64;
        println!(
            "| {} | {precision} | {} | {curves} | {:.1} | {:.2} | {:.2} | {host:.2} | {:.1} | {:.2} | {} | {} | {:.0} | {:.0} |",
            case.name,
            lanes.map_or(String::new(), |lanes| lanes.to_string()),
            1e3 * first,
            1e3 * whole,
            1e3 * kernels,
            1e3 * cpu,
            cpu / whole,
            traffic.submissions / calls,
            traffic.dispatches / calls,
            each(traffic.up),
            each(traffic.down)
        );
        if lost + on_cpu > 0 {
            eprintln!("{}, {precision}, {curves} curves: {lost} not usable, {on_cpu} finished on the CPU", case.name);
        }
        self.rows.push(json!({
            "method": case.name, "precision": precision.to_string(), "lanes": lanes, "curves": curves,
            "first_seconds": first, "call_seconds": whole, "kernel_seconds": kernels, "cpu_seconds": cpu,
            "submissions": traffic.submissions / calls, "dispatches": traffic.dispatches / calls,
            "bytes_up": each(traffic.up), "bytes_down": each(traffic.down),
            "not_usable": lost, "finished_on_cpu": on_cpu,
        }));
        first.max(whole)
    }
}
