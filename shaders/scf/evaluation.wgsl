// Costs and derivatives of segments, one thread per segment. With TENSION they are segments under
// tension.
// Twin: src/scf/evaluation.rs

struct EvaluationParams {
    tasks: u32,
}

struct Segment {
    // The index of its curve.
    owner: u32,
    // The positions of the turns at its ends.
    first: u32,
    last: u32,
    // Four times the index of its exponent, plus the kind of its ends.
    kind: u32,
}

@group(0) @binding(0) var<uniform> params: EvaluationParams;
// The segments to be evaluated.
@group(0) @binding(1) var<storage, read> tasks: array<u32>;
// A block per exponent: see universal.wgsl, and under tension tension/quadrature.wgsl.
@group(0) @binding(2) var<storage, read> exponents: array<real>;
@group(0) @binding(3) var<storage, read> segments: array<Segment>;
// Three per segment: both angles from its chord to the reference directions, and the chord: 1, or
// in the unit in which λ is 1.
@group(0) @binding(4) var<storage, read> angles: array<real>;
// Turns from the reference directions.
@group(0) @binding(5) var<storage, read> turns: array<real>;
@group(0) @binding(6) var<storage, read> states: array<SlopesState>;
// Seven numbers per segment: an Evaluation.
@group(0) @binding(7) var<storage, read_write> found: array<real>;
//:if TENSION
// SHAPE_NUMBERS per segment, named in tension/evaluate.wgsl.
@group(0) @binding(8) var<storage, read_write> shapes: array<real>;
//:end

struct Evaluation {
    // ∫|κ|^ν ds, under tension ∫(|κ|^ν + λ) ds
    cost: real,
    // ∂/∂a, ∂/∂b
    by_a: real,
    by_b: real,
    // ∂²/∂a², ∂²/∂a∂b, ∂²/∂b²
    by_aa: real,
    by_ab: real,
    by_bb: real,
    // 1 if there is a minimiser, else 0. Under tension −1 asks the host.
    exists: real,
}

// Twin: problem.rs
const ENDS_DIRECTED: u32 = 0u;
const ENDS_FREE_START: u32 = 1u;
const ENDS_FREE_END: u32 = 2u;
const ENDS_STRAIGHT: u32 = 3u;

//:include scf/slopes/standing.wgsl
//:include scf/trig.wgsl
//:include linalg/power.wgsl
//:if TENSION
//:include scf/tension/evaluate.wgsl
//:else
//:include scf/universal.wgsl
//:include scf/root.wgsl
//:include scf/evaluation/segment.wgsl
//:end

//:include entry.wgsl ENTRY=evaluate TASKS=params.tasks
    let index = tasks[task];
    let segment = segments[index];
    if (!is_waiting(states[segment.owner])) {
        return;
    }
//:if TENSION
    if (is_answered(index)) {
        return;
    }
//:end
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
