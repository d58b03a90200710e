//! Twin of `shaders/linalg/ring/thread.wgsl`: one thread a system, a ring of a single lane.

use super::lanes::{Row, solve_lanes};
use crate::linalg::Real;

/// Solves one system; see [`solve_lanes`].
pub fn solve_thread<T: Real>(rows: &[Row<T>]) -> (Vec<T>, bool) {
    solve_lanes(rows, 1)
}
