//! Segments of many curves side by side in vector lanes, whichever curve they belong to, and
//! searches that advance by them.

use super::evaluation::{Directed, Evaluation, FreeStart};
use super::slopes::{Ends, Search, SlopesStanding, Until};
use super::universal::Universal;
use crate::linalg::{Lanes, Real, Scalar, has_wide_registers};
use crate::parallel;

/// Segments a task evaluates at least: fewer are done sooner than handed over.
const TASK: usize = 4096;

/// Angles to be evaluated, all of one universal curve and one kind, and where the results belong.
#[derive(Default)]
struct Group<T> {
    angles: Vec<[T; 2]>,
    places: Vec<u32>,
    found: Vec<Evaluation<T>>,
}

/// Room for the evaluations of a chunk's segments.
pub(crate) struct Workspace<T> {
    /// Two groups for every universal curve: directed at both ends, and free at the start.
    groups: Vec<[Group<T>; 2]>,
    found: Vec<Evaluation<T>>,
}

/// Evaluates as many segments side by side as S has lanes.
fn evaluate_in_lanes<S: Scalar>(
    curve: &Universal,
    free: bool,
    angles: &[[S::Number; 2]],
    found: &mut [Evaluation<S::Number>],
) {
    for (angles, found) in angles.chunks(S::LANES).zip(found.chunks_mut(S::LANES)) {
        let mut ends = [S::ZERO; 2];
        for lane in 0..S::LANES {
            // A group that is not full repeats its last: the same numbers twice change nothing.
            for (end, angle) in ends.iter_mut().zip(angles[lane.min(angles.len() - 1)]) {
                end.set_lane(lane, angle);
            }
        }
        let all = if free { S::run(FreeStart(curve, ends[1])) } else { S::run(Directed(curve, ends)) };
        for (lane, found) in found.iter_mut().enumerate() {
            *found = Evaluation {
                cost: all.cost.lane(lane),
                gradient: all.gradient.map(|x| x.lane(lane)),
                hessian: all.hessian.map(|x| x.lane(lane)),
                exists: all.exists.lane(lane),
            };
        }
    }
}

/// Evaluates segments of unit chord with the given end angles, of one universal curve, on all
/// threads.
pub(crate) fn evaluate_all<T: Real + Scalar<Number = T>>(
    curve: &Universal,
    free: bool,
    angles: &[[T; 2]],
    found: &mut [Evaluation<T>],
) {
    let part = |(angles, found): (&[[T; 2]], &mut [Evaluation<T>])| {
        if has_wide_registers() {
            evaluate_in_lanes::<Lanes<T, 4>>(curve, free, angles, found);
        } else {
            evaluate_in_lanes::<T>(curve, free, angles, found);
        }
    };
    if angles.len() <= TASK {
        return part((angles, found));
    }
    parallel::of(angles.chunks(TASK).zip(found.chunks_mut(TASK)), part);
}

impl<T: Real + Scalar<Number = T>> Workspace<T> {
    pub fn new(curves: usize) -> Self {
        let group = || Group { angles: Vec::new(), places: Vec::new(), found: Vec::new() };
        Workspace { groups: (0..curves).map(|_| [group(), group()]).collect(), found: Vec::new() }
    }

    /// Evaluates the trials of all running searches.
    fn evaluate(&mut self, curves: &[Universal], searches: &[Search<T>]) {
        let nothing = T::of(0.0);
        let none = Evaluation { cost: nothing, gradient: [nothing; 2], hessian: [nothing; 3], exists: T::of(1.0) };
        for group in self.groups.iter_mut().flatten() {
            group.angles.clear();
            group.places.clear();
        }
        self.found.clear();
        for search in searches.iter().filter(|search| search.standing == SlopesStanding::Running) {
            let problem = &search.problem;
            for (k, span) in problem.spans.iter().enumerate() {
                let [a, b] = [span.angles[0] + search.trial[k], span.angles[1] + search.trial[problem.after(k)]];
                let (kind, angles) = match span.ends {
                    Ends::Directed => (0, [a, b]),
                    Ends::FreeStart => (1, [nothing, b]),
                    // From the other end, and mirrored.
                    Ends::FreeEnd => (1, [nothing, -a]),
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
        // Back to the first end where that is the directed one.
        let mut place = 0;
        for search in searches.iter().filter(|search| search.standing == SlopesStanding::Running) {
            for span in &search.problem.spans {
                if span.ends == Ends::FreeEnd {
                    let found = &mut self.found[place];
                    found.gradient = [-found.gradient[1], nothing];
                    found.hessian = [found.hessian[2], nothing, nothing];
                }
                place += 1;
            }
        }
    }

    /// One trial of every running search.
    pub fn tick(&mut self, curves: &[Universal], searches: &mut [Search<T>], until: &Until) {
        self.evaluate(curves, searches);
        let mut place = 0;
        for search in searches.iter_mut().filter(|search| search.standing == SlopesStanding::Running) {
            let spans = search.problem.spans.len();
            search.receive(&self.found[place..place + spans], until);
            place += spans;
        }
    }

    /// Until none runs any more.
    pub fn run(&mut self, curves: &[Universal], searches: &mut [Search<T>], until: &Until) {
        while searches.iter().any(|search| search.standing == SlopesStanding::Running) {
            self.tick(curves, searches, until);
        }
    }
}
