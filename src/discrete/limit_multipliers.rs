//! [`LimitMultipliers`]: the multipliers of the limits at the vertices of one curve.
//!
//! A limit is c ≥ 0 at a vertex. Its energy term is a [`Penalty`] or a
//! [`RegionPenalty`](super::energy::RegionPenalty). The next multiplier is ρs.

use super::area;
use super::curve_limits::CurveLimits;
use super::energy::{Functional, LIMIT_KINDS, MOST_EDGES, Penalty, RegionPenalty, Term, Visitor, Window};
use super::limits::LimitKind;
use super::multipliers::Multipliers;
use super::problem::Problem;
use crate::linalg::scalar::{Vector, dot, scale, subtract};

/// The margin by which limits are tightened, in units of c.
///
/// Iterates approach their limits from outside. For a largest curvature, c = 1 − |K|/κ, and the
/// margin is a fraction of κ.
pub(super) const MARGIN: f64 = 2e-7;

/// The violation at which multipliers are settled, in units of the margin.
pub(super) const FEASIBILITY_TOLERANCE: f64 = 0.5;

/// The initial ρ, the smallest ρ from which a curve may be given up, and the largest ρ, in units of
/// E/m.
pub(super) const INITIAL_PENALTY: f64 = 10.0;
const FIRM_PENALTY: f64 = 1e3;
const MOST_PENALTY: f64 = 1e7;

/// The factor by which ρ grows after a round that leaves more than [`LEFT`] of the violation.
const PENALTY_GROWTH: f64 = 10.0;
const LEFT: f64 = 0.1;

/// A lower bound of the energy in the unit of ρ: the bending of a curve with this total turn.
const LEAST_CURVATURE: f64 = 0.1;

/// A curve that violates its limits by less than this is not given up.
const CLOSE: f64 = 1e-4;

/// A curve is given up after this many consecutive rounds that leave more than half of its
/// violation.
const PATIENCE: u32 = 2;

/// The largest gradient norm that counts as rounding.
const MOST_ROUNDING: f64 = 1e-6;

/// If ρ cannot grow, violations up to this are removed by a larger margin.
const ROUNDING: f64 = 1e-5;

/// The limits of a curve, with their violation and the state of the multipliers.
pub(super) struct LimitMultipliers<const D: usize> {
    pub limits: CurveLimits<D>,
    /// ρ
    stiffness: f64,
    /// E/m, for the energy E at the start and m edges.
    unit: f64,
    margin: f64,
    violation: f64,
    /// The number of consecutive rounds that left more than half of the violation.
    slow: u32,
}

impl<const D: usize> LimitMultipliers<D> {
    /// Sets the penalties of these limits on a curve with this energy. `first` is the initial ρ in
    /// units of E/m.
    pub fn around(problem: &mut Problem<D>, limits: CurveLimits<D>, energy: f64, first: f64) -> Self {
        let length = problem.length();
        let least = 0.5 * problem.highest * length * (LEAST_CURVATURE / length).powi(2);
        let unit = energy.max(least) / problem.base.len() as f64;
        let (stiffness, violation) = (first * unit, f64::INFINITY);
        let mut own = LimitMultipliers { limits, stiffness, unit, margin: MARGIN, violation, slow: 0 };
        for (kind, slopes) in own.limits.slopes.iter().enumerate() {
            let penalty = |slope: &f64| match *slope {
                0.0 => Penalty::NONE,
                slope => Penalty { slope, reach: -own.offset(kind), stiffness: own.stiffness },
            };
            problem.penalties[kind] = slopes.iter().map(penalty).collect();
        }
        if let Some(regions) = &mut own.limits.regions {
            regions.choose(problem, own.margin, own.stiffness, 1.0);
        }
        own
    }

    /// o of c = o − βq, less the margin.
    fn offset(&self, kind: usize) -> f64 {
        LimitKind::<D>::ALL[kind].offset - self.margin
    }
}

impl<const D: usize> Multipliers<D> for LimitMultipliers<D> {
    fn update(&mut self, problem: &mut Problem<D>) {
        let before = self.violation;
        self.violation = 0.0;
        for kind in 0..LIMIT_KINDS {
            let offset = self.offset(kind);
            for row in 0..problem.penalties[kind].len() {
                let penalty = problem.penalties[kind][row];
                if penalty.stiffness > 0.0 {
                    // Both in units of y/ρ.
                    let (now, next) =
                        (penalty.reach + offset, penalty.beyond(problem.quantity(&self.limits.quantities[kind], row)));
                    self.violation = self.violation.max((now - next).abs());
                    problem.penalties[kind][row].reach = next;
                }
            }
        }
        if let Some(regions) = &self.limits.regions {
            for (penalty, offset) in regions.standing(&mut problem.regions) {
                let (now, next) = (penalty.reach + offset - self.margin, penalty.beyond(penalty.quantity([0.0; D]).0));
                self.violation = self.violation.max((now - next).abs());
                penalty.reach = next;
            }
        }
        let is_at_most = self.stiffness >= MOST_PENALTY * self.unit;
        let is_far = self.violation > if is_at_most { ROUNDING } else { CLOSE };
        let is_slow = self.violation > 0.5 * before && self.stiffness >= FIRM_PENALTY * self.unit && is_far;
        self.slow = if is_slow { self.slow + 1 } else { 0 };
        let grows = self.violation > LEFT * before && !self.is_settled();
        let stiffness =
            if grows { (PENALTY_GROWTH * self.stiffness).min(MOST_PENALTY * self.unit) } else { self.stiffness };
        if grows && is_at_most && self.violation <= ROUNDING {
            self.margin = self.margin.max(2.0 * self.violation / FEASIBILITY_TOLERANCE);
            // The current curve was found with the old margin.
            self.violation = f64::INFINITY;
        }
        for kind in 0..LIMIT_KINDS {
            let offset = self.offset(kind);
            for penalty in problem.penalties[kind].iter_mut().filter(|penalty| penalty.stiffness > 0.0) {
                penalty.reach = penalty.reach * self.stiffness / stiffness - offset;
                penalty.stiffness = stiffness;
            }
        }
        if let Some(regions) = &mut self.limits.regions {
            regions.choose(problem, self.margin, stiffness, self.stiffness / stiffness);
        }
        self.stiffness = stiffness;
    }

    fn violation(&self) -> f64 {
        self.violation
    }

    fn is_settled(&self) -> bool {
        self.violation <= FEASIBILITY_TOLERANCE * self.margin
    }

    fn is_given_up(&self) -> bool {
        self.slow >= PATIENCE
    }

    /// For curvatures βq has a rounding error of βε/h, with the mean edge length h. The error of a
    /// force ρsβ∇q is then ρβ²ε/h³, which √(w/h³) of the inner product divides. The result is below
    /// 1e-8 except for the largest ρ: there 9 of 6,000 rough curves stop at 1.4e-8 to 3.3e-8,
    /// against a bound of about 5e-8. For monotonicity and torsion sign the error is ρβ²ε/h. For
    /// torsion it can be arbitrarily large, so the bound is at most 1e-6.
    fn rounding(&self, problem: &Problem<D>) -> f64 {
        let h = problem.length() / problem.base.len() as f64;
        let of_kind = |(penalties, kind): (&Vec<Penalty<f64>>, LimitKind<D>)| {
            penalties.iter().map(|penalty| penalty.slope.powi(4)).sum::<f64>() * h.powi(-2 * kind.steepness)
        };
        let squares: f64 = problem.penalties.iter().zip(LimitKind::ALL).map(of_kind).sum();
        (f64::EPSILON * self.stiffness * squares.sqrt() * h.powf(1.5) / problem.highest.sqrt()).min(MOST_ROUNDING)
    }

    fn energy(&self, problem: &Problem<D>) -> f64 {
        problem.penalty_energy(&self.limits)
    }
}

/// The quantity or region that a limit is about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Limit {
    /// The quantity of the [kind](LimitKind) with this index.
    Quantity(usize),
    /// The region with this index.
    Region(usize),
    /// The length of the whole curve.
    Length,
    /// The area that the curve encloses.
    Area,
}

/// The most violated limit of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worst {
    /// −c, at most 0 if all limits are satisfied.
    pub excess: f64,
    pub limit: Limit,
    pub row: usize,
    /// q there, at size 1.
    pub quantity: f64,
}

impl<const D: usize> Problem<D> {
    /// The quantity q of penalties at a vertex of the base.
    pub(super) fn quantity(&self, q: &Functional, row: usize) -> f64 {
        let count = self.base.len();
        let edges = std::array::from_fn(|k| {
            let edge = self.base[(row + count - 1 + k) % count];
            let length = dot(edge, edge).sqrt();
            (scale(1.0 / length, edge), length)
        });
        match (q, &self.surface) {
            (Functional::GeodesicMaxCurvature(_), Some(surface)) => {
                let [(before, s), (after, t), _] = edges;
                let (turn, normal) = (subtract(after, before), surface.normal(self.places[row]));
                // Only the component of the turn in the tangent plane is geodesic.
                let turn = subtract(turn, scale(dot(turn, normal), normal));
                2.0 * dot(turn, turn).sqrt() / (s + t)
            }
            _ => q.visit(Quantity(edges)).flatten().expect("a quantity of edges"),
        }
    }

    /// The most violated limit of the base. `None` without limits.
    pub(super) fn worst(&self, limits: &CurveLimits<D>) -> Option<Worst> {
        self.worst_of_each(limits).into_iter().max_by(|a, b| a.excess.total_cmp(&b.excess))
    }

    /// The vertex of the base that violates each limit most.
    pub(super) fn worst_of_each(&self, limits: &CurveLimits<D>) -> Vec<Worst> {
        let of_kind = |(kind, slopes): (usize, &'_ Vec<f64>)| {
            let limited = slopes.iter().enumerate().filter(|(_, slope)| **slope != 0.0);
            let worst = limited.map(|(row, slope)| {
                let quantity = self.quantity(&limits.quantities[kind], row);
                let excess = slope * quantity - LimitKind::<D>::ALL[kind].offset;
                Worst { excess, limit: Limit::Quantity(kind), row, quantity }
            });
            worst.max_by(|a, b| a.excess.total_cmp(&b.excess))
        };
        let of_kinds = limits.slopes.iter().enumerate().filter_map(of_kind);
        let of_regions = limits
            .regions
            .iter()
            .flat_map(|regions| regions.least(&self.places))
            .map(|(row, region, room)| Worst { excess: -room, limit: Limit::Region(region), row, quantity: 0.0 });
        let of_length = limits.longest.map(|longest| Worst {
            excess: self.length() / longest - 1.0,
            limit: Limit::Length,
            row: 0,
            quantity: self.length(),
        });
        let of_area = limits.enclosed.map(|enclosed| Worst {
            excess: enclosed.excess(self.enclosed()).abs() - area::TOLERANCE,
            limit: Limit::Area,
            row: 0,
            quantity: self.enclosed(),
        });
        of_kinds.chain(of_regions).chain(of_length).chain(of_area).collect()
    }

    /// The number of vertices with an active limit.
    pub(super) fn held(&self, limits: &CurveLimits<D>) -> usize {
        let holds = |row: &usize| {
            let of_penalties = (0..LIMIT_KINDS).any(|kind| {
                let penalty = self.penalties[kind].get(*row).filter(|penalty| penalty.stiffness > 0.0);
                penalty.is_some_and(|penalty| penalty.beyond(self.quantity(&limits.quantities[kind], *row)) > 0.0)
            });
            let of_region =
                |regions: &Vec<RegionPenalty<f64, D>>| regions[*row].beyond(regions[*row].quantity([0.0; D]).0) > 0.0;
            of_penalties || self.regions.iter().any(of_region)
        };
        (0..self.vertices()).filter(holds).count()
    }

    /// The energy of all penalties at the base.
    fn penalty_energy(&self, limits: &CurveLimits<D>) -> f64 {
        let of_kind = |kind: usize| {
            let penalties = self.penalties[kind].iter().enumerate().filter(|(_, penalty)| penalty.stiffness > 0.0);
            penalties.map(|(row, penalty)| penalty.value(self.quantity(&limits.quantities[kind], row))).sum::<f64>()
        };
        let of_regions = self.regions.iter().flatten().map(|penalty| penalty.value([0.0; D])).sum::<f64>();
        (0..LIMIT_KINDS).map(of_kind).sum::<f64>() + of_regions
    }
}

/// The limited quantity at a window's first edge.
struct Quantity<const D: usize>([(Vector<f64, D>, f64); MOST_EDGES]);

impl<const D: usize> Visitor for Quantity<D> {
    type Output = Option<f64>;

    fn visit<T: Term<W>, const W: usize>(self, term: &T) -> Option<f64> {
        term.quantity(&Window {
            tangent: std::array::from_fn(|k| self.0[k].0),
            length: std::array::from_fn(|k| self.0[k].1),
            segments: 1.0,
            torsion_curvature: 1.0,
            taut: 1.0,
            free: 0.0,
            free_after: 0.0,
            penalty: Penalty::NONE,
        })
    }
}
