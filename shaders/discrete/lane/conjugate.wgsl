// Directions of conjugate gradients, p = −z + βp, and a line search along them: for descent.wgsl,
// which says what is asked for. Twins: `Lane::turn`, `Lane::begin` and `Descent::restart` of
// src/discrete.

// Twin: plan.rs
const DIRECTION_STEEPEST: u32 = 1u;
const DIRECTION_POLAK_RIBIERE: u32 = 2u;

const DOWNWARDS: real = real(0.01);

// Ends the lane, if it does, by ⟨g, z⟩ where the step was taken.
fn turn(lane: ptr<function, Lane>, curve: Curve, solved: Solved) {
    let tolerance = lanes[curve.slot * params.numbers + GIVEN_TOLERANCE];
    // Where nothing but rounding is left, it may be negative.
    let nothing = solved.norm2 < real(0) && -solved.norm2 <= tolerance * tolerance;
    let norm2 = select(solved.norm2, real(0), nothing);
    (*lane).norm2 = norm2;
    if (!solved.sound || is_out_of_range(norm2) || norm2 < real(0)) {
        (*lane).standing = STANDING_BROKEN;
        return;
    }
    let norm = sqrt(norm2);
    if (norm <= tolerance) {
        (*lane).standing = STANDING_CONVERGED;
    } else if (has_run_away(lane, curve)) {
        (*lane).standing = STANDING_UNBOUNDED;
    } else if ((*lane).iterations >= states[curve.slot].most_iterations) {
        (*lane).standing = STANDING_EXHAUSTED;
    } else if (falls_short(lane, norm, PATIENCE)) {
        (*lane).standing = STANDING_STALLED;
    }
}

// p = βp − z, of which the largest allowed step is returned.
fn take_direction(curve: Curve, beta: real) -> real {
    var largest = real(0);
    var first = vector();
    var before = vector();
    for (var v = 0u; v < curve.vertices; v++) {
        let p = beta * work_vector(curve.p, v) - work_vector(curve.z, v);
        store_vector(curve.p, v, p);
        if (v == 0u) {
            first = p;
        } else {
            largest = max(largest, relative_change(curve, v - 1u, p - before));
        }
        before = p;
    }
    if (curve.closed != 0u) {
        largest = max(largest, relative_change(curve, curve.segments - 1u, first - before));
    }
    return most_step(largest);
}

// β of the next direction, from ⟨g⁺, z⁺⟩, ⟨g⁺, z⟩ and ⟨g⁺, p⟩, and ⟨g, z⟩ before.
fn coefficient(lane: ptr<function, Lane>, solved: Solved, before: real, slope: real) -> real {
    if ((*lane).iterations == 0u) {
        return real(0);
    }
    let norm2 = (*lane).norm2;
    let change = slope - (*lane).search.slope;
    var beta = real(0);
    if (params.direction == DIRECTION_POLAK_RIBIERE) {
        beta = (norm2 - solved.mixed) / before;
    } else if (params.direction != DIRECTION_STEEPEST && change > real(0)) {
        beta = min((norm2 - solved.mixed) / change, norm2 / change);
    }
    if (is_out_of_range(beta) || beta <= real(0) || beta * slope - norm2 >= -(DOWNWARDS * norm2)) {
        return real(0);
    }
    return beta;
}

fn aim(lane: ptr<function, Lane>, curve: Curve, weights: Weights) -> real {
    return (*lane).search.alpha;
}

// What follows a step that was taken, of this slope along p there.
fn take(lane: ptr<function, Lane>, curve: Curve, taken: Taken, slope: real) {
    (*lane).length = taken.length;
    let before = (*lane).norm2;
    let solved = sobolev_gradient(curve);
    turn(lane, curve, solved);
    if ((*lane).standing == STANDING_RUNNING) {
        go_on(lane, curve, solved, before, slope);
    }
}

fn judge(lane: ptr<function, Lane>, curve: Curve, energy: real, slope: real) -> u32 {
    if (params.search != 0u) {
        (*lane).search = judged((*lane).search, energy, slope);
        return (*lane).search.verdict;
    }
    return select(VERDICT_ACCEPT, VERDICT_FAIL, is_out_of_range(energy));
}

fn go_on(lane: ptr<function, Lane>, curve: Curve, solved: Solved, before: real, slope: real) {
    let beta = coefficient(lane, solved, before, slope);
    let most = take_direction(curve, beta);
    (*lane).steepest = beta == real(0);
    let given = lanes[curve.slot * params.numbers + GIVEN_STEP];
    if (params.search == 0u) {
        (*lane).search = line_search((*lane).energy, beta * slope - solved.norm2, given, UNBOUNDED);
    } else {
        let alpha = select((*lane).search.alpha, real(1), (*lane).iterations == 0u);
        (*lane).search = line_search((*lane).energy, beta * slope - solved.norm2, alpha, most);
    }
}

fn give_way(lane: ptr<function, Lane>, curve: Curve) {
    if ((*lane).steepest) {
        (*lane).standing = STANDING_STALLED;
        return;
    }
    // −z after a direction has failed.
    let most = take_direction(curve, real(0));
    (*lane).steepest = true;
    (*lane).search = line_search((*lane).energy, -(*lane).norm2, real(1), most);
}
