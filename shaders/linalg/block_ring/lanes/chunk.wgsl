// A lane's chunk of vertices: all but the first $REACH are eliminated, one after the other, and
// substituted back at the end. To a chunk belong the blocks of its vertices with themselves and
// those after.

// Block of a vertex of the chunk, by unwrapped numbers, where vertices that are held are decoupled;
// 0 of the next chunk's.
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

// Leaves in `low` what the chunk's first vertices are left with, in `high` what is to be added to
// the next chunk's, and in `across` the block between.
fn ring_eliminate(curve: Curve, ring: BlockRing, smallest: ptr<function, real>) {
    // The next vertices, whose last row and column are those of the vertex about to enter; and what
    // couples them with the kept ones, window in rows.
    var window: array<matrix, RING_FRONT * RING_FRONT>;
    var window_rhs: array<vector, RING_FRONT>;
    var coupled: array<matrix, RING_FRONT * RING_REACH>;
    var low: array<matrix, RING_BLOCKS>;
    var low_rhs: array<vector, RING_REACH>;
    let first = ring.begin + RING_REACH;
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    low[$au * RING_REACH + $bu] = ring_own_block(curve, ring, ring.begin + $au, $bu - $au);
    window[$au * RING_FRONT + $bu] = ring_own_block(curve, ring, first + $au, $bu - $au);
    coupled[$au * RING_REACH + $bu] = transpose(ring_own_block(curve, ring, ring.begin + $bu, RING_REACH + $au - $bu));
//:end
    low_rhs[$a] = ring_own_rhs(curve, ring, ring.begin + $au);
    window_rhs[$a] = ring_own_rhs(curve, ring, first + $au);
//:end
    var after: array<matrix, RING_REACH>;
    var kept: array<matrix, RING_REACH>;
    var word = RING_SHARED;
    for (var v = first; v < ring.end; v++) {
//:unroll i 0..$REACH
        window[$iu * RING_FRONT + RING_REACH] = ring_own_block(curve, ring, v + $iu, RING_REACH - $iu);
        coupled[RING_REACH * RING_REACH + $iu] = matrix();
//:end
        window[RING_REACH * RING_FRONT + RING_REACH] = ring_own_block(curve, ring, v + RING_REACH, 0u);
        window_rhs[RING_REACH] = ring_own_rhs(curve, ring, v + RING_REACH);

        let factor = block_cholesky(window[0], smallest);
        let r = block_under_vector(factor, window_rhs[0]);
        ring_store_block(ring, word, factor);
        ring_store_vector(ring, word + (2u * RING_REACH + 1u) * RING_BLOCK, r);
//:unroll a 0..$REACH
        after[$a] = block_under(factor, window[$au + 1u]);
        kept[$a] = block_under(factor, coupled[$a]);
        ring_store_block(ring, word + (1u + $au) * RING_BLOCK, after[$a]);
        ring_store_block(ring, word + (1u + RING_REACH + $au) * RING_BLOCK, kept[$a]);
//:end
//:unroll a 0..$REACH
//:unroll b $a..$REACH
        low[$au * RING_REACH + $bu] -= block_product(kept[$a], kept[$b]);
//:end
        low_rhs[$a] -= block_transposed(kept[$a], r);
//:end
        // The window moves on by a vertex.
//:unroll i 0..$REACH
//:unroll j $i..$REACH
        window[$iu * RING_FRONT + $ju] =
            window[($iu + 1u) * RING_FRONT + $ju + 1u] - block_product(after[$i], after[$j]);
//:end
//:unroll a 0..$REACH
        coupled[$iu * RING_REACH + $au] =
            coupled[($iu + 1u) * RING_REACH + $au] - block_product(after[$i], kept[$a]);
//:end
        window_rhs[$i] = window_rhs[$iu + 1u] - block_transposed(after[$i], r);
//:end
        word += RING_ELIMINATED;
    }
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    ring_store_block(ring, ring_upper(RING_LOW, $au, $bu), low[$au * RING_REACH + $bu]);
    ring_store_block(ring, ring_upper(RING_HIGH, $au, $bu), window[$au * RING_FRONT + $bu]);
//:end
//:unroll b 0..$REACH
    ring_store_block(ring, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK, coupled[$au * RING_REACH + $bu]);
//:end
    ring_store_vector(ring, RING_LOW_RHS + $au * $DIMu, low_rhs[$a]);
    ring_store_vector(ring, RING_HIGH_RHS + $au * $DIMu, window_rhs[$a]);
//:end
}

// Substitutes back, from the chunk's kept unknowns, in place of the row's right-hand side, and
// those of the lane behind.
fn ring_substitute(curve: Curve, ring: BlockRing, behind: u32, row: ptr<function, RingRow>) {
    var next: array<vector, RING_REACH>;
//:unroll a 0..$REACH
    next[$a] = ring_load_vector(ring, behind, RING_LOW_RHS + $au * $DIMu);
//:end
    let first = ring.begin + RING_REACH;
    for (var v = ring.end; v > first; v--) {
        let word = RING_SHARED + (v - 1u - first) * RING_ELIMINATED;
        var x = ring_load_vector(ring, ring.lane, word + (2u * RING_REACH + 1u) * RING_BLOCK);
//:unroll a 0..$REACH
        x -= block_applied(ring_load_block(ring, ring.lane, word + (1u + $au) * RING_BLOCK), next[$a]);
        x -= block_applied(ring_load_block(ring, ring.lane, word + (1u + RING_REACH + $au) * RING_BLOCK), (*row).rhs[$a]);
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
        ring_store(curve, ring.begin + $au, (*row).rhs[$a]);
    }
//:end
}
