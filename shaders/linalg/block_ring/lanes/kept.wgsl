// The kept vertices of a lane as a row of the ring. RING_LEFT and RING_RIGHT couple them (rows) with
// the neighbours' kept vertices. RING_OWN is symmetric: its upper half is stored. Once factored,
// these hold C⁻¹ times themselves, and RING_FACTORS the diagonal blocks of C. All is in scratch
// memory, from which a thread loads a column at a time.

fn ring_square(section: u32, a: u32, b: u32) -> u32 {
    return section + (a * RING_REACH + b) * RING_BLOCK;
}

fn ring_own(ring: BlockRing, word: u32) -> matrix {
    return ring_load_block(ring, ring.lane, word);
}

// Adds the terms of the row that the lanes on both sides share.
fn ring_add_shares(ring: BlockRing, before: u32, behind: u32) {
    for (var a = 0u; a < RING_REACH; a++) {
        for (var b = a; b < RING_REACH; b++) {
            var own = ring_own(ring, ring_upper(RING_OWN, a, b));
            own += ring_load_block(ring, before, ring_upper(RING_HIGH, a, b));
            own += ring_load_block(ring, behind, ring_upper(RING_LOW, a, b));
            ring_store_block(ring, ring_upper(RING_OWN, a, b), own);
        }
        var rhs = ring_load_vector(ring, ring.lane, RING_RHS + a * $DIMu);
        rhs += ring_load_vector(ring, before, RING_HIGH_RHS + a * $DIMu);
        rhs += ring_load_vector(ring, behind, RING_LOW_RHS + a * $DIMu);
        ring_store_vector(ring, RING_RHS + a * $DIMu, rhs);
    }
    ring_take_sides(ring, before, behind);
}

// The row before any lane is eliminated: the terms that this lane and the previous one share.
fn ring_take_row(ring: BlockRing, before: u32) {
    for (var a = 0u; a < RING_REACH; a++) {
        for (var b = a; b < RING_REACH; b++) {
            let own = ring_own(ring, ring_upper(RING_LOW, a, b));
            let high = ring_load_block(ring, before, ring_upper(RING_HIGH, a, b));
            ring_store_block(ring, ring_upper(RING_OWN, a, b), own + high);
        }
        let rhs = ring_load_vector(ring, ring.lane, RING_LOW_RHS + a * $DIMu);
        let high = ring_load_vector(ring, before, RING_HIGH_RHS + a * $DIMu);
        ring_store_vector(ring, RING_RHS + a * $DIMu, rhs + high);
    }
    ring_take_sides(ring, before, ring.lane);
}

// The blocks that couple the row with its neighbours, from the lanes between it and each neighbour.
fn ring_take_sides(ring: BlockRing, before: u32, behind: u32) {
    for (var a = 0u; a < RING_REACH; a++) {
        for (var b = 0u; b < RING_REACH; b++) {
            let left = ring_load_block(ring, before, ring_square(RING_ACROSS, a, b));
            let right = transpose(ring_load_block(ring, behind, ring_square(RING_ACROSS, b, a)));
            ring_store_block(ring, ring_square(RING_LEFT, a, b), left);
            ring_store_block(ring, ring_square(RING_RIGHT, a, b), right);
        }
    }
}

// For the last row, which is its own neighbour on both sides.
fn ring_close(ring: BlockRing) {
    for (var a = 0u; a < RING_REACH; a++) {
        for (var b = 0u; b < RING_REACH; b++) {
            if (b >= a) {
                var own = ring_own(ring, ring_upper(RING_OWN, a, b));
                own += ring_own(ring, ring_square(RING_LEFT, a, b));
                own += ring_own(ring, ring_square(RING_RIGHT, a, b));
                ring_store_block(ring, ring_upper(RING_OWN, a, b), own);
            }
            ring_store_block(ring, ring_square(RING_LEFT, a, b), matrix());
            ring_store_block(ring, ring_square(RING_RIGHT, a, b), matrix());
        }
    }
}

// Factors the own block, C Cᵀ, row after row, and applies C⁻¹ to the rest of the row.
fn ring_factor(ring: BlockRing, smallest: ptr<function, real>) {
    var own: array<matrix, RING_BLOCKS>;
    var factors: array<matrix, RING_REACH>;
    var rhs: array<vector, RING_REACH>;
//:unroll i 0..$REACH
//:unroll j $i..$REACH
    own[$iu * RING_REACH + $ju] = ring_own(ring, ring_upper(RING_OWN, $iu, $ju));
//:end
    rhs[$i] = ring_load_vector(ring, ring.lane, RING_RHS + $iu * $DIMu);
//:end
//:unroll i 0..$REACH
//:unroll p 0..$i
//:unroll j $i..$REACH
    own[$iu * RING_REACH + $ju] -= block_product(own[$pu * RING_REACH + $iu], own[$pu * RING_REACH + $ju]);
//:end
    rhs[$i] -= block_transposed(own[$pu * RING_REACH + $iu], rhs[$p]);
//:end
    factors[$i] = block_cholesky(own[$iu * RING_REACH + $iu], smallest);
    ring_store_block(ring, RING_FACTORS + $iu * RING_BLOCK, factors[$i]);
//:unroll j $(i+1)..$REACH
    own[$iu * RING_REACH + $ju] = block_under(factors[$i], own[$iu * RING_REACH + $ju]);
    ring_store_block(ring, ring_upper(RING_OWN, $iu, $ju), own[$iu * RING_REACH + $ju]);
//:end
    rhs[$i] = block_under_vector(factors[$i], rhs[$i]);
    ring_store_vector(ring, RING_RHS + $iu * $DIMu, rhs[$i]);
//:end
    var column: array<matrix, RING_REACH>;
    for (var k = 0u; k < 2u * RING_REACH; k++) {
        // Columns of RING_LEFT, then of RING_RIGHT.
        let word = select(RING_LEFT + k * RING_BLOCK, RING_RIGHT + (k - RING_REACH) * RING_BLOCK, k >= RING_REACH);
//:unroll i 0..$REACH
        column[$i] = ring_own(ring, word + $iu * RING_REACH * RING_BLOCK);
//:unroll p 0..$i
        column[$i] -= block_product(own[$pu * RING_REACH + $iu], column[$p]);
//:end
        column[$i] = block_under(factors[$i], column[$i]);
        ring_store_block(ring, word + $iu * RING_REACH * RING_BLOCK, column[$i]);
//:end
    }
}

// −Σ xᵢᵀ yᵢ over the rows of column a of side x and column b of side y.
fn ring_sides(ring: BlockRing, x: u32, a: u32, y: u32, b: u32) -> matrix {
    var share = matrix();
    for (var i = 0u; i < RING_REACH; i++) {
        share -= block_product(ring_own(ring, ring_square(x, i, a)), ring_own(ring, ring_square(y, i, b)));
    }
    return share;
}

fn ring_side_rhs(ring: BlockRing, x: u32, a: u32) -> vector {
    var share = vector();
    for (var i = 0u; i < RING_REACH; i++) {
        let rhs = ring_load_vector(ring, ring.lane, RING_RHS + i * $DIMu);
        share -= block_transposed(ring_own(ring, ring_square(x, i, a)), rhs);
    }
    return share;
}

// Shares the terms of the neighbours' rows once this row, factored, is eliminated.
fn ring_share(ring: BlockRing) {
    for (var a = 0u; a < RING_REACH; a++) {
        for (var b = 0u; b < RING_REACH; b++) {
            if (b >= a) {
                ring_store_block(ring, ring_upper(RING_LOW, a, b), ring_sides(ring, RING_LEFT, a, RING_LEFT, b));
                ring_store_block(ring, ring_upper(RING_HIGH, a, b), ring_sides(ring, RING_RIGHT, a, RING_RIGHT, b));
            }
            ring_store_block(ring, ring_square(RING_ACROSS, a, b), ring_sides(ring, RING_RIGHT, a, RING_LEFT, b));
        }
        ring_store_vector(ring, RING_LOW_RHS + a * $DIMu, ring_side_rhs(ring, RING_LEFT, a));
        ring_store_vector(ring, RING_HIGH_RHS + a * $DIMu, ring_side_rhs(ring, RING_RIGHT, a));
    }
}

// The kept unknowns of an eliminated row, from the unknowns of its neighbours at that time. They replace
// the right-hand sides that the lane shared. The last row has no neighbours, and zeros for them.
fn ring_unknowns(ring: BlockRing, before: u32, behind: u32) {
    var x: array<vector, RING_REACH>;
//:unroll i 0..$REACH
    x[$i] = ring_load_vector(ring, ring.lane, RING_RHS + $iu * $DIMu);
//:end
    if (before != ring.lane) {
        for (var b = 0u; b < RING_REACH; b++) {
            let left = ring_load_vector(ring, before, RING_LOW_RHS + b * $DIMu);
            let right = ring_load_vector(ring, behind, RING_LOW_RHS + b * $DIMu);
//:unroll i 0..$REACH
            x[$i] -= block_applied(ring_own(ring, ring_square(RING_LEFT, $iu, b)), left);
            x[$i] -= block_applied(ring_own(ring, ring_square(RING_RIGHT, $iu, b)), right);
//:end
        }
    }
//:unroll i $REACH..0
    x[$i] = block_over_vector(ring_own(ring, RING_FACTORS + $iu * RING_BLOCK), x[$i]);
//:unroll p 0..$i
    x[$p] -= block_applied(ring_own(ring, ring_upper(RING_OWN, $pu, $iu)), x[$i]);
//:end
    ring_store_vector(ring, RING_LOW_RHS + $iu * $DIMu, x[$i]);
//:end
}
