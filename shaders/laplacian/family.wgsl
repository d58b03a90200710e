// Many grids in one dispatch: those of one shape are a family, whose threads begin with a workgroup.
// No twin: the CPU takes grids one by one.

// The first workgroup of every family, ascending.
@group(0) @binding(2) var<storage, read> starts: array<u32>;

//:include search.wgsl NAME=last_family AT=starts[middle]

// The family that a thread works for, and the number of its task there.
fn family_task_of(workgroup: u32, thread: u32) -> vec2<u32> {
    let family = last_family(0u, params.families, workgroup);
    return vec2<u32>(family, (workgroup - starts[family]) * $GROUPu + thread);
}
