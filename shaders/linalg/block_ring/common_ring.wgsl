// Block-banded symmetric positive definite systems of curves, open and closed: $LANES lanes share a curve, each vertex of
// which is coupled with the $REACH after it. Every lane keeps the first $REACH vertices of its chunk and eliminates the others;
// the kept ones form a cyclic block tridiagonal system, reduced by log2 $LANES steps of cyclic reduction; then every lane
// substitutes back. With ALONE a lane has its curve for itself ($LANES is 1) and waits for none. Why: src/linalg/block_ring/mod.rs.
// Twin: src/linalg/block_ring/lanes.rs.
//
// Who includes it defines $DIM and, for curves of a type Curve:
//     alias real, alias vector, alias matrix
//     var<storage, read_write> ring_scratch: array<real>;   scratch_numbers() of src/linalg/block_ring/mod.rs a curve
//     fn ring_block(curve: Curve, v: u32, k: u32) -> matrix     block of vertices v and v + k, of which [i] is row i
//     fn ring_rhs(curve: Curve, v: u32) -> vector
//     fn ring_movable(curve: Curve, v: u32) -> bool             whether the unknown is not held at 0
//     fn ring_store(curve: Curve, v: u32, x: vector)

const RING_LANES: u32 = $LANESu;
const RING_REACH: u32 = $REACHu;
const RING_FRONT: u32 = RING_REACH + 1u;
const RING_BLOCKS: u32 = RING_REACH * RING_REACH;
const RING_BLOCK: u32 = $DIMu * $DIMu;
const RING_HALF: u32 = RING_REACH * (RING_REACH + 1u) / 2u * RING_BLOCK;

// What a lane shares: what is to be added to the blocks and right-hand sides of the kept vertices before and after it, the
// block that couples these, rows of those after; the smallest pivot. Then what it has eliminated: a vertex's factor, what
// couples it with those after it and with the kept ones, its right-hand side.
const RING_LOW: u32 = 0u;
const RING_HIGH: u32 = RING_HALF;
const RING_ACROSS: u32 = 2u * RING_HALF;
const RING_LOW_RHS: u32 = RING_ACROSS + RING_BLOCKS * RING_BLOCK;
const RING_HIGH_RHS: u32 = RING_LOW_RHS + RING_REACH * $DIMu;
const RING_PIVOT: u32 = RING_HIGH_RHS + RING_REACH * $DIMu;
const RING_SHARED: u32 = RING_PIVOT + 1u;
const RING_ELIMINATED: u32 = (2u * RING_REACH + 1u) * RING_BLOCK + $DIMu;

// Stands for the pivot of a matrix without rows.
const RING_NO_PIVOT: real = real(1e30);

// A lane's part of a curve.
struct BlockRing {
    lane: u32,
    // Lanes of the ring: a power of two, each with $REACH vertices at least.
    lanes: u32,
    // Whether the lane has a part.
    working: bool,
    vertices: u32,
    closed: bool,
    // Vertices begin … end − 1.
    begin: u32,
    end: u32,
    // Number `word` of lane l is number first + word · stride + l of the scratch memory.
    first: u32,
    stride: u32,
}

// A lane of $LANES; the curve's part of the scratch memory begins at `first`. Of lanes that are not live the curve may be any.
fn block_ring(vertices: u32, closed: bool, first: u32, lane: u32, live: bool) -> BlockRing {
    let lanes = 1u << firstLeadingBit(max(min(RING_LANES, vertices / RING_REACH), 1u));
    // An open curve of fewer vertices than are kept is continued by vertices that stand still.
    let rows = max(vertices, RING_REACH);
    let begin = lane * rows / lanes;
    let end = (lane + 1u) * rows / lanes;
    return BlockRing(lane, lanes, live && lane < lanes, vertices, closed, begin, end, first, lanes);
}

fn ring_place(ring: BlockRing, lane: u32, word: u32) -> u32 {
    return ring.first + word * ring.stride + lane;
}

fn ring_load_vector(ring: BlockRing, lane: u32, word: u32) -> vector {
    var x: vector;
//:unroll c 0..$DIM
    x[$c] = ring_scratch[ring_place(ring, lane, word + $cu)];
//:end
    return x;
}

fn ring_store_vector(ring: BlockRing, word: u32, x: vector) {
//:unroll c 0..$DIM
    ring_scratch[ring_place(ring, ring.lane, word + $cu)] = x[$c];
//:end
}

fn ring_load_block(ring: BlockRing, lane: u32, word: u32) -> matrix {
    var a: matrix;
//:unroll c 0..$DIM
    a[$c] = ring_load_vector(ring, lane, word + $cu * $DIMu);
//:end
    return a;
}

fn ring_store_block(ring: BlockRing, word: u32, a: matrix) {
//:unroll c 0..$DIM
    ring_store_vector(ring, word + $cu * $DIMu, a[$c]);
//:end
}

// Where block (a, b), b ≥ a, of a symmetric one stands.
fn ring_upper(section: u32, a: u32, b: u32) -> u32 {
    return section + (a * (2u * RING_REACH - a + 1u) / 2u + b - a) * RING_BLOCK;
}

//:include linalg/block_ring/common_dense.wgsl
//:include linalg/block_ring/common_chunk.wgsl
//:include linalg/block_ring/common_factor.wgsl NAME=ring_factor BESIDE=1
//:include linalg/block_ring/common_factor.wgsl NAME=ring_factor_last

fn ring_barrier() {
//:if ALONE
//:else
    storageBarrier();
//:end
}

// Solves; all lanes of a workgroup take part, those that do not work for the barriers' sake. The solution is there for all of them
// to read. Returns the smallest pivot, to every lane that works: positive if and only if the matrix is positive definite, up
// to rounding, and 0 for one that is not a number.
fn solve_block_ring(curve: Curve, ring: BlockRing) -> real {
    var smallest = RING_NO_PIVOT;
    if (ring.working) {
        ring_eliminate(curve, ring, &smallest);
    }
    ring_barrier();

    // The row of the kept vertices: `left` and `right` couple them with those of the neighbours.
    var own: array<matrix, RING_BLOCKS>;
    var left: array<matrix, RING_BLOCKS>;
    var right: array<matrix, RING_BLOCKS>;
    var rhs: array<vector, RING_REACH>;
    var factors: array<matrix, RING_REACH>;
    if (ring.working) {
        let before = (ring.lane + ring.lanes - 1u) % ring.lanes;
//:unroll a 0..$REACH
//:unroll b $a..$REACH
        own[$au * RING_REACH + $bu] = ring_load_block(ring, ring.lane, ring_upper(RING_LOW, $au, $bu))
            + ring_load_block(ring, before, ring_upper(RING_HIGH, $au, $bu));
//:end
//:unroll b 0..$REACH
        left[$au * RING_REACH + $bu] =
            ring_load_block(ring, before, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK);
        right[$au * RING_REACH + $bu] =
            transpose(ring_load_block(ring, ring.lane, RING_ACROSS + ($bu * RING_REACH + $au) * RING_BLOCK));
//:end
        rhs[$a] = ring_load_vector(ring, ring.lane, RING_LOW_RHS + $au * $DIMu)
            + ring_load_vector(ring, before, RING_HIGH_RHS + $au * $DIMu);
//:end
    }
    ring_barrier();

    for (var step = 1u; step < RING_LANES; step *= 2u) {
        if (ring.working && step < ring.lanes) {
            var own_factored = own;
            var rhs_factored = rhs;
            ring_factor(&own_factored, &left, &right, &rhs_factored, &factors, &smallest);
            // What the neighbours are left with when this row is eliminated.
            var share = matrix();
            var share_rhs = vector();
//:unroll a 0..$REACH
//:unroll b $a..$REACH
            share = matrix();
//:unroll i 0..$REACH
            share -= block_product(left[$iu * RING_REACH + $au], left[$iu * RING_REACH + $bu]);
//:end
            ring_store_block(ring, ring_upper(RING_LOW, $au, $bu), share);
            share = matrix();
//:unroll i 0..$REACH
            share -= block_product(right[$iu * RING_REACH + $au], right[$iu * RING_REACH + $bu]);
//:end
            ring_store_block(ring, ring_upper(RING_HIGH, $au, $bu), share);
//:end
//:unroll b 0..$REACH
            share = matrix();
//:unroll i 0..$REACH
            share -= block_product(right[$iu * RING_REACH + $au], left[$iu * RING_REACH + $bu]);
//:end
            ring_store_block(ring, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK, share);
//:end
            share_rhs = vector();
//:unroll i 0..$REACH
            share_rhs -= block_transposed(left[$iu * RING_REACH + $au], rhs_factored[$i]);
//:end
            ring_store_vector(ring, RING_LOW_RHS + $au * $DIMu, share_rhs);
            share_rhs = vector();
//:unroll i 0..$REACH
            share_rhs -= block_transposed(right[$iu * RING_REACH + $au], rhs_factored[$i]);
//:end
            ring_store_vector(ring, RING_HIGH_RHS + $au * $DIMu, share_rhs);
//:end
        }
        ring_barrier();
        if (ring.working && step < ring.lanes) {
            let before = (ring.lane + ring.lanes - step) % ring.lanes;
            let behind = (ring.lane + step) % ring.lanes;
//:unroll a 0..$REACH
//:unroll b $a..$REACH
            own[$au * RING_REACH + $bu] += ring_load_block(ring, before, ring_upper(RING_HIGH, $au, $bu));
            own[$au * RING_REACH + $bu] += ring_load_block(ring, behind, ring_upper(RING_LOW, $au, $bu));
//:end
//:unroll b 0..$REACH
            left[$au * RING_REACH + $bu] =
                ring_load_block(ring, before, RING_ACROSS + ($au * RING_REACH + $bu) * RING_BLOCK);
            right[$au * RING_REACH + $bu] =
                transpose(ring_load_block(ring, behind, RING_ACROSS + ($bu * RING_REACH + $au) * RING_BLOCK));
//:end
            rhs[$a] += ring_load_vector(ring, before, RING_HIGH_RHS + $au * $DIMu);
            rhs[$a] += ring_load_vector(ring, behind, RING_LOW_RHS + $au * $DIMu);
//:end
        }
        ring_barrier();
    }

    // Both neighbours are the row itself.
    if (ring.working) {
//:unroll a 0..$REACH
//:unroll b $a..$REACH
        own[$au * RING_REACH + $bu] += left[$au * RING_REACH + $bu];
        own[$au * RING_REACH + $bu] += right[$au * RING_REACH + $bu];
//:end
//:end
        ring_factor_last(&own, &rhs, &factors, &smallest);
//:unroll i $REACH..0
        rhs[$i] = block_over_vector(factors[$i], rhs[$i]);
//:unroll p 0..$i
        rhs[$p] -= block_applied(own[$pu * RING_REACH + $iu], rhs[$i]);
//:end
        ring_store_vector(ring, RING_LOW_RHS + $iu * $DIMu, rhs[$i]);
//:end
        ring_scratch[ring_place(ring, ring.lane, RING_PIVOT)] = smallest;
    }
    ring_barrier();
    if (ring.working) {
        let behind = (ring.lane + 1u) % ring.lanes;
        var next: array<vector, RING_REACH>;
//:unroll a 0..$REACH
        next[$a] = ring_load_vector(ring, behind, RING_LOW_RHS + $au * $DIMu);
//:end
        ring_substitute(curve, ring, &rhs, &next);
        for (var lane = 0u; lane < ring.lanes; lane++) {
            smallest = min(smallest, ring_scratch[ring_place(ring, lane, RING_PIVOT)]);
        }
    }
    ring_barrier();
    return smallest;
}
