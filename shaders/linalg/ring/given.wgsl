// Rows from arrays: three bands, or the excesses and edge weights of a network (see Matrix in
// src/linalg/systems.rs). Or the rows of splines on the integers, 1/6 2/3 1/6 and unit rows at the
// ends of an open curve, times 6: only their right-hand sides are in memory.

const ROWS_NETWORK: u32 = 1u;
const ROWS_UNIFORM: u32 = 2u;

// The diagonal, or the excesses of a network.
@group(0) @binding(4) var<storage, read> diagonal: array<real>;
// Both hold the weights of a network.
@group(0) @binding(5) var<storage, read> lower: array<real>;
@group(0) @binding(6) var<storage, read> upper: array<real>;
@group(0) @binding(7) var<storage, read> right_hand_sides: array<real>;

fn load_row(system: System, i: u32) -> Row {
    let cyclic = (system.flags & FLAG_CYCLIC) != 0u;
    let k = system.start + i;
    let last = i + 1u == system.rows;
    var row: Row;
    if (params.kind == ROWS_UNIFORM) {
        if (is_end(system, i)) {
            return Row(real(1), real(0), real(0));
        }
        return Row(real(6), real(-1), real(-1));
    } else if (params.kind == ROWS_NETWORK) {
        row.left = select(real(0), lower[k], cyclic || i > 0u);
        row.right = select(real(0), upper[select(k + 1u, system.start, last)], cyclic || !last);
        row.excess = diagonal[k];
    } else {
        row.left = select(real(0), -lower[k], cyclic || i > 0u);
        row.right = select(real(0), -upper[k], cyclic || !last);
        row.excess = diagonal[k] - row.left - row.right;
    }
    return row;
}

//:include linalg/ring/read.wgsl NAME=given_rhs ARRAY=right_hand_sides
fn load_rhs(system: System, i: u32) -> columns {
    let is_scaled = params.kind == ROWS_UNIFORM && !is_end(system, i);
    return select(real(1), real(6), is_scaled) * given_rhs(system.start + i);
}

fn store_kept(system: System, i: u32, x: columns) {
    store_at(system.start + i, x);
}
