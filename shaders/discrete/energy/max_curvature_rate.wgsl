// The square of the rate of change of curvature: V/ℓ with the term V of variation.
// Twin: src/discrete/energy/max_curvature_rate.rs.
//:include discrete/energy/quantity.wgsl
//:once include discrete/energy/variation.wgsl

// V/ℓ and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    let way = way_of(w.s0, w.s1, w.s2);
    var q = scaled_partials(way.inverse, variation_gradient(w));
    q.s0 += q.value * way.beside;
    q.s1 += q.value * way.middle;
    q.s2 += q.value * way.beside;
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    let v = variation_gradient(w);
    let way = way_of(w.s0, w.s1, w.s2);
    let slope0 = way.beside;
    let slope1 = way.middle;
    let slope2 = way.beside;
    var second = add_seconds(SecondPartials(), way.inverse, variation_hessian(w));
//:unroll j 0..3
//:unroll k 0..3
    second.m$j$k += (way.inverse * slope$k) * v.t$j;
//:end
//:unroll k $j..3
    second.s$j$k += way.inverse * (slope$k * v.s$j + slope$j * v.s$k + real(2) * v.value * slope$j * slope$k);
//:end
//:end
    return second;
}
