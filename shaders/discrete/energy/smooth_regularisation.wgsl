// The regularisation of order 3: ½ (q′ − q)² over the middle edge of three, with q = c (Δs′ − Δs)
// at its ends, 0 at a data point; at the ends of an open curve also the difference form.
// Twin: src/discrete/energy/regularisation.rs.
//:once include discrete/energy/regularisation.wgsl

fn smooth_regularisation_value(w: Window) -> real {
    let difference = w.free_after * (w.s2 - w.s1) - w.free * (w.s1 - w.s0);
    return real(0.5) * difference * difference;
}

fn smooth_regularisation_gradient(w: Window) -> Partials {
    let difference = w.free_after * (w.s2 - w.s1) - w.free * (w.s1 - w.s0);
    var p = Partials();
    p.value = real(0.5) * difference * difference;
    p.s0 = w.free * difference;
    p.s1 = -((w.free_after + w.free) * difference);
    p.s2 = w.free_after * difference;
    return p;
}

fn smooth_regularisation_hessian(w: Window) -> SecondPartials {
    let middle = -(w.free + w.free_after);
    var h = SecondPartials();
    h.s00 = w.free * w.free;
    h.s01 = w.free * middle;
    h.s02 = w.free * w.free_after;
    h.s11 = middle * middle;
    h.s12 = middle * w.free_after;
    h.s22 = w.free_after * w.free_after;
    return h;
}

fn end_regularisation_value(w: Window) -> real {
    return w.ends * difference_regularisation_value(w);
}

fn end_regularisation_gradient(w: Window) -> Partials {
    return scaled_partials(w.ends, difference_regularisation_gradient(w));
}

fn end_regularisation_hessian(w: Window) -> SecondPartials {
    return add_seconds(SecondPartials(), w.ends, difference_regularisation_hessian(w));
}
