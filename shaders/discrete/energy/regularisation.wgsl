// The spacing regularisation: ½ q² with q = 2c (Δs′ − Δs)/(Δs′ + Δs), or q = c (Δs′ − Δs) for the
// difference form. Both are 0 at a data point.
// Twin: src/discrete/energy/regularisation.rs.

fn ratio_regularisation_value(w: Window) -> real {
    let q = w.free * (real(2) * (w.s1 - w.s0) / (w.s0 + w.s1));
    return real(0.5) * q * q;
}

fn ratio_regularisation_gradient(w: Window) -> Partials {
    let inverse = real(1) / (w.s0 + w.s1);
    let q = w.free * (real(2) * (w.s1 - w.s0) * inverse);
    let slope = real(4) * w.free * q * inverse * inverse;
    var p = Partials();
    p.value = real(0.5) * q * q;
    p.s0 = -(slope * w.s1);
    p.s1 = slope * w.s0;
    return p;
}

fn ratio_regularisation_hessian(w: Window) -> SecondPartials {
    let inverse = real(1) / (w.s0 + w.s1);
    let factor = real(4) * w.free * inverse * inverse;
    let q = w.free * (real(2) * (w.s1 - w.s0) * inverse);
    let by_s0 = -(factor * w.s1);
    let by_s1 = factor * w.s0;
    let bend = factor * q * inverse;
    var h = SecondPartials();
    h.s00 = by_s0 * by_s0 + real(2) * bend * w.s1;
    h.s01 = by_s0 * by_s1 + bend * (w.s1 - w.s0);
    h.s11 = by_s1 * by_s1 - real(2) * bend * w.s0;
    return h;
}

fn difference_regularisation_value(w: Window) -> real {
    let difference = w.free * (w.s1 - w.s0);
    return real(0.5) * difference * difference;
}

fn difference_regularisation_gradient(w: Window) -> Partials {
    let difference = w.free * (w.s1 - w.s0);
    var p = Partials();
    p.value = real(0.5) * difference * difference;
    p.s0 = -(w.free * difference);
    p.s1 = w.free * difference;
    return p;
}

fn difference_regularisation_hessian(w: Window) -> SecondPartials {
    var h = SecondPartials();
    h.s00 = w.free * w.free;
    h.s01 = -(w.free * w.free);
    h.s11 = w.free * w.free;
    return h;
}
