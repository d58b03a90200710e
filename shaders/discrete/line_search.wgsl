// How far along a direction: one trial a tick, decided from the energy and its slope at the trial.
// What is infinite or NaN in the twin, until something is known, is a flag here.
// Twin: src/discrete/line_search.rs, which says why.

const SLOPE: real = real(0.5);
const ENERGY_ROUNDING: real = real(1e-6);
const MOST_TRIALS: u32 = 20u;

//:if F64
const CLOSED_BRACKET: real = real(1.7763568394002505e-15);
//:else
const CLOSED_BRACKET: real = real(9.5367432e-7);
//:end

struct LineSearch {
    // Step of the next trial.
    alpha: real,
    energy: real,
    slope: real,
    most: real,
    low: real,
    low_slope: real,
    high: real,
    high_slope: real,
    has_high: bool,
    has_high_slope: bool,
    trials: u32,
    verdict: u32,
}

// Starts at an energy and a (negative) slope with a first step, which `most` bounds.
fn line_search(energy: real, slope: real, alpha: real, most: real) -> LineSearch {
    var search = LineSearch();
    search.alpha = min(alpha, most);
    search.energy = energy;
    search.slope = slope;
    search.most = most;
    search.low_slope = slope;
    return search;
}

// Judges the trial at `alpha`.
fn judged(before: LineSearch, energy: real, slope: real) -> LineSearch {
    var search = before;
    search.trials += 1u;
    let finite = !is_out_of_range(energy) && !is_out_of_range(slope);
    let rounding = ENERGY_ROUNDING * abs(search.energy);
    let not_above = finite && energy <= search.energy + rounding;
    let flat = abs(slope) <= SLOPE * abs(search.slope);
    let falls = slope < real(0);
    if (not_above && (flat || (falls && search.alpha >= search.most))) {
        search.verdict = VERDICT_ACCEPT;
        return search;
    }
    if (not_above && falls) {
        search = too_short(search, slope);
    } else {
        search.high = search.alpha;
        search.high_slope = slope;
        search.has_high = true;
        search.has_high_slope = not_above;
        search = inside(search, finite);
    }
    let closed = search.has_high && search.high - search.low <= CLOSED_BRACKET * search.high;
    search.verdict = select(VERDICT_AGAIN, VERDICT_FAIL, search.trials >= MOST_TRIALS || closed);
    return search;
}

fn too_short(before: LineSearch, slope: real) -> LineSearch {
    var search = before;
    search.low = before.alpha;
    search.low_slope = slope;
    if (search.has_high) {
        return inside(search, true);
    }
    let alpha = before.alpha;
    let farthest = real(5) * alpha;
    var secant = farthest;
    if (slope > before.low_slope) {
        secant = alpha - slope * (alpha - before.low) / (slope - before.low_slope);
    }
    search.alpha = min(search.most, clamp(secant, real(1.5) * alpha, farthest));
    return search;
}

// The next trial within the bracket.
fn inside(before: LineSearch, finite: bool) -> LineSearch {
    var search = before;
    let width = search.high - search.low;
    let tenth = real(0.1) * width;
    if (search.has_high_slope) {
        let secant = search.low - search.low_slope * width / (search.high_slope - search.low_slope);
        search.alpha = clamp(secant, search.low + tenth, search.high - tenth);
    } else {
        search.alpha = search.low + select(tenth, real(0.3) * width, finite);
    }
    return search;
}
