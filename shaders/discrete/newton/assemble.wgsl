// The blocks of H + λL by a lane's chunk of vertices, for the block ring: a vertex with itself and with the next
// two. Windows that begin before the chunk are computed again. Twin: src/discrete/newton.rs.
//:include discrete/newton/damping.wgsl

fn block_at(curve: Curve, v: u32, k: u32) -> u32 {
    return curve.blocks + (3u * v + k) * $DIMu * $DIMu * $SIDEu;
}

// Adds to a block of the chunk; those of other chunks are not the lane's.
fn add_to_block(curve: Curve, ring: BlockRing, v: i32, k: u32, x: matrix) {
    if (v >= i32(ring.begin) && v < i32(ring.end)) {
        let at = block_at(curve, u32(v), k);
        store_matrix(at, 0u, work_matrix(at, 0u) + x);
    }
}

fn assemble(curve: Curve, ring: BlockRing, weights: Weights, lambda: real) {
    for (var v = ring.begin; v < ring.end; v++) {
        var own = matrix();
//:if ATTACHMENT
        own = diagonal((real(1) + lambda) * weights.attachment * load_stiffness(curve, v));
//:end
        store_matrix(block_at(curve, v, 0u), 0u, own);
        store_matrix(block_at(curve, v, 1u), 0u, matrix());
        store_matrix(block_at(curve, v, 2u), 0u, matrix());
    }
    let first = i32(ring.begin);
    let begin = select(max(first - 2, 0), first - 2, curve.closed != 0u);
    var w = window_of(curve, weights);
    w = shifted(w, current_edge(curve, wrapped(curve, begin)));
    for (var j = begin; j < i32(ring.end); j++) {
        var edge = unit_edge();
        if (has_edge(curve, j + 1)) {
            edge = current_edge(curve, wrapped(curve, j + 1));
        }
        w = shifted(w, edge);
//:if GAUGE
        if (has_edge(curve, j)) {
            w.free = load_free(curve, wrapped(curve, j));
        }
//:end
        let edges = edges_from(curve, j);
        let blocks = vertex_blocks(w, weights, edges);
        let row = damping_row(curve, w, edges, lambda);
        // Blocks in memory spare registers.
        add_to_block(curve, ring, j, 0u, blocks.v00 + diagonal(row.x * row.x));
        add_to_block(curve, ring, j, 1u, blocks.v01 + diagonal(row.x * row.y));
        add_to_block(curve, ring, j, 2u, blocks.v02 + diagonal(row.x * row.z));
        add_to_block(curve, ring, j + 1, 0u, blocks.v11 + diagonal(row.y * row.y));
        add_to_block(curve, ring, j + 1, 1u, blocks.v12 + diagonal(row.y * row.z));
        add_to_block(curve, ring, j + 2, 0u, blocks.v22 + diagonal(row.z * row.z));
    }
}
