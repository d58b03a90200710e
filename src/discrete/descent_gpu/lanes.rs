//! The number of lanes that share a curve, chosen by a cost model.
//!
//! With one thread per curve, a small batch leaves most of the device idle, and each curve takes
//! time proportional to its number of vertices. Several lanes per curve reduce the time of a curve
//! but increase the total work.

use crate::gpu::AdapterSummary;
use crate::linalg::block_ring::ring_of;

/// The possible numbers of lanes. With 1 a single thread descends the curve.
pub(super) const LANES: [usize; 5] = [1, 4, 8, 16, 32];

/// The cost of a vertex if one thread descends the whole curve, in units of a vertex in a lane's
/// chunk.
///
/// Its elimination is shorter, since it is not coupled with the vertices that the lane keeps, and no
/// thread waits for others. This and [`STEP`] are fits to the times of an H200, which the tests
/// hold: with them the number chosen takes at most 1.15 times as long as the best.
const ALONE: f64 = 0.3;

/// The cost of a step of the ring, in vertices of a chunk.
const STEP: f64 = 2.0;

/// The numbers of lanes that curves of a dimension may have on an adapter, for an energy of an
/// order.
///
/// Software adapters have only as many threads as the CPU, so a curve gets one. On hardware a
/// thread has too few registers for a spatial curve (benches/RESULTS.md) and for order 3. These
/// need several lanes.
pub(super) fn open_lanes(adapter: &AdapterSummary, order: usize, dimension: usize) -> &'static [usize] {
    match (adapter.is_software(), order, dimension) {
        (true, 2, _) => &LANES[..1],
        (false, 2, 2) => &LANES,
        (true, ..) => &LANES[1..2],
        (false, ..) => &LANES[1..],
    }
}

/// Chooses the number of lanes with which a batch takes the least time.
///
/// `possible` is in increasing order. A vertex is coupled with the next `order` vertices, and the
/// longest curve has `longest` vertices. The modelled time is for one trial of all curves: the
/// vertices of a chunk and log₂ lanes steps, times the number of times that the device is filled.
/// Numbers that leave lanes idle are considered only if there is no other.
pub(super) fn fastest(
    possible: &[usize],
    order: usize,
    adapter: &AdapterSummary,
    curves: usize,
    longest: usize,
) -> usize {
    let time = |lanes: usize| {
        let filled = (curves * lanes) as f64 / adapter.threads() as f64;
        let each = match lanes {
            1 => ALONE * longest as f64,
            _ => longest.div_ceil(lanes) as f64 + STEP * f64::from(lanes.ilog2()),
        };
        filled.max(1.0) * each
    };
    let busy = possible.iter().copied().filter(|&lanes| ring_of(longest, order, lanes) == lanes);
    busy.min_by(|&a, &b| time(a).total_cmp(&time(b))).unwrap_or(possible[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lanes_of(adapter: &AdapterSummary, curves: usize, longest: usize, dimension: usize) -> usize {
        fastest(open_lanes(adapter, 2, dimension), 2, adapter, curves, longest)
    }

    #[test]
    fn few_curves_take_many_lanes_and_many_curves_one() {
        let discrete = AdapterSummary::of_kind("discrete GPU");
        let lanes = |curves| lanes_of(&discrete, curves, 64, 2);
        assert_eq!([1, 1_000, 10_000, 100_000, 1_000_000].map(lanes), [16, 16, 1, 1, 1]);
        assert_eq!(lanes_of(&AdapterSummary::of_kind("integrated GPU"), 10_000, 64, 2), 1);
        assert_eq!(lanes_of(&AdapterSummary::of_kind("software"), 1, 1000, 3), 1);
    }

    /// Milliseconds of the kernel in f32 on an H200, for each number of lanes.
    const MEASURED: [(usize, usize, &[f64]); 8] = [
        (1_000, 16, &[0.201, 0.409, 0.367]),
        (10_000, 16, &[0.230, 0.855, 1.068]),
        (100_000, 16, &[1.264, 10.589, 11.805]),
        (1_000, 64, &[0.995, 0.855, 0.601, 0.526, 0.499]),
        (10_000, 64, &[1.615, 2.747, 2.951, 3.296, 4.499]),
        (100_000, 64, &[9.658, 27.428, 25.282, 58.370, 44.225]),
        (1_000, 256, &[5.148, 2.862, 1.761, 1.415, 1.242]),
        (10_000, 256, &[16.871, 16.971, 12.315, 11.245, 10.750]),
    ];

    #[test]
    fn the_lanes_chosen_take_little_longer_than_the_best_measured() {
        let discrete = AdapterSummary::of_kind("discrete GPU");
        for (curves, vertices, times) in MEASURED {
            let chosen = fastest(&LANES[..times.len()], 2, &discrete, curves, vertices);
            let taken = times[LANES.iter().position(|&lanes| lanes == chosen).expect("one of them")];
            let least = times.iter().copied().fold(f64::INFINITY, f64::min);
            println!("{curves} curves of {vertices}: {chosen} lanes, {:.2} times the least", taken / least);
            assert!(taken < 1.2 * least, "{curves} curves of {vertices} vertices: {chosen} lanes");
        }
    }

    #[test]
    fn spatial_curves_take_lanes_on_hardware() {
        let lanes = [3, 64].map(|vertices| lanes_of(&AdapterSummary::of_kind("discrete GPU"), 1_000_000, vertices, 3));
        assert_eq!(lanes, [4, 4]);
    }

    #[test]
    fn no_lane_has_fewer_vertices_than_it_keeps() {
        let discrete = AdapterSummary::of_kind("discrete GPU");
        for vertices in 2..200 {
            let lanes = lanes_of(&discrete, 10, vertices, 2);
            assert!(lanes == 1 || vertices / lanes >= 2, "{vertices} vertices, {lanes} lanes");
        }
    }
}
