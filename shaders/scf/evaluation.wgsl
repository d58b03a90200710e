// Costs and derivatives of segments of unit chord, one thread a segment.
// Twin: src/scf/evaluation.rs.

struct EvaluationParams {
    tasks: u32,
}

struct Segment {
    // The curve it belongs to.
    owner: u32,
    // Where the turns at its ends stand.
    first: u32,
    last: u32,
    // Four times the number of its universal curve, and how it ends.
    kind: u32,
}

@group(0) @binding(0) var<uniform> params: EvaluationParams;
// The segments to be evaluated.
@group(0) @binding(1) var<storage, read> tasks: array<u32>;
@group(0) @binding(2) var<storage, read> universals: array<real>;
@group(0) @binding(3) var<storage, read> segments: array<Segment>;
// Two a segment, from its chord to the reference directions.
@group(0) @binding(4) var<storage, read> angles: array<real>;
// From the reference directions.
@group(0) @binding(5) var<storage, read> turns: array<real>;
@group(0) @binding(6) var<storage, read> states: array<SlopesState>;
// Seven numbers a segment: cost, first and second derivatives, and whether there is a minimiser.
@group(0) @binding(7) var<storage, read_write> found: array<real>;

//:include scf/slopes/standing.wgsl
//:include scf/trig.wgsl
//:include linalg/power.wgsl
//:include scf/universal.wgsl
//:include scf/root.wgsl
//:include scf/evaluation/segment.wgsl

// Twin: slopes.rs
const ENDS_DIRECTED: u32 = 0u;
const ENDS_FREE_START: u32 = 1u;
const ENDS_FREE_END: u32 = 2u;
const ENDS_STRAIGHT: u32 = 3u;

fn evaluation_of(segment: Segment, a: real, b: real) -> Evaluation {
    let ends = segment.kind & 3u;
    if (ends == ENDS_STRAIGHT) {
        return Evaluation(real(0), real(0), real(0), real(0), real(0), real(0), real(1));
    }
    let curve = universal_of(segment.kind / 4u);
    if (ends == ENDS_DIRECTED) {
        return evaluate_directed(curve, a, b);
    }
    // From the other end, and mirrored, where that is the directed one.
    let own = evaluate_free(curve, select(b, -a, ends == ENDS_FREE_END));
    if (ends == ENDS_FREE_END) {
        return Evaluation(own.cost, -own.by_b, real(0), own.by_bb, real(0), real(0), own.exists);
    }
    return own;
}

//:include entry.wgsl ENTRY=evaluate TASKS=params.tasks
    let index = tasks[task];
    let segment = segments[index];
    if (!is_waiting(states[segment.owner])) {
        return;
    }
    let a = angles[2u * index] + turns[segment.first];
    let b = angles[2u * index + 1u] + turns[segment.last];
    let own = evaluation_of(segment, a, b);
    found[7u * index] = own.cost;
    found[7u * index + 1u] = own.by_a;
    found[7u * index + 2u] = own.by_b;
    found[7u * index + 3u] = own.by_aa;
    found[7u * index + 4u] = own.by_ab;
    found[7u * index + 5u] = own.by_bb;
    found[7u * index + 6u] = own.exists;
}
