// Tasks, curves and states of descents, in arrays.

struct DescentTask {
    slot: u32,
    // Without LANES: as many as the loops of the longest curve of the workgroup allow.
    ticks: u32,
}

struct DescentCurve {
    // First words in the interleaved arrays.
    fixed_start: u32,
    displacement_start: u32,
    work_start: u32,
    // Rows per section: as many as the longest curve of the group has.
    stride: u32,
    segments: u32,
    closed: u32,
}

struct DescentState {
    termination: u32,
    iterations: u32,
    evaluations: u32,
    // 1: the previous step was undamped and not cut short.
    flags: u32,
    since_best: u32,
    most_iterations: u32,
}
