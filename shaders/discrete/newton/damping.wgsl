// What a window contributes to H + λL: its blocks of H, and its row of L.
// Twin: src/discrete/newton.rs.
//:if SOBOLEV
//:include discrete/sobolev.wgsl
//:else
//:include discrete/hessian.wgsl

fn blocks_of(curve: Curve, w: Window, weights: Weights, edges: u32) -> VertexBlocks {
    return vertex_blocks(w, weights, edges);
}

// The weight of L.
fn share_of(lambda: real) -> real {
    return lambda;
}
//:end
//:if SURFACE

// The blocks of H + λL in the tangent planes of the window's vertices, given the row of L. Along
// the normals they get a stiffness as large as the others, which rounding cannot make negative; no
// force acts along the normals.
fn in_tangent_planes(curve: Curve, w: Window, edges: u32, blocks: VertexBlocks, row: vec3<real>, normals: array<vector, 3>) -> VertexBlocks {
    var planes = VertexBlocks();
    let stiffness = select(real(0), curve.highest * real(2) / (w.s0 + w.s1) * w.r0 * w.r1, edges >= 2u);
//:unroll a 0..$VERTICES
//:unroll b $a..$VERTICES
    planes.v$a$b = in_planes(normals[$a], blocks.v$a$b + diagonal(row[$a] * row[$b]), normals[$b]);
//:end
    planes.v$a$a += outer(stiffness * normals[$a], normals[$a]);
//:end
    return planes;
}
//:end

//:if THIRD
// √(λ w Δs) times the row of D₃ in this window, 0 if it has no third edge.
fn damping_row(curve: Curve, w: Window, edges: u32, lambda: real) -> vec4<real> {
    if (edges < 3u) {
        return vec4<real>();
    }
    let root = sqrt(lambda * curve.highest * way_of(w.s0, w.s1, w.s2).inverse);
    let before = real(2) / (w.s0 + w.s1);
    let after = real(2) / (w.s1 + w.s2);
    let second = before * (w.r0 + w.r1) + after * w.r1;
    let third = -(before * w.r1 + after * (w.r1 + w.r2));
    return root * vec4<real>(-(before * w.r0), second, third, after * w.r2);
}
//:else
//:if FIRST
// √(λ w Δs) times the row of D₁ in this window, 0 if it has no edge.
fn damping_row(curve: Curve, w: Window, edges: u32, lambda: real) -> vec3<real> {
    if (edges < 1u) {
        return vec3<real>();
    }
    let root = sqrt(lambda * curve.highest * w.r0);
    return vec3<real>(-root, root, real(0));
}
//:else
// √(λ w Δa) times the row of D₂ in this window, 0 if it has no second edge.
fn damping_row(curve: Curve, w: Window, edges: u32, lambda: real) -> vec3<real> {
    if (edges < 2u) {
        return vec3<real>();
    }
    let root = sqrt(lambda * curve.highest * real(2) / (w.s0 + w.s1));
    return root * vec3<real>(w.r0, -(w.r0 + w.r1), w.r1);
}
//:end
//:end
