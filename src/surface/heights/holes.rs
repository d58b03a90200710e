//! Gaps of a grid of heights: filled for the spline, and kept as holes where no curve may go.

use super::EDGE;
use super::cell::AxisPosition;

/// The nodes without a height, row after row.
pub(super) type Holes = Vec<bool>;

/// Fills gaps layer by layer with the mean of the neighbours that have a height. This affects the
/// spline at a few nodes around only, since the influence of a node falls by 0.27 from each to the
/// next.
///
/// `None` if there is no height at all.
pub(super) fn fill([rows, columns]: [usize; 2], heights: &mut [f64]) -> Option<Holes> {
    let holes: Holes = heights.iter().map(|height| !height.is_finite()).collect();
    let around = |k: usize| {
        let (row, column) = (k / columns, k % columns);
        let beside = (row.saturating_sub(1)..=(row + 1).min(rows - 1))
            .flat_map(move |row| (column.saturating_sub(1)..=(column + 1).min(columns - 1)).map(move |c| (row, c)));
        beside.map(move |(row, column)| row * columns + column)
    };
    let mut missing = holes.clone();
    let mut layer: Vec<usize> =
        (0..heights.len()).filter(|&k| missing[k] && around(k).any(|other| !holes[other])).collect();
    while !layer.is_empty() {
        let mean = |&k: &usize| {
            let known = around(k).filter(|&other| !missing[other]).map(|other| heights[other]);
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), height| (sum + height, count + 1.0));
            sum / count
        };
        let means: Vec<f64> = layer.iter().map(mean).collect();
        for (&k, mean) in layer.iter().zip(means) {
            (heights[k], missing[k]) = (mean, false);
        }
        let mut next: Vec<usize> = layer.iter().flat_map(|&k| around(k)).filter(|&k| missing[k]).collect();
        next.sort_unstable();
        next.dedup();
        layer = next;
    }
    (!missing.contains(&true)).then_some(holes)
}

/// A node without a height, its row and its column, that has a part in the height of a place.
pub(super) fn beside(holes: &Holes, columns: usize, x: &AxisPosition, y: &AxisPosition) -> Option<[usize; 2]> {
    let ends = |place: &AxisPosition| {
        let (from, to) = (place.t < 1.0 - EDGE, place.t > EDGE);
        [(place.span, from), (place.span + 1, to)].into_iter().filter(|(_, counts)| *counts).map(|(node, _)| node)
    };
    ends(y).flat_map(|row| ends(x).map(move |column| [row, column])).find(|[row, column]| holes[row * columns + column])
}
