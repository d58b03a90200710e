// The state of a curve's search, shared by evaluation.wgsl and slopes.wgsl.
// Twin: src/scf/slopes.rs

// No twin: what the host writes before the first trial.
const SLOPES_STANDING_FRESH: u32 = 0u;

// Twin: problem.rs
const SLOPES_STANDING_RUNNING: u32 = 1u;
const SLOPES_STANDING_CONVERGED: u32 = 2u;
const SLOPES_STANDING_STALLED: u32 = 3u;
const SLOPES_STANDING_UNATTAINED: u32 = 4u;
const SLOPES_STANDING_NOWHERE: u32 = 5u;
const SLOPES_STANDING_EXHAUSTED: u32 = 6u;

// No twin: the CPU has these in variables, or acts at once.
// Trials have failed since the last step, one of them for lack of a minimiser.
const FLAG_UNATTAINED: u32 = 1u;
// A step was just accepted.
const FLAG_ACCEPTED: u32 = 2u;
// The matrix must be factorised with more damping before the next trial.
const FLAG_STIFFENED: u32 = 4u;
// The gradient is 0 at the current curve.
const FLAG_FLAT: u32 = 8u;
// The host is asked for segments under tension.
const FLAG_ASKED: u32 = 16u;
// A new stage has begun at the current curve.
const FLAG_LOOSENED: u32 = 32u;

struct SlopesState {
    standing: u32,
    iterations: u32,
    evaluations: u32,
    flags: u32,
    // One more than the index of the first segment without minimiser in the last trial that failed
    // for this reason.
    culprit: u32,
}

// Whether there is a trial to be evaluated.
fn is_waiting(state: SlopesState) -> bool {
    return state.standing <= SLOPES_STANDING_RUNNING && (state.flags & (FLAG_STIFFENED | FLAG_ASKED)) == 0u;
}
