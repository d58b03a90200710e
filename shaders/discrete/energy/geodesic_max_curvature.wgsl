// The penalty of the geodesic curvature |m|/Δa of curves in surfaces.
// Twin: src/discrete/energy/geodesic_max_curvature.rs.
//:once include discrete/energy/penalty.wgsl
//:once include discrete/energy/in_surface.wgsl

// |m|, at least the rounding of tangents, so that it can be a divisor.
fn geodesic_max_curvature_turn(bend: Bend) -> real {
    return max(real($ROUNDING), sqrt(bend.square));
}

fn geodesic_max_curvature_value(w: Window) -> real {
    let bend = bend_of(w);
    return penalty_value(w.penalty$PENALTY, geodesic_max_curvature_turn(bend) / bend.measure);
}

fn geodesic_max_curvature_gradient(w: Window) -> Partials {
    let bend = bend_of(w);
    let turn = geodesic_max_curvature_turn(bend);
    let curvature = turn / bend.measure;
    let by_curvature = w.penalty$PENALTY.stiffness * penalty_beyond(w.penalty$PENALTY, curvature) * w.penalty$PENALTY.slope;
    var first = BendFirst();
    first.value = penalty_value(w.penalty$PENALTY, curvature);
    first.across = by_curvature / (turn * bend.measure);
    first.by_length = real(-0.5) * by_curvature * curvature / bend.measure;
    return bend_gradient(bend, first);
}

fn geodesic_max_curvature_hessian(w: Window) -> SecondPartials {
    let bend = bend_of(w);
    let turn = geodesic_max_curvature_turn(bend);
    let curvature = turn / bend.measure;
    let beyond = penalty_beyond(w.penalty$PENALTY, curvature);
    let by_curvature = w.penalty$PENALTY.stiffness * beyond * w.penalty$PENALTY.slope;
    let twice = select(real(0), w.penalty$PENALTY.stiffness * w.penalty$PENALTY.slope * w.penalty$PENALTY.slope, beyond > real(0));
    let inverse = real(1) / bend.measure;
    // q = √s/a: 2 q_s = 1/(|m| a), 4 q_ss = −1/(|m|³ a), q_a = −q/a, q_sa = −q_s/a, q_aa = 2 q/a².
    let across = inverse / turn;
    let by_measure = -curvature * inverse;
    var second = BendSecond();
    second.across = by_curvature * across;
    second.along = twice * across * across - by_curvature * across / (turn * turn);
    second.mixed = real(0.5) * across * (twice * by_measure - by_curvature * inverse);
    second.by_lengths = real(0.25) * (twice * by_measure * by_measure) + real(0.5) * by_curvature * curvature * inverse * inverse;
    return bend_hessian(w, bend, second);
}
