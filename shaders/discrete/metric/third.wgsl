// The inner product of order 3 where lanes share a curve: its blocks by a lane's chunk of vertices, where those of
// H + λL were, for the block ring. Twin: src/discrete/metric/variation.rs.
//:include discrete/metric/tangent.wgsl

// The part of D₂ that counts at a vertex: I, or at a pin I − T Tᵀ.
fn counted(curve: Curve, v: u32) -> matrix {
    if (is_movable(curve, v)) {
        return diagonal(real(1));
    }
    let tangent = tangent_at(curve, v);
    return diagonal(real(1)) - outer(tangent, tangent);
}

// The coefficients of D₂ between two edges, at their three vertices.
fn second_difference(s0: real, s1: real) -> vec3<real> {
    let share = real(2) / (s0 + s1);
    return vec3<real>(share / s0, -(share * (real(1) / s0 + real(1) / s1)), share / s1);
}

// What a solve leaves: whether the inner product is one, and ⟨g, z⟩.
struct Solved {
    sound: bool,
    norm2: real,
}

// No twin: all is in the blocks.
struct Frozen {
    sound: bool,
}

fn not_frozen() -> Frozen {
    return Frozen(true);
}

// Freezes the inner product at the curve as it stands: assembles its blocks. All threads of a workgroup take part.
fn freeze(curve: Curve, ring: BlockRing, thread: u32) -> Frozen {
    if (ring.working) {
        for (var v = ring.begin; v < ring.end; v++) {
            var own = matrix();
//:if ATTACHMENT
            own = diagonal(load_stiffness(curve, v));
//:end
            store_matrix(block_at(curve, v, 0u), 0u, own);
//:unroll k 1..$VERTICES
            store_matrix(block_at(curve, v, $ku), 0u, matrix());
//:end
        }
        let first = i32(ring.begin);
        let begin = select(max(first - 3, 0), first - 3, curve.closed != 0u);
        for (var j = begin; j < i32(ring.end); j++) {
            if (ends_at(curve, j) > real(0)) {
                add_ends(curve, ring, j);
            }
            if (edges_from(curve, j) >= 3u) {
                add_third(curve, ring, j);
            }
        }
    }
    storageBarrier();
    return not_frozen();
}

// Adds 2 w D₃g·D₃h Δs on the middle one of the three edges from j on.
fn add_third(curve: Curve, ring: BlockRing, j: i32) {
    let s0 = length_at(curve, wrapped(curve, j));
    let s1 = length_at(curve, wrapped(curve, j + 1));
    let s2 = length_at(curve, wrapped(curve, j + 2));
    let before = second_difference(s0, s1);
    let after = second_difference(s1, s2);
    let p = counted(curve, wrapped(curve, j + 1));
    let q = counted(curve, wrapped(curve, j + 2));
    let a0 = -before.x * p;
    let a1 = after.x * q - before.y * p;
    let a2 = after.y * q - before.z * p;
    let a3 = after.z * q;
    let weight = curve.highest * way_of(s0, s1, s2).inverse;
//:unroll a 0..4
//:unroll b $a..4
    add_to_block(curve, ring, j + $a, $bu - $au, weight * (a$a * a$b));
//:end
//:end
}

// Adds the tangential part of D₂ at the vertex between the edges j and j + 1, next to an end, or all of it where pins
// are few.
fn add_ends(curve: Curve, ring: BlockRing, j: i32) {
    let s0 = length_at(curve, u32(j));
    let s1 = length_at(curve, u32(j) + 1u);
    let tangent = tangent_at(curve, u32(j) + 1u);
    let c = second_difference(s0, s1);
    var part = outer(tangent, tangent);
    if (curve.pin_count < 3u) {
        part = diagonal(real(1));
    }
    let along = (curve.highest * ends_at(curve, j) * real(2) / (s0 + s1)) * part;
//:unroll a 0..3
//:unroll b $a..3
    add_to_block(curve, ring, j + $a, $bu - $au, (c[$a] * c[$b]) * along);
//:end
//:end
}

// The lane's part of the ring that solves for the Sobolev gradient.
fn metric_ring(curve: Curve, ring: BlockRing) -> BlockRing {
    return ring;
}

// No twin: blocks say it on the CPU.
const METRIC_REACH: u32 = $REACHu;

fn metric_rhs(curve: Curve, v: u32) -> vector {
    return work_vector(curve.g, v);
}

fn metric_movable(curve: Curve, v: u32) -> bool {
    return is_movable(curve, v);
}

// Once the ring has solved: ⟨g, z⟩. All threads of a workgroup take part; to all that work the same is returned.
fn sobolev_gradient(curve: Curve, ring: BlockRing, frozen: Frozen, is_sound: bool, thread: u32) -> Solved {
    var partial = vec4<real>();
    if (ring.working) {
        for (var v = ring.begin; v < ring.end; v++) {
            partial.x += dot(work_vector(curve.g, v), work_vector(curve.z, v));
        }
    }
    return Solved(is_sound, gathered(ring, thread, partial).x);
}
