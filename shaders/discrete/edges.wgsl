// fn $SWEEP(curve: Curve, weights: Weights, first: u32, last: u32) -> Swept walks the vertices
// first … last − 1 of a curve with a window of $WIDTH edges in registers. It sums the terms whose
// first edge is one of first … last − 1. For derivatives it computes the terms of up to $WIDTH
// edges before once more.
// Twin: `Edges` in src/discrete/edges.rs.
//
// Include it after energy/mod.wgsl and edges/swept.wgsl, once for every sweep of a kernel, with
// these definitions:
//     SWEEP         the function's name
//     EDGE          fn(curve: Curve, j: u32) -> vector: edge j, 0 ≤ j < segments
//     OFFSET        with ATTACHMENT: fn(curve: Curve, v: u32) -> vector: f − p at vertex v
//     HOLD          with ATTACHMENT: fn(curve: Curve, v: u32) -> Anchor: the anchor of vertex v,
//                   zero without a data point
//     DERIVATIVES   with STORE or DIRECTION
//     STORE         for gradients: fn(curve: Curve, v: u32, gradient: vector), called for every
//                   vertex once, in order
//     DIRECTION     for the slope Σ g·p: fn(curve: Curve, j: u32) -> vector: p at the end of
//                   edge j minus p at its start
//     PLACE         with REGIONS or SURFACE: fn(curve: Curve, v: u32) -> vector: the
//                   displacement of vertex v
//     STORE_PUSH    with SURFACE: fn(curve: Curve, v: u32, push: real): n·g of vertex v, which
//                   the gradient does not contain
//     DIRECTION_AT  with DIRECTION, and ATTACHMENT, REGIONS or SURFACE:
//                   fn(curve: Curve, v: u32) -> vector: p at vertex v

fn $SWEEP(curve: Curve, weights: Weights, first: u32, last: u32) -> Swept {
    var swept = Swept();
    var w = window_of(curve, weights);
    // The gradient at a vertex needs the derivative by the edge before it, to which earlier windows
    // add.
//:if STORE
    let halo = $WIDTH;
//:else
//:if DIRECTION
    let halo = $WIDTH - 1;
//:else
    let halo = 0;
//:end
//:end
    let begin = select(max(i32(first) - halo, 0), i32(first) - halo, curve.closed != 0u);
    for (var j = begin; j < begin + $WIDTH - 1; j++) {
        var edge = unit_edge();
        if (has_edge(curve, j)) {
            edge = $EDGE(curve, wrapped(curve, j));
        }
        w = shifted(w, edge);
    }
    // The derivatives by tangents and lengths of the window's edges so far. Those of the last edge
    // are new.
//:unroll k 0..$WIDTH
    var t$k = vector();
    var s$k = real(0);
//:end
    var previous = vector();
//:if SURFACE
    let surface = load_surface(curve);
    // The derivative by the position of vertex j from the window before, and the normal there.
    var pull = vector();
    let start = vertex_row(curve, begin);
    var normal = frame_at(surface, load_place(curve, start) + $PLACE(curve, start)).normal;
//:end
    for (var j = begin; j < i32(last); j++) {
        var edge = unit_edge();
        if (has_edge(curve, j + $WIDTH - 1)) {
            edge = $EDGE(curve, wrapped(curve, j + $WIDTH - 1));
        }
        w = shifted(w, edge);
        let is_own = j >= i32(first);
        w = placed(w, curve, j);
        let edges = edges_from(curve, j);
//:if SURFACE
        let next = vertex_row(curve, j + 1);
        w = framed(w, frame_at(surface, load_place(curve, next) + $PLACE(curve, next)));
//:end
//:if DERIVATIVES
        let p = window_gradient(w, weights, edges);
        let by_edge = edge_gradient(w.t0, w.r0, t0 + p.t0, s0 + p.s0);
//:unroll k 0..$LAST
        t$k = t$(k+1) + p.t$(k+1);
        s$k = s$(k+1) + p.s$(k+1);
//:end
        let value = vec2<real>(p.value, p.regularisation);
//:else
        let value = window_value(w, weights, edges);
//:end
        if (is_own) {
            swept.energy += value.x;
            swept.regularisation += value.y;
//:if ATTACHMENT
            let offset = $OFFSET(curve, u32(j));
            let anchor = $HOLD(curve, u32(j));
            swept.energy += weights.attachment * anchor_value(anchor, offset);
//:end
//:if REGIONS
            let place = $PLACE(curve, u32(j));
            swept.energy += regions_value(curve, u32(j), place);
//:end
//:if STORE
            var gradient = previous - by_edge;
//:if ATTACHMENT
            gradient += weights.attachment * anchor_gradient(anchor, offset);
//:end
//:if REGIONS
            gradient += regions_gradient(curve, u32(j), place);
//:end
//:if SURFACE
            gradient += pull;
            let push = dot(gradient, normal);
            gradient -= push * normal;
            $STORE_PUSH(curve, u32(j), push);
            swept.slope += dot(gradient, $DIRECTION_AT(curve, u32(j)));
//:end
            $STORE(curve, u32(j), gradient);
//:end
//:if SURFACE
//:else
//:if DIRECTION
            if (has_edge(curve, j)) {
                swept.slope += dot(by_edge, $DIRECTION(curve, u32(j)));
            }
//:if ATTACHMENT
            let pull = weights.attachment * anchor_gradient(anchor, offset);
            swept.slope += dot(pull, $DIRECTION_AT(curve, u32(j)));
//:end
//:if REGIONS
            swept.slope += dot(regions_gradient(curve, u32(j), place), $DIRECTION_AT(curve, u32(j)));
//:end
//:end
//:end
        }
//:if DERIVATIVES
        previous = by_edge;
//:if SURFACE
        pull = p.x;
        normal = w.normal;
//:end
//:end
    }
    return swept;
}
