//! Options of chains that take one of a few values.

use crate::words::words;

/// How the pieces of a chain meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Joints {
    /// Pieces share their joints and nothing more.
    Free,
    /// p′ is continuous. Needs degree 3 or more.
    #[default]
    C1,
    /// p′ and p″ are continuous. Needs degree 5 or more.
    ///
    /// Degrees 3 and 4 are possible for bending alone, if nothing between joints is known but the
    /// outermost handles of an open chain. The chain is then the cubic spline.
    C2,
    /// The direction of p′ is continuous. The speeds |p′| on both sides are free and positive.
    ///
    /// Needs degree 3 or more, known joints, and a weight of ∫|p′|² or ∫|p″|².
    G1,
}

words!(Joints, "kind of joint": [
    (Free, "free", "Pieces only meet"),
    (C1, "c1", "Equal first derivatives"),
    (C2, "c2", "Equal first and second derivatives"),
    (G1, "g1", "Equal directions"),
]);

/// How long the pieces of a chain are in the parameter t.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PieceLengths {
    /// The distance between a piece's ends.
    ///
    /// A curve with an unknown joint, or with a piece whose ends coincide, takes
    /// [`Equal`](Self::Equal).
    #[default]
    Chords,
    /// 1 each.
    Equal,
}

words!(PieceLengths, "length of pieces": [
    (Chords, "chords", "The distance of a piece's ends"),
    (Equal, "equal", "1 each"),
]);
