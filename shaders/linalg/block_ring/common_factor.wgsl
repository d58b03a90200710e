// Factors the block of a lane's kept vertices, C Cᵀ, row after row, and takes C⁻¹ of the right-hand sides, and with
// BESIDE of what couples them with the kept vertices of the neighbours.
fn $NAME(
    own: ptr<function, array<matrix, RING_BLOCKS>>,
//:if BESIDE
    left: ptr<function, array<matrix, RING_BLOCKS>>,
    right: ptr<function, array<matrix, RING_BLOCKS>>,
//:end
    rhs: ptr<function, array<vector, RING_REACH>>,
    factors: ptr<function, array<matrix, RING_REACH>>,
    smallest: ptr<function, real>,
) {
//:unroll i 0..$REACH
//:unroll p 0..$i
//:unroll j $i..$REACH
    (*own)[$iu * RING_REACH + $ju] -=
        block_product((*own)[$pu * RING_REACH + $iu], (*own)[$pu * RING_REACH + $ju]);
//:end
//:if BESIDE
//:unroll b 0..$REACH
    (*left)[$iu * RING_REACH + $bu] -=
        block_product((*own)[$pu * RING_REACH + $iu], (*left)[$pu * RING_REACH + $bu]);
    (*right)[$iu * RING_REACH + $bu] -=
        block_product((*own)[$pu * RING_REACH + $iu], (*right)[$pu * RING_REACH + $bu]);
//:end
//:end
    (*rhs)[$i] -= block_transposed((*own)[$pu * RING_REACH + $iu], (*rhs)[$p]);
//:end
    (*factors)[$i] = block_cholesky((*own)[$iu * RING_REACH + $iu], smallest);
    // The first of these is Cᵀ, and not used.
//:unroll j $i..$REACH
    (*own)[$iu * RING_REACH + $ju] = block_under((*factors)[$i], (*own)[$iu * RING_REACH + $ju]);
//:end
//:if BESIDE
//:unroll b 0..$REACH
    (*left)[$iu * RING_REACH + $bu] = block_under((*factors)[$i], (*left)[$iu * RING_REACH + $bu]);
    (*right)[$iu * RING_REACH + $bu] = block_under((*factors)[$i], (*right)[$iu * RING_REACH + $bu]);
//:end
//:end
    (*rhs)[$i] = block_under_vector((*factors)[$i], (*rhs)[$i]);
//:end
}
