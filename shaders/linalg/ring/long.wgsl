// Systems longer than a workgroup holds, in three dispatches: `reduce` turns every chunk of rows
// into one row of a shorter system, which is solved by any kernel (or reduced again), and
// `substitute` eliminates each chunk anew and substitutes back between the two kept unknowns beside
// it. One thread a chunk. Twin: src/linalg/ring/long.rs.
//:include linalg/ring/mod.wgsl
//:include $ROWS

const CHUNK: u32 = $CHUNKu;

struct Chunk {
    // Index of the system in the table; rows begin … begin + rows − 1 of it.
    system: u32,
    begin: u32,
    rows: u32,
    // The chunk after it along its system (the first again after the last).
    next: u32,
}

@group(0) @binding(8) var<storage, read> chunks: array<Chunk>;
// Five numbers a chunk: excess, left and right of the kept row, alpha and share of the last row
// eliminated …
@group(0) @binding(9) var<storage, read_write> reduced: array<real>;
// … two right-hand sides: that of the kept row, and delta of the last row …
@group(0) @binding(10) var<storage, read_write> reduced_rhs: array<real>;
// … and, once the shorter system is solved, the kept unknown.
@group(0) @binding(11) var<storage, read> kept_unknowns: array<real>;

//:include linalg/ring/read.wgsl NAME=load_kept ARRAY=kept_unknowns
//:include linalg/ring/write.wgsl NAME=store_reduced ARRAY=reduced_rhs

//:include entry.wgsl ENTRY=reduce TASKS=params.count
    let chunk = chunks[task];
    let system = systems[chunk.system];
    let row = load_row(system, chunk.begin);
    var excess = row.excess;
    var right = row.right;
    var rhs = load_rhs(system, chunk.begin);
    var alpha = real(1);
    var share = real(0);
    var delta = columns();
    for (var i = 1u; i < chunk.rows; i++) {
        let at = chunk.begin + i;
//:include linalg/ring/eliminate.wgsl
        excess += right * share;
        rhs += right * delta;
        right *= gamma;
    }
    let k = 5u * task;
    reduced[k] = excess;
    reduced[k + 1u] = row.left;
    reduced[k + 2u] = right;
    reduced[k + 3u] = alpha;
    reduced[k + 4u] = share;
    store_reduced(2u * task, rhs);
    store_reduced(2u * task + 1u, delta);
}

//:include entry.wgsl ENTRY=substitute TASKS=params.count
    let chunk = chunks[task];
    let system = systems[chunk.system];
    var alphas: array<real, CHUNK>;
    var gammas: array<real, CHUNK>;
    var deltas: array<columns, CHUNK>;
    var alpha = real(1);
    var share = real(0);
    var delta = columns();
    for (var i = 1u; i < chunk.rows; i++) {
        let at = chunk.begin + i;
//:include linalg/ring/eliminate.wgsl
        alphas[i] = alpha;
        gammas[i] = gamma;
        deltas[i] = delta;
    }
    let kept = load_kept(task);
    var x = load_kept(chunk.next);
    for (var i = chunk.rows - 1u; i > 0u; i--) {
        x = deltas[i] + alphas[i] * kept + gammas[i] * x;
        store(system, chunk.begin + i, x);
    }
    store(system, chunk.begin, kept);
}
