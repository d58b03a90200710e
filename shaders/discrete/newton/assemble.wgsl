// The blocks of H + λL for a lane's chunk of vertices, for the block ring: a vertex with itself and
// with the next $REACH. Each lane computes the windows that begin before its chunk once more.
// Twin: src/discrete/newton.rs.
//:include discrete/newton/damping.wgsl

fn block_at(curve: Curve, v: u32, k: u32) -> u32 {
    return curve.blocks + ($VERTICESu * v + k) * $DIMu * $DIMu * $SIDEu;
}

// Adds to a block if it belongs to the lane's chunk.
fn add_to_block(curve: Curve, ring: BlockRing, v: i32, k: u32, x: matrix) {
    if (v >= i32(ring.begin) && v < i32(ring.end)) {
        let at = block_at(curve, u32(v), k);
        store_matrix(at, 0u, work_matrix(at, 0u) + x);
    }
}

fn edge_or_unit(curve: Curve, j: i32) -> vector {
    if (has_edge(curve, j)) {
        return current_edge(curve, wrapped(curve, j));
    }
    return unit_edge();
}

fn assemble(curve: Curve, ring: BlockRing, weights: Weights, lambda: real) {
//:if SURFACE
    let surface = load_surface(curve);
//:end
    for (var v = ring.begin; v < ring.end; v++) {
        var own = matrix();
//:if ATTACHMENT
        own = diagonal(share_of(lambda) * load_stiffness(curve, v));
//:end
//:if SOBOLEV
//:else
//:if ATTACHMENT
        own += anchor_hessian(load_anchor(curve, v), current_offset(curve, v));
//:end
//:if REGIONS
        own += regions_hessian(curve, v, displacement(curve, v));
//:end
//:end
//:if SURFACE
        let frame = current_frame(curve, surface, i32(v));
        own = in_planes(frame.normal, own, frame.normal) + bend_of_surface(curve, v, frame);
//:end
        store_matrix(block_at(curve, v, 0u), 0u, own);
//:unroll k 1..$VERTICES
        store_matrix(block_at(curve, v, $ku), 0u, matrix());
//:end
    }
    let first = i32(ring.begin);
    let begin = select(max(first - $WIDTH, 0), first - $WIDTH, curve.closed != 0u);
    var w = window_of(curve, weights);
//:unroll k 0..$LAST
    w = shifted(w, edge_or_unit(curve, begin + $k));
//:end
//:if SURFACE
    var here = current_frame(curve, surface, begin);
    var next = current_frame(curve, surface, begin + 1);
//:end
    for (var j = begin; j < i32(ring.end); j++) {
        w = shifted(w, edge_or_unit(curve, j + $LAST));
        w = placed(w, curve, j);
        let edges = edges_from(curve, j);
//:if SURFACE
        w = framed(w, next);
        let after = current_frame(curve, surface, j + 2);
        let normals = array<vector, 3>(here.normal, next.normal, after.normal);
        let damped = damping_row(curve, w, edges, lambda);
        let blocks = in_tangent_planes(curve, w, edges, blocks_of(curve, w, weights, edges), damped, normals);
        let row = vec3<real>();
        here = next;
        next = after;
//:else
        let blocks = blocks_of(curve, w, weights, edges);
        let row = damping_row(curve, w, edges, lambda);
//:end
        // Blocks in memory save registers.
//:unroll a 0..$VERTICES
//:unroll b $a..$VERTICES
        add_to_block(curve, ring, j + $a, $bu - $au, blocks.v$a$b + diagonal(row[$a] * row[$b]));
//:end
//:end
    }
}
