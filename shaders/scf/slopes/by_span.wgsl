// Curves under tension: spans are judged one by one, and dots become movable in stages.
// Twin: src/scf/slopes.rs

//:if F64
const CLOSE: real = real(1e-9);
//:else
// No twin: f32 has fewer digits to lose.
const CLOSE: real = real(1e-3);
//:end
const NEARLY: real = real(1e-4);

// No twin: the CPU has separate arrays. The values of the spans at the current curve.
const WORK_SPAN_COST: u32 = 8u;
const WORK_SPAN_FIRST: u32 = 9u;
const WORK_SPAN_LAST: u32 = 10u;
// Twin: gpu/bounds.rs
const WORK_TAUT_NUMBERS: u32 = 11u;

// The stage of the curve.
var<private> stage: real;

// 1 if a direction is an unknown in this stage, else 0.
fn movable(dot: u32) -> real {
    return select(real(0), fixed[dot], fixed[2u * params.dots + dot] <= stage);
}

fn is_last_stage(curve: SlopesCurve) -> bool {
    return u32(stage) + 1u >= curve.stages;
}

fn span_count(curve: SlopesCurve) -> u32 {
    return curve.dots - 1u + curve.closed;
}

// Whether the evaluation kernel could not follow a segment.
fn is_to_be_asked(curve: SlopesCurve) -> bool {
    var is_asked = false;
    for (var k = 0u; k < span_count(curve); k++) {
        is_asked = is_asked || found[7u * (curve.start + k) + 6u] < real(0);
    }
    return is_asked;
}

// The change of the cost for a trial, summed over spans.
fn change(curve: SlopesCurve) -> real {
    let dots = params.dots;
    var sum = real(0);
    let opening = turns[curve.start] - turns[dots + curve.start];
    var first = opening;
    for (var k = 0u; k < span_count(curve); k++) {
        let here = curve.start + k;
        var last = opening;
        if (k + 1u < curve.dots) {
            last = turns[here + 1u] - turns[dots + here + 1u];
        }
        let before = work[WORK_SPAN_COST * dots + here];
        var own = found[7u * here] - before;
        if (!(abs(own) > CLOSE * before)) {
            let slope_first = work[WORK_SPAN_FIRST * dots + here] + found[7u * here + 1u];
            let slope_last = work[WORK_SPAN_LAST * dots + here] + found[7u * here + 2u];
            own = real(0.5) * (slope_first * first + slope_last * last);
        }
        sum += fixed[dots + here] * own;
        first = last;
    }
    return sum;
}

fn keep_spans(curve: SlopesCurve) {
    let dots = params.dots;
    for (var k = 0u; k < span_count(curve); k++) {
        let here = curve.start + k;
        work[WORK_SPAN_COST * dots + here] = found[7u * here];
        work[WORK_SPAN_FIRST * dots + here] = found[7u * here + 1u];
        work[WORK_SPAN_LAST * dots + here] = found[7u * here + 2u];
    }
}

// √(g H⁻¹g/cost), the largest value of any dot with its adjacent spans.
fn decrement_by_dot(curve: SlopesCurve) -> real {
    let dots = params.dots;
    var most = real(0);
    var before = real(0);
    if (curve.closed != 0u) {
        let last = curve.start + curve.dots - 1u;
        before = fixed[dots + last] * work[WORK_SPAN_COST * dots + last];
    }
    for (var k = 0u; k < curve.dots; k++) {
        let here = curve.start + k;
        var after = real(0);
        if (k < span_count(curve)) {
            after = fixed[dots + here] * work[WORK_SPAN_COST * dots + here];
        }
        let own = abs(work[WORK_GRADIENT * dots + here] * work[WORK_STEP * dots + here]) / (before + after);
        most = larger_of(own, most);
        before = after;
    }
    return sqrt(most);
}

// If a stage other than the last has ended, begins the next. Its first trial is the current curve.
fn loosened(curve: SlopesCurve, index: u32, ended: SlopesState) -> SlopesState {
    var state = ended;
    if (state.standing == SLOPES_STANDING_RUNNING || is_last_stage(curve)) {
        return state;
    }
    for (var k = curve.start; k < curve.start + curve.dots; k++) {
        turns[k] = turns[params.dots + k];
    }
    numbers[index * SLOPES_NUMBERS + SLOPES_STAGE] = stage + real(1);
    numbers[index * SLOPES_NUMBERS + SLOPES_LAMBDA] = real(0);
    state.standing = SLOPES_STANDING_RUNNING;
    state.flags = FLAG_LOOSENED;
    return state;
}
