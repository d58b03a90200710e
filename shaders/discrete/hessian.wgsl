// The Hessian of the terms that start at one edge, with respect to the vertices of their window, by
// the chain rule from tangents and lengths to edges, and from edges to vertices. Include it after
// energy/mod.wgsl.
// Twin: src/discrete/hessian.rs.

// v01: with respect to vertex 0 (rows) and vertex 1 of the window.
struct VertexBlocks {
//:unroll j 0..$VERTICES
//:unroll k $j..$VERTICES
    v$j$k: matrix,
//:end
//:end
}

// The block of two edges:
// (P/Δs) F_TT (P′/Δs′) + (P/Δs) F_TΔs′ T′ᵀ + T (F_T′Δs P′/Δs′)ᵀ + T F_ΔsΔs′ T′ᵀ with P = I − T Tᵀ.
// `mixed` is by the first tangent and the second length, `mixed_back` by the second tangent and the
// first length.
fn edge_block(
    t: vector,
    r: real,
    t_other: vector,
    r_other: real,
    tangents: matrix,
    mixed: vector,
    mixed_back: vector,
    lengths: real,
) -> matrix {
    let left = tangents - outer(t, t * tangents);
    let both = left - outer(left * t_other, t_other);
    let along = r * (mixed - dot(t, mixed) * t) + lengths * t;
    let back = r_other * (mixed_back - dot(t_other, mixed_back) * t_other);
    return (r * r_other) * both + outer(along, t_other) + outer(t, back);
}

// The contribution of the first derivatives at one edge, because P/Δs and T depend on the edge.
fn edge_curvature(t: vector, r: real, by_tangent: vector, by_length: real) -> matrix {
    let along = dot(t, by_tangent);
    let across = (r * r) * (by_tangent - along * t);
    let rest = r * by_length - r * r * along;
    return diagonal(rest) - outer(rest * t + across, t) - outer(t, across);
}

fn vertex_blocks(w: Window, weights: Weights, edges: u32) -> VertexBlocks {
    let p = window_gradient(w, weights, edges);
    let h = window_hessian(w, weights, edges);
    var v = VertexBlocks();
    // The blocks of the edges j and k: edge j is vertex j + 1 minus vertex j.
//:unroll j 0..$WIDTH
    let e$j$j = edge_block(w.t$j, w.r$j, w.t$j, w.r$j, h.t$j$j, h.m$j$j, h.m$j$j, h.s$j$j)
        + edge_curvature(w.t$j, w.r$j, p.t$j, p.s$j);
    v.v$j$j += e$j$j;
    v.v$j$(j+1) -= e$j$j;
    v.v$(j+1)$(j+1) += e$j$j;
//:unroll k $(j+1)..$WIDTH
    let e$j$k = edge_block(w.t$j, w.r$j, w.t$k, w.r$k, h.t$j$k, h.m$j$k, h.m$k$j, h.s$j$k);
    v.v$j$k += e$j$k;
    v.v$j$(k+1) -= e$j$k;
    v.v$(j+1)$k -= e$j$k;
//:if $k == $(j+1)
    v.v$k$k -= transpose(e$j$k);
//:end
    v.v$(j+1)$(k+1) += e$j$k;
//:end
//:end
//:if SURFACE
    // The block of an edge (rows) and the position of vertex 1. The edges are v₁ − v₀ and v₂ − v₁.
    let before = w.r0 * (h.x0 - outer(w.t0, w.t0 * h.x0)) + outer(w.t0, h.sx);
    let after = w.r1 * (h.x1 - outer(w.t1, w.t1 * h.x1)) + outer(w.t1, h.sx);
    v.v01 -= before;
    v.v12 += transpose(after);
    v.v11 += h.xx + before + transpose(before) - after - transpose(after);
//:end
    return v;
}
