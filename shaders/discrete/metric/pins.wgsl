// The pins of a curve, where it may turn: their numbers, and what couples neighbours. See metric/hats.wgsl.
// Twin: src/discrete/metric/hats.rs.

// No twin: what the CPU has in structs. Numbers a pin: own and coupling integrals, tangent, inverse block, block with the border, turn.
const PIN_TANGENT: u32 = 2u;
const PIN_INVERSE: u32 = 2u + $DIMu;
const PIN_BORDER: u32 = 2u + $DIMu + $DIMu * $DIMu;
const PIN_TURN: u32 = 2u + $DIMu + 2u * $DIMu * $DIMu;
const PIN_NUMBERS: u32 = 2u + 2u * $DIMu + 2u * $DIMu * $DIMu;

fn pin_at(curve: Curve, k: u32, number: u32) -> u32 {
    return curve.pin_section + (k * PIN_NUMBERS + number) * $SIDEu;
}

fn pin_vector(curve: Curve, k: u32, number: u32) -> vector {
    return work_vector(pin_at(curve, k, number), 0u);
}

fn store_pin_vector(curve: Curve, k: u32, number: u32, x: vector) {
    store_vector(pin_at(curve, k, number), 0u, x);
}

fn pin_matrix(curve: Curve, k: u32, number: u32) -> matrix {
    return work_matrix(pin_at(curve, k, number), 0u);
}

fn store_pin_matrix(curve: Curve, k: u32, number: u32, x: matrix) {
    store_matrix(pin_at(curve, k, number), 0u, x);
}

// P x
fn across_tangent(tangent: vector, x: vector) -> vector {
    return x - dot(tangent, x) * tangent;
}

fn coupling(both: real, from_tangent: vector, to_tangent: vector) -> matrix {
    let projected = diagonal(real(1)) - outer(to_tangent, to_tangent);
    return both * (projected - outer(projected * from_tangent, from_tangent));
}

// One row past the span from pin k to the next.
fn span_end(curve: Curve, k: u32) -> u32 {
    if (k + 1u < curve.pin_count) {
        return pins[curve.first_pin + k + 1u];
    }
    return curve.segments;
}

fn has_turns(curve: Curve) -> bool {
    // The ends of an open curve are free to turn: no D₂ stands there.
    return curve.pin_count > select(2u, 0u, curve.closed != 0u);
}

// The unit vector halfway between the tangents of the edges at a vertex.
fn tangent_at(curve: Curve, v: u32) -> vector {
    let is_first = v == 0u && curve.closed == 0u;
    let before_edge = select(select(v, curve.segments, v == 0u) - 1u, 0u, is_first);
    let after_edge = min(v, curve.segments - 1u);
    let before = current_edge(curve, before_edge) / length_at(curve, before_edge);
    let after = current_edge(curve, after_edge) / length_at(curve, after_edge);
    let sum = before + after;
    let square = dot(sum, sum);
    // Edges that turn back have no direction in common: any serves.
    if (square > real(1e-12)) {
        return sum / sqrt(square);
    }
    return after;
}
