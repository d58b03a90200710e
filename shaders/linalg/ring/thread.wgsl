// Batched tridiagonal systems, one thread per system: the ring of lanes.wgsl with a single lane and
// any number of rows. Scratch memory holds the coefficients of the back substitution, two per row.
// The array of the solution holds the intermediate right-hand sides.
// Twin: src/linalg/ring/lanes.rs with a single lane.
//:include linalg/ring/mod.wgsl
//:include $ROWS

@group(0) @binding(8) var<storage, read_write> scratch: array<real>;

//:include linalg/ring/read.wgsl NAME=load_at ARRAY=solution

//:include entry.wgsl ENTRY=solve TASKS=params.count
    let system = systems[task];
    let row = load_row(system, 0u);
    var excess = row.excess;
    var right = row.right;
    var rhs = load_rhs(system, 0u);
    var alpha = real(1);
    var share = real(0);
    var delta = columns();
    for (var i = 1u; i < system.rows; i++) {
        let at = i;
//:include linalg/ring/eliminate.wgsl
        scratch[2u * (system.start + i)] = alpha;
        scratch[2u * (system.start + i) + 1u] = gamma;
        store_at(system.start + i, delta);
        excess += right * share;
        rhs += right * delta;
        right *= gamma;
    }
    // Both neighbours of the kept row are the kept row itself. Only the share remains of its coupling.
    excess += row.left * share;
    rhs += row.left * delta;

    var kept = columns();
    if (excess != real(0)) {
        kept = rhs / excess;
    }
    var x = kept;
    for (var i = system.rows - 1u; i > 0u; i--) {
        let k = 2u * (system.start + i);
        x = load_at(system.start + i) + scratch[k] * kept + scratch[k + 1u] * x;
        store_at(system.start + i, x);
    }
    store_kept(system, 0u, kept);
    status[system.index] = select(STATUS_SOLVED, STATUS_SINGULAR, excess == real(0));
}
