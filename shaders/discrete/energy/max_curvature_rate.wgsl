// The rate of change of curvature, q = √(V/ℓ) with the term V of variation.
// Twin: src/discrete/energy/max_curvature_rate.rs.
//:include discrete/energy/quantity.wgsl
//:once include discrete/energy/variation.wgsl

// q and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    let v = variation_gradient(w);
    let way = way_of(w.s0, w.s1, w.s2);
    var q = Partials();
    q.value = max(real($ROUNDING), sqrt(v.value * way.inverse));
    let factor = real(0.5) * way.inverse / q.value;
//:unroll k 0..3
    q.t$k = factor * v.t$k;
//:end
    q.s0 = factor * (v.s0 + v.value * way.beside);
    q.s1 = factor * (v.s1 + v.value * way.middle);
    q.s2 = factor * (v.s2 + v.value * way.beside);
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    let v = variation_gradient(w);
    let h = variation_hessian(w);
    let way = way_of(w.s0, w.s1, w.s2);
    let inverse = real(1) / first.value;
    let factor = real(0.5) * way.inverse * inverse;
    let slope0 = way.beside;
    let slope1 = way.middle;
    let slope2 = way.beside;
    var second = SecondPartials();
//:unroll j 0..3
//:unroll k 0..3
    second.m$j$k = factor * (h.m$j$k + slope$k * v.t$j) - (inverse * first.s$k) * first.t$j;
//:end
//:unroll k $j..3
    second.t$j$k = factor * h.t$j$k - outer(inverse * first.t$j, first.t$k);
    second.s$j$k = factor * (h.s$j$k + slope$k * v.s$j + slope$j * v.s$k + real(2) * v.value * slope$j * slope$k)
        - inverse * first.s$j * first.s$k;
//:end
//:end
    return second;
}
