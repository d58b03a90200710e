// What a descent keeps of a curve, and its place in the arrays of descent.wgsl between dispatches.

// One curve's numbers.
struct Lane {
    standing: u32,
    iterations: u32,
    evaluations: u32,
    since_best: u32,
    steepest: bool,
    // The energy with its gauge, and without.
    energy: real,
    reported: real,
    norm2: real,
    length: real,
    start_energy: real,
    best: real,
    energy_then: real,
    search: LineSearch,
}

fn load_lane(slot: u32) -> Lane {
    let state = states[slot];
    let at = slot * params.numbers + KEPT;
    var lane = Lane();
    lane.standing = state.standing;
    if (state.standing == STANDING_START) {
        lane.best = UNBOUNDED;
        lane.energy_then = UNBOUNDED;
        lane.steepest = true;
        return lane;
    }
    lane.iterations = state.iterations;
    lane.evaluations = state.evaluations;
    lane.since_best = state.since_best;
    lane.steepest = (state.flags & FLAG_STEEPEST) != 0u;
    lane.energy = lanes[at];
    lane.reported = lanes[at + 1u];
    lane.norm2 = lanes[at + 2u];
    lane.length = lanes[at + 3u];
    lane.start_energy = lanes[at + 4u];
    lane.best = lanes[at + 5u];
    lane.search.alpha = lanes[at + 6u];
    lane.search.energy = lanes[at + 7u];
    lane.search.slope = lanes[at + 8u];
    lane.search.most = lanes[at + 9u];
    lane.search.low = lanes[at + 10u];
    lane.search.low_slope = lanes[at + 11u];
    lane.search.high = lanes[at + 12u];
    lane.search.high_slope = lanes[at + 13u];
    lane.energy_then = lanes[at + 14u];
    lane.search.has_high = (state.flags & FLAG_HIGH) != 0u;
    lane.search.has_high_slope = (state.flags & FLAG_HIGH_SLOPE) != 0u;
    lane.search.trials = state.trials;
    return lane;
}

fn store_lane(slot: u32, lane: Lane) {
    let at = slot * params.numbers + KEPT;
    var flags = select(0u, FLAG_STEEPEST, lane.steepest);
    flags |= select(0u, FLAG_HIGH, lane.search.has_high);
    flags |= select(0u, FLAG_HIGH_SLOPE, lane.search.has_high_slope);
    states[slot].standing = lane.standing;
    states[slot].iterations = lane.iterations;
    states[slot].evaluations = lane.evaluations;
    states[slot].flags = flags;
    states[slot].since_best = lane.since_best;
    states[slot].trials = lane.search.trials;
    lanes[at] = lane.energy;
    lanes[at + 1u] = lane.reported;
    lanes[at + 2u] = lane.norm2;
    lanes[at + 3u] = lane.length;
    lanes[at + 4u] = lane.start_energy;
    lanes[at + 5u] = lane.best;
    lanes[at + 6u] = lane.search.alpha;
    lanes[at + 7u] = lane.search.energy;
    lanes[at + 8u] = lane.search.slope;
    lanes[at + 9u] = lane.search.most;
    lanes[at + 10u] = lane.search.low;
    lanes[at + 11u] = lane.search.low_slope;
    lanes[at + 12u] = lane.search.high;
    lanes[at + 13u] = lane.search.high_slope;
    lanes[at + 14u] = lane.energy_then;
}
