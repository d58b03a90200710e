// Variation of curvature: |(I − T Tᵀ)(K′ − K)|²/Δs of the middle edge.
// Twin: src/discrete/energy/variation.rs.
//:once include discrete/energy/across.wgsl

fn variation_value(w: Window) -> real {
    let x = across_of(w, real(-1), real(1));
    return dot(x.across, x.across) * w.r1;
}

fn variation_gradient(w: Window) -> Partials {
    var p = scaled_partials(w.r1, across_gradient(across_of(w, real(-1), real(1))));
    p.s1 -= p.value * w.r1;
    return p;
}

fn variation_hessian(w: Window) -> SecondPartials {
    let x = across_of(w, real(-1), real(1));
    // Of Φ/Δs: by its gradient p = ∇Φ/Δs.
    let p = scaled_partials(w.r1, across_gradient(x));
    var h = add_seconds(SecondPartials(), w.r1, across_hessian(x, w.t1));
    h.m01 -= w.r1 * p.t0;
    h.m11 -= w.r1 * p.t1;
    h.m21 -= w.r1 * p.t2;
    h.s01 -= w.r1 * p.s0;
    h.s12 -= w.r1 * p.s2;
    h.s11 += real(2) * w.r1 * (p.value * w.r1 - p.s1);
    return h;
}
