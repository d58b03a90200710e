// Sobolev gradients of orders 1 and 2: the metric L in place of H, and the steps along −L⁻¹g.
// Twin: src/discrete/sobolev.rs, which has the reasons.

const MEMORY: real = real(0.85);
const SUFFICIENT: real = real(1e-4);
const LONGER: real = real(4.0);
const LONGEST: real = real(1e4);
const SHORTEST: real = real(1e-8);

struct VertexBlocks {
//:unroll j 0..$VERTICES
//:unroll k $j..$VERTICES
    v$j$k: matrix,
//:end
//:end
}

// What the window contributes to L.
fn blocks_of(curve: Curve, w: Window, weights: Weights, edges: u32) -> VertexBlocks {
    let row = damping_row(curve, w, edges, real(1));
    var counted = diagonal(real(1));
//:if SECOND
    // At a data point only the component across the curve counts.
    let sum = w.t0 + w.t1;
    let square = dot(sum, sum);
    var along = w.t1;
    if (square > real(1e-12)) {
        along = sum / sqrt(square);
    }
    if (w.free <= real(0)) {
        counted -= outer(along, along);
    }
//:end
    var v = VertexBlocks();
//:unroll a 0..$VERTICES
//:unroll b $a..$VERTICES
    v.v$a$b = (row[$a] * row[$b]) * counted;
//:end
//:end
    return v;
}

fn share_of(lambda: real) -> real {
    return real(1);
}

// The next step, and the mean of energies.
struct Stride {
    alpha: real,
    mean: real,
    verdict: u32,
}

// Judges a trial along −z.
fn strode(mean: real, trial: Trial) -> Stride {
    let is_finite = !is_out_of_range(trial.energy_there) && !is_out_of_range(trial.slope_there);
    let is_sound = trial.sound && !is_out_of_range(trial.slope) && trial.slope < real(0);
    let promised = -(trial.alpha * trial.slope);
    let rounding = ROUNDING * (EPSILON * abs(trial.energy));
    if (!(is_finite && is_sound && trial.energy_there <= mean - SUFFICIENT * promised + rounding)) {
        let shorter = trial.alpha / LONGER;
        return Stride(shorter, mean, select(VERDICT_AGAIN, VERDICT_FAIL, shorter < SHORTEST));
    }
    let change = trial.slope - trial.slope_there;
    let factor = select(LONGER, trial.slope / change, change < real(0));
    let alpha = min(trial.alpha * factor, LONGEST);
    return Stride(alpha, MEMORY * mean + (real(1) - MEMORY) * trial.energy_there, VERDICT_ACCEPT);
}
