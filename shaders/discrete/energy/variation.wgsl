// Variation of curvature: |(I − T Tᵀ)(K′ − K)|²/ℓ, with the distance ℓ from K to K′.
// Twin: src/discrete/energy/variation.rs.
//:once include discrete/energy/across.wgsl

fn variation_value(w: Window) -> real {
    let x = across_of(w, real(-1), real(1));
    return dot(x.across, x.across) * way_of(w.s0, w.s1, w.s2).inverse;
}

fn variation_gradient(w: Window) -> Partials {
    let way = way_of(w.s0, w.s1, w.s2);
    var p = scaled_partials(way.inverse, across_gradient(across_of(w, real(-1), real(1))));
    p.s0 += p.value * way.beside;
    p.s1 += p.value * way.middle;
    p.s2 += p.value * way.beside;
    return p;
}

fn variation_hessian(w: Window) -> SecondPartials {
    let way = way_of(w.s0, w.s1, w.s2);
    let x = across_of(w, real(-1), real(1));
    // The Hessian of Φ/ℓ, from its gradient p.
    let p = scaled_partials(way.inverse, across_gradient(x));
    var h = add_seconds(SecondPartials(), way.inverse, across_hessian(x, w.t1));
//:unroll j 0..3
    h.m$j0 += way.beside * p.t$j;
    h.m$j1 += way.middle * p.t$j;
    h.m$j2 += way.beside * p.t$j;
//:end
    let both = p.value * way.middle;
    h.s11 += real(2) * way.middle * (p.s1 + both);
    h.s01 += way.middle * p.s0 + way.beside * (p.s1 + real(2) * both);
    h.s12 += way.middle * p.s2 + way.beside * (p.s1 + real(2) * both);
    let own = real(2) * p.value * way.beside;
    h.s00 += way.beside * (real(2) * p.s0 + own);
    h.s02 += way.beside * (p.s0 + p.s2 + own);
    h.s22 += way.beside * (real(2) * p.s2 + own);
    return h;
}
