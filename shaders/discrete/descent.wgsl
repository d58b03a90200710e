// Curves that descend an energy, by Newton's method, or with SOBOLEV along Sobolev gradients. A
// tick is one direction and the trial along it. A dispatch has many ticks. The whole state of a
// descent is in storage, so the result does not depend on how ticks are divided into dispatches.
// One thread computes a curve (descent/alone.wgsl), or with LANES several threads share one
// (descent/lanes.wgsl).
// Twin: src/discrete/descent.rs, which has the reasons.
//
// `fixed`, `displacements` and `work` interleave the curves of $SIDE threads: in a section of width
// w, number c of row v is (v w + c) $SIDE words after the section's first word, which depends on
// the curve. The order is FIRST, SECOND or THIRD; it is THIRD only where lanes share curves.

struct DescentParams {
    // The number of curves in `tasks`.
    tasks: u32,
    // Numbers per curve in `lanes`.
    numbers: u32,
    // With LANES: the ticks of every curve.
    ticks: u32,
    // With LANES: the number of lanes per curve.
    lanes: u32,
}

//:include discrete/descent/curve.wgsl

// No twin: stands for infinity where nothing bounds a number yet.
const UNBOUNDED: real = real(1e38);

// Numbers of a curve in `lanes`: first from the host, then of the descent, then the energy's
// weights.
// Twin: descent_gpu/packing.rs
const GIVEN: u32 = 4u;
const NUMBERS: u32 = 14u;
// No twin: the host gives them in this order.
const GIVEN_HIGHEST: u32 = 0u;
const GIVEN_TOLERANCE: u32 = 1u;
const GIVEN_LONGEST: u32 = 2u;
//:if F64
//:else
const GIVEN_ROUNDING: u32 = 3u;

// Twin: minimise.rs
const COARSEST_IN_F32: real = real(1e-3);
//:end

@group(0) @binding(0) var<uniform> params: DescentParams;
@group(0) @binding(1) var<storage, read> tasks: array<DescentTask>;
@group(0) @binding(2) var<storage, read> curves: array<DescentCurve>;
// A row has the edge of the base that starts at the vertex; 1 if the vertex at its end is not a
// data point; 1 if the vertex may move; with ATTACHMENT the displacement of its data point and its
// anchor; with TAUT 1/w² of the edge; the penalties at the end of the edge, and the region
// penalties of the vertex; with SURFACE the position of the vertex.
@group(0) @binding(3) var<storage, read> fixed: array<real>;
@group(0) @binding(4) var<storage, read_write> states: array<DescentState>;
@group(0) @binding(5) var<storage, read_write> lanes: array<real>;
@group(0) @binding(6) var<storage, read_write> displacements: array<real>;
// Sections p, g and x of vectors, then the lengths of edges. With SURFACE: n·g of the current curve
// and of the trial, and the positions to which the trial moves vertices. Then the factors; their
// couplings with the border of a closed curve are before the first section. With LANES instead of
// the factors: the blocks with respect to vertices, and the scratch of the block ring.
@group(0) @binding(7) var<storage, read_write> work: array<real>;
//:if SURFACE_TABLE
// The table that the text of the surface reads.
@group(0) @binding(8) var<storage, read> surface_table: array<real>;
//:end

// A curve for its thread: the first words of its sections.
struct Curve {
    slot: u32,
    segments: u32,
    closed: u32,
    vertices: u32,
    fixed_start: u32,
    u: u32,
    p: u32,
    g: u32,
    x: u32,
    length: u32,
//:if SURFACE
    push: u32,
    trial_push: u32,
    moved: u32,
//:end
//:if LANES
    blocks: u32,
    scratch: u32,
//:else
    factor: u32,
    border: u32,
//:end
    highest: real,
    // The step length of the trial that is being evaluated.
    alpha: real,
}

fn load_weight(curve: Curve, index: u32) -> real {
    return lanes[curve.slot * params.numbers + NUMBERS + index];
}

//:include discrete/energy/mod.wgsl
//:include discrete/edges/swept.wgsl
//:include damping/verdict.wgsl
//:include damping.wgsl

//:include discrete/descent/trial.wgsl
//:include discrete/edges.wgsl SWEEP=sweep EDGE=load_edge OFFSET=load_offset HOLD=load_anchor PLACE=trial DERIVATIVES=1 STORE=store_gradient DIRECTION=load_edge_direction DIRECTION_AT=load_direction STORE_PUSH=store_push
//:include discrete/lane.wgsl

//:if SURFACE_WGSL
// Whether the host must begin the curve again: the text has left the curve to the host, or the
// driver has cut loops of this thread short, so that the loop here does not run twice.
fn is_for_host() -> bool {
    var turns = 0u;
    for (var k = 0u; k <= min(params.tasks, 1u); k++) {
        turns++;
    }
    return is_left || turns < 2u;
}
//:end

// Twin: edges.rs
const MOST_OF_AN_EDGE: real = real(0.5);

// The largest step that changes no edge by more than MOST_OF_AN_EDGE of its length.
fn most_step(largest_square: real) -> real {
    return MOST_OF_AN_EDGE / max(sqrt(largest_square), real(1e-30));
}

fn relative_change(curve: Curve, j: u32, change: vector) -> real {
    let inverse = real(1) / length_at(curve, j);
    return dot(change, change) * inverse * inverse;
}

// Counts steps without progress. Returns whether there were too many in a row.
fn falls_short(lane: ptr<function, Lane>) -> bool {
    let norm = sqrt((*lane).norm2);
    if (norm < PROGRESS * (*lane).best || (*lane).energy < (*lane).energy_then) {
        (*lane).best = min(norm, (*lane).best);
        (*lane).energy_then = (*lane).energy - FALL * abs((*lane).energy);
        (*lane).since_best = 0u;
    } else {
        (*lane).since_best += 1u;
    }
//:if SOBOLEV
    return (*lane).since_best > SOBOLEV_PATIENCE;
//:else
    return (*lane).since_best > PATIENCE;
//:end
}

fn has_run_away(lane: ptr<function, Lane>, curve: Curve) -> bool {
    let longest = lanes[curve.slot * params.numbers + GIVEN_LONGEST];
    return (*lane).length > longest && (*lane).energy < (*lane).start_energy;
}

// The verdict on a trial, from its energies and the slope there.
fn verdict_on(lane: ptr<function, Lane>, curve: Curve, swept: Swept) -> u32 {
    let energy = swept.energy + swept.regularisation;
    (*lane).evaluations += 1u;
    var verdict = VERDICT_ACCEPT;
    if ((*lane).termination == TERMINATION_STATUS_START) {
        // The first trial is the base.
        (*lane).termination = TERMINATION_STATUS_RUNNING;
        (*lane).start_energy = energy;
//:if SOBOLEV
        (*lane).stride = real(1);
        (*lane).mean = energy;
//:end
//:if F64
//:else
        // Of a curve whose base the host has not evaluated.
        let given = curve.slot * params.numbers;
        let rounding = min(lanes[given + GIVEN_ROUNDING] * sqrt(swept.energy), COARSEST_IN_F32);
        lanes[given + GIVEN_TOLERANCE] = max(lanes[given + GIVEN_TOLERANCE], rounding);
//:end
        if (is_out_of_range(energy)) {
            (*lane).termination = TERMINATION_STATUS_BROKEN;
            (*lane).reported = swept.energy;
            return VERDICT_AGAIN;
        }
    } else {
        verdict = judge(lane, curve, energy, swept.slope);
        // Rounding may decide whether the last step is accepted, so the count does not depend on
        // it.
        if (verdict == VERDICT_ACCEPT || (*lane).termination == TERMINATION_STATUS_CONVERGED) {
            (*lane).iterations += 1u;
        }
    }
    if (verdict == VERDICT_ACCEPT) {
        (*lane).energy = energy;
        (*lane).reported = swept.energy;
    }
    return verdict;
}

//:if LANES
//:include discrete/descent/lanes.wgsl
//:else
//:include discrete/descent/alone.wgsl
//:end
