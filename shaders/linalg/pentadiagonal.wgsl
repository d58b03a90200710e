// Symmetric pentadiagonal systems, open and cyclic, LDLᵀ in place, one thread per system. All of a
// system is in the array `scratch`. The arguments are positions there: of the diagonal, the first and
// the second band, the border of a cyclic system, and the right-hand sides, $D numbers per row.
// No twin: the CPU has banded matrices of any width (src/linalg/banded.rs), whose border are the
// first rows, not the last.

// No twin: the CPU refuses a matrix whose last pivot is not positive. Here a pivot within 64 ε of
// its entry counts as 0, and its unknown is 0.
//:if F64
const NOISE: real = real(1.4210854715202004e-14);
//:else
const NOISE: real = real(7.6293945e-6);
//:end

// NaN or infinite, by its bits, since comparisons with NaN are unreliable.
fn is_out_of_range(x: real) -> bool {
    return (bitcast<u32>(f32(x)) & 0x7f800000u) == 0x7f800000u;
}

// False if a pivot is not positive.
fn factor_pentadiagonal(diagonal: u32, first: u32, second: u32, n: u32) -> bool {
    var l1 = real(0);
    var l2 = real(0);
    var l2_before = real(0);
    var u1 = real(0);
    var u2 = real(0);
    var u2_before = real(0);
    for (var i = 0u; i < n; i++) {
        let pivot = scratch[diagonal + i] - l2_before * u2_before - l1 * u1;
        if (pivot <= real(0) || is_out_of_range(pivot)) {
            return false;
        }
        let inverse = real(1) / pivot;
        scratch[diagonal + i] = inverse;
        var u1_here = real(0);
        var u2_here = real(0);
        if (i + 1u < n) {
            u1_here = scratch[first + i] - l1 * u2;
        }
        if (i + 2u < n) {
            u2_here = scratch[second + i];
        }
        l2_before = l2;
        u2_before = u2;
        l1 = u1_here * inverse;
        u1 = u1_here;
        l2 = u2_here * inverse;
        u2 = u2_here;
        if (i + 1u < n) {
            scratch[first + i] = l1;
        }
        if (i + 2u < n) {
            scratch[second + i] = l2;
        }
    }
    return true;
}

//:include linalg/pentadiagonal/solve.wgsl NAME=solve_pentadiagonal W=$D
//:include linalg/pentadiagonal/solve.wgsl NAME=solve_border W=2

fn factor_cyclic_pentadiagonal(diagonal: u32, first: u32, second: u32, border: u32, n: u32) -> bool {
    let m = n - 2u;
    for (var i = 0u; i < m; i++) {
        scratch[border + 2u * i] = real(0);
        scratch[border + 2u * i + 1u] = real(0);
    }
    // The corner block of the last two unknowns: (m, m), (m, m + 1), (m + 1, m + 1).
    var corner = vec3<real>(scratch[diagonal + m], real(0), scratch[diagonal + m + 1u]);
    // Every band entry of these two.
    for (var k = max(m, 2u) - 2u; k < n; k++) {
        for (var hop = 1u; hop <= 2u; hop++) {
            let other = (k + hop) % n;
            let low = min(k, other);
            let high = max(k, other);
            if (high < m) {
                continue;
            }
            let x = scratch[select(second, first, hop == 1u) + k];
            if (low < m) {
                scratch[border + 2u * low + (high - m)] += x;
            } else if (low == high) {
                if (low == m) {
                    corner.x += x + x;
                } else {
                    corner.z += x + x;
                }
            } else {
                corner.y += x;
            }
        }
    }
    let largest = corner.z;
    if (!factor_pentadiagonal(diagonal, first, second, m)) {
        return false;
    }
    var one = vec2<real>();
    var two = vec2<real>();
    for (var i = 0u; i < m; i++) {
        var y = vec2<real>(scratch[border + 2u * i], scratch[border + 2u * i + 1u]);
        if (i >= 2u) {
            y -= scratch[second + i - 2u] * two;
        }
        if (i >= 1u) {
            y -= scratch[first + i - 1u] * one;
        }
        let inverse = scratch[diagonal + i];
        corner.x -= y.x * y.x * inverse;
        corner.y -= y.x * y.y * inverse;
        corner.z -= y.y * y.y * inverse;
        two = one;
        one = y;
    }
    solve_border(diagonal, first, second, m, border);
    if (corner.x <= real(0) || is_out_of_range(corner.x)) {
        return false;
    }
    let inverse = real(1) / corner.x;
    let factor = corner.y * inverse;
    let last = corner.z - factor * corner.y;
    let noise = NOISE * largest;
    if (last <= -noise || is_out_of_range(last)) {
        return false;
    }
    scratch[diagonal + m] = inverse;
    scratch[first + m] = factor;
    scratch[diagonal + m + 1u] = real(0);
    if (last > noise) {
        scratch[diagonal + m + 1u] = real(1) / last;
    }
    return true;
}

fn solve_cyclic_pentadiagonal(diagonal: u32, first: u32, second: u32, border: u32, n: u32, x: u32) {
    let m = n - 2u;
    let tail = x + m * $Du;
//:unroll c 0..$D
    var x0$c = scratch[tail + $cu];
    var x1$c = scratch[tail + $Du + $cu];
//:end
    for (var i = 0u; i < m; i++) {
        let b0 = scratch[border + 2u * i];
        let b1 = scratch[border + 2u * i + 1u];
//:unroll c 0..$D
        x0$c -= b0 * scratch[x + i * $Du + $cu];
        x1$c -= b1 * scratch[x + i * $Du + $cu];
//:end
    }
//:unroll c 0..$D
    x1$c = (x1$c - scratch[first + m] * x0$c) * scratch[diagonal + m + 1u];
    x0$c = x0$c * scratch[diagonal + m] - scratch[first + m] * x1$c;
    scratch[tail + $cu] = x0$c;
    scratch[tail + $Du + $cu] = x1$c;
//:end
    solve_pentadiagonal(diagonal, first, second, m, x);
    for (var i = 0u; i < m; i++) {
        let b0 = scratch[border + 2u * i];
        let b1 = scratch[border + 2u * i + 1u];
//:unroll c 0..$D
        scratch[x + i * $Du + $cu] -= b0 * x0$c + b1 * x1$c;
//:end
    }
}
