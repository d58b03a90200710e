// The inner product of order 2: two solves with the network, and between them the turns of the
// curve at its pins, on the hat functions of the pins. Twin: src/discrete/metric/hats.rs, which
// derives it. The system of the turns is block tridiagonal, a block a pin, and is eliminated block
// by block; a closed curve keeps pin 0, the border, for the end. Blocks act normal to the curve
// alone: along it right-hand sides and couplings are 0, so that a multiple of the unit matrix
// serves there.

//:include discrete/metric/pins.wgsl

fn inverse_of(m: matrix) -> matrix {
//:if SPATIAL
    let a = cross(m[1], m[2]);
    let b = cross(m[2], m[0]);
    let c = cross(m[0], m[1]);
    return (real(1) / dot(m[0], a)) * transpose(matrix(a, b, c));
//:else
    let determinant = m[0].x * m[1].y - m[1].x * m[0].y;
    return (real(1) / determinant) * matrix(m[1].y, -m[0].y, -m[1].x, m[0].x);
//:end
}

// both · P_to P_from x, the coupling from one pin to another.
fn coupled(both: real, from_tangent: vector, to_tangent: vector, x: vector) -> vector {
    return both * across_tangent(to_tangent, across_tangent(from_tangent, x));
}

// One past the last pin that is eliminated in order; pin 0 is the border or an end.
fn chain_end(curve: Curve) -> u32 {
    return select(curve.pin_count - 1u, curve.pin_count, curve.closed != 0u);
}

// Integrals of the hats: fractions of arc length at the vertices, own and coupling numbers of the
// pins, and the right-hand sides −∫ φ y of the turns.
fn integrate_hats(curve: Curve) {
    var before = real(0);
    var before_turn = vector();
    for (var k = 0u; k < curve.pin_count; k++) {
        let span = integrate_span(curve, k, before, before_turn);
        work[pin_at(curve, k, 0u)] = span.here;
        work[pin_at(curve, k, 1u)] = span.both;
        store_pin_vector(curve, k, PIN_TURN, -span.here_turn);
        before = span.next;
        before_turn = span.next_turn;
    }
    if (curve.closed != 0u) {
        // The ring ends at its first pin, which one pin alone couples with itself.
        let itself = select(real(0), real(2) * work[pin_at(curve, 0u, 1u)], curve.pin_count == 1u);
        work[pin_at(curve, 0u, 0u)] += before + itself;
        store_pin_vector(curve, 0u, PIN_TURN, pin_vector(curve, 0u, PIN_TURN) - before_turn);
    }
}

// Solves for the turns. False where a block is not positive.
fn solve_turns(curve: Curve) -> bool {
    let is_closed = curve.closed != 0u;
    let end = chain_end(curve);
    let first_tangent = pin_vector(curve, 0u, PIN_TANGENT);
    var sound = true;
    var tangent = first_tangent;
    var border = diagonal(work[pin_at(curve, 0u, 0u)]);
    var border_turn = across_tangent(first_tangent, pin_vector(curve, 0u, PIN_TURN));
    var inverse = matrix();
    var beside = matrix();
    var turn = vector();
    for (var k = 1u; k < end; k++) {
        let own_tangent = pin_vector(curve, k, PIN_TANGENT);
        let both = work[pin_at(curve, k - 1u, 1u)];
        let couple = coupling(both, tangent, own_tangent);
        let eliminated = couple * inverse;
        let block = diagonal(work[pin_at(curve, k, 0u)]) - eliminated * transpose(couple);
        turn = across_tangent(own_tangent, pin_vector(curve, k, PIN_TURN)) - eliminated * turn;
        if (is_closed) {
            if (k == 1u) {
                beside = couple;
            } else {
                beside = real(-1) * (eliminated * beside);
            }
            if (k + 1u == end) {
                beside += coupling(work[pin_at(curve, k, 1u)], first_tangent, own_tangent);
            }
        }
        inverse = inverse_of(block);
        sound = sound && is_positive(inverse);
        if (is_closed) {
            let towards = transpose(beside) * inverse;
            border -= towards * beside;
            border_turn -= towards * turn;
            store_pin_matrix(curve, k, PIN_BORDER, beside);
        }
        store_pin_matrix(curve, k, PIN_INVERSE, inverse);
        store_pin_vector(curve, k, PIN_TURN, turn);
        tangent = own_tangent;
    }
    var first_turn = vector();
    if (is_closed) {
        let inverse_border = inverse_of(border);
        sound = sound && is_positive(inverse_border);
        first_turn = inverse_border * border_turn;
    } else {
        store_pin_vector(curve, curve.pin_count - 1u, PIN_TURN, vector());
    }
    store_pin_vector(curve, 0u, PIN_TURN, first_turn);
    var next_turn = vector();
    var next_tangent = first_tangent;
    for (var k = end; k > 1u; k--) {
        let own_tangent = pin_vector(curve, k - 1u, PIN_TANGENT);
        let both = work[pin_at(curve, k - 1u, 1u)];
        var rest = pin_vector(curve, k - 1u, PIN_TURN) - coupled(both, next_tangent, own_tangent, next_turn);
        if (is_closed) {
            rest -= pin_matrix(curve, k - 1u, PIN_BORDER) * first_turn;
        }
        next_turn = pin_matrix(curve, k - 1u, PIN_INVERSE) * rest;
        next_tangent = own_tangent;
        store_pin_vector(curve, k - 1u, PIN_TURN, next_turn);
    }
    return sound;
}

// Whether the diagonal of a block is, which for a symmetric block of elimination decides.
fn is_positive(m: matrix) -> bool {
    var positive = true;
//:unroll c 0..$DIM
    positive = positive && m[$c][$c] > real(0) && !is_out_of_range(m[$c][$c]);
//:end
    return positive;
}

// Adds Σ c_p φ_p.
fn add_turns(curve: Curve) {
    for (var k = 0u; k < curve.pin_count; k++) {
        let here = pin_vector(curve, k, PIN_TURN);
        let next = pin_vector(curve, select(k + 1u, 0u, k + 1u == curve.pin_count), PIN_TURN);
        let end = span_end(curve, k);
        for (var v = pins[curve.first_pin + k] + 1u; v < end; v++) {
            let turned = here + work[curve.fraction + v * $SIDEu] * (next - here);
            store_vector(curve.x, v, work_vector(curve.x, v) + turned);
        }
    }
}

fn hats_gradient(curve: Curve) -> Solved {
    var network = Network(real(1), real(0));
//:if ATTACHMENT
    var attached = real(0);
    var length = real(0);
    for (var v = 0u; v < curve.vertices; v++) {
        attached += load_stiffness(curve, v);
        length += mass_at(curve, v);
    }
    network.density = sqrt(attached / (length * curve.highest));
//:end
    var sound = factor(curve, network);
    // y = K⁻¹ g
    solve(curve, network, curve.g, real(0), curve.x);
    if (has_turns(curve)) {
        integrate_hats(curve);
        let turned = solve_turns(curve);
        sound = sound && turned;
        add_turns(curve);
    }
    // z = K⁻¹ M (y + Σ c φ)/w
    var solved = solve(curve, network, curve.x, real(1) / curve.highest, curve.z);
    solved.sound = sound;
    return solved;
}
