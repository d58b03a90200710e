//! [`Stop`]: a vertex on the way of a curve.

/// A vertex on an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stop {
    pub vertex: u32,
    /// Whole turns of longitude, from the vertex to the point.
    pub turn: i32,
    /// The curve and its point where the arc was first found.
    pub curve: u32,
    pub point: u32,
}
