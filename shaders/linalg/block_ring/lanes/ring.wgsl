// Block-banded symmetric positive definite systems of curves, open and closed. params.lanes lanes
// share a curve, whose vertices are coupled with the $REACH vertices after them. Every lane keeps the
// first $REACH vertices of its chunk and eliminates the others. The kept ones form a cyclic block
// tridiagonal system, which is reduced by log2 lanes steps of cyclic reduction. Then every lane
// substitutes back. Reasons: src/linalg/block_ring/mod.rs.
// Twin: src/linalg/block_ring/lanes.rs.
//
// Who includes it defines $DIM and, for curves of a type Curve:
//     alias real, alias vector, alias matrix
//     params.lanes, of a uniform
//     $SCRATCH, a storage array of reals: scratch_numbers() of src/linalg/block_ring/mod.rs a curve
//     fn ring_block(curve: Curve, v: u32, k: u32) -> matrix     block of vertices v and v + k, of which [i] is row i
//     fn ring_rhs(curve: Curve, v: u32) -> vector
//     fn ring_movable(curve: Curve, v: u32) -> bool             whether the unknown is not held at 0
//     fn ring_store(curve: Curve, v: u32, x: vector)

const RING_REACH: u32 = $REACHu;
const RING_FRONT: u32 = RING_REACH + 1u;
const RING_BLOCKS: u32 = RING_REACH * RING_REACH;
const RING_BLOCK: u32 = $DIMu * $DIMu;
const RING_HALF: u32 = RING_REACH * (RING_REACH + 1u) / 2u * RING_BLOCK;

// No twin: the CPU has arrays. A lane shares terms of the blocks and right-hand sides of the kept
// vertices before and after it, the block that couples these (rows of the ones after), and the
// smallest pivot.
const RING_LOW: u32 = 0u;
const RING_HIGH: u32 = RING_HALF;
const RING_ACROSS: u32 = 2u * RING_HALF;
const RING_LOW_RHS: u32 = RING_ACROSS + RING_BLOCKS * RING_BLOCK;
const RING_HIGH_RHS: u32 = RING_LOW_RHS + RING_REACH * $DIMu;
const RING_PIVOT: u32 = RING_HIGH_RHS + RING_REACH * $DIMu;
// No twin: its row of the ring, see lanes/kept.wgsl.
const RING_OWN: u32 = RING_PIVOT + 1u;
const RING_FACTORS: u32 = RING_OWN + RING_HALF;
const RING_LEFT: u32 = RING_FACTORS + RING_REACH * RING_BLOCK;
const RING_RIGHT: u32 = RING_LEFT + RING_BLOCKS * RING_BLOCK;
const RING_RHS: u32 = RING_RIGHT + RING_BLOCKS * RING_BLOCK;
// No twin: then the eliminated vertices. Each has its factor, the blocks that couple it with the next
// vertices and with the kept ones, and its right-hand side.
const RING_SHARED: u32 = RING_RHS + RING_REACH * $DIMu;
const RING_ELIMINATED_RHS: u32 = (2u * RING_REACH + 1u) * RING_BLOCK;
const RING_ELIMINATED: u32 = RING_ELIMINATED_RHS + $DIMu;

// Stands for the pivot of a matrix without rows.
const RING_NO_PIVOT: real = real(1e30);

// A lane's part of a curve.
struct BlockRing {
    lane: u32,
    // Lanes of the ring: a power of two, each with at least $REACH vertices.
    lanes: u32,
    // Whether the lane has a chunk.
    working: bool,
    vertices: u32,
    closed: bool,
    // Vertices begin … end − 1.
    begin: u32,
    end: u32,
    // Number `word` of lane l is number first + word · params.lanes + l of the scratch memory.
    first: u32,
}

// A lane. The curve's scratch memory begins at `first`. Lanes that are not live may have any curve.
fn block_ring(vertices: u32, closed: bool, first: u32, lane: u32, live: bool) -> BlockRing {
    let lanes = 1u << firstLeadingBit(max(min(params.lanes, vertices / RING_REACH), 1u));
    // An open curve of fewer vertices than are kept is continued by vertices that stand still.
    let rows = max(vertices, RING_REACH);
    let begin = lane * rows / lanes;
    let end = (lane + 1u) * rows / lanes;
    return BlockRing(lane, lanes, live && lane < lanes, vertices, closed, begin, end, first);
}

fn ring_place(ring: BlockRing, lane: u32, word: u32) -> u32 {
    return ring.first + word * params.lanes + lane;
}

fn ring_load_vector(ring: BlockRing, lane: u32, word: u32) -> vector {
    var x: vector;
//:unroll c 0..$DIM
    x[$c] = $SCRATCH[ring_place(ring, lane, word + $cu)];
//:end
    return x;
}

fn ring_store_vector(ring: BlockRing, word: u32, x: vector) {
//:unroll c 0..$DIM
    $SCRATCH[ring_place(ring, ring.lane, word + $cu)] = x[$c];
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

// The position of block (a, b), b ≥ a, of a symmetric block matrix.
fn ring_upper(section: u32, a: u32, b: u32) -> u32 {
    return section + (a * (2u * RING_REACH - a + 1u) / 2u + b - a) * RING_BLOCK;
}

//:include linalg/block_ring/dense.wgsl
//:include linalg/block_ring/lanes/chunk.wgsl
//:include linalg/block_ring/lanes/kept.wgsl

// Solves. All lanes of a workgroup call it, idle ones for the barriers. Afterwards all of them can read
// the solution. Returns the smallest pivot to working lanes: positive if and only if the matrix is
// positive definite, up to rounding, and 0 if a pivot is not finite.
fn solve_block_ring(curve: Curve, ring: BlockRing) -> real {
    var smallest = RING_NO_PIVOT;
    if (ring.working) {
        ring_eliminate(curve, ring, &smallest);
    }
    storageBarrier();

    if (ring.working) {
        ring_take_row(ring, (ring.lane + ring.lanes - 1u) % ring.lanes);
    }
    storageBarrier();

    // Every second remaining lane is eliminated, lane 0 last, which is then its own neighbour on both
    // sides.
    for (var step = 1u; step <= params.lanes; step *= 2u) {
        let before = (ring.lane + ring.lanes - step % ring.lanes) % ring.lanes;
        let behind = (ring.lane + step) % ring.lanes;
        let is_last = ring.lane == 0u && step == ring.lanes;
        if (ring.working && (ring.lane % (2u * step) == step || is_last)) {
            if (is_last) {
                ring_close(ring);
            }
            ring_factor(ring, &smallest);
            if (!is_last) {
                ring_share(ring);
            }
        }
        storageBarrier();
        if (ring.working && ring.lane % (2u * step) == 0u && step < ring.lanes) {
            ring_add_shares(ring, before, behind);
        }
        storageBarrier();
    }

    // Back, in the opposite order. Unknowns replace the right-hand sides that were shared.
    for (var step = params.lanes; step > 0u; step /= 2u) {
        let is_last = ring.lane == 0u && step == ring.lanes;
        if (ring.working && (ring.lane % (2u * step) == step || is_last)) {
            ring_unknowns(ring, (ring.lane + ring.lanes - step) % ring.lanes, (ring.lane + step) % ring.lanes);
            $SCRATCH[ring_place(ring, ring.lane, RING_PIVOT)] = smallest;
        }
        storageBarrier();
    }
    if (ring.working) {
        ring_substitute(curve, ring, (ring.lane + 1u) % ring.lanes);
        for (var lane = 0u; lane < ring.lanes; lane++) {
            smallest = min(smallest, $SCRATCH[ring_place(ring, lane, RING_PIVOT)]);
        }
    }
    storageBarrier();
    return smallest;
}
