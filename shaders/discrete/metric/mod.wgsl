// The inner product of order 1, and the tridiagonal network K + excess that those of orders 1 and 2
// solve with: between neighbours of edge length Δs the weight w/Δs, at a vertex an excess.
// Elimination adds and multiplies non-negative numbers alone, so that f32 keeps its digits; a
// pinned vertex passes the weight of its edge on as excess. A closed curve keeps row 0, the border,
// for the end. Twin: src/discrete/metric/mod.rs, with src/linalg/banded.rs.

//:include discrete/metric/network.wgsl

// Factors the network at the lengths stored: 1/pivot, 0 where the vertex is held, and of closed
// curves how much of the border's unknown each row takes. False where a pivot is not positive.
fn factor(curve: Curve, network: Network) -> bool {
    let is_closed = curve.closed != 0u;
    let begin = select(0u, 1u, is_closed);
    var sound = true;
    var share = real(0);
    var chain = real(0);
    var left = real(0);
    var border = real(0);
    if (is_closed) {
        chain = real(1);
        left = network.weight / length_at(curve, 0u);
        border = excess_at(curve, network, 0u);
    }
    for (var v = begin; v < curve.vertices; v++) {
        var right = real(0);
        if (v < curve.segments) {
            right = network.weight / length_at(curve, v);
        }
        let own = excess_at(curve, network, v) + left * share;
        let link = left * chain;
        let pivot = own + link + right;
        var inverse = real(0);
        chain = real(0);
        share = real(1);
        if (is_movable(curve, v)) {
            sound = sound && pivot > real(0) && !is_out_of_range(pivot);
            inverse = real(1) / pivot;
            chain = link * inverse;
            share = own * inverse;
            border += link * share;
        }
        work[curve.pivot + v * $SIDEu] = inverse;
        work[curve.chain + v * $SIDEu] = chain;
        left = right;
    }
    if (is_closed) {
        // The last row's right neighbour is the border.
        border += left * share;
        var inverse = real(0);
        if (is_movable(curve, 0u)) {
            sound = sound && border > real(0) && !is_out_of_range(border);
            inverse = real(1) / border;
        }
        work[curve.pivot] = inverse;
    }
    return sound;
}

// What a solve leaves: whether the inner product is one, and ⟨g, z⟩ for the new Sobolev gradient
// and the one before.
struct Solved {
    sound: bool,
    norm2: real,
    mixed: real,
}

// Solves for the vectors in the section `right_hand_sides`, each times `by_mass` times its vertex's
// mass where that is not 0. The solution goes to `solution`; where that is the section z, ⟨g, z⟩ is
// summed on the way.
fn solve(curve: Curve, network: Network, right_hand_sides: u32, by_mass: real, solution: u32) -> Solved {
    let is_closed = curve.closed != 0u;
    let begin = select(0u, 1u, is_closed);
    var delta = vector();
    var left = real(0);
    var border = vector();
    var length_before = real(0);
    if (is_closed) {
        length_before = length_at(curve, 0u);
        left = network.weight / length_before;
        border = work_vector(right_hand_sides, 0u);
        if (by_mass != real(0)) {
            border *= by_mass * mass_at(curve, 0u);
        }
    }
    for (var v = begin; v < curve.vertices; v++) {
        var length = real(0);
        if (v < curve.segments) {
            length = length_at(curve, v);
        }
        var sum = work_vector(right_hand_sides, v);
        if (by_mass != real(0)) {
            sum *= by_mass * (real(0.5) * (length_before + length));
        }
        sum += left * delta;
        // 0 at a pinned vertex.
        delta = work[curve.pivot + v * $SIDEu] * sum;
        if (is_closed) {
            border += work[curve.chain + v * $SIDEu] * sum;
        }
        store_vector(curve.x, v, delta);
        length_before = length;
        left = network.weight / length;
    }
    var next = vector();
    if (is_closed) {
        // The last row's right neighbour is the border.
        border = work[curve.pivot] * (border + left * delta);
        next = border;
    }
    var solved = Solved(true, real(0), real(0));
    for (var k = curve.vertices; k > begin; k--) {
        let v = k - 1u;
        var x = work_vector(curve.x, v);
        if (v < curve.segments) {
            let share = network.weight / length_at(curve, v) * work[curve.pivot + v * $SIDEu];
            x += share * next;
        }
        if (is_closed) {
            x += work[curve.chain + v * $SIDEu] * border;
        }
        next = x;
        solved = take_solution(solved, curve, solution, v, x);
    }
    if (is_closed) {
        solved = take_solution(solved, curve, solution, 0u, border);
    }
    return solved;
}

fn take_solution(before: Solved, curve: Curve, section: u32, v: u32, x: vector) -> Solved {
    var solved = before;
    if (section == curve.z) {
        let g = work_vector(curve.g, v);
        solved.norm2 += dot(g, x);
        solved.mixed += dot(g, work_vector(curve.z, v));
    }
    store_vector(section, v, x);
    return solved;
}

// Freezes the inner product at the curve, and turns the gradient in the section g into the Sobolev
// gradient in z.
fn sobolev_gradient(curve: Curve) -> Solved {
//:if SECOND
    return hats_gradient(curve);
//:else
//:if FIRST
    let network = Network(curve.highest, real(0));
    let sound = factor(curve, network);
    var solved = solve(curve, network, curve.g, real(0), curve.z);
    solved.sound = sound;
    return solved;
//:else
    var solved = Solved(true, real(0), real(0));
    for (var v = 0u; v < curve.vertices; v++) {
        solved = take_solution(solved, curve, curve.z, v, work_vector(curve.g, v));
    }
    return solved;
//:end
//:end
}
