// The inner product of order 2 where lanes share a curve: the solves with the network by partition and cyclic
// reduction, as in linalg/ring/lanes.wgsl with rows of any number, and the turns at pins by the block ring.
// Twins: src/linalg/ring/lanes.rs and src/discrete/metric/hats.rs.
//:include discrete/metric/network.wgsl
//:include discrete/metric/pins.wgsl

// No twin: what the CPU has in variables. Until the turns are solved for, their blocks are not there.
const PIN_NEXT: u32 = 2u + $DIMu;
const PIN_NEXT_TURN: u32 = 2u + $DIMu + $DIMu * $DIMu;

// A chunk's first row, which is kept, once the others are eliminated: (excess + left + right) x − left x₋ − right x₊;
// and of the last row eliminated the share of the kept unknown and its own.
struct Chunk {
    excess: real,
    left: real,
    right: real,
    alpha: real,
    share: real,
    sound: bool,
}

fn held_chunk() -> Chunk {
    return Chunk(real(1), real(0), real(0), real(0), real(1), true);
}

fn weight_after(curve: Curve, network: Network, v: u32) -> real {
    if (v < curve.segments) {
        return network.weight / length_at(curve, v);
    }
    return real(0);
}

fn weight_before(curve: Curve, network: Network, v: u32) -> real {
    if (v > 0u || curve.closed != 0u) {
        return network.weight / length_at(curve, select(v, curve.segments, v == 0u) - 1u);
    }
    return real(0);
}

// Stores 1/pivot, 0 where the vertex is held, and the share of the kept unknown of every row eliminated.
fn factor_chunk(curve: Curve, ring: BlockRing, network: Network) -> Chunk {
    let first = ring.begin;
    // A vertex that is held is the row 1 · x = 0, and takes the weights of its edges on as excess of its neighbours'.
    var chunk = held_chunk();
    if (is_movable(curve, first)) {
        let left = weight_before(curve, network, first);
        let right = weight_after(curve, network, first);
        chunk = Chunk(excess_at(curve, network, first), left, right, real(1), real(0), true);
    }
    var left = weight_after(curve, network, first);
    for (var v = first + 1u; v < ring.end; v++) {
        let right = weight_after(curve, network, v);
        let own = excess_at(curve, network, v) + left * chunk.share;
        let link = left * chunk.alpha;
        let pivot = own + link + right;
        var inverse = real(0);
        chunk.alpha = real(0);
        chunk.share = real(1);
        if (is_movable(curve, v)) {
            chunk.sound = chunk.sound && pivot > real(0) && !is_out_of_range(pivot);
            inverse = real(1) / pivot;
            chunk.alpha = link * inverse;
            chunk.share = own * inverse;
        }
        work[curve.pivot + v * $SIDEu] = inverse;
        work[curve.chain + v * $SIDEu] = chunk.alpha;
        chunk.excess += chunk.right * chunk.share;
        chunk.right *= right * inverse;
        left = right;
    }
    return chunk;
}

// What a solve leaves: whether the inner product is one, and ⟨g, z⟩.
struct Solved {
    sound: bool,
    norm2: real,
}

// Solves for the vectors in the section `right_hand_sides`, each times `by_mass` times its vertex's mass where that
// is not 0. All threads of a workgroup take part. What is returned is the lane's own part.
fn solve_network(
    curve: Curve,
    ring: BlockRing,
    network: Network,
    chunk: Chunk,
    right_hand_sides: u32,
    by_mass: real,
    solution: u32,
    thread: u32,
) -> Solved {
    var rhs = vector();
    var delta = vector();
    if (ring.working) {
        rhs = network_rhs(curve, right_hand_sides, by_mass, ring.begin);
        var left = weight_after(curve, network, ring.begin);
        var right = select(real(0), left, is_movable(curve, ring.begin));
        for (var v = ring.begin + 1u; v < ring.end; v++) {
            let inverse = work[curve.pivot + v * $SIDEu];
            delta = inverse * (network_rhs(curve, right_hand_sides, by_mass, v) + left * delta);
            store_vector(curve.x, v, delta);
            rhs += right * delta;
            left = weight_after(curve, network, v);
            right *= left * inverse;
        }
    }
    let base = thread - ring.lane;
    let before = base + (ring.lane + ring.lanes - 1u) % ring.lanes;
    let after = base + (ring.lane + 1u) % ring.lanes;
    shared_row[thread] = vec4<real>(chunk.alpha, chunk.share, real(0), real(0));
    shared_vector[thread] = delta;
    workgroupBarrier();
    var row = Chunk(real(1), real(0), real(0), real(0), real(0), chunk.sound);
    if (ring.working) {
        let last = shared_row[before];
        row.excess = chunk.excess + chunk.left * last.y;
        row.left = chunk.left * last.x;
        row.right = chunk.right;
        rhs += chunk.left * shared_vector[before];
    }
    workgroupBarrier();
    for (var step = 1u; step < RING_LANES; step *= 2u) {
        shared_row[thread] = vec4<real>(row.excess, row.left, row.right, real(1) / (row.excess + row.left + row.right));
        shared_vector[thread] = rhs;
        workgroupBarrier();
        if (ring.working && step < ring.lanes) {
            let l = base + (ring.lane + ring.lanes - step) % ring.lanes;
            let r = base + (ring.lane + step) % ring.lanes;
            let there_l = shared_row[l];
            let there_r = shared_row[r];
            let link_l = row.left * there_l.w;
            let link_r = row.right * there_r.w;
            row.excess += link_l * there_l.x + link_r * there_r.x;
            rhs += link_l * shared_vector[l] + link_r * shared_vector[r];
            row.left = link_l * there_l.y;
            row.right = link_r * there_r.z;
        }
        workgroupBarrier();
    }
    let kept = rhs / row.excess;
    shared_vector[thread] = kept;
    workgroupBarrier();
    var solved = Solved(row.sound && row.excess > real(0) && !is_out_of_range(row.excess), real(0));
    if (ring.working) {
        var x = shared_vector[after];
        for (var v = ring.end - 1u; v > ring.begin; v--) {
            let gamma = weight_after(curve, network, v) * work[curve.pivot + v * $SIDEu];
            x = work_vector(curve.x, v) + work[curve.chain + v * $SIDEu] * kept + gamma * x;
            solved.norm2 += dot(work_vector(curve.g, v), x);
            store_vector(solution, v, x);
        }
        solved.norm2 += dot(work_vector(curve.g, ring.begin), kept);
        store_vector(solution, ring.begin, kept);
    }
    storageBarrier();
    return solved;
}

fn network_rhs(curve: Curve, section: u32, by_mass: real, v: u32) -> vector {
    if (!is_movable(curve, v)) {
        return vector();
    }
    let x = work_vector(section, v);
    if (by_mass != real(0)) {
        return (by_mass * mass_at(curve, v)) * x;
    }
    return x;
}

// A lane's share of the pins: first … last − 1.
fn pins_of(curve: Curve, ring: BlockRing) -> vec2<u32> {
    return vec2<u32>(ring.lane * curve.pin_count / ring.lanes, (ring.lane + 1u) * curve.pin_count / ring.lanes);
}

// Integrals of the hats over the spans from a lane's pins on: fractions of arc length at the vertices, own and
// coupling numbers of the pins, and −∫ φ y; what belongs to the span's second pin apart.
fn integrate_hats(curve: Curve, ring: BlockRing) {
    let own = pins_of(curve, ring);
    for (var k = own.x; k < own.y; k++) {
        let span = integrate_span(curve, k, real(0), vector());
        work[pin_at(curve, k, 0u)] = span.here;
        work[pin_at(curve, k, 1u)] = span.both;
        work[pin_at(curve, k, PIN_NEXT)] = span.next;
        store_pin_vector(curve, k, PIN_TURN, -span.here_turn);
        store_pin_vector(curve, k, PIN_NEXT_TURN, -span.next_turn);
    }
}

// The system of the turns, block tridiagonal, a block a pin: where the blocks of vertices were. Along the curve
// right-hand sides and couplings are 0.
fn assemble_turns(curve: Curve, ring: BlockRing) {
    let own = pins_of(curve, ring);
    for (var k = own.x; k < own.y; k++) {
        let tangent = pin_vector(curve, k, PIN_TANGENT);
        let both = work[pin_at(curve, k, 1u)];
        var here = work[pin_at(curve, k, 0u)];
        var turn = pin_vector(curve, k, PIN_TURN);
        if (k > 0u || curve.closed != 0u) {
            let before = select(k, curve.pin_count, k == 0u) - 1u;
            here += work[pin_at(curve, before, PIN_NEXT)];
            turn += pin_vector(curve, before, PIN_NEXT_TURN);
        }
        if (curve.closed != 0u && curve.pin_count == 1u) {
            // The ring's only pin is coupled with itself.
            here += real(2) * both;
        }
        let next = pin_vector(curve, select(k + 1u, 0u, k + 1u == curve.pin_count), PIN_TANGENT);
        store_matrix(block_at(curve, k, 0u), 0u, diagonal(here));
        store_matrix(block_at(curve, k, 1u), 0u, coupling(both, next, tangent));
        // Where p was, which has served.
        store_vector(curve.p, k, across_tangent(tangent, turn));
    }
}

// Adds Σ c_p φ_p.
fn add_turns(curve: Curve, ring: BlockRing) {
    let own = pins_of(curve, ring);
    for (var k = own.x; k < own.y; k++) {
        let here = work_vector(curve.p, k);
        let next = work_vector(curve.p, select(k + 1u, 0u, k + 1u == curve.pin_count));
        let end = span_end(curve, k);
        for (var v = pins[curve.first_pin + k] + 1u; v < end; v++) {
            let turned = here + work[curve.fraction + v * $SIDEu] * (next - here);
            store_vector(curve.x, v, work_vector(curve.x, v) + turned);
        }
    }
}

// The network of the order 2 at the lengths stored. All threads of a workgroup take part.
fn network_of(curve: Curve, ring: BlockRing, thread: u32) -> Network {
    var network = Network(real(1), real(0));
//:if ATTACHMENT
    var partial = vec4<real>();
    if (ring.working) {
        for (var v = ring.begin; v < ring.end; v++) {
            partial.x += load_stiffness(curve, v);
            partial.y += mass_at(curve, v);
        }
    }
    let whole = gathered(ring, thread, partial);
    network.density = sqrt(whole.x / (whole.y * curve.highest));
//:end
    return network;
}

// The inner product at the curve as it stands.
struct Frozen {
    network: Network,
    chunk: Chunk,
    sound: bool,
}

fn not_frozen() -> Frozen {
    return Frozen(Network(real(1), real(0)), held_chunk(), true);
}

// Freezes the inner product, solves with the network once, and leaves the system of the turns to the block ring. All
// threads of a workgroup take part.
fn freeze(curve: Curve, ring: BlockRing, thread: u32) -> Frozen {
    var frozen = not_frozen();
    frozen.network = network_of(curve, ring, thread);
    if (ring.working) {
        frozen.chunk = factor_chunk(curve, ring, frozen.network);
    }
    // y = K⁻¹ g
    frozen.sound = solve_network(curve, ring, frozen.network, frozen.chunk, curve.g, real(0), curve.x, thread).sound;
    let turns = ring.working && has_turns(curve);
    if (turns) {
        integrate_hats(curve, ring);
    }
    storageBarrier();
    if (turns) {
        assemble_turns(curve, ring);
    }
    storageBarrier();
    return frozen;
}

// The lane's part of the ring that solves for the turns.
fn metric_ring(curve: Curve, ring: BlockRing) -> BlockRing {
    let is_ring = curve.closed != 0u && curve.pin_count > 1u;
    return block_ring(curve.pin_count, is_ring, curve.scratch, ring.lane, ring.working && has_turns(curve));
}

// No twin: a pin is coupled with the next alone.
const METRIC_REACH: u32 = 1u;

fn metric_rhs(curve: Curve, k: u32) -> vector {
    return work_vector(curve.p, k);
}

fn metric_movable(curve: Curve, k: u32) -> bool {
    // The ends of an open curve are free to turn.
    return curve.closed != 0u || (k > 0u && k + 1u < curve.pin_count);
}

// Once the turns are known, z = K⁻¹ M (y + Σ c φ)/w, the Sobolev gradient. All threads of a workgroup take part; to
// all that work the same is returned.
fn sobolev_gradient(curve: Curve, ring: BlockRing, frozen: Frozen, are_turned: bool, thread: u32) -> Solved {
    if (ring.working && has_turns(curve)) {
        add_turns(curve, ring);
    }
    storageBarrier();
    let by_mass = real(1) / curve.highest;
    let own = solve_network(curve, ring, frozen.network, frozen.chunk, curve.x, by_mass, curve.z, thread);
    let unsound = select(real(1), real(0), are_turned && frozen.sound && own.sound);
    let all = gathered(ring, thread, vec4<real>(own.norm2, unsound, real(0), real(0)));
    return Solved(all.y == real(0), all.x);
}
