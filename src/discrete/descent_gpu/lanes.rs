//! The number of lanes that share a curve.
//!
//! A device works on a number of threads at once. With a thread a curve, few curves leave most of it
//! idle, and each takes as long as its vertices one after the other. With several lanes a curve
//! takes less time and more work. The cost model states when which is faster.

use crate::gpu::AdapterSummary;
use crate::linalg::block_ring::ring_of;

/// Lanes that a curve can have. With 1 it has a thread for itself.
pub(super) const LANES: [usize; 5] = [1, 4, 8, 16, 32];

/// The cost of a vertex with a thread for the whole curve.
///
/// The unit is the cost of a vertex of a lane's chunk. Its elimination takes 15 operations on blocks,
/// since it is also coupled with the vertices that its lane keeps; alone, on an open curve, it takes
/// 6. The Hessian and the sweep are taken for 30 in both: 36/45, and fewer barriers. An estimate.
const ALONE: f64 = 0.75;

/// The cost of a step of the ring, in vertices of a chunk.
///
/// Eliminating a row of two vertices takes 36 operations on blocks: 36/45, and about as much again for barriers. An
/// estimate.
const STEP: f64 = 1.5;

/// The numbers of lanes that curves of a dimension may have on an adapter, for an energy of an order.
///
/// Software has as many threads as the CPU: a curve has one. A thread of hardware has not the
/// registers for a spatial curve (benches/RESULTS.md), and none has them for order 3: these take
/// lanes.
pub(super) fn open_lanes(adapter: &AdapterSummary, order: usize, dimension: usize) -> &'static [usize] {
    match (adapter.is_software(), order, dimension) {
        (true, 2, _) => &LANES[..1],
        (false, 2, 2) => &LANES,
        (true, ..) => &LANES[1..2],
        (false, ..) => &LANES[1..],
    }
}

/// Of several numbers of lanes, the least first, the one with which a batch takes the least time.
///
/// A vertex is coupled with `order` of those after it. `longest` is the number of vertices of the
/// longest curve. The time is that of one trial of all
/// curves: the vertices of a chunk and log₂ lanes steps, as many times as the device has to be
/// filled. Rings of idle lanes are left out, where there are others.
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
        assert_eq!([1, 1_000, 10_000, 100_000, 1_000_000].map(lanes), [32, 32, 16, 1, 1]);
        assert_eq!(lanes_of(&AdapterSummary::of_kind("integrated GPU"), 10_000, 64, 2), 1);
        assert_eq!(lanes_of(&AdapterSummary::of_kind("software"), 1, 1000, 3), 1);
    }

    #[test]
    fn ten_thousand_curves_fill_half_of_a_large_gpu() {
        let cards =
            [("H100", "discrete GPU", 270_336), ("RTX 4070", "discrete GPU", 70_656), ("M2", "integrated GPU", 10_240)];
        for (card, kind, holds) in cards {
            for curves in [1_000, 10_000, 100_000] {
                let lanes = lanes_of(&AdapterSummary::of_kind(kind), curves, 64, 2);
                let share = ((curves * lanes) as f64 / f64::from(holds)).min(1.0);
                println!(
                    "{card}: {curves} curves of 64 vertices, {lanes} lanes, {:.0} % of {holds} threads",
                    100.0 * share
                );
                assert!(curves != 10_000 || share >= 0.5, "{card}: {share}");
            }
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
