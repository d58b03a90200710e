// A weighted sum of energies over the windows that start at one edge. It contains the terms of the
// list TERM. Each has the NAME that its functions begin with, its FILE or its text WGSL, the index
// of its WEIGHT, and its number of EDGES. REGULARISATION and ATTACHMENT, if defined, are the
// indices of their weights. The list REGULARISATION_TERM has the regularisation's terms. The host
// makes the definitions: src/discrete/compose.rs.
//
// A kernel that includes this file defines
//     alias Curve = …;  a struct with members `segments: u32` (edges) and `closed: u32` (0 or 1)
//     fn load_weight(curve: Curve, index: u32) -> real
//     fn load_free(curve: Curve, j: u32) -> real
//         with REGULARISATION: the factor of the vertex at the end of edge j
//     fn load_taut(curve: Curve, j: u32) -> real
//         with TAUT: 1/w², where w is the width of edge j's span
//     fn load_penalty(curve: Curve, j: u32, k: u32) -> Penalty
//         with PENALTIES: penalty k at the end of edge j
//     fn load_region(curve: Curve, v: u32, layer: u32) -> RegionPenalty
//         with REGIONS: the region penalty of vertex v in a layer
//     fn load_place(curve: Curve, v: u32) -> vector
//         with SURFACE: the position of vertex v of the base
//:include discrete/energy/window.wgsl
//:if SURFACE
//:include discrete/within.wgsl
//:end
//:each TERM
//:if WGSL
// The text of a custom energy may call what the energies here call.
//:once include linalg/power.wgsl
//:once include discrete/energy/across.wgsl
$WGSL
//:else
//:include $FILE
//:end
//:end
//:each REGULARISATION_TERM
//:once include $FILE
//:end
//:if ATTACHMENT
//:include discrete/energy/attachment.wgsl
//:end
//:if REGIONS
//:include discrete/energy/region_penalty.wgsl

// The energy of a vertex's region penalties at the displacement u.
fn regions_value(curve: Curve, v: u32, u: vector) -> real {
    var value = real(0);
//:unroll k 0..$REGIONS
    value += region_value(load_region(curve, v, $ku), u);
//:end
    return value;
}

fn regions_gradient(curve: Curve, v: u32, u: vector) -> vector {
    var gradient = vector();
//:unroll k 0..$REGIONS
    gradient += region_gradient(load_region(curve, v, $ku), u);
//:end
    return gradient;
}

fn regions_hessian(curve: Curve, v: u32, u: vector) -> matrix {
    var hessian = matrix();
//:unroll k 0..$REGIONS
    hessian += region_hessian(load_region(curve, v, $ku), u);
//:end
    return hessian;
}
//:end

struct Weights {
//:each TERM
    $NAME: real,
//:end
//:if REGULARISATION
    regularisation: real,
//:end
//:if ATTACHMENT
    attachment: real,
//:end
    torsion_curvature: real,
}

fn load_weights(curve: Curve) -> Weights {
    var weights = Weights();
//:each TERM
    weights.$NAME = load_weight(curve, $WEIGHTu);
//:end
//:if REGULARISATION
    weights.regularisation = load_weight(curve, $REGULARISATIONu);
//:end
//:if ATTACHMENT
    weights.attachment = load_weight(curve, $ATTACHMENTu);
//:end
    weights.torsion_curvature = load_weight(curve, $TORSION_CURVATUREu);
    return weights;
}

// The window of a curve before its first edge.
fn window_of(curve: Curve, weights: Weights) -> Window {
    var w = Window();
    w.segments = real(curve.segments);
    w.torsion_curvature = weights.torsion_curvature;
    return w;
}

// The values of the energies and of the regularisation. `edges` of the window's edges exist.
fn window_value(w: Window, weights: Weights, edges: u32) -> vec2<real> {
    var value = real(0);
    var regularisation = real(0);
//:each TERM
    if (edges >= $EDGESu) {
        value += weights.$NAME * $NAME_value(w);
    }
//:end
//:each REGULARISATION_TERM
    if (edges >= $EDGESu) {
        regularisation += weights.regularisation * $NAME_value(w);
    }
//:end
    return vec2<real>(value, regularisation);
}

// Values and partial derivatives.
fn window_gradient(w: Window, weights: Weights, edges: u32) -> Partials {
    var sum = Partials();
//:each TERM
    if (edges >= $EDGESu) {
        sum = add_partials(sum, weights.$NAME, $NAME_gradient(w));
    }
//:end
//:each REGULARISATION_TERM
    if (edges >= $EDGESu) {
        var regularisation = $NAME_gradient(w);
        sum.regularisation += weights.regularisation * regularisation.value;
        regularisation.value = real(0);
        sum = add_partials(sum, weights.regularisation, regularisation);
    }
//:end
    return sum;
}

// Second partial derivatives.
fn window_hessian(w: Window, weights: Weights, edges: u32) -> SecondPartials {
    var sum = SecondPartials();
//:each TERM
    if (edges >= $EDGESu) {
        sum = add_seconds(sum, weights.$NAME, $NAME_hessian(w));
    }
//:end
//:each REGULARISATION_TERM
    if (edges >= $EDGESu) {
        sum = add_seconds(sum, weights.regularisation, $NAME_hessian(w));
    }
//:end
    return sum;
}

// The gradient by the edge e = Δs T: (I − T Tᵀ) ∂/∂T / Δs + T ∂/∂Δs.
fn edge_gradient(t: vector, r: real, by_tangent: vector, by_length: real) -> vector {
    return r * (by_tangent - dot(t, by_tangent) * t) + by_length * t;
}

// The index of edge j of a closed curve, −$WIDTH ≤ j < m + $WIDTH. An open curve only has its own
// edges.
fn wrapped(curve: Curve, j: i32) -> u32 {
    let m = i32(curve.segments);
//:if WIDE
    // A triangle has fewer edges than a window, so the window may go around it more than once.
    return u32(j + 2 * m) % curve.segments;
//:else
    return u32(select(select(j, j - m, j >= m), j + m, j < 0));
//:end
}

// Whether a curve has an edge j.
fn has_edge(curve: Curve, j: i32) -> bool {
    return curve.closed != 0u || (j >= 0 && j < i32(curve.segments));
}

// The number of ends of an open curve that the two edges from edge j touch.
fn ends_at(curve: Curve, j: i32) -> real {
    let is_first = j == 0;
    let is_last = j + 2 == i32(curve.segments);
    let touched = select(real(0), real(1), is_first) + select(real(0), real(1), is_last);
    return select(real(0), touched, curve.closed == 0u && j + 2 <= i32(curve.segments));
}

// The number of consecutive edges from edge j ≥ 0, at most $WIDTH.
fn edges_from(curve: Curve, j: i32) -> u32 {
    return select(u32(clamp(i32(curve.segments) - j, 0, $WIDTH)), $WIDTHu, curve.closed != 0u);
}

// Sets what depends on the position of the window along the curve, for the regularisation, tautness
// and penalties.
fn placed(window: Window, curve: Curve, j: i32) -> Window {
    var w = window;
//:if TAUT
    if (has_edge(curve, j)) {
        w.taut = load_taut(curve, wrapped(curve, j));
    }
//:end
//:if PENALTIES
    if (has_edge(curve, j)) {
//:unroll k 0..$PENALTIES
        w.penalty$k = load_penalty(curve, wrapped(curve, j), $ku);
//:end
    }
//:end
//:if REGULARISATION
    if (has_edge(curve, j)) {
        w.free = load_free(curve, wrapped(curve, j));
    }
//:if SMOOTH_REGULARISATION
    w.free_after = real(0);
    if (has_edge(curve, j + 1)) {
        w.free_after = load_free(curve, wrapped(curve, j + 1));
    }
    // A short edge gives the tangent of an end, which is then not free.
    w.ends = select(real(0), ends_at(curve, j), min(w.s0, w.s1) > SHORT_EDGE * (w.s0 + w.s1));
//:end
//:end
    return w;
}

//:if SURFACE
// Sets the frame of the surface at the vertex after the window's first edge.
fn framed(window: Window, frame: Frame) -> Window {
    var w = window;
    w.normal = frame.normal;
    w.shape = frame.shape;
//:if SURFACE_WGSL
    w.place = frame.place;
    w.unit = frame.unit;
//:end
    return w;
}

// The index of vertex v ≥ −$WIDTH, which may be past the last. On an open curve it is clamped.
fn vertex_row(curve: Curve, v: i32) -> u32 {
    let count = i32(curve.segments) + select(1, 0, curve.closed != 0u);
    if (curve.closed != 0u) {
        return wrapped(curve, v);
    }
    return u32(clamp(v, 0, count - 1));
}
//:end

// Moves a window on by one edge. `edge` becomes its last edge.
fn shifted(window: Window, edge: vector) -> Window {
    var w = window;
//:unroll k 0..$LAST
    w.t$k = window.t$(k+1);
    w.s$k = window.s$(k+1);
    w.r$k = window.r$(k+1);
//:end
    let length = sqrt(dot(edge, edge));
    let inverse = real(1) / length;
    w.t$LAST = inverse * edge;
    w.s$LAST = length;
    w.r$LAST = inverse;
    return w;
}
