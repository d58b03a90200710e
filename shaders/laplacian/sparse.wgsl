// Sparse rules applied: every thread makes one new point, the weighted sum of the old ones in its
// window. Twin: src/laplacian/sparse.rs, with src/laplacian/stencil.rs for lines and windows.

struct SparseParams {
    families: u32,
    // Values a point.
    dimension: u32,
    radius: u32,
}

// Grids of one shape.
struct SparseFamily {
    grids: u32,
    // Of old points.
    rows: u32,
    columns: u32,
    // First value of the old points, and of the new ones.
    coarse: u32,
    fine: u32,
    // First weight of the stencils; lines of columns among them.
    stencils: u32,
    lines: u32,
    // Lines at each end that see a border, more than there are where every row, or column, is a
    // line.
    row_border: u32,
    column_border: u32,
}

@group(0) @binding(0) var<uniform> params: SparseParams;
@group(0) @binding(1) var<storage, read> families: array<SparseFamily>;
//:include laplacian/family.wgsl
// For every pair of lines a square of radius + 1 rows and columns, the window's weights row after
// row, then zeros.
@group(0) @binding(3) var<storage, read> weights: array<real>;
@group(0) @binding(4) var<storage, read> coarse: array<real>;
@group(0) @binding(5) var<storage, read_write> fine: array<real>;

// The line of a new row, or column.
fn line(row: u32, border: u32, intervals: u32) -> u32 {
    if (row < border) {
        return row;
    }
    if (row + border > 2u * intervals) {
        return 2u * border + 1u - (2u * intervals - row);
    }
    return border + row % 2u;
}

// The old rows (columns) that a new one may look at: the first, and how many.
fn window(row: u32, intervals: u32) -> vec2<u32> {
    let first = (max(row, params.radius) - params.radius + 1u) / 2u;
    let last = min((row + params.radius) / 2u, intervals);
    return vec2<u32>(first, last + 1u - first);
}

//:include entry.wgsl ENTRY=subdivide
    let own = family_task_of(workgroup, thread);
    let family = families[own.x];
    let point = own.y;
    let n = family.rows - 1u;
    let m = family.columns - 1u;
    let points = (2u * n + 1u) * (2u * m + 1u);
    let grid = point / points;
    if (grid >= family.grids) {
        return;
    }
    let row = (point - grid * points) / (2u * m + 1u);
    let column = point - grid * points - row * (2u * m + 1u);
    let high = window(row, n);
    let wide = window(column, m);
    let lines = line(row, family.row_border, n) * family.lines + line(column, family.column_border, m);
    let stencil = family.stencils + lines * (params.radius + 1u) * (params.radius + 1u);
    let width = (m + 1u) * params.dimension;
    let above = family.coarse + grid * (n + 1u) * width + high.x * width + wide.x * params.dimension;
    for (var c = 0u; c < params.dimension; c++) {
        var sum = real(0);
        var weight = stencil;
        for (var a = 0u; a < high.y; a++) {
            var old = above + a * width + c;
            for (var b = 0u; b < wide.y; b++) {
                sum += weights[weight] * coarse[old];
                weight++;
                old += params.dimension;
            }
        }
        fine[family.fine + point * params.dimension + c] = sum;
    }
}
