// Tautness: Δs/w², where w is the width of the span.
// Twin: src/discrete/energy/tautness.rs.

fn tautness_value(w: Window) -> real {
    return w.taut * w.s0;
}

fn tautness_gradient(w: Window) -> Partials {
    var p = Partials();
    p.value = w.taut * w.s0;
    p.s0 = w.taut;
    return p;
}

fn tautness_hessian(w: Window) -> SecondPartials {
    return SecondPartials();
}
