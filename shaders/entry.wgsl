// The head of the entry point $ENTRY. Its body, and the brace that ends it, stand where this is
// included. `task` is the thread's number in the dispatch, `workgroup` that of its workgroup, and
// `thread` its number there. Workgroups stand in rows: a dimension takes 65,535 of them. Where TASKS
// says how many tasks there are, no other thread goes on. No twin: the CPU takes curve after curve.
@compute @workgroup_size($GROUP)
fn $ENTRY(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(num_workgroups) num_workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let workgroup = workgroup_id.x + workgroup_id.y * num_workgroups.x;
    let task = workgroup * $GROUPu + thread;
//:if TASKS
    if (task >= $TASKS) {
        return;
    }
//:end
