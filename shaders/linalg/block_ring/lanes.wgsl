// Block-banded systems from arrays. params.lanes lanes share a curve.
// Twin: src/linalg/block_ring/lanes.rs.

struct BlockParams {
    // Curves of the dispatch.
    count: u32,
    // Lanes that share a curve.
    lanes: u32,
}

struct BlockCurve {
    // First vertex in the arrays.
    start: u32,
    vertices: u32,
    closed: u32,
    // First number of its scratch memory.
    scratch: u32,
}

alias Curve = BlockCurve;
alias vector = vec$DIM<real>;
alias matrix = mat$DIMx$DIM<real>;

@group(0) @binding(0) var<uniform> params: BlockParams;
@group(0) @binding(1) var<storage, read> curves: array<BlockCurve>;
// Four blocks of $DIM × $DIM numbers per vertex, row after row: with itself and the next three.
@group(0) @binding(2) var<storage, read> blocks: array<real>;
@group(0) @binding(3) var<storage, read> right_hand_sides: array<real>;
// 0 if the unknown is held at 0.
@group(0) @binding(4) var<storage, read> movable: array<u32>;
@group(0) @binding(5) var<storage, read_write> solution: array<real>;
// The smallest pivot of each curve.
@group(0) @binding(6) var<storage, read_write> pivots: array<real>;
@group(0) @binding(7) var<storage, read_write> ring_scratch: array<real>;

//:include linalg/block_ring/lanes/ring.wgsl SCRATCH=ring_scratch

fn ring_block(curve: Curve, v: u32, k: u32) -> matrix {
    let at = ((curve.start + v) * 4u + k) * RING_BLOCK;
    var a: matrix;
//:unroll i 0..$DIM
//:unroll j 0..$DIM
    a[$i][$j] = blocks[at + $iu * $DIMu + $ju];
//:end
//:end
    return a;
}

fn ring_rhs(curve: Curve, v: u32) -> vector {
    var x: vector;
//:unroll c 0..$DIM
    x[$c] = right_hand_sides[(curve.start + v) * $DIMu + $cu];
//:end
    return x;
}

fn ring_movable(curve: Curve, v: u32) -> bool {
    return movable[curve.start + v] != 0u;
}

fn ring_store(curve: Curve, v: u32, x: vector) {
//:unroll c 0..$DIM
    solution[(curve.start + v) * $DIMu + $cu] = x[$c];
//:end
}

//:include entry.wgsl ENTRY=solve
    let index = task / params.lanes;
    let curve = curves[min(index, params.count - 1u)];
    let live = index < params.count;
    let ring = block_ring(curve.vertices, curve.closed != 0u, curve.scratch, thread % params.lanes, live);
    let smallest = solve_block_ring(curve, ring);
    if (ring.working && ring.lane == 0u) {
        pivots[index] = smallest;
    }
}
