// A weighted sum of energies over the windows that start at one edge. Compiled in are the energies that are defined:
// LENGTH, TENSION, BENDING, VARIATION, TORSION, CUSTOM, GAUGE and ATTACHMENT, each the index of its weight; a user's text
// is CUSTOM_WGSL, its functions begin with CUSTOM_NAME, and its terms see CUSTOM_EDGES edges. The host makes the
// definitions: src/discrete/compose.rs. Of torsion, TORSION_CURVATURE is the index of ε.
//
// A kernel that includes this defines
//     alias Curve = …;        a struct with the members `segments: u32` (edges) and `closed: u32` (0 or 1)
//     fn load_weight(curve: Curve, index: u32) -> real
//:include discrete/energy/window.wgsl
//:if POWER
//:include linalg/power.wgsl
//:end
//:if ACROSS
//:include discrete/energy/across.wgsl
//:end
//:if LENGTH
//:include discrete/energy/length.wgsl
//:end
//:if TENSION
//:include discrete/energy/tension.wgsl
//:end
//:if BENDING
//:include discrete/energy/bending.wgsl
//:end
//:if VARIATION
//:include discrete/energy/variation.wgsl
//:end
//:if TORSION
//:include discrete/energy/torsion.wgsl
//:end
//:if GAUGE
//:include discrete/energy/gauge.wgsl
//:end
//:if ATTACHMENT
//:include discrete/energy/attachment.wgsl
//:end
//:if CUSTOM
$CUSTOM_WGSL
//:end

struct Weights {
//:if LENGTH
    length: real,
//:end
//:if TENSION
    tension: real,
//:end
//:if BENDING
    bending: real,
//:end
//:if VARIATION
    variation: real,
//:end
//:if TORSION
    torsion: real,
    torsion_curvature: real,
//:end
//:if CUSTOM
    custom: real,
//:end
//:if GAUGE
    gauge: real,
//:end
//:if ATTACHMENT
    attachment: real,
//:end
}

fn load_weights(curve: Curve) -> Weights {
    var weights = Weights();
//:if LENGTH
    weights.length = load_weight(curve, $LENGTHu);
//:end
//:if TENSION
    weights.tension = load_weight(curve, $TENSIONu);
//:end
//:if BENDING
    weights.bending = load_weight(curve, $BENDINGu);
//:end
//:if VARIATION
    weights.variation = load_weight(curve, $VARIATIONu);
//:end
//:if TORSION
    weights.torsion = load_weight(curve, $TORSIONu);
    weights.torsion_curvature = load_weight(curve, $TORSION_CURVATUREu);
//:end
//:if CUSTOM
    weights.custom = load_weight(curve, $CUSTOMu);
//:end
//:if GAUGE
    weights.gauge = load_weight(curve, $GAUGEu);
//:end
//:if ATTACHMENT
    weights.attachment = load_weight(curve, $ATTACHMENTu);
//:end
    return weights;
}

// A window of a curve before any of its edges.
fn window_of(curve: Curve, weights: Weights) -> Window {
    var w = Window();
    w.segments = real(curve.segments);
//:if TORSION
    w.torsion_curvature = weights.torsion_curvature;
//:end
    return w;
}

// Values alone: of the energies, and of the gauge. `edges` of the window's edges exist.
fn window_value(w: Window, weights: Weights, edges: u32) -> vec2<real> {
    var value = real(0);
    var gauge = real(0);
    if (edges >= 1u) {
//:if LENGTH
        value += weights.length * length_value(w);
//:end
//:if TENSION
        value += weights.tension * tension_value(w);
//:end
    }
//:if EDGES_2
    if (edges >= 2u) {
//:if BENDING
        value += weights.bending * bending_value(w);
//:end
//:if GAUGE
        gauge = weights.gauge * gauge_value(w);
//:end
    }
//:end
//:if EDGES_3
    if (edges >= 3u) {
//:if VARIATION
        value += weights.variation * variation_value(w);
//:end
//:if TORSION
        value += weights.torsion * torsion_value(w);
//:end
    }
//:end
//:if CUSTOM
    if (edges >= $CUSTOM_EDGESu) {
        value += weights.custom * $CUSTOM_NAME_value(w);
    }
//:end
    return vec2<real>(value, gauge);
}

// Values and partial derivatives.
fn window_gradient(w: Window, weights: Weights, edges: u32) -> Partials {
    var sum = Partials();
    if (edges >= 1u) {
//:if LENGTH
        sum = add_partials(sum, weights.length, length_gradient(w));
//:end
//:if TENSION
        sum = add_partials(sum, weights.tension, tension_gradient(w));
//:end
    }
//:if EDGES_2
    if (edges >= 2u) {
//:if BENDING
        sum = add_partials(sum, weights.bending, bending_gradient(w));
//:end
//:if GAUGE
        var gauge = gauge_gradient(w);
        sum.gauge = weights.gauge * gauge.value;
        gauge.value = real(0);
        sum = add_partials(sum, weights.gauge, gauge);
//:end
    }
//:end
//:if EDGES_3
    if (edges >= 3u) {
//:if VARIATION
        sum = add_partials(sum, weights.variation, variation_gradient(w));
//:end
//:if TORSION
        sum = add_partials(sum, weights.torsion, torsion_gradient(w));
//:end
    }
//:end
//:if CUSTOM
    if (edges >= $CUSTOM_EDGESu) {
        sum = add_partials(sum, weights.custom, $CUSTOM_NAME_gradient(w));
    }
//:end
    return sum;
}

// Second partial derivatives.
fn window_hessian(w: Window, weights: Weights, edges: u32) -> SecondPartials {
    var sum = SecondPartials();
    if (edges >= 1u) {
//:if LENGTH
        sum = add_seconds(sum, weights.length, length_hessian(w));
//:end
//:if TENSION
        sum = add_seconds(sum, weights.tension, tension_hessian(w));
//:end
    }
//:if EDGES_2
    if (edges >= 2u) {
//:if BENDING
        sum = add_seconds(sum, weights.bending, bending_hessian(w));
//:end
//:if GAUGE
        sum = add_seconds(sum, weights.gauge, gauge_hessian(w));
//:end
    }
//:end
//:if EDGES_3
    if (edges >= 3u) {
//:if VARIATION
        sum = add_seconds(sum, weights.variation, variation_hessian(w));
//:end
//:if TORSION
        sum = add_seconds(sum, weights.torsion, torsion_hessian(w));
//:end
    }
//:end
//:if CUSTOM
    if (edges >= $CUSTOM_EDGESu) {
        sum = add_seconds(sum, weights.custom, $CUSTOM_NAME_hessian(w));
    }
//:end
    return sum;
}

// By the edge e = Δs T: (I − T Tᵀ) ∂/∂T / Δs + T ∂/∂Δs.
fn edge_gradient(t: vector, r: real, by_tangent: vector, by_length: real) -> vector {
    return r * (by_tangent - dot(t, by_tangent) * t) + by_length * t;
}

// Where edge j of a closed curve stands, −m ≤ j < 2m; an open curve has no other edges than its own.
fn wrapped(curve: Curve, j: i32) -> u32 {
    let m = i32(curve.segments);
    return u32(select(select(j, j - m, j >= m), j + m, j < 0));
}

// Whether a curve has an edge j.
fn has_edge(curve: Curve, j: i32) -> bool {
    return curve.closed != 0u || (j >= 0 && j < i32(curve.segments));
}

// How many edges from j ≥ 0 on follow each other, up to three.
fn edges_from(curve: Curve, j: i32) -> u32 {
    return select(u32(clamp(i32(curve.segments) - j, 0, 3)), 3u, curve.closed != 0u);
}

// Shifts a window on by one edge, and takes `edge` for the last of its $WIDTH.
fn shifted(window: Window, edge: vector) -> Window {
    var w = window;
    let length = sqrt(dot(edge, edge));
    let inverse = real(1) / length;
    let tangent = inverse * edge;
//:if EDGES_2
    w.t0 = window.t1;
    w.s0 = window.s1;
    w.r0 = window.r1;
//:else
    w.t0 = tangent;
    w.s0 = length;
    w.r0 = inverse;
//:end
//:if EDGES_3
    w.t1 = window.t2;
    w.s1 = window.s2;
    w.r1 = window.r2;
    w.t2 = tangent;
    w.s2 = length;
    w.r2 = inverse;
//:else
    w.t1 = tangent;
    w.s1 = length;
    w.r1 = inverse;
//:end
    return w;
}
