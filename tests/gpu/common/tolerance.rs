//! How far a device may be from the CPU: all numbers in one place, each with its reason.
//!
//! A difference may be `roundings` · ε · the unit of the comparison, ε being that of the precision
//! on the device, and `reach` · ε of f64 · the largest number of the curve, for its distance from
//! the origin, which no device normalises away.

/// So many roundings, because of …
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    pub roundings: f64,
    pub reach: f64,
    pub why: &'static str,
}

const fn tolerance(roundings: f64, why: &'static str) -> Tolerance {
    // Mapping normalised coordinates back rounds three times at most, and the CPU's own result
    // carries the fourth.
    Tolerance { roundings, reach: 4.0, why }
}

/// Dominant bands, in units of the largest unknown of the system.
pub const BANDS: Tolerance = tolerance(
    24.0,
    "rows dominant by 0.3 of up to 3.3 have inverses of up to 10 a rounding of the entries, and the data lose one",
);

/// Networks with right-hand sides that are not negative, every unknown by itself.
pub const NETWORK: Tolerance = tolerance(
    32.0,
    "no subtraction: about four roundings an eliminated row, of which only those near the row weigh, whatever the condition",
);

/// A kernel against its twin in the same precision, in units of the largest unknown of the system.
pub const TWIN: Tolerance =
    tolerance(8.0, "the same operations in the same order: only divisions and contractions of a driver may differ");

/// Samples and values of splines, in units of the curve's size.
pub const SPLINE: Tolerance = tolerance(
    16.0,
    "a system dominant by a factor of two keeps the two roundings of an edge, of a span and of a right-hand side, and \
     the polynomial of a span adds four; 16 ε of f32 are 1.9e-6",
);

/// The same over knots of a curve's own, uneven by many decades.
pub const UNEVEN_SPLINE: Tolerance = tolerance(
    48.0,
    "a slope is good to the roundings of an edge and a span, but its difference to the next, and what long spans make of \
     it, are measured against slopes of short spans beside them",
);

/// The same at equal arc lengths, where each device finds its own places along its own curve.
pub const SPACING: Tolerance = tolerance(
    48.0,
    "the place of a sample is a sum over the lengths of all spans before it, which differ by the roundings of the fit",
);

/// Smoothing splines for a given λ, in units of the curve's size.
pub const SMOOTHING: Tolerance = tolerance(
    96.0,
    "a hundredth of the last step of refinement, which is 256 ε at most, the few roundings of a spline, and what an ill-conditioned \
     system leaves after it",
);

/// Energies of whole curves, in units of themselves.
pub const ENERGY: Tolerance =
    tolerance(64.0, "second derivatives good to some roundings of the largest, squared and summed over the spans");

/// Coefficients, values and subdivisions on the integers, in units of the curve's size.
pub const UNIFORM: Tolerance = Tolerance {
    reach: 16.0,
    ..tolerance(
        8.0,
        "rows 1 4 1: the inverse is bounded by 3, normalising and mapping back round twice; the CPU solves where the \
         curve lies, so its roundings are those of its distance from the origin, times that inverse",
    )
};

/// Sums of products of second differences, in units of what the rounding of the points themselves
/// makes of them.
pub const DIFFERENCES: Tolerance = tolerance(
    16.0,
    "a second difference of four terms carries four roundings of the points, a product two of those, the sum one more a term",
);

/// Discrete energies, their gradients and Hessians, in units of what one rounding of every edge
/// changes about them.
pub const DISCRETE: Tolerance = tolerance(
    32.0,
    "an edge is rounded when it is uploaded, its length, tangent, curvature and each product of them once more, about a dozen \
     in a term; all act as roundings of edges would, but for those of a tangent's length of 1, which variation of sharp \
     turns doubles when it takes away what lies along the tangent",
);

/// x^y on a device, in units of x^y times 1 + |y|, and in f32 times 1 + |y log₂ x|.
pub const POWER: Tolerance = tolerance(
    8.0,
    "x itself is a quotient good to two roundings, which count y times; log₂ and 2^x add less than two in f64, and WGSL \
     grants pow in f32 three roundings of y log₂ x beside those",
);

/// Control points of Béziers, in units of the curve's size.
pub const BEZIER: Tolerance = tolerance(
    16.7,
    "2e-6 in f32, which is what curves that the CPU does not compute again are good to by the magnitudes of their sums",
);

/// Subdivided grids, in units of half their largest extent.
pub const LAPLACIAN: Tolerance = Tolerance {
    reach: 32.0,
    ..tolerance(
        16.7,
        "2e-6 in f32: weights sum to 2 or so in magnitude, a round adds some roundings of the values, and those that follow average \
         what lies side by side; the CPU computes where the grid lies, so its roundings are those of its distance from the origin",
    )
};
