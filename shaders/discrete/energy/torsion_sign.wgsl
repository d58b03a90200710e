// The twist: a fence of t = det(T, T′, T″), which has the sign of the torsion of spatial curves.
// Twin: src/discrete/energy/torsion_sign.rs.
//:once include discrete/energy/fence.wgsl

// t and its partial derivatives.
fn torsion_sign_volume(w: Window) -> Partials {
    var q = Partials();
//:if SPATIAL
    q.t0 = cross(w.t1, w.t2);
    q.t1 = cross(w.t2, w.t0);
    q.t2 = cross(w.t0, w.t1);
    q.value = dot(w.t0, q.t0);
//:end
    return q;
}

//:if SPATIAL
// ∂²(a·(b × c))/∂a∂b: row a, column b.
fn torsion_sign_pair(c: vector) -> matrix {
    return matrix(real(0), -c.z, c.y, c.z, real(0), -c.x, -c.y, c.x, real(0));
}
//:end

fn torsion_sign_value(w: Window) -> real {
    return fence_value(w.fence$FENCE, torsion_sign_volume(w).value);
}

fn torsion_sign_gradient(w: Window) -> Partials {
    return fence_gradient(w.fence$FENCE, torsion_sign_volume(w));
}

fn torsion_sign_hessian(w: Window) -> SecondPartials {
    var second = SecondPartials();
//:if SPATIAL
    second.t01 = torsion_sign_pair(w.t2);
    second.t12 = torsion_sign_pair(w.t0);
    second.t02 = torsion_sign_pair(-w.t1);
//:end
    return fence_hessian(w.fence$FENCE, torsion_sign_volume(w), second);
}
