// Many grids in one dispatch: those of one shape are a family, whose threads begin with a workgroup.
// No twin: the CPU takes grids one by one.

// The first workgroup of every family, ascending.
@group(0) @binding(2) var<storage, read> starts: array<u32>;

// The family that a thread works for, and the number of its task there.
fn family_task_of(workgroup: u32, thread: u32) -> vec2<u32> {
    var low = 0u;
    var high = params.families;
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if (starts[middle] <= workgroup) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return vec2<u32>(low, (workgroup - starts[low]) * $GROUPu + thread);
}
