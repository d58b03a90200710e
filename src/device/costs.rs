//! [`Costs`]: estimated times on the CPU and on an adapter, by which `auto` chooses.

use crate::gpu::AdapterSummary;

/// The workload of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Work {
    /// Number of points read and written.
    pub points: usize,
    /// The cost of a point, relative to natural splines.
    pub cost: f64,
    /// The part of the cost that the host takes beside an adapter, from 0 to 1.
    pub on_host: f64,
}

impl Work {
    #[doc(hidden)]
    /// A workload for which any hardware GPU is faster than the CPU.
    pub const ENDLESS: Work = Work { points: usize::MAX, cost: 1e9, on_host: 0.0 };

    /// Natural splines with this number of points, read and written together.
    pub fn splines(points: usize) -> Self {
        Work { points, cost: 1.0, on_host: 0.0 }
    }
}

/// Times on the CPU and on an adapter, in seconds.
///
/// The CPU takes `points · cost · cpu`. The adapter takes `open + points · (transfer + cost ·
/// kernels)`, and the host beside it its part of the CPU's time. Launches are negligible: tens of
/// them, of some 50 µs each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// Opening the adapter.
    pub open: f64,
    /// A point of natural splines on all threads of the CPU.
    pub cpu: f64,
    /// Packing, transferring and unpacking a point.
    pub transfer: f64,
    /// A point of natural splines in the adapter's kernels.
    pub kernels: f64,
    /// The rate of f64 arithmetic in kernels relative to f32. 0 if it is unknown.
    pub f64_rate: f64,
    /// Whether the times were measured on this machine.
    pub measured: bool,
}

/// Seconds for a thread of the CPU to fit or sample a point of natural splines
/// (benches/RESULTS.md: 8.9 ns with two threads).
const CPU_THREAD: f64 = 18e-9;

/// Seconds for a thread of the CPU to pack or unpack a point (benches/RESULTS.md: 9.8 ns with two
/// threads, including copies of a software driver).
const PACKING_THREAD: f64 = 20e-9;

/// Bytes of a point over the bandwidth of a bus.
const BUS: f64 = 16.0 / 16e9;

/// Bytes moved in an adapter's memory per point of natural splines.
const MOVED: f64 = 100.0;

/// The least time to open a driver.
pub(super) const LEAST_OPEN: f64 = 0.05;

impl Costs {
    /// Estimates by the adapter's kind.
    ///
    /// 500 GB/s for a discrete GPU, 100 GB/s for an integrated one, and 0.3 s to open a driver.
    pub fn estimated(adapter: &AdapterSummary) -> Self {
        let bandwidth = if adapter.kind == "discrete GPU" { 500e9 } else { 100e9 };
        let (open, threads) = (0.3, rayon::current_num_threads() as f64);
        let (cpu, transfer) = (CPU_THREAD / threads, PACKING_THREAD / threads + BUS);
        Costs { open, cpu, transfer, kernels: MOVED / bandwidth, f64_rate: 0.0, measured: false }
    }

    /// Seconds on the CPU.
    pub fn cpu_seconds(&self, work: &Work) -> f64 {
        work.points as f64 * work.cost * self.cpu
    }

    /// Seconds on the adapter, including its opening.
    pub fn gpu_seconds(&self, work: &Work) -> f64 {
        let in_kernels = work.points as f64 * (self.transfer + work.cost * self.kernels);
        self.open + in_kernels + work.on_host * self.cpu_seconds(work)
    }

    /// Whether f64 runs at half of the rate of f32 or better, but for the noise of a measurement.
    pub(super) fn prefers_f64(&self) -> bool {
        self.f64_rate >= 0.4
    }

    /// Whether the adapter is faster.
    pub fn pays(&self, work: &Work) -> bool {
        self.gpu_seconds(work) < self.cpu_seconds(work)
    }

    /// The two times in words.
    pub(super) fn compared(&self, work: &Work) -> String {
        let source = if self.measured { "measured" } else { "estimated" };
        let [gpu, cpu] = [self.gpu_seconds(work), self.cpu_seconds(work)];
        format!("some {gpu:.1} s against {cpu:.1} s on the CPU, {source}")
    }
}

/// Estimated seconds on the CPU.
pub(super) fn on_the_cpu(work: &Work) -> f64 {
    work.points as f64 * work.cost * CPU_THREAD / rayon::current_num_threads() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs { open: 0.25, cpu: 4e-9, transfer: 3e-9, kernels: 1e-10, f64_rate: 0.5, measured: true };

    #[test]
    fn an_adapter_pays_where_what_it_saves_is_more_than_opening_and_the_way_there() {
        let pays = |points: usize, cost: f64| COSTS.pays(&Work { points, cost, on_host: 0.0 });
        // 0.9 ns a point are saved, and opening takes 0.25 s: 278 million points.
        assert_eq!([200_000_000, 300_000_000].map(|points| pays(points, 1.0)), [false, true]);
        // 50 times the work: 192 ns a point are saved.
        assert_eq!([1_000_000, 2_000_000].map(|points| pays(points, 50.0)), [false, true]);
        assert!(COSTS.pays(&Work::ENDLESS));
        // Of what the host takes anyway nothing is saved.
        let fair = |on_host: f64| COSTS.pays(&Work { points: 2_000_000, cost: 50.0, on_host });
        assert_eq!([0.0, 0.3, 0.9].map(fair), [true, true, false]);
        let slow_bus = Costs { transfer: 5e-9, ..COSTS };
        assert!(!slow_bus.pays(&Work::splines(usize::MAX)));
    }

    #[test]
    fn f64_is_preferred_where_it_was_measured_at_half_of_f32() {
        let prefers = |f64_rate: f64| Costs { f64_rate, ..COSTS }.prefers_f64();
        assert_eq!([0.0, 1.0 / 64.0, 1.0 / 32.0, 0.49, 1.0].map(prefers), [false, false, false, true, true]);
    }

    #[test]
    fn times_are_told_with_their_source() {
        let told = |costs: Costs| costs.compared(&Work { points: 10_000_000, cost: 50.0, on_host: 0.0 });
        assert_eq!(told(COSTS), "some 0.3 s against 2.0 s on the CPU, measured");
        assert!(told(Costs { measured: false, ..COSTS }).ends_with("estimated"));
    }
}
