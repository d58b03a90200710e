// Newton's method damped in the Sobolev metric, (H + λL) p = −g, one trial a tick: for
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

// The next direction is found where the next trial begins.
fn go_on(lane: ptr<function, Lane>, curve: Curve, solved: Solved, before: real, slope: real) {}

fn give_way(lane: ptr<function, Lane>, curve: Curve) {
    (*lane).standing = STANDING_STALLED;
}
