// The side: a fence of the signed curvature κ = (T × T′)/Δa of planar curves. Twin: src/discrete/energy/curvature_sign.rs.
//:once include discrete/energy/fence.wgsl

// κ and its partial derivatives.
fn curvature_sign_curvature(w: Window) -> Partials {
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

fn curvature_sign_value(w: Window) -> real {
    return fence_value(w.fence$FENCE, curvature_sign_curvature(w).value);
}

fn curvature_sign_gradient(w: Window) -> Partials {
    return fence_gradient(w.fence$FENCE, curvature_sign_curvature(w));
}

fn curvature_sign_hessian(w: Window) -> SecondPartials {
    let r = real(2) / (w.s0 + w.s1);
    let first = curvature_sign_curvature(w);
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
    return fence_hessian(w.fence$FENCE, first, second);
}
