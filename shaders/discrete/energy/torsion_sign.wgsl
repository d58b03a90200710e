// t = det(T, T′, T″), which has the sign of the torsion of spatial curves.
// Twin: src/discrete/energy/torsion_sign.rs.
//:include discrete/energy/quantity.wgsl

// t and its partial derivatives.
fn $NAME_quantity(w: Window) -> Partials {
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
fn $NAME_pair(c: vector) -> matrix {
    return matrix(real(0), -c.z, c.y, c.z, real(0), -c.x, -c.y, c.x, real(0));
}
//:end

fn $NAME_second(w: Window, first: Partials) -> SecondPartials {
    var second = SecondPartials();
//:if SPATIAL
    second.t01 = $NAME_pair(w.t2);
    second.t12 = $NAME_pair(w.t0);
    second.t02 = $NAME_pair(-w.t1);
//:end
    return second;
}
