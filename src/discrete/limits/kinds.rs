//! [`LimitKind`]: the table of limits on quantities along a curve.

use super::along::{Polygon, sign_along};
use super::{Limits, of_spans};
use crate::batch::CurveBatch;
use crate::discrete::energy::{Functional, LIMIT_KINDS, Monotone};

/// A kind of limit: c = o − βq ≥ 0 at every vertex, for a quantity q.
///
/// The quantity and its derivatives are a file of `energy` and one of its shaders.
pub(in crate::discrete) struct LimitKind<const D: usize> {
    /// The quantity; `true` for curves in a surface.
    pub functional: fn(&Limits, bool) -> Functional,
    /// o
    pub offset: f64,
    /// The power of 1/h in βq·β∇q, for edges of length h.
    pub steepness: i32,
    /// Whether the limits or the batch require it.
    pub is_asked: fn(&Limits, &CurveBatch) -> bool,
    /// β at every vertex of curve `i`, 0 where there is no limit.
    pub slopes: fn(&Polygon<'_, D>, &Limits, &CurveBatch, usize) -> Vec<f64>,
    /// The sentences of a message: what the curve violates, and what would be feasible.
    pub words: fn(&Broken<'_>) -> [String; 2],
}

/// A violated limit, in units of the input.
pub(in crate::discrete) struct Broken<'a> {
    pub limits: &'a Limits,
    pub dimension: usize,
    pub in_surface: bool,
    /// q and β, at size 1.
    pub quantity: f64,
    pub slope: f64,
    pub size: f64,
    /// Whether q is the smallest feasible value that was found.
    pub is_least: bool,
}

impl<const D: usize> LimitKind<D> {
    /// All kinds, indexed by [`Functional::penalty`].
    pub const ALL: [Self; LIMIT_KINDS] = [
        Self::MAX_CURVATURE,
        Self::CURVATURE_SIGN,
        Self::TORSION_SIGN,
        Self::MAX_CURVATURE_RATE,
        Self::CLIMB,
        Self::monotone::<0>(),
        Self::monotone::<1>(),
        Self::monotone::<2>(),
        #[cfg(test)]
        Self::TOY,
    ];

    const MAX_CURVATURE: Self = LimitKind {
        functional: |_, in_surface| match in_surface {
            true => Functional::GeodesicMaxCurvature(Default::default()),
            false => Functional::MaxCurvature(Default::default()),
        },
        offset: 1.0,
        steepness: 3,
        is_asked: |limits, batch| limits.curvature.is_some() || batch.constraints().largest_curvatures.is_some(),
        slopes: |polygon, limits, batch, i| {
            let column = batch.constraints().largest_curvatures.as_deref();
            let bounds = of_spans(limits.curvature, column, batch, i, polygon.spans);
            bounds.map(|bounds| polygon.by_bounds(&bounds)).unwrap_or_default()
        },
        words: |broken| {
            let [own, bound] = [broken.quantity, 1.0 / broken.slope].map(|curvature| curvature / broken.size);
            let larger = match broken.is_least {
                true => format!("a curvature of {}", seven_digits(own * (1.0 + 1e-6))),
                false => "a larger curvature".into(),
            };
            let what = if broken.in_surface { "geodesic curvature" } else { "curvature" };
            let [curvature, bound] = [own, bound].map(seven_digits);
            [format!("its {what} is {curvature} from here to the next point, where {bound} is the largest"), larger]
        },
    };

    const CURVATURE_SIGN: Self = LimitKind {
        functional: |_, _| Functional::CurvatureSign(Default::default()),
        offset: 0.0,
        steepness: 3,
        is_asked: |limits, _| limits.shape && D == 2,
        slopes: |polygon, _, _, _| polygon.sides(),
        words: |broken| {
            let curvature = broken.quantity.abs() / broken.size;
            let what = "it turns to the other side than its points from here to the next point, with a curvature of";
            [format!("{what} {}", seven_digits(curvature)), "it to".into()]
        },
    };

    const TORSION_SIGN: Self = LimitKind {
        functional: |_, _| Functional::TorsionSign(Default::default()),
        offset: 0.0,
        steepness: 1,
        is_asked: |limits, _| limits.shape && D == 3,
        slopes: |polygon, _, _, _| polygon.twists(),
        words: |_| {
            ["it twists to the other side than its points from here to the next point", "it to"].map(String::from)
        },
    };

    const MAX_CURVATURE_RATE: Self = LimitKind {
        functional: |_, _| Functional::MaxCurvatureRate(Default::default()),
        offset: 1.0,
        steepness: 5,
        is_asked: |limits, _| limits.curvature_rate.is_some(),
        slopes: |polygon, limits, _, _| {
            let bound = limits.curvature_rate.unwrap_or_default() * polygon.size * polygon.size;
            polygon.between_edges(bound.powi(-2))
        },
        words: |broken| {
            let size = broken.size * broken.size;
            let [rate, bound] = [broken.quantity, 1.0 / broken.slope].map(|square: f64| square.sqrt() / size);
            let larger = match broken.is_least {
                true => format!("a rate of {}", seven_digits(rate * (1.0 + 1e-6))),
                false => "a larger rate".into(),
            };
            let [rate, bound] = [rate, bound].map(seven_digits);
            [format!("its curvature changes by {rate} a unit of length here, where {bound} is the most"), larger]
        },
    };

    const CLIMB: Self = LimitKind {
        functional: |_, _| Functional::Climb(Default::default()),
        offset: 1.0,
        steepness: 1,
        is_asked: |limits, _| limits.climb.is_some(),
        slopes: |polygon, limits, _, _| {
            let climb = limits.climb.unwrap_or_default();
            polygon.of_edges(|_| climb.hypot(1.0) / climb)
        },
        words: |broken| {
            let slope = |sine: f64| sine / (1.0 - sine * sine).sqrt();
            let [own, bound] = [broken.quantity, 1.0 / broken.slope].map(slope).map(seven_digits);
            let steeper = if broken.is_least { format!("a slope of {own}") } else { "a steeper slope".into() };
            [format!("its slope is {own} between this point and the next, where {bound} is the largest"), steeper]
        },
    };

    /// Progress along direction `K`.
    const fn monotone<const K: usize>() -> Self {
        LimitKind {
            functional: |limits, _| Functional::Monotone(Monotone { direction: limits.directions()[K], number: K }),
            offset: 0.0,
            steepness: 1,
            is_asked: |limits, _| limits.monotone.len() > K,
            slopes: |polygon, limits, _, _| polygon.of_edges(|chord| -sign_along(chord, limits.monotone[K])),
            words: |broken| {
                let coordinates = broken.limits.monotone[K].map(|x| x.to_string());
                let direction = coordinates[..broken.dimension].join(", ");
                [format!("it goes back along ({direction}) between this point and the next"), "it to".into()]
            },
        }
    }

    /// The limit of the recipe in CONTRIBUTING.md, for tests only: no edge is steeper than 53°.
    #[cfg(test)]
    const TOY: Self = LimitKind {
        functional: |_, _| Functional::ToyLimit(Default::default()),
        offset: 1.0,
        steepness: 1,
        is_asked: |limits, _| limits.toy,
        slopes: |polygon, _, _, _| vec![1.0 / 0.8; polygon.vertices],
        words: |_| ["it is too steep", "it to"].map(String::from),
    };

    /// The slopes β of every kind at each vertex of curve `i`. Kinds without a limit are empty.
    pub fn slopes_of(
        polygon: &Polygon<'_, D>,
        limits: &Limits,
        batch: &CurveBatch,
        i: usize,
    ) -> [Vec<f64>; LIMIT_KINDS] {
        Self::ALL.map(|kind| {
            let slopes = if (kind.is_asked)(limits, batch) { (kind.slopes)(polygon, limits, batch, i) } else { vec![] };
            if slopes.iter().any(|slope| *slope != 0.0) { slopes } else { vec![] }
        })
    }
}

/// A number rounded to seven digits, of any size.
pub(in crate::discrete) fn seven_digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.6e}").parse().unwrap_or(x);
    if rounded.abs() < 1e-4 { format!("{rounded:e}") } else { rounded.to_string() }
}
