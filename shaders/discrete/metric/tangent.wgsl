// The tangent at a vertex of a curve as it stands. Twin: src/discrete/metric/mod.rs.

// The unit vector halfway between the tangents of the edges at a vertex.
fn tangent_at(curve: Curve, v: u32) -> vector {
    let is_first = v == 0u && curve.closed == 0u;
    let before_edge = select(select(v, curve.segments, v == 0u) - 1u, 0u, is_first);
    let after_edge = min(v, curve.segments - 1u);
    let before = current_edge(curve, before_edge) / length_at(curve, before_edge);
    let after = current_edge(curve, after_edge) / length_at(curve, after_edge);
    let sum = before + after;
    let square = dot(sum, sum);
    // Edges that turn back have no direction in common: any serves.
    if (square > real(1e-12)) {
        return sum / sqrt(square);
    }
    return after;
}
