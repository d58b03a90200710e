// The signed curvature κ = (T × T′)/Δa of planar curves.
// Twin: src/discrete/energy/curvature_sign.rs.
//:include discrete/energy/quantity.wgsl

// κ and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
    let r = real(2) / (w.s0 + w.s1);
    var q = Partials();
//:if SPATIAL
//:else
    q.value = r * (w.t0.x * w.t1.y - w.t0.y * w.t1.x);
    q.t0 = r * vector(w.t1.y, -w.t1.x);
    q.t1 = r * vector(-w.t0.y, w.t0.x);
//:end
    q.s0 = real(-0.5) * r * q.value;
    q.s1 = q.s0;
    return q;
}

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    let r = real(2) / (w.s0 + w.s1);
    var second = SecondPartials();
//:if SPATIAL
//:else
    second.t01 = matrix(real(0), -r, r, real(0));
//:end
    second.m00 = (real(-0.5) * r) * first.t0;
    second.m01 = second.m00;
    second.m10 = (real(-0.5) * r) * first.t1;
    second.m11 = second.m10;
    second.s00 = real(0.5) * r * r * first.value;
    second.s01 = second.s00;
    second.s11 = second.s00;
    return second;
}
