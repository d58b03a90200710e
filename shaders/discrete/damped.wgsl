// Newton's method damped in the Sobolev metric, (H + λL) p = −g, one trial a tick, until √(−g·p) is small: for
// descent.wgsl, which says what is asked for. Twin: src/discrete/damped.rs.

// Of a direction: whether its matrix was positive definite, g·p, and the square of the largest
// change of an edge to its length.
struct Found {
    sound: bool,
    slope: real,
    largest_square: real,
}

// The part of the direction that a trial takes.
fn step_of(found: Found) -> real {
    return min(real(1), most_step(found.largest_square));
}

// Ends the lane before a trial along p, if it does.
fn end_before(lane: ptr<function, Lane>, curve: Curve, found: Found) {
    let tolerance = lanes[curve.slot * params.numbers + GIVEN_TOLERANCE];
    let square = (real(1) + (*lane).lambda) * -found.slope;
    let least = tolerance * tolerance;
    // Rounding may make a slope positive at a minimum.
    let is_sound = found.sound && !is_out_of_range(square) && square >= -least;
    if (is_sound) {
        (*lane).norm2 = max(square, real(0));
    }
    if (is_sound && square <= least) {
        (*lane).standing = STANDING_CONVERGED;
    } else if (has_run_away(lane, curve)) {
        (*lane).standing = STANDING_UNBOUNDED;
    } else if ((*lane).iterations >= params.most_iterations) {
        (*lane).standing = STANDING_EXHAUSTED;
    }
}

// What follows a step that was taken, of this slope along p there.
fn take(lane: ptr<function, Lane>, curve: Curve, taken: Taken, slope: real) {
    (*lane).length = taken.length;
    if (is_out_of_range(taken.squares)) {
        (*lane).standing = STANDING_BROKEN;
    } else if (falls_short(lane, sqrt((*lane).norm2), NEWTON_PATIENCE)) {
        (*lane).standing = STANDING_STALLED;
    }
}

fn aimed(lane: ptr<function, Lane>, found: Found) -> real {
    (*lane).sound = found.sound;
    (*lane).slope = found.slope;
    (*lane).alpha = step_of(found);
    return (*lane).alpha;
}

fn judge(lane: ptr<function, Lane>, energy: real, slope: real) -> u32 {
    let trial = Trial((*lane).sound, (*lane).slope, slope, (*lane).energy, energy, (*lane).alpha);
    let damping = damped((*lane).lambda, trial);
    (*lane).lambda = damping.lambda;
    return damping.verdict;
}

fn give_way(lane: ptr<function, Lane>, curve: Curve) {
    (*lane).standing = STANDING_STALLED;
}
