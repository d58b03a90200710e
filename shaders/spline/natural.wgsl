// Rows of the moment system of cubic splines through a curve's own knots, computed from spans and
// edges as they are needed: nothing but the data is in memory. Included by the kernels of
// linalg/ring. Twin: src/spline/natural.rs.
//
// Unknowns are the second derivatives M at the knots. Interior (and periodic) row i, with mu =
// before/(before + after)
// and lambda = 1 − mu:   mu M_{i−1} + 2 M_i + lambda M_{i+1} = 6 [x_{i−1}, x_i, x_{i+1}] y, so its excess is 3.
// Natural end: M = 0. Clamped end: 2 M_0 + M_1 = 6/h ((y_1 − y_0)/h − v).

// Length of the span after each knot; 0 after a curve's last.
@group(0) @binding(4) var<storage, read> spans: array<real>;
// Edges: the step from the point at each knot to the next; 0 after a curve's last. Not the points,
// whose differences would lose what two points close to each other have apart.
@group(0) @binding(5) var<storage, read> edges: array<real>;
// Two derivatives a curve, at its first and last knot; read only where the flags say clamped.
@group(0) @binding(6) var<storage, read> end_derivatives: array<real>;

// Twin: packing.rs
const FLAG_CLAMPED_START: u32 = 4u;
const FLAG_CLAMPED_END: u32 = 8u;

//:include linalg/ring/read.wgsl NAME=edge_at ARRAY=edges
//:include linalg/ring/read.wgsl NAME=end_derivative ARRAY=end_derivatives

fn span_before(system: System, i: u32) -> u32 {
    return system.start + select(i, system.rows, i == 0u) - 1u;
}

fn load_row(system: System, i: u32) -> Row {
    if (is_end(system, i)) {
        if (i == 0u && (system.flags & FLAG_CLAMPED_START) != 0u) {
            return Row(real(3), real(0), real(-1));
        }
        if (i > 0u && (system.flags & FLAG_CLAMPED_END) != 0u) {
            return Row(real(3), real(-1), real(0));
        }
        return Row(real(1), real(0), real(0));
    }
    let before = spans[span_before(system, i)];
    let after = spans[system.start + i];
    let both = before + after;
    return Row(real(3), -(before / both), -(after / both));
}

fn load_rhs(system: System, i: u32) -> columns {
    let k = system.start + i;
    if (is_end(system, i)) {
        if (i == 0u && (system.flags & FLAG_CLAMPED_START) != 0u) {
            let h = spans[k];
            return (real(6) / h) * (edge_at(k) / h - end_derivative(2u * system.index));
        }
        if (i > 0u && (system.flags & FLAG_CLAMPED_END) != 0u) {
            let h = spans[k - 1u];
            return (real(6) / h) * (end_derivative(2u * system.index + 1u) - edge_at(k - 1u) / h);
        }
        return columns();
    }
    let b = span_before(system, i);
    let before = spans[b];
    let after = spans[k];
    let slope_after = edge_at(k) / after;
    let slope_before = edge_at(b) / before;
    return (real(6) / (before + after)) * (slope_after - slope_before);
}

fn store_kept(system: System, i: u32, x: columns) {
    store_repeated(system, i, x);
}
