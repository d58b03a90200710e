//! [`CurveStatus`]: how a fit can end.

/// How the fit of one curve ended, in order of severity.
///
/// With the feature `formats` it is serialised as its [`word`](Self::word).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum CurveStatus {
    /// The stopping rule was met, or the linear system of a direct method was solved.
    #[default]
    Converged,
    /// Infinitely many curves attain the least energy. The result is the smallest.
    NotUnique,
    /// The iteration limit was reached, or the device was lost. The result is the best curve found.
    NotConverged,
    /// No curve attains the least energy.
    NoMinimiser,
    /// No curve was found that satisfies its limits.
    ///
    /// The result is the curve with the smallest violation found. If only curves with loops satisfy
    /// the limits, it is the unconstrained curve. The message names the limit, the place and the
    /// violation.
    Infeasible,
    /// The length grows without bound as the energy falls. The result is the input polyline.
    Unbounded,
    /// There are fewer than two distinct points, or two distinct points at one parameter. The
    /// result is the input polyline.
    Degenerate,
    /// The input is NaN, infinite, decreasing or otherwise invalid. The result is the input
    /// polyline.
    Invalid,
}

impl CurveStatus {
    /// Whether the curve is a result of the method.
    pub fn is_usable(self) -> bool {
        matches!(self, CurveStatus::Converged | CurveStatus::NotUnique)
    }

    /// The status of a curve in pieces is the one of highest severity.
    pub(crate) fn severity(self) -> u32 {
        self as u32
    }

    /// The word in reports and files.
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
