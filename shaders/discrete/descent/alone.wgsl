// Descents with one thread per curve.
// Twin: src/discrete/descent.rs.

// After an accepted step: the length of the curve, and g·g.
struct Taken {
    length: real,
    squares: real,
}

// The base: no displacement, no direction.
fn begin(curve: Curve) {
    for (var v = 0u; v < curve.vertices; v++) {
        store_displacement(curve, v, vector());
        store_vector(curve.p, v, vector());
    }
}

// Accepts the step and its gradient, and stores the lengths of the edges.
fn take_step(curve: Curve) -> Taken {
    var length = real(0);
    var squares = real(0);
    var first = vector();
    var before = vector();
    for (var v = 0u; v < curve.vertices; v++) {
        let x = trial(curve, v);
        store_displacement(curve, v, x);
        let g = work_vector(curve.x, v);
        store_vector(curve.g, v, g);
        squares += dot(g, g);
//:if SURFACE
        take_push(curve, v);
//:end
        if (v == 0u) {
            first = x;
        } else {
            length += take_length(curve, v - 1u, x - before);
        }
        before = x;
    }
    if (curve.closed != 0u) {
        length += take_length(curve, curve.segments - 1u, first - before);
    }
    return Taken(length, squares);
}

fn take_length(curve: Curve, j: u32, change: vector) -> real {
    let edge = fixed_vector(curve, j, 0u) + change;
    let length = sqrt(dot(edge, edge));
    work[curve.length + j * $SIDEu] = length;
    return length;
}

//:include discrete/newton.wgsl
//:include discrete/damped.wgsl

// One trial.
fn tick(lane: ptr<function, Lane>, at_step: Curve) {
    var curve = at_step;
    let weights = load_weights(curve);
    let is_first = (*lane).termination == TERMINATION_STATUS_START;
    // The first trial is the base.
    curve.alpha = real(0);
    if (!is_first) {
        curve.alpha = aim(lane, curve, weights);
        if ((*lane).termination > TERMINATION_STATUS_CONVERGED) {
            return;
        }
    }
//:if SURFACE
    move_back(curve, 0u, curve.vertices);
//:end
    let swept = sweep(curve, weights, 0u, curve.vertices);
    let verdict = verdict_on(lane, curve, swept);
    if (verdict == VERDICT_ACCEPT) {
        take(lane, take_step(curve));
    } else if (verdict == VERDICT_FAIL) {
        give_way(lane, curve);
    }
}

//:include entry.wgsl ENTRY=descend TASKS=params.tasks
    let own = tasks[task];
    let curve = load_curve(own.slot);
    var lane = load_lane(own.slot);
    if (lane.termination == TERMINATION_STATUS_START) {
        begin(curve);
    }
    for (var done = 0u; done < own.ticks; done++) {
        if (lane.termination > TERMINATION_STATUS_RUNNING) {
            break;
        }
        tick(&lane, curve);
    }
//:if SURFACE_WGSL
    if (is_for_host()) {
        lane.termination = TERMINATION_STATUS_LEFT;
    }
//:end
    store_lane(own.slot, lane);
}
