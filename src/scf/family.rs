//! The two families of segments, plain and under tension, and the start data of a curve of either.

use super::evaluation::Evaluation;
use super::problem::{SlopesProblem, Stages};
use super::tension::{Near, TensionLaw, TensionSpan};
use super::universal::Universal;

/// The family of a batch's segments, with one entry per exponent.
#[derive(Clone, Copy)]
pub(super) enum Family<'a> {
    Plain(&'a [Universal]),
    UnderTension(&'a [TensionLaw]),
}

/// A curve whose tangent angles are searched from its reference directions.
pub(super) struct SlopesSearch {
    pub problem: SlopesProblem,
    /// The segments under tension. Empty for plain segments, as are the next two fields.
    pub spans: Vec<TensionSpan>,
    /// Their shapes at the start.
    pub known: Vec<Near>,
    /// Their costs at the start.
    pub found: Vec<Evaluation<f64>>,
    pub stages: Stages,
}

/// Spans that cost less than this fraction of the most expensive span wait until it has converged.
/// Compared with it they have no weight, and their directions would wander.
const LEVEL: f64 = 1e-4;

/// The number of cost levels that are searched one after the other. Everything cheaper is one more
/// level.
const LEVELS: usize = 20;

impl Family<'_> {
    /// The kernel's block of numbers per exponent.
    pub fn packed(&self) -> Vec<f64> {
        match self {
            Family::Plain(curves) => curves.iter().flat_map(Universal::packed).collect(),
            Family::UnderTension(laws) => laws.iter().flat_map(TensionLaw::packed).collect(),
        }
    }

    /// The exponent of a segment.
    pub fn exponent(&self, search: &SlopesSearch, k: usize) -> f64 {
        let number = usize::from(search.problem.spans[k].curve);
        match self {
            Family::Plain(curves) => curves[number].exponent,
            Family::UnderTension(laws) => laws[number].exponent(),
        }
    }

    /// The chord of a segment in the unit in which λ is 1, and the unit of its cost there. Both are
    /// 1 without tension.
    pub fn units(&self, search: &SlopesSearch, k: usize) -> [f64; 2] {
        match self {
            Family::Plain(_) => [1.0; 2],
            Family::UnderTension(laws) => search.spans[k].units(&laws[usize::from(search.problem.spans[k].curve)]),
        }
    }

    /// The unit of a curve's costs in the kernel.
    pub fn unit(&self, search: &SlopesSearch) -> f64 {
        match self {
            Family::Plain(_) => 1.0,
            Family::UnderTension(_) => self.weights(search).into_iter().fold(0.0, f64::max),
        }
    }

    /// The weights of a curve's costs in the unit in which λ is 1.
    pub fn weights(&self, search: &SlopesSearch) -> Vec<f64> {
        let spans = &search.problem.spans;
        (0..spans.len()).map(|k| spans[k].weight * self.units(search, k)[1]).collect()
    }
}

impl SlopesSearch {
    /// A curve of plain segments.
    pub fn plain(problem: SlopesProblem) -> Self {
        SlopesSearch { problem, spans: vec![], known: vec![], found: vec![], stages: Stages::default() }
    }

    /// A curve under tension.
    pub fn under_tension(problem: SlopesProblem, spans: Vec<TensionSpan>, laws: &[TensionLaw]) -> Self {
        let mut search = SlopesSearch { spans, ..Self::plain(problem) };
        let mut known = vec![Near::default(); search.spans.len()];
        search.found = search.evaluate(laws, &vec![0.0; search.problem.dots()], &mut known);
        search.known = known;
        search.stages = search.stages();
        search
    }

    /// Evaluates the spans under tension at these turns, following the known shapes.
    pub fn evaluate(&self, laws: &[TensionLaw], turns: &[f64], known: &mut [Near]) -> Vec<Evaluation<f64>> {
        let mut found = Vec::with_capacity(self.spans.len());
        for (k, span) in self.spans.iter().enumerate() {
            let law = &laws[usize::from(self.problem.spans[k].curve)];
            found.push(span.evaluate(law, self.problem.angles(k, turns), &mut known[k]));
        }
        found
    }

    /// The stages in which dots become movable. The dots of the spans that are most expensive at
    /// the start come first.
    ///
    /// With ν = 20 a span costs 10¹⁹ times as much as one ten times as long.
    fn stages(&self) -> Stages {
        let problem = &self.problem;
        let mut costs = Vec::with_capacity(self.found.len());
        for (found, span) in self.found.iter().zip(&problem.spans) {
            // The dots of a span without minimiser at the start are movable at once.
            costs.push(if found.exists > 0.0 { span.weight * found.cost } else { f64::INFINITY });
        }
        let dearest = costs.iter().copied().filter(|cost| cost.is_finite()).fold(0.0, f64::max);
        let mut levels = vec![LEVELS; problem.dots()];
        for (k, &cost) in costs.iter().enumerate() {
            let level =
                if cost >= dearest { 0 } else { ((cost / dearest).ln() / LEVEL.ln()).min(LEVELS as f64) as usize };
            for dot in [k, problem.after(k)] {
                levels[dot] = levels[dot].min(level);
            }
        }
        let mut distinct = levels.clone();
        distinct.sort_unstable();
        distinct.dedup();
        let of_dots = levels.iter().map(|level| distinct.partition_point(|other| other < level)).collect();
        Stages { of_dots, last: distinct.len() - 1 }
    }
}
