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
const STATUS_SOLVED: u32 = 1u;
const STATUS_SINGULAR: u32 = 2u;

struct Row {
    excess: real,
    left: real,
    right: real,
}

// $R right-hand sides, solved for together.
//:if R1
alias columns = real;
//:else
alias columns = vec$R<real>;
//:end

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> systems: array<System>;
@group(0) @binding(2) var<storage, read_write> status: array<u32>;
@group(0) @binding(3) var<storage, read_write> solution: array<real>;

//:include linalg/ring/write.wgsl NAME=store_at ARRAY=solution
