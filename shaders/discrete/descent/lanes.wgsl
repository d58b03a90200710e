// Descents by Newton's method with params.lanes lanes per curve. Each lane has the same chunk of
// vertices as in the block ring. The first lane judges trials for all. Several curves share a
// workgroup. All threads meet its barriers; threads of curves that have ended do nothing between
// them.
// Twin: src/discrete/descent.rs.

// A number of every thread, for the other lanes of its curve.
var<workgroup> shared_row: array<vec4<real>, $GROUP>;
var<workgroup> shared_vector: array<vector, $GROUP>;
var<workgroup> any_runs: u32;

//:include linalg/block_ring/lanes/ring.wgsl SCRATCH=work
//:include discrete/newton/assemble.wgsl
//:include discrete/damped.wgsl

// After an accepted step: the length of the curve, and g·g.
struct Taken {
    length: real,
    squares: real,
}

fn ring_block(curve: Curve, v: u32, k: u32) -> matrix {
    return transpose(work_matrix(block_at(curve, v, k), 0u));
}

fn ring_rhs(curve: Curve, v: u32) -> vector {
    return -work_vector(curve.g, v);
}

fn ring_movable(curve: Curve, v: u32) -> bool {
    return is_movable(curve, v);
}

fn ring_store(curve: Curve, v: u32, x: vector) {
    store_vector(curve.p, v, x);
}

// The sums of x, y and z and the largest w over the lanes of a curve.
fn gathered(ring: BlockRing, thread: u32, own: vec4<real>) -> vec4<real> {
    shared_row[thread] = own;
    workgroupBarrier();
    var all = own;
    if (ring.working) {
        all = shared_row[thread - ring.lane];
        for (var lane = 1u; lane < ring.lanes; lane++) {
            let there = shared_row[thread - ring.lane + lane];
            all = vec4<real>(all.xyz + there.xyz, max(all.w, there.w));
        }
    }
    workgroupBarrier();
    return all;
}

// The base: no displacement, no direction.
fn begin(curve: Curve, ring: BlockRing) {
    for (var v = ring.begin; v < ring.end; v++) {
        store_displacement(curve, v, vector());
        store_vector(curve.p, v, vector());
    }
}

// The slope of p at the current curve, and the largest relative change of an edge.
fn found_of(curve: Curve, ring: BlockRing, smallest: real, thread: u32) -> Found {
    var partial = vec4<real>();
    if (ring.working) {
        for (var v = ring.begin; v < ring.end; v++) {
            partial.x += dot(work_vector(curve.g, v), work_vector(curve.p, v));
            if (v < curve.segments) {
                partial.w = max(partial.w, relative_change(curve, v, load_edge_direction(curve, v)));
            }
        }
    }
    let all = gathered(ring, thread, partial);
    return Found(smallest > real(0), all.x, all.w);
}

// Accepts the step and its gradient.
fn take_step(curve: Curve, ring: BlockRing, thread: u32) -> Taken {
    var partial = vec4<real>();
    if (ring.working) {
        for (var j = ring.begin; j < min(ring.end, curve.segments); j++) {
            let edge = load_edge(curve, j);
            let length = sqrt(dot(edge, edge));
            work[curve.length + j * $SIDEu] = length;
            partial.x += length;
        }
    }
    // Edges end at vertices of other lanes.
    storageBarrier();
    if (ring.working) {
        for (var v = ring.begin; v < ring.end; v++) {
            store_displacement(curve, v, trial(curve, v));
            let g = work_vector(curve.x, v);
            store_vector(curve.g, v, g);
            partial.y += dot(g, g);
//:if SURFACE
            take_push(curve, v);
//:end
        }
    }
    storageBarrier();
    let all = gathered(ring, thread, partial);
    return Taken(all.x, all.y);
}

// The first lane of a curve ends it before its trial, if it is done.
fn end_all(curve: Curve, ring: BlockRing, found: Found) {
    if (ring.working && ring.lane == 0u) {
        var lane = load_lane(curve.slot);
        end_before(&lane, curve, found);
        store_lane(curve.slot, lane);
    }
    storageBarrier();
}

// The first lane of a curve judges a trial and passes the verdict to all lanes. Until then the
// state of the curve stays in storage, not in registers.
fn judged(curve: Curve, ring: BlockRing, found: Found, swept: vec4<real>, thread: u32) -> u32 {
    var verdict = VERDICT_AGAIN;
    if (ring.working && ring.lane == 0u) {
        var lane = load_lane(curve.slot);
        if (lane.termination != TERMINATION_STATUS_START) {
            aimed(&lane, found);
        }
        verdict = verdict_on(&lane, curve, Swept(swept.x, swept.y, swept.z));
        if (verdict == VERDICT_FAIL) {
            give_way(&lane, curve);
        }
        store_lane(curve.slot, lane);
    }
    shared_row[thread].x = real(verdict);
    workgroupBarrier();
    verdict = u32(shared_row[thread - ring.lane].x);
    workgroupBarrier();
    return verdict;
}

// Makes the trial along a direction, and returns the verdict.
fn trial_along(curve: Curve, ring: BlockRing, found: Found, thread: u32) -> u32 {
//:if SURFACE
    if (ring.working) {
        move_back(curve, ring.begin, ring.end);
    }
    storageBarrier();
//:end
    var swept = Swept();
    if (ring.working) {
        swept = sweep(curve, load_weights(curve), ring.begin, ring.end);
    }
    let whole = gathered(ring, thread, vec4<real>(swept.energy, swept.regularisation, swept.slope, real(0)));
    return judged(curve, ring, found, whole, thread);
}

// Makes one trial for every curve that is running.
fn tick(at_step: Curve, running: BlockRing, thread: u32) {
    var curve = at_step;
    // The first trial is the base.
    var solving = running;
    solving.working = running.working && states[curve.slot].termination == TERMINATION_STATUS_RUNNING;
    if (solving.working) {
        assemble(curve, running, load_weights(curve), load_lambda(curve.slot));
    }
    storageBarrier();
    let smallest = solve_block_ring(curve, solving);
    let found = found_of(curve, solving, smallest, thread);
    curve.alpha = select(real(0), step_of(found, load_stride(curve.slot)), solving.working);
    end_all(curve, solving, found);
    var trying = running;
    trying.working = running.working && states[curve.slot].termination <= TERMINATION_STATUS_CONVERGED;
    let verdict = trial_along(curve, trying, found, thread);
    var taking = trying;
    taking.working = trying.working && verdict == VERDICT_ACCEPT;
    let taken = take_step(curve, taking, thread);
    if (taking.working && taking.lane == 0u) {
        var lane = load_lane(curve.slot);
        take(&lane, taken);
        store_lane(curve.slot, lane);
    }
    storageBarrier();
}

// Tells all threads of the workgroup whether any of them runs.
fn anyone(runs: bool, thread: u32) -> bool {
    shared_row[thread].x = select(real(0), real(1), runs);
    workgroupBarrier();
    if (thread == 0u) {
        var any = real(0);
        for (var k = 0u; k < $GROUPu; k++) {
            any += shared_row[k].x;
        }
        any_runs = select(0u, 1u, any > real(0));
    }
    return workgroupUniformLoad(&any_runs) != 0u;
}

//:include entry.wgsl ENTRY=descend
    let index = min(task / params.lanes, params.tasks - 1u);
    let live = task / params.lanes < params.tasks;
    let curve = load_curve(tasks[index].slot);
    var ring = block_ring(curve.vertices, curve.closed != 0u, curve.scratch, thread % params.lanes, live);
    let works = ring.working;
    if (works && states[curve.slot].termination == TERMINATION_STATUS_START) {
        begin(curve, ring);
    }
    storageBarrier();
    for (var done = 0u; done < params.ticks; done++) {
        ring.working = works && states[curve.slot].termination <= TERMINATION_STATUS_RUNNING;
        if (!anyone(ring.working, thread)) {
            break;
        }
        tick(curve, ring, thread);
    }
//:if SURFACE_WGSL
    // All lanes of a curve that write this write the same value.
    if (works && is_for_host()) {
        states[curve.slot].termination = TERMINATION_STATUS_LEFT;
    }
//:end
}
