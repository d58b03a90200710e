// The quantity T_y, a limit for tests.
// Twin: src/discrete/energy/toy_limit.rs.
//:include discrete/energy/quantity.wgsl

fn $NAME_quantity(w: Window) -> Partials {
    var q = Partials();
    q.t0.y = real(1);
    q.value = w.t0.y;
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    return SecondPartials();
}
