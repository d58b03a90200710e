//! [`Workspace`]: evaluates segments of many curves side by side in vector lanes, and advances
//! their searches. All curves of a chunk advance together, one trial per tick.

use super::evaluation::{Directed, Evaluation, FreeStart};
use super::problem::{Ends, Outcome, SlopesProblem, SlopesStanding, Until};
use super::slopes::Search;
use super::universal::Universal;
use crate::linalg::{Lanes, Scalar, has_wide_registers};
use crate::parallel;

/// The fewest segments per task. Fewer are evaluated faster than handed over.
const TASK: usize = 4096;

/// The angles of segments of one universal curve and one kind, and the places of the results.
#[derive(Default)]
struct Group {
    angles: Vec<[f64; 2]>,
    places: Vec<u32>,
    found: Vec<Evaluation<f64>>,
}

/// Buffers for the evaluations of a chunk's segments.
pub(crate) struct Workspace {
    /// Two groups for every universal curve: directed at both ends, and free at the start.
    groups: Vec<[Group; 2]>,
    found: Vec<Evaluation<f64>>,
}

/// Evaluates S::LANES segments at a time.
fn evaluate_in_lanes<S: Scalar<Number = f64>>(
    curve: &Universal,
    free: bool,
    angles: &[[f64; 2]],
    found: &mut [Evaluation<f64>],
) {
    for (angles, found) in angles.chunks(S::LANES).zip(found.chunks_mut(S::LANES)) {
        let mut ends = [S::ZERO; 2];
        for lane in 0..S::LANES {
            // An incomplete group repeats its last segment, which does not change the others.
            for (end, angle) in ends.iter_mut().zip(angles[lane.min(angles.len() - 1)]) {
                end.set_lane(lane, angle);
            }
        }
        let lanes = if free { S::run(FreeStart(curve, ends[1])) } else { S::run(Directed(curve, ends)) };
        for (lane, found) in found.iter_mut().enumerate() {
            *found = Evaluation {
                cost: lanes.cost.lane(lane),
                gradient: lanes.gradient.map(|x| x.lane(lane)),
                hessian: lanes.hessian.map(|x| x.lane(lane)),
                exists: lanes.exists.lane(lane),
            };
        }
    }
}

/// Evaluates segments of unit chord with these end angles, of one universal curve, on all threads.
pub(crate) fn evaluate_all(curve: &Universal, free: bool, angles: &[[f64; 2]], found: &mut [Evaluation<f64>]) {
    let part = |(angles, found): (&[[f64; 2]], &mut [Evaluation<f64>])| {
        if has_wide_registers() {
            evaluate_in_lanes::<Lanes<f64, 4>>(curve, free, angles, found);
        } else {
            evaluate_in_lanes::<f64>(curve, free, angles, found);
        }
    };
    if angles.len() <= TASK {
        return part((angles, found));
    }
    parallel::of(angles.chunks(TASK).zip(found.chunks_mut(TASK)), part);
}

impl Workspace {
    pub fn new(curves: usize) -> Self {
        Workspace { groups: (0..curves).map(|_| Default::default()).collect(), found: Vec::new() }
    }

    /// Evaluates the trials of all running searches.
    fn evaluate(&mut self, curves: &[Universal], searches: &[Search]) {
        let none = Evaluation::straight();
        for group in self.groups.iter_mut().flatten() {
            group.angles.clear();
            group.places.clear();
        }
        self.found.clear();
        for search in searches.iter().filter(|search| search.standing == SlopesStanding::Running) {
            let problem = &search.problem;
            for (k, span) in problem.spans.iter().enumerate() {
                let [a, b] = problem.angles(k, &search.trial);
                let (kind, angles) = match span.ends {
                    Ends::Directed => (0, [a, b]),
                    Ends::FreeStart => (1, [0.0, b]),
                    // Reversed and mirrored.
                    Ends::FreeEnd => (1, [0.0, -a]),
                    Ends::Straight => {
                        self.found.push(none);
                        continue;
                    }
                };
                let group = &mut self.groups[span.curve as usize][kind];
                group.angles.push(angles);
                group.places.push(self.found.len() as u32);
                self.found.push(none);
            }
        }
        for (curve, groups) in curves.iter().zip(&mut self.groups) {
            for (kind, group) in groups.iter_mut().enumerate() {
                group.found.resize(group.angles.len(), none);
                evaluate_all(curve, kind == 1, &group.angles, &mut group.found);
                for (&place, &found) in group.places.iter().zip(&group.found) {
                    self.found[place as usize] = found;
                }
            }
        }
        // Restores segments whose first end is the directed one.
        let mut place = 0;
        for search in searches.iter().filter(|search| search.standing == SlopesStanding::Running) {
            for span in &search.problem.spans {
                if span.ends == Ends::FreeEnd {
                    self.found[place] = self.found[place].reversed();
                }
                place += 1;
            }
        }
    }

    /// Advances all searches until none runs.
    pub fn run(&mut self, curves: &[Universal], searches: &mut [Search], until: &Until) {
        while searches.iter().any(|search| search.standing == SlopesStanding::Running) {
            self.evaluate(curves, searches);
            let mut place = 0;
            for search in searches.iter_mut().filter(|search| search.standing == SlopesStanding::Running) {
                let spans = search.problem.spans.len();
                search.receive(&self.found[place..place + spans], until);
                place += spans;
            }
        }
    }

    /// The outcomes of searches from the reference directions.
    pub fn search(&mut self, curves: &[Universal], problems: Vec<SlopesProblem>, until: &Until) -> Vec<Outcome> {
        let mut searches: Vec<Search> = problems.into_iter().map(Search::new).collect();
        self.run(curves, &mut searches, until);
        searches.into_iter().map(Outcome::from).collect()
    }
}
