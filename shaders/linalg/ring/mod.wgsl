// Rows of a tridiagonal system in the form that keeps its accuracy: row i reads
//     (excess + left + right) x_i − left x_{i−1} − right x_{i+1} = rhs_i,
// so the row sum is stored, not a band that is a difference. Elimination in this form is a star-mesh
// reduction of a resistor network: it has sums, products and quotients, and no subtraction if all
// three are non-negative.

struct Params {
    // Systems of this dispatch, or chunks of them.
    count: u32,
    // Right-hand sides of a row in memory, and the first one solved for here.
    columns: u32,
    column: u32,
    // Lanes that share a system in lanes.wgsl.
    lanes: u32,
    // Which of the kinds of rows of its source. A branch on a uniform is cheaper than one on flags.
    kind: u32,
}

struct System {
    // First row in the arrays, number of rows.
    start: u32,
    rows: u32,
    flags: u32,
    // Where the status goes.
    index: u32,
}

const FLAG_CYCLIC: u32 = 1u;
// The first unknown stands again after the last.
const FLAG_REPEATED: u32 = 2u;
const STATUS_SOLVED: u32 = 1u;
const STATUS_SINGULAR: u32 = 2u;

struct Row {
    excess: real,
    left: real,
    right: real,
}

// $R right-hand sides, solved for together.
//:if $R == 1
alias columns = real;
//:else
alias columns = vec$R<real>;
//:end

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> systems: array<System>;
@group(0) @binding(2) var<storage, read_write> status: array<u32>;
@group(0) @binding(3) var<storage, read_write> solution: array<real>;

//:include linalg/ring/write.wgsl NAME=store_at ARRAY=solution

fn is_end(system: System, i: u32) -> bool {
    return (system.flags & FLAG_CYCLIC) == 0u && (i == 0u || i + 1u == system.rows);
}

// Stores the kept unknown of row i. FLAG_REPEATED stores the unknown of row 0 a second time, after the
// last. Sources without repeated rows define `store_kept` without flags, which spares a register.
fn store_repeated(system: System, i: u32, x: columns) {
    store_at(system.start + i, x);
    if (i == 0u && (system.flags & FLAG_REPEATED) != 0u) {
        store_at(system.start + system.rows, x);
    }
}
