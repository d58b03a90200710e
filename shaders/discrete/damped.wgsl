// Directions of Newton's method damped in the Sobolev metric, (H + λL) p = −g, or with SOBOLEV of
// Sobolev gradients, L p = −g, and one trial per tick. Included by descent.wgsl.
// Twin: src/discrete/damped.rs.

// What is known of a direction: whether its matrix was positive definite, g·p, and the largest
// square of an edge's change over its length.
struct Found {
    sound: bool,
    slope: real,
    largest_square: real,
}

// The step length along the direction, at most `most`.
fn step_of(found: Found, most: real) -> real {
    return min(most, most_step(found.largest_square));
}

// Ends the lane before a trial along p, if it is done. A converged lane takes this last step too,
// if it can.
fn end_before(lane: ptr<function, Lane>, curve: Curve, found: Found) {
    let tolerance = lanes[curve.slot * params.numbers + GIVEN_TOLERANCE];
    let square = (real(1) + (*lane).lambda) * -found.slope;
    let least = tolerance * tolerance;
    // Rounding may make a slope positive at a minimum.
    let is_sound = found.sound && !is_out_of_range(square) && square >= -least;
//:if SOBOLEV
    let is_full = false;
//:else
    let is_full = is_sound && (*lane).lambda == real(0) && step_of(found, real(1)) == real(1);
//:end
    // Quadratic convergence squares the contraction of the error in every step.
    let contraction = square / (*lane).norm2;
    let next = contraction * contraction * square;
    let contracts = is_full && (*lane).full && contraction <= CONTRACTION && next <= CONTRACTION * least;
    if (is_sound) {
        (*lane).norm2 = select(max(square, real(0)), next, contracts);
    }
    (*lane).full = is_full;
    if ((is_sound && square <= least) || contracts) {
        (*lane).termination = TERMINATION_STATUS_CONVERGED;
    } else if (has_run_away(lane, curve)) {
        (*lane).termination = TERMINATION_STATUS_UNBOUNDED;
    } else if ((*lane).iterations >= states[curve.slot].most_iterations) {
        (*lane).termination = TERMINATION_STATUS_EXHAUSTED;
    }
}

// Updates the lane after an accepted step.
fn take(lane: ptr<function, Lane>, taken: Taken) {
    (*lane).length = taken.length;
    if (is_out_of_range(taken.squares)) {
        (*lane).termination = TERMINATION_STATUS_BROKEN;
    } else if ((*lane).termination == TERMINATION_STATUS_RUNNING && falls_short(lane)) {
        (*lane).termination = TERMINATION_STATUS_STALLED;
    }
}

fn aimed(lane: ptr<function, Lane>, found: Found) -> real {
    (*lane).sound = found.sound;
    (*lane).slope = found.slope;
//:if SOBOLEV
    (*lane).alpha = step_of(found, (*lane).stride);
//:else
    (*lane).alpha = step_of(found, real(1));
//:end
    return (*lane).alpha;
}

fn judge(lane: ptr<function, Lane>, curve: Curve, energy: real, slope: real) -> u32 {
    let trial = Trial((*lane).sound, (*lane).slope, slope, (*lane).energy, energy, (*lane).alpha);
//:if SOBOLEV
    let next = strode((*lane).mean, trial);
    (*lane).stride = next.alpha;
    (*lane).mean = next.mean;
    return next.verdict;
//:else
    let is_damped = (*lane).lambda > real(0);
    let damping = damped((*lane).lambda, trial);
    // A damped decrement may be too small.
    let tolerance = lanes[curve.slot * params.numbers + GIVEN_TOLERANCE];
    let leads_on = damping.verdict == VERDICT_ACCEPT && is_damped && (*lane).since_best == 0u && tolerance <= ROUGH;
    // Contraction does not count if the step fails.
    let contracted = damping.verdict == VERDICT_AGAIN && !is_damped && -(*lane).slope > tolerance * tolerance;
    if ((*lane).termination == TERMINATION_STATUS_CONVERGED && (leads_on || contracted)) {
        (*lane).termination = TERMINATION_STATUS_RUNNING;
    }
    (*lane).lambda = damping.lambda;
    return damping.verdict;
//:end
}

fn give_way(lane: ptr<function, Lane>, curve: Curve) {
    if ((*lane).termination == TERMINATION_STATUS_RUNNING) {
        (*lane).termination = TERMINATION_STATUS_STALLED;
    }
}
