// Tension: ½ m Δs² for m edges. Twin: src/discrete/energy/tension.rs.

fn tension_value(w: Window) -> real {
    return real(0.5) * w.segments * w.s0 * w.s0;
}

fn tension_gradient(w: Window) -> Partials {
    var p = Partials();
    p.s0 = w.segments * w.s0;
    p.value = real(0.5) * p.s0 * w.s0;
    return p;
}

fn tension_hessian(w: Window) -> SecondPartials {
    var h = SecondPartials();
    h.s00 = w.segments;
    return h;
}
