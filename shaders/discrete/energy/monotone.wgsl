// a = n·T, the progress of an edge along a direction. Twin: src/discrete/energy/monotone.rs.
// A kernel may contain several of these terms, each with its direction and its $NAME.
//:include discrete/energy/quantity.wgsl

// a and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    var q = Partials();
//:if SPATIAL
    q.t0 = vector(real($X), real($Y), real($Z));
//:else
    q.t0 = vector(real($X), real($Y));
//:end
    q.value = dot(q.t0, w.t0);
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    return SecondPartials();
}
