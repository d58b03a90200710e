// The gauge: ½ c² (Δs′ − Δs)², 0 at a data point. Twin: src/discrete/energy/gauge.rs.

fn gauge_value(w: Window) -> real {
    let difference = w.free * (w.s1 - w.s0);
    return real(0.5) * difference * difference;
}

fn gauge_gradient(w: Window) -> Partials {
    let difference = w.free * (w.s1 - w.s0);
    var p = Partials();
    p.value = real(0.5) * difference * difference;
    p.s0 = -(w.free * difference);
    p.s1 = w.free * difference;
    return p;
}

fn gauge_hessian(w: Window) -> SecondPartials {
    var h = SecondPartials();
    h.s00 = w.free * w.free;
    h.s01 = -(w.free * w.free);
    h.s11 = w.free * w.free;
    return h;
}
