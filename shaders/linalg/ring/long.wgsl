// Systems longer than a workgroup holds, in three dispatches, one thread per chunk of rows. `reduce`
// reduces every chunk to a row of a shorter system. Any kernel solves that, or it is reduced again.
// `substitute` computes the chunk's other unknowns from the kept unknowns at both of its ends.
// `reduce` alone reads rows, and has their source ROWS. Twin: src/linalg/ring/long.rs.
//:include linalg/ring/mod.wgsl

struct Chunk {
    // Index of the system in the table. The chunk has its rows begin … begin + rows − 1.
    system: u32,
    begin: u32,
    rows: u32,
    // The next chunk of its system (after the last chunk the first).
    next: u32,
}

@group(0) @binding(8) var<storage, read> chunks: array<Chunk>;
// Five numbers per chunk: excess, left and right of the kept row, alpha and share of the last
// eliminated row. After all chunks two numbers per row: alpha and gamma.
@group(0) @binding(9) var<storage, read_write> reduced: array<real>;
// Two vectors per chunk: the right-hand side of the kept row, and delta of the last row. After all
// chunks every row's delta.
@group(0) @binding(10) var<storage, read_write> reduced_rhs: array<real>;
// Solution of the shorter system: the kept unknown of every chunk.
@group(0) @binding(11) var<storage, read> kept_unknowns: array<real>;

//:if ROWS
//:include $ROWS
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
        let place = system.start + at;
        reduced[5u * params.count + 2u * place] = alpha;
        reduced[5u * params.count + 2u * place + 1u] = gamma;
        store_reduced(2u * params.count + place, delta);
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
//:else
//:include linalg/ring/read.wgsl NAME=load_kept ARRAY=kept_unknowns
//:include linalg/ring/read.wgsl NAME=load_reduced ARRAY=reduced_rhs

//:include entry.wgsl ENTRY=substitute TASKS=params.count
    let chunk = chunks[task];
    let system = systems[chunk.system];
    let kept = load_kept(task);
    var x = load_kept(chunk.next);
    for (var i = chunk.rows - 1u; i > 0u; i--) {
        let place = system.start + chunk.begin + i;
        let alpha = reduced[5u * params.count + 2u * place];
        let gamma = reduced[5u * params.count + 2u * place + 1u];
        x = load_reduced(2u * params.count + place) + alpha * kept + gamma * x;
        store_at(place, x);
    }
    store_repeated(system, chunk.begin, kept);
}
//:end
