// |T_z|, the sine of an edge's angle to the xy-plane. Twin: src/discrete/energy/climb.rs.
//:include discrete/energy/quantity.wgsl

// |T_z| and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    var q = Partials();
//:if SPATIAL
    q.t0.z = select(real(-1), real(1), w.t0.z > real(0));
    q.value = q.t0.z * w.t0.z;
//:end
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    return SecondPartials();
}
