//! [`CurveStatus`]: how a fit can end, each status explained once.

/// How the fit of one curve ended.
///
/// With the feature `formats` it is serialised as its [`word`](Self::word).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum CurveStatus {
    /// The curve asked for was found.
    ///
    /// For a direct method (natural splines, smoothing with a given λ) the linear system was
    /// solved.
    Converged,
    /// The iteration limit, or a lost device, came before the stopping rule was met.
    ///
    /// The curve is the best one reached.
    NotConverged,
    /// The length runs away while the energy falls: there is no minimiser.
    ///
    /// The result is the input polyline.
    Unbounded,
    /// No curve attains the least energy.
    NoMinimiser,
    /// Infinitely many curves attain the least energy. The smallest is returned.
    NotUnique,
    /// No curve was found that keeps its limits.
    ///
    /// The curve is the one with the smallest violation found. If only curves with loops satisfy
    /// the limits, it is the unconstrained curve. The sentence says which limit is violated, where
    /// and by how much.
    Infeasible,
    /// Too little to fit: fewer than two distinct points, or two different points at one parameter.
    ///
    /// The result is the input polyline.
    Degenerate,
    /// The input is NaN, infinite, decreasing or otherwise invalid.
    ///
    /// The result is the input polyline.
    Invalid,
}

impl CurveStatus {
    /// Whether the curve may be used as what was asked for.
    pub fn is_usable(self) -> bool {
        matches!(self, CurveStatus::Converged | CurveStatus::NotUnique)
    }

    /// A curve made of several pieces has the status of highest severity among them.
    pub(crate) fn severity(self) -> u32 {
        match self {
            CurveStatus::Converged => 0,
            CurveStatus::NotUnique => 1,
            CurveStatus::NotConverged => 2,
            CurveStatus::NoMinimiser => 3,
            CurveStatus::Infeasible => 4,
            CurveStatus::Unbounded => 5,
            CurveStatus::Degenerate => 6,
            CurveStatus::Invalid => 7,
        }
    }

    /// The word used in reports and files.
    pub fn word(self) -> &'static str {
        match self {
            CurveStatus::Converged => "converged",
            CurveStatus::NotConverged => "not_converged",
            CurveStatus::Unbounded => "unbounded",
            CurveStatus::NoMinimiser => "no_minimiser",
            CurveStatus::NotUnique => "not_unique",
            CurveStatus::Infeasible => "infeasible",
            CurveStatus::Degenerate => "degenerate",
            CurveStatus::Invalid => "invalid",
        }
    }
}
