// Plain curves before and after descent.wgsl: their splines are divided into edges, and their
// vertices placed. Between dispatches of descents the curves that still run are listed.
// Twin: src/discrete/resident.rs: what it computes is in division.rs, setup.rs and verdict.rs.

struct ResidentParams {
    // Slots of descents, and splines with a knot.
    slots: u32,
    splines: u32,
    // Knots, with the first one of a closed curve again at its end.
    knots: u32,
    dimension: u32,
    // Edges per span.
    segments: u32,
    // Curves that are interleaved, and numbers per row of `fixed`.
    side: u32,
    width: u32,
    // Numbers per curve in `given`, and in `lanes`.
    given: u32,
    numbers: u32,
    // The place of the weight of the regularisation among the weights.
    regularisation: u32,
    most_iterations: u32,
    // Curves per workgroup of the next descents, and their ticks.
    per_group: u32,
    ticks: u32,
}

//:include discrete/descent/curve.wgsl

@group(0) @binding(0) var<uniform> params: ResidentParams;
// The splines, as sample.wgsl has them: lengths of spans, edges of the data polygon and second
// derivatives at knots.
@group(0) @binding(1) var<storage, read> spans: array<real>;
@group(0) @binding(2) var<storage, read> edges: array<real>;
@group(0) @binding(3) var<storage, read> second: array<real>;
// The first knot of each spline, and the number of knots at the end.
@group(0) @binding(4) var<storage, read> starts: array<u32>;
// The slot of each spline, or NO_SLOT.
@group(0) @binding(5) var<storage, read> slot_of: array<u32>;
// 1/w² of the span after each knot, if the energy needs it.
@group(0) @binding(6) var<storage, read> taut: array<real>;
// Of each slot the numbers that `lanes` begins with, and the weights.
@group(0) @binding(7) var<storage, read> given: array<real>;
@group(0) @binding(8) var<storage, read> curves: array<DescentCurve>;
@group(0) @binding(9) var<storage, read_write> fixed: array<real>;
@group(0) @binding(10) var<storage, read_write> states: array<DescentState>;
@group(0) @binding(11) var<storage, read_write> lanes: array<real>;
@group(0) @binding(12) var<storage, read_write> displacements: array<real>;
// The params of the next descents, whose first word is the number of tasks; its workgroups; its
// tasks.
@group(0) @binding(13) var<storage, read_write> listed: array<atomic<u32>>;
@group(0) @binding(14) var<storage, read_write> workgroups: array<atomic<u32>>;
@group(0) @binding(15) var<storage, read_write> tasks: array<DescentTask>;
// Of each slot its tolerance, its energy without the regularisation, its squared decrement and its
// length.
@group(0) @binding(16) var<storage, read_write> records: array<real>;
// The vertices of each span, as displacements from the data point at its start.
@group(0) @binding(17) var<storage, read_write> vertices: array<real>;

// No twin: the curve has no place among those that descend.
const NO_SLOT: u32 = 4294967295u;

// Twin: descent_gpu/packing.rs
const GIVEN: u32 = 4u;
const NUMBERS: u32 = 14u;

// No twin: the host gives them in this order.
const GIVEN_TOLERANCE: u32 = 1u;
//:if F64
//:else
const GIVEN_ROUNDING: u32 = 3u;

// Twin: problem.rs
const ROUNDING: real = real(1.3113022e-7);
//:end

const RECORD: u32 = 4u;

// No twin: the codes of TERMINATIONS.
const TERMINATION_STATUS_RUNNING: u32 = 1u;
const TERMINATION_STATUS_LEFT: u32 = 7u;

// Twin: setup.rs
//:if F64
const TURNS_BACK: real = real(1.7763568394002505e-15);
//:else
const TURNS_BACK: real = real(9.5367431640625e-7);
//:end

//:include search.wgsl NAME=spline_of AT=starts[middle]

fn fixed_at(slot: u32, row: u32, number: u32) -> u32 {
    return curves[slot].fixed_start + (row * params.width + number) * params.side;
}

fn load_edge(slot: u32, row: u32) -> vec3<real> {
    var edge = vec3<real>();
    for (var c = 0u; c < params.dimension; c++) {
        edge[c] = fixed[fixed_at(slot, row, c)];
    }
    return edge;
}

fn store_edge(slot: u32, row: u32, edge: vec3<real>) {
    for (var c = 0u; c < params.dimension; c++) {
        fixed[fixed_at(slot, row, c)] = edge[c];
    }
}

// The span p + u (a + u (b + u c)).
struct Cubic {
    a: vec3<real>,
    b: vec3<real>,
    c: vec3<real>,
}

// The step to the next data point, and the span after a knot.
fn chord_of(knot: u32) -> vec3<real> {
    var chord = vec3<real>();
    for (var c = 0u; c < params.dimension; c++) {
        chord[c] = edges[knot * params.dimension + c];
    }
    return chord;
}

fn cubic_of(knot: u32, chord: vec3<real>) -> Cubic {
    let h = spans[knot];
    var start = vec3<real>();
    var end = vec3<real>();
    for (var c = 0u; c < params.dimension; c++) {
        start[c] = h * (h * second[knot * params.dimension + c]);
        end[c] = h * (h * second[(knot + 1u) * params.dimension + c]);
    }
    return Cubic(chord - (real(2) * start + end) / real(6), real(0.5) * start, (end - start) / real(6));
}

fn place_at(cubic: Cubic, u: real) -> vec3<real> {
    return u * (cubic.a + u * (cubic.b + u * cubic.c));
}

fn speed_at(cubic: Cubic, u: real) -> real {
    let v = cubic.a + u * (real(2) * cubic.b + (real(3) * u) * cubic.c);
    return sqrt(dot(v, v));
}

// The length of panel k by Simpson's rule. `before` is the speed at its start, and becomes that at
// its end.
fn panel_length(cubic: Cubic, k: u32, before: ptr<function, real>) -> real {
    let panel = real(1) / real(params.segments);
    let after = speed_at(cubic, real(k + 1u) * panel);
    let between = speed_at(cubic, (real(k) + real(0.5)) * panel);
    let length = panel / real(6) * (*before + real(4) * between + after);
    *before = after;
    return length;
}

// Divides the span after each knot into edges of about equal length.
//:include entry.wgsl ENTRY=divide TASKS=params.knots
    let spline = spline_of(0u, params.splines, task);
    let slot = slot_of[spline];
    if (slot == NO_SLOT || task + 1u == starts[spline + 1u]) {
        return;
    }
    let chord = chord_of(task);
    let cubic = cubic_of(task, chord);
    let n = params.segments;
    let panel = real(1) / real(n);
    var before = speed_at(cubic, real(0));
    var total = real(0);
    for (var k = 0u; k < n; k++) {
        total += panel_length(cubic, k, &before);
    }
    let first = (task - starts[spline]) * n;
    before = speed_at(cubic, real(0));
    var arc = real(0);
    var piece = 1u;
    var last = vec3<real>();
    var length = real(0);
    for (var k = 0u; k < n; k++) {
        let width = panel_length(cubic, k, &before);
        for (; piece < n; piece++) {
            let wanted = total * real(piece) * panel;
            if (k + 1u < n && arc + width < wanted) {
                break;
            }
            let part = select(real(0.5), (wanted - arc) / width, width > real(0));
            let here = place_at(cubic, (real(k) + part) * panel);
            let edge = here - last;
            store_edge(slot, first + piece - 1u, edge);
            length += sqrt(dot(edge, edge));
            last = here;
        }
        arc += width;
    }
    let edge = chord - last;
    store_edge(slot, first + n - 1u, edge);
    length += sqrt(dot(edge, edge));
    // The factor of the regularisation at the end of each edge, but for the mean edge of the curve.
    let factor = real(1) / sqrt(length / real(n));
    for (var k = 0u; k < n; k++) {
        fixed[fixed_at(slot, first + k, params.dimension)] = select(factor, real(0), k + 1u == n);
        fixed[fixed_at(slot, first + k, params.dimension + 1u)] = select(real(1), real(0), k == 0u);
        if (params.width > params.dimension + 2u) {
            fixed[fixed_at(slot, first + k, params.dimension + 2u)] = taut[task];
        }
    }
}

// What depends on the whole curve: the regularisation, and whether it turns back on itself.
//:include entry.wgsl ENTRY=prepare TASKS=params.slots
    let segments = curves[task].segments;
    let is_closed = curves[task].closed != 0u;
    var length = real(0);
    var is_folded = false;
    var before = load_edge(task, select(0u, segments - 1u, is_closed));
    var length_before = sqrt(dot(before, before));
    for (var j = 0u; j < segments; j++) {
        let edge = load_edge(task, j);
        let own = sqrt(dot(edge, edge));
        length += own;
        if (j > 0u || is_closed) {
            is_folded = is_folded || dot(before, edge) <= (TURNS_BACK - real(1)) * (length_before * own);
        }
        before = edge;
        length_before = own;
    }
    let h = length / real(segments);
    let root = sqrt(h);
    for (var j = 0u; j < segments; j++) {
        let at = fixed_at(task, j, params.dimension);
        fixed[at] = root * fixed[at];
    }
    if (!is_closed) {
        for (var k = 0u; k < params.width; k++) {
            fixed[fixed_at(task, segments, k)] = real(0);
        }
    }
    for (var k = 0u; k < params.given; k++) {
        let to = select(k + NUMBERS - GIVEN, k, k < GIVEN);
        lanes[task * params.numbers + to] = given[task * params.given + k];
    }
    let highest = given[task * params.given];
    lanes[task * params.numbers + NUMBERS + params.regularisation] = highest / h;
//:if F64
//:else
    lanes[task * params.numbers + GIVEN_ROUNDING] = ROUNDING * sqrt(real(0.5) * highest) / h;
//:end
    let termination = select(0u, TERMINATION_STATUS_LEFT, is_folded);
    states[task] = DescentState(termination, 0u, 0u, 0u, 0u, params.most_iterations);
}

// Lists the curves that run for the next descents.
//:include entry.wgsl ENTRY=list TASKS=params.slots
    if (states[task].termination <= TERMINATION_STATUS_RUNNING) {
        let place = atomicAdd(&listed[0], 1u);
        tasks[place] = DescentTask(task, params.ticks);
        atomicMax(&workgroups[0], place / params.per_group + 1u);
    }
}

// The vertices of the span after each knot, and with the first knot of a curve its record.
//:include entry.wgsl ENTRY=place TASKS=params.knots
    let spline = spline_of(0u, params.splines, task);
    let slot = slot_of[spline];
    if (slot == NO_SLOT) {
        return;
    }
    if (task == starts[spline]) {
        records[slot * RECORD] = lanes[slot * params.numbers + GIVEN_TOLERANCE];
        for (var k = 1u; k < RECORD; k++) {
            records[slot * RECORD + k] = lanes[slot * params.numbers + GIVEN + k];
        }
    }
    if (task + 1u == starts[spline + 1u]) {
        return;
    }
    let first = (task - starts[spline]) * params.segments;
    var at = vec3<real>();
    for (var k = 0u; k < params.segments; k++) {
        let row = first + k;
        // Every spline before this one has a knot without a span.
        let to = ((task - spline) * params.segments + k) * params.dimension;
        for (var c = 0u; c < params.dimension; c++) {
            let u = curves[slot].displacement_start + (row * params.dimension + c) * params.side;
            vertices[to + c] = at[c] + displacements[u];
        }
        at += load_edge(slot, row);
    }
}
