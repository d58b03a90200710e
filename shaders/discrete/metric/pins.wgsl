// The pins of a curve, where it may turn: their numbers, and what couples neighbours. See metric/hats.wgsl.
// Twin: src/discrete/metric/hats.rs.

//:include discrete/metric/tangent.wgsl

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

// Integrals of the hats over the span from a pin to the next: by the pin's own hat, by both, by the next
// pin's; and those of φ y.
struct Span {
    here: real,
    both: real,
    next: real,
    here_turn: vector,
    next_turn: vector,
}

// Adds to what the span before has of the pin. Leaves fractions of arc length at the vertices, and the pin's tangent.
fn integrate_span(curve: Curve, k: u32, before: real, before_turn: vector) -> Span {
    let row = pins[curve.first_pin + k];
    let end = span_end(curve, k);
    store_pin_vector(curve, k, PIN_TANGENT, tangent_at(curve, row));
    var length = real(0);
    for (var j = row; j < end; j++) {
        work[curve.fraction + j * $SIDEu] = length;
        length += length_at(curve, j);
    }
    let inverse = select(real(0), real(1) / length, length > real(0));
    var span = Span(before + mass_at(curve, row), real(0), real(0), before_turn, vector());
    for (var v = row + 1u; v < end; v++) {
        let theta = work[curve.fraction + v * $SIDEu] * inverse;
        let rest = real(1) - theta;
        work[curve.fraction + v * $SIDEu] = theta;
        let mass = mass_at(curve, v);
        span.here += mass * rest * rest;
        span.both += mass * rest * theta;
        span.next += mass * theta * theta;
        let weighted = mass * work_vector(curve.x, v);
        span.here_turn += rest * weighted;
        span.next_turn += theta * weighted;
    }
    return span;
}
