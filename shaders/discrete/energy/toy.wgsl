// A toy energy for tests: |T′ − T|² Δs Δs′.
// Twin: src/discrete/energy/toy.rs.

fn toy_value(w: Window) -> real {
    let d = w.t1 - w.t0;
    return dot(d, d) * w.s0 * w.s1;
}

fn toy_gradient(w: Window) -> Partials {
    let d = w.t1 - w.t0;
    let q = dot(d, d);
    var p = Partials();
    p.value = q * w.s0 * w.s1;
    p.t1 = (real(2) * w.s0 * w.s1) * d;
    p.t0 = -p.t1;
    p.s0 = q * w.s1;
    p.s1 = q * w.s0;
    return p;
}

fn toy_hessian(w: Window) -> SecondPartials {
    let d = w.t1 - w.t0;
    var h = SecondPartials();
    h.t00 = diagonal(real(2) * w.s0 * w.s1);
    h.t01 = real(-1) * h.t00;
    h.t11 = h.t00;
    h.m10 = (real(2) * w.s1) * d;
    h.m11 = (real(2) * w.s0) * d;
    h.m00 = -h.m10;
    h.m01 = -h.m11;
    h.s01 = dot(d, d);
    return h;
}
