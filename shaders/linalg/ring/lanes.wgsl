// Batched tridiagonal systems, open and cyclic, by partition and cyclic reduction over a ring of
// lanes.
//
// params.lanes lanes share a system. Each reduces its chunk of at most $Q consecutive rows to the first
// one, the kept row. The kept rows form a cyclic tridiagonal system, which is reduced by log2 lanes
// steps of cyclic reduction. Then every lane substitutes back. Open systems (one weight is zero) and
// cyclic systems run the same code. Row form: see mod.wgsl.
// Twin: src/linalg/ring/lanes.rs, same names, same order of operations.
//:include linalg/ring/mod.wgsl
//:include $ROWS

const GROUP: u32 = $GROUPu;

//:if SUBGROUP
//:else
var<workgroup> ring_excess: array<real, GROUP>;
var<workgroup> ring_left: array<real, GROUP>;
var<workgroup> ring_right: array<real, GROUP>;
var<workgroup> ring_pivot: array<real, GROUP>;
var<workgroup> ring_rhs: array<columns, GROUP>;
//:end

@compute @workgroup_size(GROUP)
fn solve(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
//:if SUBGROUP
    @builtin(subgroup_invocation_id) thread: u32,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_size) subgroup_size: u32,
) {
    let slot = subgroup * (subgroup_size / params.lanes) + thread / params.lanes;
//:else
    @builtin(local_invocation_index) thread: u32,
) {
    let slot = thread / params.lanes;
//:end
    let task = (workgroup.x + workgroup.y * workgroups.x) * (GROUP / params.lanes) + slot;
    let live = task < params.count;
    let system = systems[min(task, params.count - 1u)];
    let lane = thread % params.lanes;
    let base = thread - lane;

    // Short systems use a ring of fewer lanes, a power of two. Other lanes idle.
    let ring = 1u << firstLeadingBit(min(params.lanes, system.rows));
    let working = live && lane < ring;
    let begin = lane * system.rows / ring;
    let rows = select(0u, (lane + 1u) * system.rows / ring - begin, working);

    // Eliminate rows 1 … rows − 1 of the chunk; row 0 is kept.
    var excess = real(1);
    var left = real(0);
    var right = real(0);
    var rhs = columns();
    if (working) {
        let row = load_row(system, begin);
        excess = row.excess;
        left = row.left;
        right = row.right;
        rhs = load_rhs(system, begin);
    }
    var alpha = real(1); // share of the kept unknown in the last row eliminated
    var share = real(0); // its own excess over its pivot
    var delta = columns(); // its value when both neighbours vanish
//:unroll i 1..$Q
    var alpha$i = real(0);
    var gamma$i = real(0);
    var delta$i = columns();
    if ($iu < rows) {
        let at = begin + $iu;
//:include linalg/ring/eliminate.wgsl
        alpha$i = alpha;
        gamma$i = gamma;
        delta$i = delta;
        excess += right * share;
        rhs += right * delta;
        right *= gamma$i;
    }
//:end

    // Couple the kept row to the previous chunk's kept row.
    let previous = base + (lane + ring - 1u) % ring;
    let next = base + (lane + 1u) % ring;
//:if SUBGROUP
    let alpha_left = subgroupShuffle(alpha, previous);
    let share_left = subgroupShuffle(share, previous);
    let delta_left = subgroupShuffle(delta, previous);
//:else
    ring_left[thread] = alpha;
    ring_excess[thread] = share;
    ring_rhs[thread] = delta;
    workgroupBarrier();
    let alpha_left = ring_left[previous];
    let share_left = ring_excess[previous];
    let delta_left = ring_rhs[previous];
    workgroupBarrier();
//:end
    if (working) {
        excess += left * share_left;
        rhs += left * delta_left;
        left *= alpha_left;
    }

    // Cyclic reduction over the ring.
    for (var step = 1u; step < params.lanes; step *= 2u) {
        let r = real(1) / (excess + left + right);
        let L = base + (lane + ring - (step % ring)) % ring;
        let R = base + (lane + step) % ring;
//:if SUBGROUP
        let r_L = subgroupShuffle(r, L);
        let excess_L = subgroupShuffle(excess, L);
        let left_L = subgroupShuffle(left, L);
        let rhs_L = subgroupShuffle(rhs, L);
        let r_R = subgroupShuffle(r, R);
        let excess_R = subgroupShuffle(excess, R);
        let right_R = subgroupShuffle(right, R);
        let rhs_R = subgroupShuffle(rhs, R);
//:else
        ring_pivot[thread] = r;
        ring_excess[thread] = excess;
        ring_left[thread] = left;
        ring_right[thread] = right;
        ring_rhs[thread] = rhs;
        workgroupBarrier();
        let r_L = ring_pivot[L];
        let excess_L = ring_excess[L];
        let left_L = ring_left[L];
        let rhs_L = ring_rhs[L];
        let r_R = ring_pivot[R];
        let excess_R = ring_excess[R];
        let right_R = ring_right[R];
        let rhs_R = ring_rhs[R];
        workgroupBarrier();
//:end
        if (working && step < ring) {
            let link_L = left * r_L;
            let link_R = right * r_R;
            excess += link_L * excess_L + link_R * excess_R;
            rhs += link_L * rhs_L + link_R * rhs_R;
            left = link_L * left_L;
            right = link_R * right_R;
        }
    }

    // A network without excess is singular, and every constant solves it. Take zero, and report it.
    var kept = columns();
    if (excess != real(0)) {
        kept = rhs / excess;
    }
//:if SUBGROUP
    var x = subgroupShuffle(kept, next);
//:else
    ring_rhs[thread] = kept;
    workgroupBarrier();
    var x = ring_rhs[next];
//:end

    // Substitute back.
//:unroll i $Q..1
    if ($iu < rows) {
        x = delta$i + alpha$i * kept + gamma$i * x;
        store_at(system.start + begin + $iu, x);
    }
//:end
    if (working) {
        store_kept(system, begin, kept);
        if (lane == 0u) {
            status[system.index] = select(STATUS_SOLVED, STATUS_SINGULAR, excess == real(0));
        }
    }
}
