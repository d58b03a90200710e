// Fences: ψ = ½ ρ s² with s = max(0, r + βq), for a quantity q of a few edges. Twin: src/discrete/energy/fence.rs.

fn fence_beyond(fence: Fence, q: real) -> real {
    return max(fence.reach + fence.slope * q, real(0));
}

fn fence_value(fence: Fence, q: real) -> real {
    let beyond = fence_beyond(fence, q);
    return real(0.5) * fence.stiffness * beyond * beyond;
}

// ψ and its derivatives, from q and its own.
fn fence_gradient(fence: Fence, q: Partials) -> Partials {
    let by_q = fence.stiffness * fence_beyond(fence, q.value) * fence.slope;
    var p = Partials();
    p.value = fence_value(fence, q.value);
//:unroll k 0..$WIDTH
    p.t$k = by_q * q.t$k;
    p.s$k = by_q * q.s$k;
//:end
    return p;
}

// [s > 0] ρβ² ∇q∇qᵀ + ρsβ ∇²q
fn fence_hessian(fence: Fence, q: Partials, second: SecondPartials) -> SecondPartials {
    let beyond = fence_beyond(fence, q.value);
    let by_q = fence.stiffness * beyond * fence.slope;
    let by_qq = select(real(0), fence.stiffness * fence.slope * fence.slope, beyond > real(0));
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
