// Descents of which each has a thread for itself. Twin: src/discrete/descent.rs.
//:include discrete/metric/mod.wgsl
//:if SECOND
//:include discrete/metric/hats.wgsl
//:end

// The base: no displacement, no direction.
fn begin(curve: Curve) {
    for (var v = 0u; v < curve.vertices; v++) {
        store_displacement(curve, v, vector());
        store_vector(curve.p, v, vector());
        store_vector(curve.z, v, vector());
    }
}

// Takes the step and its gradient; its edges' lengths are kept, and their sum is returned.
fn take_step(curve: Curve) -> real {
    var length = real(0);
    var first = vector();
    var before = vector();
    for (var v = 0u; v < curve.vertices; v++) {
        let x = trial(curve, v);
        store_displacement(curve, v, x);
//:if NEWTON
        store_vector(curve.g, v, work_vector(curve.x, v));
//:if SURFACE
        take_push(curve, v);
//:end
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
    return length;
}

fn take_length(curve: Curve, j: u32, change: vector) -> real {
    let edge = fixed_vector(curve, j, 0u) + change;
    let length = sqrt(dot(edge, edge));
    work[curve.length + j * $SIDEu] = length;
    return length;
}

// What differs with the way directions are found:
//     fn aim(lane: ptr<function, Lane>, curve: Curve, weights: Weights) -> real: the step of the trial along p
//     fn judge(lane: ptr<function, Lane>, energy: real, slope: real) -> u32: the verdict on the trial
//     fn go_on(lane: ptr<function, Lane>, curve: Curve, solved: Solved, before: real, slope: real): after a step that was
//         taken and did not end the lane; `before` is ⟨g, z⟩ before it
//     fn give_way(lane: ptr<function, Lane>, curve: Curve): after a direction that failed
//:if NEWTON
//:include discrete/newton.wgsl
//:include discrete/damped.wgsl
//:else
//:include discrete/lane/conjugate.wgsl
//:end

// One trial.
fn tick(lane: ptr<function, Lane>, at_step: Curve) {
    var curve = at_step;
    let weights = load_weights(curve);
    let is_first = (*lane).standing == STANDING_START;
    // The first trial is the base.
    curve.alpha = real(0);
    if (!is_first) {
        curve.alpha = aim(lane, curve, weights);
    }
//:if SURFACE
    move_back(curve, 0u, curve.vertices);
//:end
    let swept = sweep(curve, weights, 0u, curve.vertices);
    let verdict = verdict_on(lane, swept);
    if (verdict == VERDICT_ACCEPT) {
        (*lane).length = take_step(curve);
        let before = (*lane).norm2;
        let solved = sobolev_gradient(curve);
        turn(lane, curve, solved);
        if ((*lane).standing == STANDING_RUNNING) {
            go_on(lane, curve, solved, before, swept.slope);
        }
    } else if (verdict == VERDICT_FAIL) {
        give_way(lane, curve);
    }
}

//:include entry.wgsl ENTRY=descend TASKS=params.tasks
    let own = tasks[task];
    let curve = load_curve(own.slot);
    var lane = load_lane(own.slot);
    if (lane.standing == STANDING_START) {
        begin(curve);
    }
    for (var done = 0u; done < own.ticks; done++) {
        if (lane.standing > STANDING_RUNNING) {
            break;
        }
        tick(&lane, curve);
    }
//:if SURFACE_WGSL
    if (is_for_host()) {
        lane.standing = STANDING_LEFT;
    }
//:end
    store_lane(own.slot, lane);
}
