// How a curve's search goes, as evaluation.wgsl and slopes.wgsl both see it.
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

// No twin: what the CPU has in variables, or does at once.
// Trials failed since the last step, one of them for want of a minimiser.
const FLAG_UNATTAINED: u32 = 1u;
// A step was just taken.
const FLAG_ACCEPTED: u32 = 2u;
// The matrix is to be factored with more damping before the next trial.
const FLAG_STIFFENED: u32 = 4u;
// The gradient is 0 where it stands.
const FLAG_FLAT: u32 = 8u;
// The host is asked for segments under tension.
const FLAG_ASKED: u32 = 16u;
// More dots became movable where it stands.
const FLAG_LOOSENED: u32 = 32u;

struct SlopesState {
    standing: u32,
    iterations: u32,
    evaluations: u32,
    flags: u32,
    // One more than the first segment that had no minimiser in the last trial that failed for it.
    culprit: u32,
}

// Whether there is a trial to be evaluated.
fn is_waiting(state: SlopesState) -> bool {
    return state.standing <= SLOPES_STANDING_RUNNING && (state.flags & (FLAG_STIFFENED | FLAG_ASKED)) == 0u;
}
