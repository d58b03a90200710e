// Cubic smoothing splines after Reinsch, one thread a curve and one solve a dispatch: for a given
// λ, or the next step of the search for the largest λ that keeps a deviation. A whole search in one
// dispatch would run into watchdogs, and llvmpipe ends a thread's loops, without a word, after
// 65,535 iterations all told. Everything is normalised: parameter length 1, coordinates and largest
// weight of size 1. Twin: src/spline/reinsch.rs (the search: src/spline/smoother/search.rs); the
// regression line and averaged points are the host's.

struct SmoothingParams {
    curves: u32,
    dimension: u32,
}

struct SmoothingCurve {
    // First knot, number of knots (a closed curve's first not repeated).
    start: u32,
    count: u32,
    flags: u32,
    padding: u32,
}

// Twin: smoothing_gpu.rs
const FLAG_CLOSED: u32 = 1u;
const FLAG_DEVIATION: u32 = 2u;
const STATUS_SOLVED: u32 = 1u;
// Rounding got the better of it: the host fits this curve in f64.
const STATUS_FAILED: u32 = 2u;
// The search is not done.
const STATUS_PENDING: u32 = 3u;

// Products of constants are written out: naga does not multiply 64-bit ones.
const MAX_REFINEMENTS: u32 = 6u;
//:if F64
const REFINED: real = real(5.684341886080802e-14);
const FAILED: real = real(1.8189894035458565e-12);
// No twin: 1 − 64 ε, so that the host, which adds up in another order, finds no more than was allowed.
const KEPT: real = real(0.9999999999999858);
//:else
const REFINED: real = real(3.0517578125e-05);
const FAILED: real = real(0.0009765625);
// No twin: as in f64.
const KEPT: real = real(0.9999924);
//:end

// Steps of λ: 2^(j/512). Twin: smoother/search.rs
const STEPS_PER_OCTAVE: i32 = 512;
const STRIDE: i32 = 3 * STEPS_PER_OCTAVE;
const LAST_STEP: i32 = 66 * STEPS_PER_OCTAVE;
//:if F64
const FIRST_STEP: i32 = -1020 * STEPS_PER_OCTAVE;
//:else
// No twin: what is smaller underflows.
const FIRST_STEP: i32 = -120 * STEPS_PER_OCTAVE;
//:end

@group(0) @binding(0) var<uniform> params: SmoothingParams;
@group(0) @binding(1) var<storage, read> curves: array<SmoothingCurve>;
@group(0) @binding(2) var<storage, read_write> status: array<u32>;
// 2^(j/512) for j from 0 to 511: λ is searched among these numbers times powers of 2.
@group(0) @binding(3) var<storage, read> octave: array<real>;
@group(0) @binding(4) var<storage, read> spans: array<real>;
@group(0) @binding(5) var<storage, read> inverse_weights: array<real>;
@group(0) @binding(6) var<storage, read> data: array<real>;
// Of every curve in turn: diagonal, first, second (1 a knot each), border (2), moments, step,
// correction (dimension each).
@group(0) @binding(7) var<storage, read_write> scratch: array<real>;
// Eight numbers a curve: the amount asked for (λ, or the deviation to keep); the phase of the
// search; the largest step known to keep the deviation, the smallest known to break it, the next
// one to try; the number of solves.
@group(0) @binding(8) var<storage, read_write> searches: array<real>;

// No twin: the CPU searches in one loop.
const PHASE_START: u32 = 0u;
const PHASE_SEARCH: u32 = 1u;
const PHASE_LAST: u32 = 2u;
const PHASE_DONE: u32 = 3u;

//:include linalg/pentadiagonal.wgsl

struct Problem {
    start: u32,
    n: u32,
    d: u32,
    closed: bool,
    // Positions in `scratch`.
    diagonal: u32,
    first: u32,
    second: u32,
    border: u32,
    moments: u32,
    step: u32,
    correction: u32,
}

fn before(p: Problem, k: u32) -> u32 {
    return select(k, p.n, k == 0u) - 1u;
}

fn after(p: Problem, k: u32) -> u32 {
    return select(k + 1u, 0u, k + 1u == p.n);
}

// A span that an open curve does not have counts as infinitely long.
fn inverse_span(p: Problem, k: u32) -> real {
    if (!p.closed && k + 1u == p.n) {
        return real(0);
    }
    return real(1) / spans[p.start + k];
}

fn inverse_span_before(p: Problem, k: u32) -> real {
    if (!p.closed && k == 0u) {
        return real(0);
    }
    return real(1) / spans[p.start + before(p, k)];
}

fn unknowns(p: Problem) -> u32 {
    return select(max(p.n, 2u) - 2u, p.n, p.closed);
}

fn data_difference(p: Problem, k: u32, c: u32) -> real {
    let here = data[(p.start + k) * p.d + c];
    return (data[(p.start + after(p, k)) * p.d + c] - here) * inverse_span(p, k)
        - (here - data[(p.start + before(p, k)) * p.d + c]) * inverse_span_before(p, k);
}

fn scratch_difference(p: Problem, u: u32, k: u32, c: u32) -> real {
    let here = scratch[u + k * p.d + c];
    return (scratch[u + after(p, k) * p.d + c] - here) * inverse_span(p, k)
        - (here - scratch[u + before(p, k) * p.d + c]) * inverse_span_before(p, k);
}

fn fitted(p: Problem, k: u32, c: u32) -> real {
    return data[(p.start + k) * p.d + c] - scratch[p.correction + k * p.d + c];
}

fn fitted_difference(p: Problem, k: u32, c: u32) -> real {
    let here = fitted(p, k, c);
    return (fitted(p, after(p, k), c) - here) * inverse_span(p, k)
        - (here - fitted(p, before(p, k), c)) * inverse_span_before(p, k);
}

fn fill_bands(p: Problem, alpha: real, beta: real) {
    let skipped = select(1u, 0u, p.closed);
    for (var j = 0u; j < unknowns(p); j++) {
        let here = j + skipped;
        let previous = before(p, here);
        let next = after(p, here);
        let h_before = spans[p.start + previous];
        let h_here = spans[p.start + here];
        let ih_before = real(1) / h_before;
        let ih_here = real(1) / h_here;
        let ih_next = inverse_span(p, next);
        let w_before = inverse_weights[p.start + previous];
        let w_here = inverse_weights[p.start + here];
        let w_next = inverse_weights[p.start + next];
        let centre = -(ih_before + ih_here);
        let centre_next = -(ih_here + ih_next);
        scratch[p.diagonal + j] = alpha * ((h_before + h_here) / real(3))
            + beta * (w_before * (ih_before * ih_before) + w_here * (centre * centre) + w_next * (ih_here * ih_here));
        scratch[p.first + j] = alpha * (h_here / real(6)) + beta * (ih_here * (w_here * centre + w_next * centre_next));
        scratch[p.second + j] = beta * (w_next * (ih_here * ih_next));
    }
}

fn solve_factored(p: Problem, x: u32) {
    let d = p.d;
    if (!p.closed) {
//:unroll c 0..$D
            scratch[x + $cu] = real(0);
            scratch[x + (p.n - 1u) * d + $cu] = real(0);
//:end
        solve_pentadiagonal(p.diagonal, p.first, p.second, unknowns(p), x + d);
        return;
    }
    solve_cyclic_pentadiagonal(p.diagonal, p.first, p.second, p.border, p.n, x);
    // Second derivatives of a periodic spline integrate to 0, which large λ leaves undetermined.
    var integral = vec$D<real>();
    var length = real(0);
    for (var k = 0u; k < p.n; k++) {
        let share = spans[p.start + before(p, k)] + spans[p.start + k];
//:unroll c 0..$D
        integral[$c] += share * scratch[x + k * d + $cu];
//:end
        length += share;
    }
    let mean = integral / length;
    for (var k = 0u; k < p.n; k++) {
//:unroll c 0..$D
        scratch[x + k * d + $cu] -= mean[$c];
//:end
    }
}

// Residual of the system at the current moments, from the fitted values.
fn refinement_rhs(p: Problem, alpha: real) {
    let skipped = select(1u, 0u, p.closed);
    for (var k = 0u; k < p.n; k++) {
        let inside = k >= skipped && k + skipped < p.n;
//:unroll c 0..$D
        {
            var residual = fitted_difference(p, k, $cu);
            if (inside) {
                let left = spans[p.start + before(p, k)];
                let right = spans[p.start + k];
                let sum = left * scratch[p.moments + before(p, k) * p.d + $cu]
                    + real(2) * (left + right) * scratch[p.moments + k * p.d + $cu]
                    + right * scratch[p.moments + after(p, k) * p.d + $cu];
                residual -= alpha * (sum / real(6));
            }
            scratch[p.step + k * p.d + $cu] = residual;
        }
//:end
    }
}

fn solve_for(p: Problem, lambda: real) -> bool {
    let alpha = real(1) / (real(1) + lambda);
    let beta = lambda / (real(1) + lambda);
    let d = p.d;
    fill_bands(p, alpha, beta);
    var factored = true;
    if (p.closed) {
        factored = factor_cyclic_pentadiagonal(p.diagonal, p.first, p.second, p.border, p.n);
    } else {
        factored = factor_pentadiagonal(p.diagonal, p.first, p.second, unknowns(p));
    }
    if (!factored) {
        return false;
    }
    for (var k = 0u; k < p.n; k++) {
//:unroll c 0..$D
            scratch[p.moments + k * d + $cu] = data_difference(p, k, $cu);
//:end
    }
    solve_factored(p, p.moments);
    var broken = false;
    for (var k = 0u; k < p.n; k++) {
        let w = inverse_weights[p.start + k];
//:unroll c 0..$D
        {
            let change = w * scratch_difference(p, p.moments, k, $cu);
            broken = broken || is_out_of_range(change);
            scratch[p.correction + k * d + $cu] = beta * change;
        }
//:end
    }
    if (broken) {
        return false;
    }
    if (beta == real(0) || unknowns(p) == 0u) {
        return true;
    }
    var moved = real(0);
    for (var refinement = 0u; refinement < MAX_REFINEMENTS; refinement++) {
        refinement_rhs(p, alpha);
        solve_factored(p, p.step);
        moved = real(0);
        for (var k = 0u; k < p.n; k++) {
            let w = inverse_weights[p.start + k];
//:unroll c 0..$D
            {
                scratch[p.moments + k * d + $cu] += scratch[p.step + k * d + $cu];
                let change = beta * (w * scratch_difference(p, p.step, k, $cu));
                scratch[p.correction + k * d + $cu] += change;
                broken = broken || is_out_of_range(change);
                moved = max(moved, abs(change));
            }
//:end
        }
        if (broken) {
            return false;
        }
        if (moved <= REFINED) {
            return true;
        }
    }
    return moved <= FAILED;
}

// Largest squared distance between data and curve.
fn square_deviation(p: Problem) -> real {
    var largest = real(0);
    for (var k = 0u; k < p.n; k++) {
        var square = real(0);
//:unroll c 0..$D
        {
            let x = scratch[p.correction + k * p.d + $cu];
            square += x * x;
        }
//:end
        largest = max(largest, square);
    }
    return largest;
}

// Largest squared |ω_i (Qγ)_i| of the last solve: what a small λ is multiplied by to give the
// largest correction.
fn square_pull(p: Problem, alpha: real) -> real {
    var largest = real(0);
    for (var k = 0u; k < p.n; k++) {
        var square = real(0);
//:unroll c 0..$D
        {
            let pull = alpha * (inverse_weights[p.start + k] * scratch_difference(p, p.moments, k, $cu));
            square += pull * pull;
        }
//:end
        largest = max(largest, square);
    }
    return largest;
}

// The λ of a step.
fn lambda_at(step: i32) -> real {
    let octaves = step >> 9u;
    var power = real(2);
    if (octaves < 0) {
        power = real(0.5);
    }
    var lambda = octave[u32(step & 511)];
    for (var left = u32(abs(octaves)); left > 0u; left >>= 1u) {
        if ((left & 1u) != 0u) {
            lambda *= power;
        }
        power *= power;
    }
    return lambda;
}

//:include entry.wgsl ENTRY=fit TASKS=params.curves
    let curve = curves[task];
    let n = curve.count;
    let d = params.dimension;
    let base = curve.start * (5u + 3u * d);
    var p: Problem;
    p.start = curve.start;
    p.n = n;
    p.d = d;
    p.closed = (curve.flags & FLAG_CLOSED) != 0u;
    p.diagonal = base;
    p.first = base + n;
    p.second = base + 2u * n;
    p.border = base + 3u * n;
    p.moments = base + 5u * n;
    p.step = p.moments + n * d;
    p.correction = p.step + n * d;

    let search = 8u * task;
    let amount = searches[search];
    var phase = u32(searches[search + 1u]);
    if (phase == PHASE_DONE) {
        return;
    }
    var below = i32(searches[search + 2u]);
    var above = i32(searches[search + 3u]);
    var next_step = i32(searches[search + 4u]);
    let by_deviation = (curve.flags & FLAG_DEVIATION) != 0u;

    var lambda = amount;
    if (phase == PHASE_START && by_deviation) {
        lambda = real(0);
    } else if (by_deviation) {
        lambda = lambda_at(next_step);
    }
    let solved = solve_for(p, lambda);
    searches[search + 5u] += real(1);
    status[task] = STATUS_PENDING;
    if (!solved) {
        status[task] = STATUS_FAILED;
        phase = PHASE_DONE;
    } else if (phase == PHASE_LAST || !by_deviation) {
        status[task] = STATUS_SOLVED;
        phase = PHASE_DONE;
    } else if (phase == PHASE_START) {
        // While λ is small the points move by λ|ΩQγ|: a start close to the goal for noisy data.
        let octaves = log2(f32(amount)) - 0.5 * log2(max(f32(square_pull(p, real(1))), 1e-37));
        next_step = i32(floor(clamp(octaves, -120.0, 66.0) / 3.0)) * STRIDE;
        below = FIRST_STEP - 1;
        above = LAST_STEP + 1;
        phase = PHASE_SEARCH;
    } else {
        let allowed = amount * KEPT;
        if (square_deviation(p) <= allowed * allowed) {
            below = next_step;
            next_step = min(next_step + STRIDE, LAST_STEP);
        } else {
            above = next_step;
            next_step = max(next_step - STRIDE, FIRST_STEP);
        }
        if (below >= FIRST_STEP && above <= LAST_STEP) {
            next_step = below + (above - below) / 2;
        }
        if (above - below <= 1) {
            // Found, or kept by no step at all: then the host must say why.
            next_step = below;
            phase = PHASE_LAST;
            if (below < FIRST_STEP) {
                status[task] = STATUS_FAILED;
                phase = PHASE_DONE;
            }
        }
    }
    searches[search + 1u] = real(phase);
    searches[search + 2u] = real(below);
    searches[search + 3u] = real(above);
    searches[search + 4u] = real(next_step);
}
