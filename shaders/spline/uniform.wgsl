// Rows of N, the interpolation matrix of natural cubic splines on the integers: 1/6 2/3 1/6, unit
// rows at the ends of an open curve, times 6. Included by the kernels of linalg/ring.
// Twin: src/spline/uniform.rs.

@group(0) @binding(4) var<storage, read> values: array<real>;

//:include linalg/ring/read.wgsl NAME=value_at ARRAY=values

fn is_end(system: System, i: u32) -> bool {
    return (system.flags & FLAG_CYCLIC) == 0u && (i == 0u || i + 1u == system.rows);
}

fn load_row(system: System, i: u32) -> Row {
    if (is_end(system, i)) {
        return Row(real(1), real(0), real(0));
    }
    return Row(real(6), real(-1), real(-1));
}

fn load_rhs(system: System, i: u32) -> columns {
    let value = value_at(system.start + i);
    if (is_end(system, i)) {
        return value;
    }
    return real(6) * value;
}

fn store(system: System, i: u32, x: columns) {
    store_at(system.start + i, x);
}
