// Penalties: ψ = ½ ρ s² with s = max(0, r + βq), for a quantity q of a few edges.
// Twin: src/discrete/energy/penalty.rs.

fn penalty_beyond(penalty: Penalty, q: real) -> real {
    return max(penalty.reach + penalty.slope * q, real(0));
}

fn penalty_value(penalty: Penalty, q: real) -> real {
    let beyond = penalty_beyond(penalty, q);
    return real(0.5) * penalty.stiffness * beyond * beyond;
}

// ψ and its derivatives, from q and its derivatives.
fn penalty_gradient(penalty: Penalty, q: Partials) -> Partials {
    let by_q = penalty.stiffness * penalty_beyond(penalty, q.value) * penalty.slope;
    var p = Partials();
    p.value = penalty_value(penalty, q.value);
//:unroll k 0..$WIDTH
    p.t$k = by_q * q.t$k;
    p.s$k = by_q * q.s$k;
//:end
    return p;
}

// [s > 0] ρβ² ∇q∇qᵀ + ρsβ ∇²q
fn penalty_hessian(penalty: Penalty, q: Partials, second: SecondPartials) -> SecondPartials {
    let beyond = penalty_beyond(penalty, q.value);
    let by_q = penalty.stiffness * beyond * penalty.slope;
    let by_qq = select(real(0), penalty.stiffness * penalty.slope * penalty.slope, beyond > real(0));
    var h = SecondPartials();
//:unroll j 0..$WIDTH
//:unroll k 0..$WIDTH
    h.m$j$k = (by_qq * q.s$k) * q.t$j + by_q * second.m$j$k;
//:end
//:unroll k $j..$WIDTH
    h.t$j$k = outer(by_qq * q.t$j, q.t$k) + by_q * second.t$j$k;
    h.s$j$k = by_qq * q.s$j * q.s$k + by_q * second.s$j$k;
//:end
//:end
    return h;
}
