// The vertices that a lane keeps, as a row of the ring: `left` and `right` couple them (rows) with
// those of the neighbours, of which symmetric `own` the upper half is used. Once factored, C⁻¹ of
// all that, and the diagonal blocks of C.
struct RingRow {
    own: array<matrix, RING_BLOCKS>,
    left: array<matrix, RING_BLOCKS>,
    right: array<matrix, RING_BLOCKS>,
    rhs: array<vector, RING_REACH>,
    factors: array<matrix, RING_REACH>,
}

// What couples the row with its neighbours, as told by the lane between it and the one before, and
// by that between it and the one after.
fn ring_load_sides(ring: BlockRing, before: u32, behind: u32, row: ptr<function, RingRow>) {
//:unroll a 0..$REACH
//:unroll b 0..$REACH
    (*row).left[$au * RING_REACH + $bu] =
        ring_load_block(ring, before, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK);
    (*row).right[$au * RING_REACH + $bu] =
        transpose(ring_load_block(ring, behind, RING_ACROSS + ($bu * RING_REACH + $au) * RING_BLOCK));
//:end
//:end
}

// Both neighbours are the row itself.
fn ring_close(row: ptr<function, RingRow>) {
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    (*row).own[$au * RING_REACH + $bu] += (*row).left[$au * RING_REACH + $bu];
    (*row).own[$au * RING_REACH + $bu] += (*row).right[$au * RING_REACH + $bu];
//:end
//:end
//:unroll k 0..$REACH
//:unroll b 0..$REACH
    (*row).left[$ku * RING_REACH + $bu] = matrix();
    (*row).right[$ku * RING_REACH + $bu] = matrix();
//:end
//:end
}

// Factors `own`, C Cᵀ, row after row, and takes C⁻¹ of all that stands beside it.
fn ring_factor(row: ptr<function, RingRow>, smallest: ptr<function, real>) {
//:unroll i 0..$REACH
//:unroll p 0..$i
//:unroll j $i..$REACH
    (*row).own[$iu * RING_REACH + $ju] -=
        block_product((*row).own[$pu * RING_REACH + $iu], (*row).own[$pu * RING_REACH + $ju]);
//:end
//:unroll b 0..$REACH
    (*row).left[$iu * RING_REACH + $bu] -=
        block_product((*row).own[$pu * RING_REACH + $iu], (*row).left[$pu * RING_REACH + $bu]);
    (*row).right[$iu * RING_REACH + $bu] -=
        block_product((*row).own[$pu * RING_REACH + $iu], (*row).right[$pu * RING_REACH + $bu]);
//:end
    (*row).rhs[$i] -= block_transposed((*row).own[$pu * RING_REACH + $iu], (*row).rhs[$p]);
//:end
    (*row).factors[$i] = block_cholesky((*row).own[$iu * RING_REACH + $iu], smallest);
    // The first of these is Cᵀ, and not used.
//:unroll j $i..$REACH
    (*row).own[$iu * RING_REACH + $ju] = block_under((*row).factors[$i], (*row).own[$iu * RING_REACH + $ju]);
//:end
//:unroll b 0..$REACH
    (*row).left[$iu * RING_REACH + $bu] = block_under((*row).factors[$i], (*row).left[$iu * RING_REACH + $bu]);
    (*row).right[$iu * RING_REACH + $bu] = block_under((*row).factors[$i], (*row).right[$iu * RING_REACH + $bu]);
//:end
    (*row).rhs[$i] = block_under_vector((*row).factors[$i], (*row).rhs[$i]);
//:end
}

// Shares what the neighbours are left with once this row, factored, is eliminated.
fn ring_share(ring: BlockRing, row: ptr<function, RingRow>) {
    var share = matrix();
    var share_rhs = vector();
//:unroll a 0..$REACH
//:unroll b $a..$REACH
    share = matrix();
//:unroll i 0..$REACH
    share -= block_product((*row).left[$iu * RING_REACH + $au], (*row).left[$iu * RING_REACH + $bu]);
//:end
    ring_store_block(ring, ring_upper(RING_LOW, $au, $bu), share);
    share = matrix();
//:unroll i 0..$REACH
    share -= block_product((*row).right[$iu * RING_REACH + $au], (*row).right[$iu * RING_REACH + $bu]);
//:end
    ring_store_block(ring, ring_upper(RING_HIGH, $au, $bu), share);
//:end
//:unroll b 0..$REACH
    share = matrix();
//:unroll i 0..$REACH
    share -= block_product((*row).right[$iu * RING_REACH + $au], (*row).left[$iu * RING_REACH + $bu]);
//:end
    ring_store_block(ring, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK, share);
//:end
    share_rhs = vector();
//:unroll i 0..$REACH
    share_rhs -= block_transposed((*row).left[$iu * RING_REACH + $au], (*row).rhs[$i]);
//:end
    ring_store_vector(ring, RING_LOW_RHS + $au * $DIMu, share_rhs);
    share_rhs = vector();
//:unroll i 0..$REACH
    share_rhs -= block_transposed((*row).right[$iu * RING_REACH + $au], (*row).rhs[$i]);
//:end
    ring_store_vector(ring, RING_HIGH_RHS + $au * $DIMu, share_rhs);
//:end
}

// The kept unknowns of a row that was eliminated, in place of its right-hand side and to be read by
// others, from those of the neighbours it had then. The row that was eliminated last has none, and
// zeros beside it.
fn ring_unknowns(ring: BlockRing, before: u32, behind: u32, row: ptr<function, RingRow>) {
    if (before != ring.lane) {
        var x = vector();
//:unroll b 0..$REACH
        x = ring_load_vector(ring, before, RING_LOW_RHS + $bu * $DIMu);
//:unroll i 0..$REACH
        (*row).rhs[$i] -= block_applied((*row).left[$iu * RING_REACH + $bu], x);
//:end
        x = ring_load_vector(ring, behind, RING_LOW_RHS + $bu * $DIMu);
//:unroll i 0..$REACH
        (*row).rhs[$i] -= block_applied((*row).right[$iu * RING_REACH + $bu], x);
//:end
//:end
    }
//:unroll i $REACH..0
    (*row).rhs[$i] = block_over_vector((*row).factors[$i], (*row).rhs[$i]);
//:unroll p 0..$i
    (*row).rhs[$p] -= block_applied((*row).own[$pu * RING_REACH + $iu], (*row).rhs[$i]);
//:end
    ring_store_vector(ring, RING_LOW_RHS + $iu * $DIMu, (*row).rhs[$i]);
//:end
}
