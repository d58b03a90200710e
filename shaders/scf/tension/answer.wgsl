// Writes the evaluations of the segments that the host was asked for, one thread per segment.
// No twin: the CPU finds its segments at once.

struct AnswerParams {
    tasks: u32,
}

struct Answer {
    segment: u32,
    owner: u32,
    // 1 for the first answer of a curve, which clears the curve's flag.
    is_first: u32,
}

@group(0) @binding(0) var<uniform> params: AnswerParams;
@group(0) @binding(1) var<storage, read> answers: array<Answer>;
// Ten numbers per answer: kind and unknowns of the shape, and the evaluation.
@group(0) @binding(2) var<storage, read> given: array<real>;
@group(0) @binding(3) var<storage, read_write> shapes: array<real>;
@group(0) @binding(4) var<storage, read_write> found: array<real>;
@group(0) @binding(5) var<storage, read_write> states: array<SlopesState>;

//:include scf/slopes/standing.wgsl

//:include entry.wgsl ENTRY=answer TASKS=params.tasks
    let own = answers[task];
    for (var k = 0u; k < 3u; k++) {
        shapes[4u * own.segment + k] = given[10u * task + k];
    }
    // The answer is valid for the next trial.
    shapes[4u * own.segment + 3u] = real(1);
    for (var k = 0u; k < 7u; k++) {
        found[7u * own.segment + k] = given[10u * task + 3u + k];
    }
    if (own.is_first != 0u) {
        states[own.owner].flags &= ~FLAG_ASKED;
    }
}
