// What a descent keeps of a curve, and its place in the arrays of descent.wgsl between dispatches.

// No twin: what the host writes before the first tick.
const STANDING_START: u32 = 0u;

const STANDING_RUNNING: u32 = 1u;
const STANDING_CONVERGED: u32 = 2u;
const STANDING_STALLED: u32 = 3u;
const STANDING_EXHAUSTED: u32 = 4u;
const STANDING_UNBOUNDED: u32 = 5u;
const STANDING_BROKEN: u32 = 6u;
// No twin: the host descends the curve.
const STANDING_LEFT: u32 = 7u;

const PATIENCE: u32 = 100u;
const NEWTON_PATIENCE: u32 = 16u;
const PROGRESS: real = real(0.7);
const CONTRACTION: real = real(1e-2);
const ROUGH: real = real(1e-6);
//:if F64
const FALL: real = real(1.4210854715202004e-14);
//:else
const FALL: real = real(7.6293945e-6);
//:end

// No twin: what the CPU has in variables. 1: p is −z; 2: the search has a bracket; 4: it knows the slope at its end.
const FLAG_STEEPEST: u32 = 1u;
const FLAG_HIGH: u32 = 2u;
const FLAG_HIGH_SLOPE: u32 = 4u;
// No twin: 1: the step before was undamped, and not cut short.
const FLAG_FULL: u32 = 1u;

// One curve's numbers.
struct Lane {
    standing: u32,
    iterations: u32,
    evaluations: u32,
    since_best: u32,
    // The energy with its gauge, and without.
    energy: real,
    reported: real,
    norm2: real,
    length: real,
    start_energy: real,
    best: real,
    energy_then: real,
//:if NEWTON
    lambda: real,
    // Whether the step before was undamped, and not cut short.
    full: bool,
    // Of the trial under way: what its matrix was, the slope along p, and how much of p is taken.
    sound: bool,
    slope: real,
    alpha: real,
//:else
    steepest: bool,
    search: LineSearch,
//:end
}

//:if LANES
// λ before a curve has any.
fn load_lambda(slot: u32) -> real {
    return lanes[slot * params.numbers + GIVEN + 6u];
}

//:end
fn load_lane(slot: u32) -> Lane {
    let state = states[slot];
    let at = slot * params.numbers + GIVEN;
    var lane = Lane();
    lane.standing = state.standing;
    if (state.standing == STANDING_START) {
        lane.norm2 = UNBOUNDED;
        lane.best = UNBOUNDED;
        lane.energy_then = UNBOUNDED;
//:if NEWTON
//:else
        lane.steepest = true;
//:end
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
    lane.energy_then = lanes[at + 14u];
//:if NEWTON
    lane.lambda = lanes[at + 6u];
    lane.full = (state.flags & FLAG_FULL) != 0u;
//:else
    lane.steepest = (state.flags & FLAG_STEEPEST) != 0u;
    lane.search.alpha = lanes[at + 6u];
    lane.search.energy = lanes[at + 7u];
    lane.search.slope = lanes[at + 8u];
    lane.search.most = lanes[at + 9u];
    lane.search.low = lanes[at + 10u];
    lane.search.low_slope = lanes[at + 11u];
    lane.search.high = lanes[at + 12u];
    lane.search.high_slope = lanes[at + 13u];
    lane.search.has_high = (state.flags & FLAG_HIGH) != 0u;
    lane.search.has_high_slope = (state.flags & FLAG_HIGH_SLOPE) != 0u;
    lane.search.trials = state.trials;
//:end
    return lane;
}

fn store_lane(slot: u32, lane: Lane) {
    let at = slot * params.numbers + GIVEN;
    states[slot].standing = lane.standing;
    states[slot].iterations = lane.iterations;
    states[slot].evaluations = lane.evaluations;
    states[slot].since_best = lane.since_best;
    lanes[at] = lane.energy;
    lanes[at + 1u] = lane.reported;
    lanes[at + 2u] = lane.norm2;
    lanes[at + 3u] = lane.length;
    lanes[at + 4u] = lane.start_energy;
    lanes[at + 5u] = lane.best;
    lanes[at + 14u] = lane.energy_then;
//:if NEWTON
    lanes[at + 6u] = lane.lambda;
    states[slot].flags = select(0u, FLAG_FULL, lane.full);
//:else
    var flags = select(0u, FLAG_STEEPEST, lane.steepest);
    flags |= select(0u, FLAG_HIGH, lane.search.has_high);
    flags |= select(0u, FLAG_HIGH_SLOPE, lane.search.has_high_slope);
    states[slot].flags = flags;
    states[slot].trials = lane.search.trials;
    lanes[at + 6u] = lane.search.alpha;
    lanes[at + 7u] = lane.search.energy;
    lanes[at + 8u] = lane.search.slope;
    lanes[at + 9u] = lane.search.most;
    lanes[at + 10u] = lane.search.low;
    lanes[at + 11u] = lane.search.low_slope;
    lanes[at + 12u] = lane.search.high;
    lanes[at + 13u] = lane.search.high_slope;
//:end
}
