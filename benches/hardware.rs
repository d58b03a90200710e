//! How many curves a second does a GPU fit, by batch, length, precision and lanes a curve?
//!
//! A Markdown table, and with `FAIRCURVE_JSON` a file of the same rows. Kernel times come from the device's own clock;
//! what the whole call takes more is packing, upload, download and the host's part. `FAIRCURVE_BANDWIDTH` in GB/s gives
//! natural splines as a share of the bound of bytes. `FAIRCURVE_SECONDS` bounds the whole (240 if it is not set): a
//! batch that no time is left for is left out, and so are larger ones of what took seconds.

use std::time::Instant;

use faircurve::discrete::{Fair, Segments, bending, length};
use faircurve::gpu::Gpu;
use faircurve::spline::Natural;
use faircurve::{CurveBatch, Device, Fit, Precision, Result};
use serde_json::{Value, json};

/// Spans of a fair curve.
const SPANS: usize = 4;

/// The most points of a batch: they and what is made of them fit into a few GB.
const MOST_POINTS: usize = 1 << 24;

/// A batch that took this long is the largest of its kind, in seconds.
const LONG: f64 = 2.0;

/// Sizes of batches and curves.
struct Sizes {
    curves: &'static [usize],
    points: &'static [usize],
    lanes: &'static [usize],
}

const MEASURED: Sizes =
    Sizes { curves: &[1_000, 10_000, 100_000, 1_000_000], points: &[16, 64, 256, 1024], lanes: &[1, 4, 8, 16, 32] };
const TRIED: Sizes = Sizes { curves: &[20], points: &[16, 64], lanes: &[1, 8] };

fn main() {
    let is_measuring = std::env::args().any(|argument| argument == "--bench");
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<f64>().ok());
    let adapter = number("FAIRCURVE_ADAPTER").unwrap_or(0.0) as usize;
    let summary = match Gpu::open(adapter) {
        Ok(gpu) => gpu.summary().clone(),
        Err(error) => return println!("no GPU to measure: {error}"),
    };
    let seconds = number("FAIRCURVE_SECONDS").unwrap_or(240.0);
    println!("{} ({}), {}, {}", summary.name, summary.driver, summary.backend, summary.kind);
    println!();
    println!(
        "| task | type | curves | points | lanes | kernel, ms | whole call, ms | curves/s by kernel | by call | share of bytes |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut table =
        Table { adapter, start: Instant::now(), seconds, bandwidth: number("FAIRCURVE_BANDWIDTH"), rows: vec![] };
    let sizes = if is_measuring { MEASURED } else { TRIED };
    for precision in [Precision::F32, Precision::F64] {
        if precision == Precision::F32 || summary.has_f64 {
            table.natural(&sizes, precision);
            table.fair(&sizes, precision);
        }
    }
    if let Ok(path) = std::env::var("FAIRCURVE_JSON") {
        let all = json!({
            "adapter": summary.name, "driver": summary.driver, "kind": summary.kind, "rows": table.rows,
        });
        std::fs::write(&path, format!("{all:#}\n")).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
}

/// Points around a circle, or along it where they do not close, moved by numbers without a pattern: the fractional
/// parts of multiples of the golden ratio.
fn batch(curves: usize, points: usize) -> CurveBatch {
    let coords = (0..curves * points).flat_map(|k| {
        let turn = 5.0 * (k % points) as f64 / points as f64;
        let noise = |factor: usize| 0.1 / points as f64 * ((k * factor) as f64 * 0.618_033_988_749_894_9).fract();
        [turn.cos() + noise(1), turn.sin() + noise(7)]
    });
    let offsets = (0..=curves).map(|i| i * points).collect();
    CurveBatch::from_ragged(2, coords.collect(), offsets).expect("they fit together")
}

/// What batches of growing size have in common.
struct Kind {
    task: &'static str,
    precision: Precision,
    /// Points or vertices of a curve, and the data points that it is given by.
    points: usize,
    data: usize,
    lanes: Option<usize>,
    /// Bytes that a curve moves at least, if that bounds it.
    bytes: Option<usize>,
}

struct Table {
    adapter: usize,
    start: Instant,
    seconds: f64,
    bandwidth: Option<f64>,
    rows: Vec<Value>,
}

impl Table {
    fn natural(&mut self, sizes: &Sizes, precision: Precision) {
        for &points in sizes.points {
            // Coordinates in and moments out.
            let bytes = if precision == Precision::F64 { 32 } else { 16 } * points;
            let kind = Kind { task: "natural", precision, points, data: points, lanes: None, bytes: Some(bytes) };
            self.batches(sizes, &kind, |batch, device| Natural::default().fit(batch, device));
        }
    }

    fn fair(&mut self, sizes: &Sizes, precision: Precision) {
        for &points in sizes.points {
            let segments = Segments::PerSpan(points / SPANS);
            let fair = Fair { energy: bending(2.0) + 0.1 * length(), segments, ..Fair::default() };
            for &lanes in sizes.lanes.iter().filter(|&&lanes| 2 * lanes <= points) {
                let lanes = Some(lanes);
                let kind = Kind { task: "fair, Newton", precision, points, data: SPANS + 1, lanes, bytes: None };
                self.batches(sizes, &kind, |batch, device| fair.fit(batch, device));
            }
        }
    }

    fn batches(&mut self, sizes: &Sizes, kind: &Kind, fit: impl Fn(&CurveBatch, &Device) -> Result<Fit>) {
        let &Kind { task, precision, points, data, lanes, bytes } = kind;
        let gpu = Gpu::open(self.adapter).expect("it opened before");
        let device = Device::from_gpu(lanes.into_iter().fold(gpu, Gpu::with_lanes)).with_precision(precision);
        for &curves in sizes.curves.iter().filter(|&&curves| curves * points <= MOST_POINTS) {
            if self.start.elapsed().as_secs_f64() > self.seconds {
                return eprintln!("no time is left for {task} of {curves} curves of {points} points");
            }
            let batch = batch(curves, data);
            let run = || {
                let start = Instant::now();
                let fit = fit(&batch, &device).expect("a right problem");
                let whole = start.elapsed().as_secs_f64();
                let usable = fit.reports().iter().filter(|report| report.status.is_usable()).count();
                let kernel = device.as_gpu().expect("it is one").take_kernel_seconds();
                (kernel, whole, curves - usable, fit.device().finished_on_cpu)
            };
            // The first compiles. The better of two after it counts.
            run();
            let (first, second) = (run(), run());
            let (kernel, whole) = (first.0.min(second.0), first.1.min(second.1));
            let [lost, finished] = [second.2, second.3];
            if lost + finished > 0 {
                eprintln!(
                    "{task}, {precision}, {curves} of {points}: {lost} not usable, {finished} finished on the CPU"
                );
            }
            let rate = |seconds: f64| if seconds > 0.0 { curves as f64 / seconds } else { f64::NAN };
            let share =
                bytes.zip(self.bandwidth).map(|(bytes, gigabytes)| rate(kernel) * bytes as f64 / (1e9 * gigabytes));
            let shown = share.map_or(String::new(), |share| format!("{:.1} %", 100.0 * share));
            println!(
                "| {task} | {precision} | {curves} | {points} | {} | {:.3} | {:.3} | {:.3e} | {:.3e} | {shown} |",
                lanes.map_or(String::new(), |lanes| lanes.to_string()),
                1e3 * kernel,
                1e3 * whole,
                rate(kernel),
                rate(whole)
            );
            self.rows.push(json!({
                "task": task, "precision": precision.to_string(), "curves": curves, "points": points, "lanes": lanes,
                "kernel_seconds": kernel, "call_seconds": whole, "share_of_bytes": share,
                "not_usable": lost, "finished_on_cpu": finished,
            }));
            if whole > LONG {
                return;
            }
        }
    }
}
