// Energies, gradients and Hessians of discrete curves. Each thread evaluates a block of a curve's
// vertices; the host sums the energies of blocks.
// Twin: src/discrete/evaluate.rs.

struct EvaluateParams {
    blocks: u32,
    // Weights per curve.
    weights: u32,
}

struct EvaluateCurve {
    // The curve's first vertex and first edge. Every curve has room for as many edges as vertices.
    start: u32,
    segments: u32,
    closed: u32,
    index: u32,
}

struct VertexRange {
    curve: u32,
    // Vertices begin … end − 1 of the curve.
    begin: u32,
    end: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: EvaluateParams;
@group(0) @binding(1) var<storage, read> curves: array<EvaluateCurve>;
@group(0) @binding(2) var<storage, read> blocks: array<VertexRange>;
@group(0) @binding(3) var<storage, read> weight_table: array<real>;
// `edges` has for each edge: its $DIM numbers; 1 if the vertex at its end is not a data point, else
// 0; and with TAUT 1/w², where w is the width of its span. `offsets` has for each vertex: its $DIM
// numbers of f − p, and their weight.
@group(0) @binding(4) var<storage, read> edges: array<real>;
@group(0) @binding(5) var<storage, read> offsets: array<real>;
// Energy, regularisation and slope of a block.
@group(0) @binding(6) var<storage, read_write> sums: array<real>;
// Gradients, or the direction whose slope is wanted.
@group(0) @binding(7) var<storage, read_write> gradients: array<real>;
// $BLOCKS blocks of $DIM × $DIM numbers per vertex: with itself and with the next vertices.
@group(0) @binding(8) var<storage, read_write> hessians: array<real>;

alias Curve = EvaluateCurve;

fn load_weight(curve: Curve, index: u32) -> real {
    return weight_table[curve.index * params.weights + index];
}

//:include discrete/energy/mod.wgsl
//:include discrete/edges/swept.wgsl
//:include discrete/hessian.wgsl

//:if TAUT
const EDGE_NUMBERS: u32 = $DIMu + 2u;
//:else
const EDGE_NUMBERS: u32 = $DIMu + 1u;
//:end

fn load_edge(curve: Curve, j: u32) -> vector {
    let at = (curve.start + j) * EDGE_NUMBERS;
//:if SPATIAL
    return vector(edges[at], edges[at + 1u], edges[at + 2u]);
//:else
    return vector(edges[at], edges[at + 1u]);
//:end
}

fn load_free(curve: Curve, j: u32) -> real {
    return edges[(curve.start + j) * EDGE_NUMBERS + $DIMu];
}

//:if TAUT
fn load_taut(curve: Curve, j: u32) -> real {
    return edges[(curve.start + j) * EDGE_NUMBERS + $DIMu + 1u];
}
//:end

fn load_offset(curve: Curve, v: u32) -> vector {
    let at = (curve.start + v) * ($DIMu + 1u);
//:if SPATIAL
    return vector(offsets[at], offsets[at + 1u], offsets[at + 2u]);
//:else
    return vector(offsets[at], offsets[at + 1u]);
//:end
}

//:if ATTACHMENT
fn load_anchor(curve: Curve, v: u32) -> Anchor {
    var anchor = Anchor();
    anchor.spring = offsets[(curve.start + v) * ($DIMu + 1u) + $DIMu];
    return anchor;
}
//:end

fn store_gradient(curve: Curve, v: u32, gradient: vector) {
    let at = (curve.start + v) * $DIMu;
//:unroll c 0..$DIM
    gradients[at + $cu] = gradient[$c];
//:end
}

fn load_direction(curve: Curve, v: u32) -> vector {
    let at = (curve.start + v) * $DIMu;
//:if SPATIAL
    return vector(gradients[at], gradients[at + 1u], gradients[at + 2u]);
//:else
    return vector(gradients[at], gradients[at + 1u]);
//:end
}

fn load_edge_direction(curve: Curve, j: u32) -> vector {
    let next = select(j + 1u, 0u, curve.closed != 0u && j + 1u == curve.segments);
    return load_direction(curve, next) - load_direction(curve, j);
}

//:include discrete/edges.wgsl SWEEP=sweep_gradient EDGE=load_edge OFFSET=load_offset HOLD=load_anchor DERIVATIVES=1 STORE=store_gradient
//:include discrete/edges.wgsl SWEEP=sweep_slope EDGE=load_edge OFFSET=load_offset HOLD=load_anchor DERIVATIVES=1 DIRECTION=load_edge_direction DIRECTION_AT=load_direction
//:include discrete/edges.wgsl SWEEP=sweep_value EDGE=load_edge OFFSET=load_offset HOLD=load_anchor

fn store_sums(block: u32, swept: Swept) {
    sums[3u * block] = swept.energy;
    sums[3u * block + 1u] = swept.regularisation;
    sums[3u * block + 2u] = swept.slope;
}

//:include entry.wgsl ENTRY=gradient TASKS=params.blocks
    let range = blocks[task];
    let curve = curves[range.curve];
    store_sums(task, sweep_gradient(curve, load_weights(curve), range.begin, range.end));
}

//:include entry.wgsl ENTRY=slope TASKS=params.blocks
    let range = blocks[task];
    let curve = curves[range.curve];
    store_sums(task, sweep_slope(curve, load_weights(curve), range.begin, range.end));
}

//:include entry.wgsl ENTRY=value TASKS=params.blocks
    let range = blocks[task];
    let curve = curves[range.curve];
    store_sums(task, sweep_value(curve, load_weights(curve), range.begin, range.end));
}

fn edge_or_unit(curve: Curve, j: i32) -> vector {
    if (has_edge(curve, j)) {
        return load_edge(curve, wrapped(curve, j));
    }
    return unit_edge();
}

fn add_to_hessian(curve: Curve, range: VertexRange, v: i32, k: u32, block: matrix) {
    if (v < i32(range.begin) || v >= i32(range.end)) {
        return;
    }
    let at = ((curve.start + u32(v)) * $BLOCKSu + k) * $DIMu * $DIMu;
//:unroll a 0..$DIM
//:unroll b 0..$DIM
    hessians[at + $au * $DIMu + $bu] += block[$b][$a];
//:end
//:end
}

// Adds the blocks of a term for the edges of the window from edge j: edge j is vertex j + 1 minus
// vertex j.
fn add_term(curve: Curve, range: VertexRange, j: i32, w: Window, weight: real, p: Partials, h: SecondPartials) {
//:unroll j 0..$WIDTH
    let e$j$j = weight * (edge_block(w.t$j, w.r$j, w.t$j, w.r$j, h.t$j$j, h.m$j$j, h.m$j$j, h.s$j$j)
        + edge_curvature(w.t$j, w.r$j, p.t$j, p.s$j));
    add_to_hessian(curve, range, j + $j, 0u, e$j$j);
    add_to_hessian(curve, range, j + $j, 1u, real(-1) * e$j$j);
    add_to_hessian(curve, range, j + $(j+1), 0u, e$j$j);
//:unroll k $(j+1)..$WIDTH
    let e$j$k = weight * edge_block(w.t$j, w.r$j, w.t$k, w.r$k, h.t$j$k, h.m$j$k, h.m$k$j, h.s$j$k);
    add_to_hessian(curve, range, j + $j, $ku - $ju, e$j$k);
    add_to_hessian(curve, range, j + $j, $(k+1)u - $ju, real(-1) * e$j$k);
//:if $k == $(j+1)
    add_to_hessian(curve, range, j + $k, 0u, real(-1) * (e$j$k + transpose(e$j$k)));
//:else
    add_to_hessian(curve, range, j + $(j+1), $ku - $(j+1)u, real(-1) * e$j$k);
//:end
    add_to_hessian(curve, range, j + $(j+1), $ku - $ju, e$j$k);
//:end
//:end
}

// Adds the terms over the window from edge j one after the other, block by block: all together
// would need more than a thread's registers.
fn add_window(curve: Curve, range: VertexRange, j: i32, w: Window, weights: Weights) {
    let edges = edges_from(curve, j);
//:each TERM
    if (edges >= $EDGESu) {
        add_term(curve, range, j, w, weights.$NAME, $NAME_gradient(w), $NAME_hessian(w));
    }
//:end
//:each REGULARISATION_TERM
    if (edges >= $EDGESu) {
        add_term(curve, range, j, w, weights.regularisation, $NAME_gradient(w), $NAME_hessian(w));
    }
//:end
}

//:include entry.wgsl ENTRY=hessian TASKS=params.blocks
    let range = blocks[task];
    let curve = curves[range.curve];
    let weights = load_weights(curve);
    for (var i = range.begin * $BLOCKSu * $DIMu * $DIMu; i < range.end * $BLOCKSu * $DIMu * $DIMu; i++) {
        hessians[curve.start * $BLOCKSu * $DIMu * $DIMu + i] = real(0);
    }
//:if ATTACHMENT
    for (var v = range.begin; v < range.end; v++) {
        let held = anchor_hessian(load_anchor(curve, v), vector());
        add_to_hessian(curve, range, i32(v), 0u, weights.attachment * held);
    }
//:end
    // Windows have $VERTICES vertices.
    let begin = select(max(i32(range.begin) - $WIDTH, 0), i32(range.begin) - $WIDTH, curve.closed != 0u);
    var w = window_of(curve, weights);
    for (var j = begin; j < begin + $WIDTH - 1; j++) {
        w = shifted(w, edge_or_unit(curve, j));
    }
    for (var j = begin; j < i32(range.end); j++) {
        w = shifted(w, edge_or_unit(curve, j + $WIDTH - 1));
        w = placed(w, curve, j);
        add_window(curve, range, j, w, weights);
    }
}
