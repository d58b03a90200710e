// The curvature |K| = |T′ − T|/Δa. Twin: src/discrete/energy/max_curvature.rs.
//:include discrete/energy/quantity.wgsl

// |T′ − T|, at least the rounding of tangents, so that it can be a divisor.
fn $NAME_turn(w: Window) -> real {
    let d = w.t1 - w.t0;
    return max(real($ROUNDING), sqrt(dot(d, d)));
}

// |K| and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    let a = real(0.5) * (w.s0 + w.s1);
    let turn = $NAME_turn(w);
    var q = Partials();
    q.value = turn / a;
    q.t1 = (real(1) / (turn * a)) * (w.t1 - w.t0);
    q.t0 = -q.t1;
    q.s0 = real(-0.5) * q.value / a;
    q.s1 = q.s0;
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    let a = real(0.5) * (w.s0 + w.s1);
    let across = real(1) / ($NAME_turn(w) * a);
    let by_lengths = real(0.5) * first.value / (a * a);
    // (I − e eᵀ)/(|d| a) with e = d/|d|, where ∂q/∂T′ = e/a.
    let by_tangents = diagonal(across) - outer((across * a * a) * first.t1, first.t1);
    let by_tangent_and_length = (real(-0.5) / a) * first.t1;
    var second = SecondPartials();
    second.t00 = by_tangents;
    second.t01 = real(-1) * by_tangents;
    second.t11 = by_tangents;
    second.m00 = -by_tangent_and_length;
    second.m01 = -by_tangent_and_length;
    second.m10 = by_tangent_and_length;
    second.m11 = by_tangent_and_length;
    second.s00 = by_lengths;
    second.s01 = by_lengths;
    second.s11 = by_lengths;
    return second;
}
