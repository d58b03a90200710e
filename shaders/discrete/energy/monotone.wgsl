// Ahead: a fence of a = n·T, the way that an edge goes along a direction. Twin: src/discrete/energy/monotone.rs.
// A kernel may hold several of these terms. Each has its direction and its $NAME.
//:once include discrete/energy/fence.wgsl

// a and its partial derivatives.
fn $NAME_way(w: Window) -> Partials {
    var q = Partials();
//:if SPATIAL
    q.t0 = vector(real($X), real($Y), real($Z));
//:else
    q.t0 = vector(real($X), real($Y));
//:end
    q.value = dot(q.t0, w.t0);
    return q;
}

fn $NAME_value(w: Window) -> real {
    return fence_value(w.fence$FENCE, $NAME_way(w).value);
}

fn $NAME_gradient(w: Window) -> Partials {
    return fence_gradient(w.fence$FENCE, $NAME_way(w));
}

fn $NAME_hessian(w: Window) -> SecondPartials {
    return fence_hessian(w.fence$FENCE, $NAME_way(w), SecondPartials());
}
