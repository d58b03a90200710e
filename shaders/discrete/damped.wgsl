// Newton's method damped in the Sobolev metric, (H + λL) p = −g, one trial a tick: for
// descent.wgsl, which says what is asked for. Twin: src/discrete/damped.rs.

fn aim(lane: ptr<function, Lane>, curve: Curve, weights: Weights) -> real {
    let found = newton_direction(curve, weights, (*lane).lambda);
    (*lane).sound = found.sound;
    (*lane).slope = found.slope;
    (*lane).alpha = min(real(1), most_step(found.largest_square));
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
