// Newton's method on the tangent angles of a curve, one thread per curve: takes the evaluations of
// its segments at the trial, and computes the next trial. If the matrix is not positive definite,
// the next dispatch continues with more damping, so that a thread's loops stay short.
// Twin: src/scf/slopes.rs

struct SlopesParams {
    tasks: u32,
    // Dots of all curves.
    dots: u32,
    most_iterations: u32,
}

struct SlopesCurve {
    // Its first dot, which is also the position of its first segment.
    start: u32,
    dots: u32,
    closed: u32,
    // The number of stages in which its dots become movable.
    stages: u32,
}

@group(0) @binding(0) var<uniform> params: SlopesParams;
// The running curves.
@group(0) @binding(1) var<storage, read> tasks: array<u32>;
@group(0) @binding(2) var<storage, read> curves: array<SlopesCurve>;
@group(0) @binding(3) var<storage, read_write> states: array<SlopesState>;
// SLOPES_NUMBERS per curve, named below.
@group(0) @binding(4) var<storage, read_write> numbers: array<real>;
// 1 for every dot whose direction is an unknown, else 0; then the weights of all segments; then the
// stages in which dots become movable.
@group(0) @binding(5) var<storage, read> fixed: array<real>;
// The evaluations of the segments at the trial: see evaluation.wgsl.
@group(0) @binding(6) var<storage, read> found: array<real>;
// The trials of all dots, then their current turns.
@group(0) @binding(7) var<storage, read_write> turns: array<real>;
// WORK_… of all dots, one after the other.
@group(0) @binding(8) var<storage, read_write> work: array<real>;

//:include scf/slopes/standing.wgsl
//:include damping/verdict.wgsl
//:include damping.wgsl
//:include linalg/power.wgsl

const MOST_TURN: real = real(0.5);
const EDGE: real = real(1e4);

// No twin: the host writes these in this order: 1/ν, 1 − 1/ν, the least remaining part of a step's
// length, and the tolerance of the relative decrement.
const SLOPES_SHARE: u32 = 0u;
const SLOPES_PART: u32 = 1u;
const SLOPES_LEAST: u32 = 2u;
const SLOPES_TOLERANCE: u32 = 3u;

// Kept, as in the twin. Twin: gpu/search.rs
const SLOPES_COST: u32 = 4u;
const SLOPES_DECREMENT: u32 = 5u;
const SLOPES_NUMBERS: u32 = 13u;
// No twin: these are not downloaded.
const SLOPES_ALPHA: u32 = 6u;
const SLOPES_SLOPE: u32 = 7u;
const SLOPES_STRETCH: u32 = 8u;
const SLOPES_SMALLEST: u32 = 9u;
const SLOPES_LAMBDA: u32 = 10u;
// No twin: under tension, the tolerance of all stages but the last, and the stage.
const SLOPES_ROUGHLY: u32 = 11u;
const SLOPES_STAGE: u32 = 12u;

// No twin: the CPU has separate arrays for these.
const WORK_GRADIENT: u32 = 0u;
const WORK_THERE: u32 = 1u;
const WORK_STEP: u32 = 2u;
const WORK_DIAGONAL: u32 = 3u;
const WORK_COUPLING: u32 = 4u;
const WORK_PIVOT: u32 = 5u;
const WORK_BAND: u32 = 6u;
const WORK_BORDER: u32 = 7u;
// Twin: gpu/bounds.rs
const WORK_NUMBERS: u32 = 8u;

//:if TENSION
//:include scf/slopes/by_span.wgsl
//:else
// 1 if a direction is an unknown, else 0.
fn movable(dot: u32) -> real {
    return fixed[dot];
}
//:end

struct Received {
    cost: real,
    // One more than the index of the first segment without minimiser, or 0.
    missing: u32,
    // The slope along the step that led to the trial.
    slope: real,
}

// Sums the costs of the segments, with the gradient.
fn receive(curve: SlopesCurve) -> Received {
    let there = WORK_THERE * params.dots + curve.start;
    let step = WORK_STEP * params.dots + curve.start;
    let spans = curve.dots - 1u + curve.closed;
    var cost = real(0);
    var missing = 0u;
    // The derivative of the previous segment at the shared dot.
    var before = real(0);
    var slope = real(0);
    // A closed curve's first dot is where its last segment ends.
    var opening = real(0);
    for (var k = 0u; k < spans; k++) {
        let at = 7u * (curve.start + k);
        let weight = fixed[params.dots + curve.start + k];
        if (missing == 0u && !(found[at + 6u] > real(0))) {
            missing = k + 1u;
        }
        cost += weight * found[at];
        let own = before + weight * found[at + 1u];
        before = weight * found[at + 2u];
        if (k == 0u) {
            opening = own;
        } else {
            work[there + k] = own * movable(curve.start + k);
        }
    }
    if (curve.closed != 0u) {
        opening += before;
    } else {
        work[there + spans] = before * movable(curve.start + spans);
    }
    work[there] = opening * movable(curve.start);
    for (var k = 0u; k < curve.dots; k++) {
        slope += work[there + k] * work[step + k];
    }
    return Received(cost, missing, slope);
}

// Accepts the trial.
fn accept(curve: SlopesCurve) -> bool {
    let dots = params.dots;
    let spans = curve.dots - 1u + curve.closed;
    var before = real(0);
    var opening = real(0);
    var is_flat = true;
    for (var k = 0u; k < curve.dots; k++) {
        let to = curve.start + k;
        let gradient = work[WORK_THERE * dots + to];
        is_flat = is_flat && gradient == real(0);
        work[WORK_GRADIENT * dots + to] = gradient;
        turns[dots + to] = turns[to];
        var own = before;
        if (k < spans) {
            let at = 7u * to;
            let weight = fixed[dots + to];
            own += weight * found[at + 3u];
            work[WORK_COUPLING * dots + to] = weight * found[at + 4u];
            before = weight * found[at + 5u];
        }
        work[WORK_DIAGONAL * dots + to] = own;
        if (k == 0u) {
            opening = own;
        }
    }
    if (curve.closed != 0u) {
        work[WORK_DIAGONAL * dots + curve.start] = opening + before;
    }
    return is_flat;
}

//:include scf/slopes/factor.wgsl

fn tick(index: u32) {
    let curve = curves[index];
    var state = states[index];
    if (state.standing > SLOPES_STANDING_RUNNING) {
        return;
    }
    let at = index * SLOPES_NUMBERS;
//:if TENSION
    stage = numbers[at + SLOPES_STAGE];
    if (is_waiting(state) && is_to_be_asked(curve)) {
        state.flags |= FLAG_ASKED;
        state.standing = SLOPES_STANDING_RUNNING;
        states[index] = state;
    }
    if ((state.flags & FLAG_ASKED) != 0u) {
        return;
    }
//:end
    let share = numbers[at + SLOPES_SHARE];
    var cost = numbers[at + SLOPES_COST];
    var lambda = numbers[at + SLOPES_LAMBDA];
    if (is_waiting(state)) {
        let received = receive(curve);
        state.evaluations += 1u;
        let exists = received.missing == 0u;
        if (!exists) {
            state.culprit = received.missing;
        }
        var taken = true;
        if (state.evaluations == 1u || (state.flags & FLAG_LOOSENED) != 0u) {
            if (!exists || is_no_number(received.cost)) {
                state.standing = SLOPES_STANDING_NOWHERE;
                states[index] = state;
                return;
            }
        } else {
            // In terms of the root of the cost, to which the Newton step belongs, relative to the
            // current curve.
            let stretch = numbers[at + SLOPES_STRETCH];
            let root = power(received.cost / cost, share);
            let there = received.slope * root / received.cost;
//:if TENSION
            let part = change(curve) / cost;
            // If the root is too close to 1 for its digits, it is taken to first order.
            let energy = real(0);
            let energy_there = select(root - real(1), share * part, abs(part) < NEARLY);
//:else
            let energy = real(1);
            let energy_there = root;
//:end
            let trial = Trial(
                exists && numbers[at + SLOPES_SMALLEST] > real(0),
                share * stretch * numbers[at + SLOPES_SLOPE] / cost,
                share * stretch * there,
                energy,
                energy_there,
                numbers[at + SLOPES_ALPHA],
            );
            let damping = damped(lambda, trial);
            lambda = damping.lambda;
            taken = damping.verdict == VERDICT_ACCEPT;
            if (taken) {
                state.iterations += 1u;
            } else {
                if (!exists) {
                    state.flags |= FLAG_UNATTAINED;
                }
                let at_the_edge = !exists && lambda > EDGE;
                if (damping.verdict == VERDICT_FAIL || at_the_edge) {
                    let unattained = (state.flags & FLAG_UNATTAINED) != 0u;
                    state.standing = select(SLOPES_STANDING_STALLED, SLOPES_STANDING_UNATTAINED, unattained);
//:if TENSION
                    state = loosened(curve, index, state);
//:end
                    states[index] = state;
                    return;
                }
            }
        }
        if (taken) {
            cost = received.cost;
            numbers[at + SLOPES_COST] = cost;
            let is_flat = accept(curve);
//:if TENSION
            keep_spans(curve);
//:end
            state.flags = FLAG_ACCEPTED | select(0u, FLAG_FLAT, is_flat);
        }
    }
    state.standing = SLOPES_STANDING_RUNNING;
    let smallest = factor(curve, lambda);
    if (!(smallest > real(0))) {
        lambda = grown(lambda);
        if (lambda <= MOST) {
            numbers[at + SLOPES_LAMBDA] = lambda;
            state.flags |= FLAG_STIFFENED;
            states[index] = state;
            return;
        }
    }
    let solved = solve(curve);
    // Newton's step on cost^{1/ν} is longer than that on the cost by the factor 1/(1 − (1 − 1/ν)
    // gᵀH⁻¹g/cost).
    let least = numbers[at + SLOPES_LEAST];
    var left = least;
    if (cost > real(0)) {
        left = larger_of(real(1) + numbers[at + SLOPES_PART] * solved.slope / cost, least);
    }
    let stretch = real(1) / left;
    let most = stretch * solved.most;
    let alpha = select(real(1), MOST_TURN / most, most > MOST_TURN);
    let along = alpha * stretch;
    for (var k = curve.start; k < curve.start + curve.dots; k++) {
        turns[k] = turns[params.dots + k] + along * work[WORK_STEP * params.dots + k];
    }
    numbers[at + SLOPES_ALPHA] = alpha;
    numbers[at + SLOPES_SLOPE] = solved.slope;
    numbers[at + SLOPES_STRETCH] = stretch;
    numbers[at + SLOPES_SMALLEST] = smallest;
    numbers[at + SLOPES_LAMBDA] = lambda;
    if ((state.flags & FLAG_ACCEPTED) != 0u) {
        let square = -solved.slope;
        let undamped = lambda == real(0) && smallest > real(0);
        if (undamped && square <= real(0) && (state.flags & FLAG_FLAT) != 0u) {
            numbers[at + SLOPES_DECREMENT] = real(0);
            state.standing = SLOPES_STANDING_CONVERGED;
        } else if (undamped) {
//:if TENSION
            let decrement = decrement_by_dot(curve);
            let tolerance = numbers[at + select(SLOPES_ROUGHLY, SLOPES_TOLERANCE, is_last_stage(curve))];
//:else
            let decrement = sqrt(larger_of(square, real(0)) / cost);
            let tolerance = numbers[at + SLOPES_TOLERANCE];
//:end
            numbers[at + SLOPES_DECREMENT] = decrement;
            if (decrement <= tolerance) {
                state.standing = SLOPES_STANDING_CONVERGED;
            }
        }
        if (state.standing == SLOPES_STANDING_RUNNING && state.iterations >= params.most_iterations) {
            state.standing = SLOPES_STANDING_EXHAUSTED;
        }
    }
    state.flags &= FLAG_UNATTAINED;
//:if TENSION
    state = loosened(curve, index, state);
//:end
    states[index] = state;
}

//:include entry.wgsl ENTRY=advance TASKS=params.tasks
    tick(tasks[task]);
}
