// Ahead: a fence of a = n·T, the way that an edge goes along a direction. Twin: src/discrete/energy/ahead.rs.
//:once include discrete/energy/fence.wgsl

// a and its partial derivatives.
fn ahead_way(w: Window) -> Partials {
    var q = Partials();
//:if SPATIAL
    q.t0 = vector(real($X), real($Y), real($Z));
//:else
    q.t0 = vector(real($X), real($Y));
//:end
    q.value = dot(q.t0, w.t0);
    return q;
}

fn ahead_value(w: Window) -> real {
    return fence_value(w.ahead, ahead_way(w).value);
}

fn ahead_gradient(w: Window) -> Partials {
    return fence_gradient(w.ahead, ahead_way(w));
}

fn ahead_hessian(w: Window) -> SecondPartials {
    return fence_hessian(w.ahead, ahead_way(w), SecondPartials());
}
