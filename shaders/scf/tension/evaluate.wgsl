// Costs and derivatives of segments under tension, one thread a segment: each is followed from the shape that it
// had before. What cannot be followed is asked of the host.
// Twin: src/scf/tension/evaluate.rs. The CPU's code has no f32: nested roots, which alone tell kinds of shapes
// apart, need f64, and tests hold this kernel in both precisions to the CPU in f64.

struct EvaluationParams {
    tasks: u32,
}

struct Segment {
    // The curve it belongs to.
    owner: u32,
    // Where the turns at its ends stand.
    first: u32,
    last: u32,
    // Four times the number of its exponent, and how it ends.
    kind: u32,
}

@group(0) @binding(0) var<uniform> params: EvaluationParams;
// The segments to be evaluated.
@group(0) @binding(1) var<storage, read> tasks: array<u32>;
@group(0) @binding(2) var<storage, read> laws: array<real>;
@group(0) @binding(3) var<storage, read> segments: array<Segment>;
// Three a segment: from its chord to the reference directions, and the chord in the unit in which λ is 1.
@group(0) @binding(4) var<storage, read> angles: array<real>;
// From the reference directions.
@group(0) @binding(5) var<storage, read> turns: array<real>;
@group(0) @binding(6) var<storage, read> states: array<SlopesState>;
// SHAPE_NUMBERS a segment, named below.
@group(0) @binding(7) var<storage, read_write> shapes: array<real>;
// Seven numbers a segment: cost, first and second derivatives, and what became of it.
@group(0) @binding(8) var<storage, read_write> found: array<real>;

//:include scf/slopes/standing.wgsl
//:include damping/verdict.wgsl
//:include scf/trig.wgsl
//:include linalg/power.wgsl
//:include scf/tension/quadrature.wgsl
//:include scf/tension/solve/near.wgsl
//:include scf/tension/hessian.wgsl

// Twin: ../slopes.rs
const ENDS_DIRECTED: u32 = 0u;
const ENDS_FREE_START: u32 = 1u;
const ENDS_FREE_END: u32 = 2u;
const ENDS_STRAIGHT: u32 = 3u;

const FOLLOWED_NOTHING: u32 = 0u;
const FOLLOWED_BELOW: u32 = 1u;
const FOLLOWED_FLAT: u32 = 2u;
const FOLLOWED_ABOVE: u32 = 3u;
const FOLLOWED_FREE_FLAT: u32 = 4u;
const FOLLOWED_FREE_ABOVE: u32 = 5u;

// No twin: the kind, its two unknowns, and 1 where the host has written into `found` what is found at the next
// trial.
const SHAPE_KIND: u32 = 0u;
const SHAPE_FIRST: u32 = 1u;
const SHAPE_SECOND: u32 = 2u;
const SHAPE_GIVEN: u32 = 3u;
const SHAPE_NUMBERS: u32 = 4u;

// No twin: the host is asked.
const ASKED: real = real(-1);

struct Evaluation {
    cost: real,
    by_a: real,
    by_b: real,
    by_aa: real,
    by_ab: real,
    by_bb: real,
    // 1, or ASKED.
    exists: real,
}

fn asked() -> Evaluation {
    return Evaluation(real(0), real(0), real(0), real(0), real(0), real(0), ASKED);
}

// |κ|^{ν−1} at an end of this radius of curvature.
fn bending(law: Law, end: End, radius: real) -> real {
    return select(real(0), end.excess / (law.nu - real(1)) * radius, end.excess > real(0));
}

fn evaluation_of(index: u32, segment: Segment, a: real, b: real) -> Evaluation {
    let ends = segment.kind & 3u;
    let law = law_of(segment.kind / 4u);
    let chord = angles[3u * index + 2u];
    if (ends == ENDS_STRAIGHT) {
        return Evaluation(chord, real(0), real(0), real(0), real(0), real(0), real(1));
    }
    let at = SHAPE_NUMBERS * index;
    let kind = u32(shapes[at + SHAPE_KIND]);
    let largest = larger(abs(a), abs(b));
    if (kind == FOLLOWED_NOTHING || !(largest <= PI) || largest < STRAIGHT) {
        return asked();
    }
    // Mirrored so that a + b ≤ 0, and where an end is free so that it is the upper one.
    let is_free = ends != ENDS_DIRECTED;
    let given = select(a, b, ends == ENDS_FREE_START);
    let mirror = select(real(1), real(-1), select(a + b, given, is_free) > real(0));
    let forwards = select(mirror * a <= mirror * b, ends == ENDS_FREE_END, is_free);
    let low = select(smaller(mirror * a, mirror * b), -abs(given), is_free);
    let high = larger(mirror * a, mirror * b);
    let here = near(law, chord, kind, low, high, shapes[at + SHAPE_FIRST], shapes[at + SHAPE_SECOND]);
    if (!here.found) {
        return asked();
    }
    let hessian = hessian_of(kind, here);
    // P·chord
    let gap = select(real(0), here.u, kind == FOLLOWED_BELOW);
    let pull = (real(1) - gap) * here.cosine - here.lift * here.sine;
    let cost = (law.nu * here.length - pull) / (law.nu - real(1));
    let low_by = -law.nu * mirror * bending(law, here.low, here.low.radius);
    // Where the turn comes back to the upper end the curvature there is of the other sign.
    let back = select(-here.side, real(1), kind == FOLLOWED_BELOW);
    let radius = here.high.radius / select(real(1), here.scale, kind == FOLLOWED_ABOVE);
    let high_by = select(back * law.nu * mirror * bending(law, here.high, radius), real(0), is_free);
    let high_high = select(hessian.high, real(0), is_free);
    let both = select(hessian.both, real(0), is_free);
    let sum = abs(cost) + abs(low_by) + abs(high_by) + abs(hessian.low) + abs(both) + abs(high_high);
    if (is_no_number(sum)) {
        return asked();
    }
    shapes[at + SHAPE_FIRST] = here.u;
    shapes[at + SHAPE_SECOND] = here.v;
    if (forwards) {
        return Evaluation(cost, low_by, high_by, hessian.low, both, high_high, real(1));
    }
    return Evaluation(cost, high_by, low_by, high_high, both, hessian.low, real(1));
}

//:include entry.wgsl ENTRY=evaluate TASKS=params.tasks
    let index = tasks[task];
    let segment = segments[index];
    if (!is_waiting(states[segment.owner])) {
        return;
    }
    let given = SHAPE_NUMBERS * index + SHAPE_GIVEN;
    if (shapes[given] > real(0)) {
        shapes[given] = real(0);
        return;
    }
    let a = angles[3u * index] + turns[segment.first];
    let b = angles[3u * index + 1u] + turns[segment.last];
    let own = evaluation_of(index, segment, a, b);
    found[7u * index] = own.cost;
    found[7u * index + 1u] = own.by_a;
    found[7u * index + 2u] = own.by_b;
    found[7u * index + 3u] = own.by_aa;
    found[7u * index + 4u] = own.by_ab;
    found[7u * index + 5u] = own.by_bb;
    found[7u * index + 6u] = own.exists;
}
