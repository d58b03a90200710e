// Rows of the shorter system of long.wgsl: the kept row of every chunk, coupled to the kept row of
// the previous chunk.

@group(0) @binding(4) var<storage, read> parts: array<real>;
@group(0) @binding(5) var<storage, read> part_rhs: array<real>;

fn previous_part(system: System, i: u32) -> u32 {
    return system.start + select(i, system.rows, i == 0u) - 1u;
}

fn load_row(system: System, i: u32) -> Row {
    let k = 5u * (system.start + i);
    let p = 5u * previous_part(system, i);
    let left = parts[k + 1u];
    var row: Row;
    row.excess = parts[k] + left * parts[p + 4u];
    row.left = left * parts[p + 3u];
    row.right = parts[k + 2u];
    return row;
}

//:include linalg/ring/read.wgsl NAME=part_at ARRAY=part_rhs
fn load_rhs(system: System, i: u32) -> columns {
    let left = parts[5u * (system.start + i) + 1u];
    return part_at(2u * (system.start + i)) + left * part_at(2u * previous_part(system, i) + 1u);
}

fn store_kept(system: System, i: u32, x: columns) {
    store_at(system.start + i, x);
}
