// The solution of (H + λ diag|H|) p = −g for a curve, in two halves.
// Twin: src/scf/slopes.rs, and src/linalg/banded.rs for the elimination.

fn damped_diagonal(curve: SlopesCurve, k: u32, lambda: real) -> real {
    let d = work[WORK_DIAGONAL * params.dots + curve.start + k];
    // A dot between straight segments has neither stiffness nor moment.
    return select(d + lambda * abs(d), real(1), d == real(0));
}

// Factorises H + λ diag|H|, and takes −g through the first half of the solution. Returns the
// smallest pivot. See src/linalg/banded.rs.
fn factor(curve: SlopesCurve, lambda: real) -> real {
    let dots = params.dots;
    let coupling = WORK_COUPLING * dots + curve.start;
    let pivots = WORK_PIVOT * dots + curve.start;
    let bands = WORK_BAND * dots + curve.start;
    let borders = WORK_BORDER * dots + curve.start;
    let steps = WORK_STEP * dots + curve.start;
    let gradients = WORK_GRADIENT * dots + curve.start;
    let closed = curve.closed != 0u;
    let n = curve.dots;
    var smallest = real(1) / real(1e-30);
    var movable_before = movable(curve.start);
    let movable_first = movable_before;
    var corner = damped_diagonal(curve, 0u, lambda) * movable_first + (real(1) - movable_first);
    var kept = -work[gradients];
    var inverse = real(0);
    var border_before = real(0);
    var x_before = real(0);
    var first = 1u;
    if (!closed) {
        smallest = -larger_of(-smallest, -corner);
        inverse = real(1) / corner;
        work[pivots] = inverse;
        work[steps] = kept;
        x_before = kept;
        first = 0u;
    }
    for (var i = 1u; i < n; i++) {
        let movable_here = movable(curve.start + i);
        var pivot = damped_diagonal(curve, i, lambda) * movable_here + (real(1) - movable_here);
        let entry = work[coupling + i - 1u] * (movable_here * movable_before);
        var x = -work[gradients + i];
        var border = real(0);
        if (i > first) {
            let l = entry * inverse;
            pivot -= l * entry;
            work[bands + i] = l;
            x -= l * x_before;
            border -= l * border_before;
        } else {
            // Row 0 of a closed curve is kept for the end.
            border = entry;
        }
        inverse = real(1) / pivot;
        smallest = -larger_of(-smallest, -pivot);
        work[pivots + i] = inverse;
        work[steps + i] = x;
        if (closed) {
            if (i + 1u == n) {
                border += work[coupling + i] * (movable_first * movable_here);
            }
            let scaled = border * inverse;
            corner -= scaled * border;
            kept -= scaled * x;
            work[borders + i] = scaled;
            border_before = border;
        }
        movable_before = movable_here;
        x_before = x;
    }
    if (closed) {
        smallest = -larger_of(-smallest, -corner);
        work[steps] = kept * (real(1) / corner);
    }
    return smallest;
}

fn larger_of(x: real, y: real) -> real {
    return select(y, x, x > y);
}

struct Solved {
    // g·p
    slope: real,
    // The largest |p|.
    most: real,
}

// The second half of the solution p of (H + λ diag|H|) p = −g.
fn solve(curve: SlopesCurve) -> Solved {
    let dots = params.dots;
    let pivots = WORK_PIVOT * dots + curve.start;
    let bands = WORK_BAND * dots + curve.start;
    let borders = WORK_BORDER * dots + curve.start;
    let steps = WORK_STEP * dots + curve.start;
    let gradients = WORK_GRADIENT * dots + curve.start;
    let closed = curve.closed != 0u;
    let n = curve.dots;
    let kept = work[steps];
    var after = real(0);
    var most = select(real(0), abs(kept), closed);
    // From the last row to the first one, except a kept row 0.
    for (var k = curve.closed; k < n; k++) {
        let i = n - 1u - k + curve.closed;
        var here = work[pivots + i] * work[steps + i];
        if (i + 1u < n) {
            here -= work[bands + i + 1u] * after;
        }
        if (closed) {
            here -= work[borders + i] * kept;
        }
        work[steps + i] = here;
        after = here;
        most = larger_of(most, abs(here));
    }
    var slope = real(0);
    for (var k = 0u; k < n; k++) {
        slope += work[gradients + k] * work[steps + k];
    }
    return Solved(slope, most);
}
