// What a window has of H + λL: its blocks of H, and its row of L. Twin: src/discrete/newton.rs.
//:include discrete/hessian.wgsl

// √(λ w Δa) times the row of D₂ in this window: 0 where it has no second edge.
fn damping_row(curve: Curve, w: Window, edges: u32, lambda: real) -> vec3<real> {
    if (edges < 2u) {
        return vec3<real>();
    }
    let root = sqrt(lambda * curve.highest * real(2) / (w.s0 + w.s1));
    return root * vec3<real>(w.r0, -(w.r0 + w.r1), w.r1);
}
