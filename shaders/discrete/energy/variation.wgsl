// Variation of curvature: |(I − T Tᵀ)(K′ − K)|²/ℓ with the way ℓ from K to K′.
// Twin: src/discrete/energy/variation.rs.
//:once include discrete/energy/across.wgsl

fn variation_value(w: Window) -> real {
    let x = across_of(w, real(-1), real(1));
    return dot(x.across, x.across) * way_of(w.s0, w.s1, w.s2).inverse;
}

fn variation_gradient(w: Window) -> Partials {
    let way = way_of(w.s0, w.s1, w.s2);
    var p = scaled_partials(way.inverse, across_gradient(across_of(w, real(-1), real(1))));
//:unroll k 0..3
    p.s$k += p.value * way.l$k;
//:end
    return p;
}

fn variation_hessian(w: Window) -> SecondPartials {
    let way = way_of(w.s0, w.s1, w.s2);
    let x = across_of(w, real(-1), real(1));
    // Of Φ/ℓ: by its gradient p = ∇Φ/ℓ.
    let p = scaled_partials(way.inverse, across_gradient(x));
    var h = add_seconds(SecondPartials(), way.inverse, across_hessian(x, w.t1));
//:unroll j 0..3
//:unroll k 0..3
    h.m$j$k += way.l$k * p.t$j;
//:end
//:unroll k $j..3
    h.s$j$k += way.l$k * p.s$j + way.l$j * p.s$k + real(2) * p.value * way.l$j * way.l$k;
//:end
//:end
    return h;
}
