// A lane's chunk of vertices: all but the first $REACH are eliminated, one after the other, and
// substituted back at the end. A chunk has the blocks of its vertices with themselves and with the
// vertices after them.

// Block of a vertex of the chunk, by unwrapped indices, with held vertices decoupled. 0 for vertices
// of the next chunk.
fn ring_own_block(curve: Curve, ring: BlockRing, v: u32, k: u32) -> matrix {
    if (v >= ring.end) {
        return matrix();
    }
    var other = v + k;
    if (ring.closed && other >= ring.vertices) {
        other -= ring.vertices;
    }
    // The second is unread where there is no such vertex.
    let moves = other < ring.vertices && ring_movable(curve, v) && ring_movable(curve, min(other, ring.vertices - 1u));
    if (moves) {
        return ring_block(curve, v, k);
    }
    if (k == 0u) {
        return block_unit();
    }
    return matrix();
}

fn ring_own_rhs(curve: Curve, ring: BlockRing, v: u32) -> vector {
    if (v < ring.end && v < ring.vertices) {
        if (ring_movable(curve, v)) {
            return ring_rhs(curve, v);
        }
    }
    return vector();
}

// Eliminates the chunk's vertices but the first $REACH. A first pass factors them, and leaves terms of
// the next chunk's first vertices. Then a pass for each of the chunk's first vertices couples it with
// them. There are several passes so that a thread keeps few blocks at a time.
fn ring_eliminate(curve: Curve, ring: BlockRing, smallest: ptr<function, real>) {
    ring_factor_chunk(curve, ring, smallest);
    for (var a = 0u; a < RING_REACH; a++) {
        ring_couple(curve, ring, a);
    }
}

// The first word of an eliminated vertex.
fn ring_eliminated(ring: BlockRing, v: u32) -> u32 {
    return RING_SHARED + (v - ring.begin - RING_REACH) * RING_ELIMINATED;
}

fn ring_factor_chunk(curve: Curve, ring: BlockRing, smallest: ptr<function, real>) {
    // The next vertices. The last row and column belong to the vertex about to enter.
    var window: array<matrix, RING_FRONT * RING_FRONT>;
    var window_rhs: array<vector, RING_FRONT>;
    let first = ring.begin + RING_REACH;
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    window[$au * RING_FRONT + $bu] = ring_own_block(curve, ring, first + $au, $bu - $au);
//:end
    window_rhs[$a] = ring_own_rhs(curve, ring, first + $au);
//:end
    var after: array<matrix, RING_REACH>;
    for (var v = first; v < ring.end; v++) {
//:unroll i 0..$REACH
        window[$iu * RING_FRONT + RING_REACH] = ring_own_block(curve, ring, v + $iu, RING_REACH - $iu);
//:end
        window[RING_REACH * RING_FRONT + RING_REACH] = ring_own_block(curve, ring, v + RING_REACH, 0u);
        window_rhs[RING_REACH] = ring_own_rhs(curve, ring, v + RING_REACH);

        let word = ring_eliminated(ring, v);
        let factor = block_cholesky(window[0], smallest);
        let r = block_under_vector(factor, window_rhs[0]);
        ring_store_block(ring, word, factor);
        ring_store_vector(ring, word + RING_ELIMINATED_RHS, r);
//:unroll a 0..$REACH
        after[$a] = block_under(factor, window[$au + 1u]);
        ring_store_block(ring, word + (1u + $au) * RING_BLOCK, after[$a]);
//:end
        // The window moves on by a vertex.
//:unroll i 0..$REACH
//:unroll j $i..$REACH
        window[$iu * RING_FRONT + $ju] =
            window[($iu + 1u) * RING_FRONT + $ju + 1u] - block_product(after[$i], after[$j]);
//:end
        window_rhs[$i] = window_rhs[$iu + 1u] - block_transposed(after[$i], r);
//:end
    }
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    ring_store_block(ring, ring_upper(RING_HIGH, $au, $bu), window[$au * RING_FRONT + $bu]);
//:end
    ring_store_vector(ring, RING_HIGH_RHS + $au * $DIMu, window_rhs[$a]);
//:end
}

// Couples the chunk's vertex a with the eliminated ones. Of its row, `low` remains for the chunk's
// first vertices, and `across` for the next chunk's.
fn ring_couple(curve: Curve, ring: BlockRing, a: u32) {
    // Rows of the next vertices; and by the chunk's vertices up to a.
    var coupled: array<matrix, RING_REACH>;
    var low: array<matrix, RING_REACH>;
    let own = ring.begin + a;
//:unroll i 0..$REACH
    if ($iu <= a) {
        coupled[$i] = transpose(ring_own_block(curve, ring, own, RING_REACH + $iu - a));
        low[$i] = ring_own_block(curve, ring, ring.begin + $iu, a - $iu);
    }
//:end
    var low_rhs = ring_own_rhs(curve, ring, own);
    for (var v = ring.begin + RING_REACH; v < ring.end; v++) {
        let word = ring_eliminated(ring, v);
        let kept = block_under(ring_load_block(ring, ring.lane, word), coupled[0]);
        ring_store_block(ring, word + (1u + RING_REACH + a) * RING_BLOCK, kept);
//:unroll i 0..$REACH
        if ($iu <= a) {
            low[$i] -= block_product(ring_load_block(ring, ring.lane, word + (1u + RING_REACH + $iu) * RING_BLOCK), kept);
        }
//:end
        low_rhs -= block_transposed(kept, ring_load_vector(ring, ring.lane, word + RING_ELIMINATED_RHS));
//:unroll i 1..$REACH
        coupled[$iu - 1u] = coupled[$i] - block_product(ring_load_block(ring, ring.lane, word + $iu * RING_BLOCK), kept);
//:end
        coupled[RING_REACH - 1u] =
            matrix() - block_product(ring_load_block(ring, ring.lane, word + RING_REACH * RING_BLOCK), kept);
    }
//:unroll i 0..$REACH
    if ($iu <= a) {
        ring_store_block(ring, ring_upper(RING_LOW, $iu, a), low[$i]);
    }
    ring_store_block(ring, RING_ACROSS + ($iu * RING_REACH + a) * RING_BLOCK, coupled[$i]);
//:end
    ring_store_vector(ring, RING_LOW_RHS + a * $DIMu, low_rhs);
}

// Substitutes back, from the kept unknowns of this chunk and of the next.
fn ring_substitute(curve: Curve, ring: BlockRing, behind: u32) {
    var next: array<vector, RING_REACH>;
    var kept: array<vector, RING_REACH>;
//:unroll a 0..$REACH
    next[$a] = ring_load_vector(ring, behind, RING_LOW_RHS + $au * $DIMu);
    kept[$a] = ring_load_vector(ring, ring.lane, RING_LOW_RHS + $au * $DIMu);
//:end
    for (var v = ring.end; v > ring.begin + RING_REACH; v--) {
        let word = ring_eliminated(ring, v - 1u);
        var x = ring_load_vector(ring, ring.lane, word + RING_ELIMINATED_RHS);
//:unroll a 0..$REACH
        x -= block_applied(ring_load_block(ring, ring.lane, word + (1u + $au) * RING_BLOCK), next[$a]);
        x -= block_applied(ring_load_block(ring, ring.lane, word + (1u + RING_REACH + $au) * RING_BLOCK), kept[$a]);
//:end
        x = block_over_vector(ring_load_block(ring, ring.lane, word), x);
//:unroll a $REACH..1
        next[$a] = next[$au - 1u];
//:end
        next[0] = x;
        ring_store(curve, v - 1u, x);
    }
//:unroll a 0..$REACH
    if (ring.begin + $au < ring.vertices) {
        ring_store(curve, ring.begin + $au, kept[$a]);
    }
//:end
}
