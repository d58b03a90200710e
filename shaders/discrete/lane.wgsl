// The state of a curve's descent, and its layout in the arrays of descent.wgsl between dispatches.

// No twin: the host writes it before the first tick.
const TERMINATION_STATUS_START: u32 = 0u;

const TERMINATION_STATUS_RUNNING: u32 = 1u;
const TERMINATION_STATUS_CONVERGED: u32 = 2u;
const TERMINATION_STATUS_STALLED: u32 = 3u;
const TERMINATION_STATUS_EXHAUSTED: u32 = 4u;
const TERMINATION_STATUS_UNBOUNDED: u32 = 5u;
const TERMINATION_STATUS_BROKEN: u32 = 6u;
// No twin: the curve is left to the host.
const TERMINATION_STATUS_LEFT: u32 = 7u;

const PATIENCE: u32 = 16u;
const SOBOLEV_PATIENCE: u32 = 100u;
const PROGRESS: real = real(0.7);
const CONTRACTION: real = real(1e-2);
const ROUGH: real = real(1e-6);
//:if F64
const FALL: real = real(1.4210854715202004e-14);
//:else
const FALL: real = real(7.6293945e-6);
//:end

// No twin: 1 if the previous step was undamped and not cut short.
const FLAG_FULL: u32 = 1u;

// The state of one curve's descent.
struct Lane {
    termination: u32,
    iterations: u32,
    evaluations: u32,
    since_best: u32,
    // The energy with and without its regularisation.
    energy: real,
    reported: real,
    norm2: real,
    length: real,
    start_energy: real,
    best: real,
    energy_then: real,
    lambda: real,
//:if SOBOLEV
    // The next step, and a mean of the energies so far.
    stride: real,
    mean: real,
//:end
    // Whether the previous step was undamped and not cut short.
    full: bool,
    // The current trial: whether its matrix was positive definite, the slope along p, and the step
    // length.
    sound: bool,
    slope: real,
    alpha: real,
}

//:if LANES
// λ only.
fn load_lambda(slot: u32) -> real {
    return lanes[slot * params.numbers + GIVEN + 6u];
}

// The largest step length along p.
fn load_stride(slot: u32) -> real {
//:if SOBOLEV
    return lanes[slot * params.numbers + GIVEN + 9u];
//:else
    return real(1);
//:end
}

//:end
fn load_lane(slot: u32) -> Lane {
    let state = states[slot];
    let at = slot * params.numbers + GIVEN;
    var lane = Lane();
    lane.termination = state.termination;
    if (state.termination == TERMINATION_STATUS_START) {
        lane.norm2 = UNBOUNDED;
        lane.best = UNBOUNDED;
        lane.energy_then = UNBOUNDED;
        return lane;
    }
    lane.iterations = state.iterations;
    lane.evaluations = state.evaluations;
    lane.since_best = state.since_best;
    lane.energy = lanes[at];
    lane.reported = lanes[at + 1u];
    lane.norm2 = lanes[at + 2u];
    lane.length = lanes[at + 3u];
    lane.start_energy = lanes[at + 4u];
    lane.best = lanes[at + 5u];
    lane.energy_then = lanes[at + 7u];
    lane.lambda = lanes[at + 6u];
//:if SOBOLEV
    lane.stride = lanes[at + 9u];
    lane.mean = lanes[at + 8u];
//:end
    lane.full = (state.flags & FLAG_FULL) != 0u;
    return lane;
}

fn store_lane(slot: u32, lane: Lane) {
    let at = slot * params.numbers + GIVEN;
    states[slot].termination = lane.termination;
    states[slot].iterations = lane.iterations;
    states[slot].evaluations = lane.evaluations;
    states[slot].since_best = lane.since_best;
    lanes[at] = lane.energy;
    lanes[at + 1u] = lane.reported;
    lanes[at + 2u] = lane.norm2;
    lanes[at + 3u] = lane.length;
    lanes[at + 4u] = lane.start_energy;
    lanes[at + 5u] = lane.best;
    lanes[at + 7u] = lane.energy_then;
    lanes[at + 6u] = lane.lambda;
//:if SOBOLEV
    lanes[at + 9u] = lane.stride;
    lanes[at + 8u] = lane.mean;
//:end
    states[slot].flags = select(0u, FLAG_FULL, lane.full);
}
