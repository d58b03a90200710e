// Curves that descend an energy, by Newton's method, or with SOBOLEV along Sobolev gradients. A tick
// is one direction and the trial along it. A dispatch has many ticks. Everything that a curve needs
// to go on is in storage, so that a descent is the same whatever its ticks are divided into. A
// thread has a curve for itself (descent/alone.wgsl), or with LANES several threads share one
// (descent/lanes.wgsl). Twin: src/discrete/descent.rs, which says why.
//
// Curves of $SIDE threads stand side by side in `fixed`, `displacements` and `work`: number c of
// row v in a section of width w is (v w + c) $SIDE words from the section's first, the curve's
// place being part of that. The order is FIRST, SECOND or THIRD, the third where lanes share
// curves.

struct DescentParams {
    // Curves listed in `tasks`.
    tasks: u32,
    // Numbers of a curve in `lanes`.
    numbers: u32,
    // With LANES: of every curve.
    ticks: u32,
    // With LANES: the number of lanes that share a curve.
    lanes: u32,
}

struct DescentTask {
    slot: u32,
    // Without LANES: as many as the loops of the longest curve of the workgroup allow.
    ticks: u32,
}

struct DescentCurve {
    // First words in the interleaved arrays.
    fixed_start: u32,
    displacement_start: u32,
    work_start: u32,
    // Rows of a section: those of the longest curve of the group.
    stride: u32,
    segments: u32,
    closed: u32,
}

struct DescentState {
    termination: u32,
    iterations: u32,
    evaluations: u32,
    // 1: the step before was undamped, and not cut short.
    flags: u32,
    since_best: u32,
    most_iterations: u32,
}

// No twin: stands for the infinity of what nothing has bounded yet.
const UNBOUNDED: real = real(1e38);

// Numbers of a curve in `lanes`: what the host says, then what the descent keeps, then the energy's
// weights.
// Twin: descent_gpu/packing.rs
const GIVEN: u32 = 3u;
const NUMBERS: u32 = 13u;
// No twin: the host gives them in this order.
const GIVEN_HIGHEST: u32 = 0u;
const GIVEN_TOLERANCE: u32 = 1u;
const GIVEN_LONGEST: u32 = 2u;

@group(0) @binding(0) var<uniform> params: DescentParams;
@group(0) @binding(1) var<storage, read> tasks: array<DescentTask>;
@group(0) @binding(2) var<storage, read> curves: array<DescentCurve>;
// A row: the edge of the base from the vertex on, 1 where the vertex at its end is no data point, 1
// where the vertex may move; with ATTACHMENT its data point's displacement and what holds it; with TAUT 1/w² of
// the edge; the penalties of the vertex at its end, and the region penalties of the vertex; with SURFACE where it lies.
@group(0) @binding(3) var<storage, read> fixed: array<real>;
@group(0) @binding(4) var<storage, read_write> states: array<DescentState>;
@group(0) @binding(5) var<storage, read_write> lanes: array<real>;
@group(0) @binding(6) var<storage, read_write> displacements: array<real>;
// Sections p, g, x of vectors, then lengths of edges, with SURFACE n·g of the curve as it stands and
// of the trial, and where the trial moves vertices; then the factors, and what they share with the
// border of a closed curve before its first section; with LANES in their place the blocks by vertices, and what the lanes of a ring share.
@group(0) @binding(7) var<storage, read_write> work: array<real>;
//:if SURFACE_TABLE
// What the text of the surface reads.
@group(0) @binding(8) var<storage, read> surface_table: array<real>;
//:end

// A curve as its thread sees it: first words of its sections.
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
    // The step of the trial that is being evaluated.
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
// Whether the host is to begin the curve anew: the text has left it, or the driver has ended loops of this thread, which
// then do not turn twice.
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

// Largest step that changes no edge by more than its allowed part.
fn most_step(largest_square: real) -> real {
    return MOST_OF_AN_EDGE / max(sqrt(largest_square), real(1e-30));
}

fn relative_change(curve: Curve, j: u32, change: vector) -> real {
    let inverse = real(1) / length_at(curve, j);
    return dot(change, change) * inverse * inverse;
}

// Counts the steps in a row without progress. Returns whether there are too many.
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

// What is said of a trial: its energies, and the slope there.
fn verdict_on(lane: ptr<function, Lane>, curve: Curve, swept: Swept) -> u32 {
    let energy = swept.energy + swept.regularisation;
    (*lane).evaluations += 1u;
    var verdict = VERDICT_ACCEPT;
    if ((*lane).termination == TERMINATION_STATUS_START) {
        // The base.
        (*lane).termination = TERMINATION_STATUS_RUNNING;
        (*lane).start_energy = energy;
//:if SOBOLEV
        (*lane).stride = real(1);
        (*lane).mean = energy;
//:end
        if (is_out_of_range(energy)) {
            (*lane).termination = TERMINATION_STATUS_BROKEN;
            (*lane).reported = swept.energy;
            return VERDICT_AGAIN;
        }
    } else {
        verdict = judge(lane, curve, energy, swept.slope);
        // Rounding decides whether the last step is taken, and not on the count.
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
