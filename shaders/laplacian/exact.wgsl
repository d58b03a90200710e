// The exact rule, by cosine transforms along rows and tridiagonal systems along columns, in four
// steps. Twin: src/laplacian/exact.rs, but that the transforms are plain sums here, over cosines
// from the host.

struct ExactParams {
    families: u32,
    // Values a point.
    dimension: u32,
}

// Grids of one shape.
struct ExactFamily {
    grids: u32,
    // Of old points.
    rows: u32,
    columns: u32,
    // First value of the old points, and of the new ones.
    coarse: u32,
    fine: u32,
    // First number of the spectra, and of v and what is as large. Both stand row after row,
    // coordinate after coordinate, frequency after frequency.
    spectrum: u32,
    v: u32,
    // The table cos(πk / intervals), k = 0 … 2 · intervals − 1, then 2 − 2 cos(πk / intervals), k =
    // 0 … intervals.
    table: u32,
    intervals: u32,
    // Places of the table that are one frequency of the fine grid.
    step: u32,
}

@group(0) @binding(0) var<uniform> params: ExactParams;
@group(0) @binding(1) var<storage, read> families: array<ExactFamily>;
//:include laplacian/family.wgsl
@group(0) @binding(3) var<storage, read> tables: array<real>;
@group(0) @binding(4) var<storage, read> coarse: array<real>;
@group(0) @binding(5) var<storage, read_write> spectrum: array<real>;
@group(0) @binding(6) var<storage, read_write> v: array<real>;
// Pivots, then W.
@group(0) @binding(7) var<storage, read_write> w: array<real>;
@group(0) @binding(8) var<storage, read_write> fine: array<real>;

//:include laplacian/exact/cosines.wgsl NAME=coarse_cosines ARRAY=coarse
//:include laplacian/exact/cosines.wgsl NAME=v_cosines ARRAY=v

// The spectra of all rows: a thread has one coordinate of a row and two frequencies, k and m − k.
//:include entry.wgsl ENTRY=forward
    let own = family_task_of(workgroup, thread);
    let family = families[own.x];
    let m = family.columns - 1u;
    let pairs = m / 2u + 1u;
    // Row after row of all grids, each coordinate by itself.
    let line = own.y / pairs;
    let k = own.y - line * pairs;
    if (line >= family.grids * family.rows * params.dimension) {
        return;
    }
    let row = line / params.dimension;
    let first = family.coarse + row * family.columns * params.dimension + line - row * params.dimension;
    let sums = coarse_cosines(first, params.dimension, m, family.table, 2u * family.intervals, 2u * family.step * k);
    let place = family.spectrum + line * family.columns;
    spectrum[place + k] = sums.x + sums.y;
    spectrum[place + m - k] = sums.x - sums.y;
}

// v of one coordinate and frequency of a grid.
//:include entry.wgsl ENTRY=sweep
    let own = family_task_of(workgroup, thread);
    let family = families[own.x];
    let wide = 2u * family.columns - 1u;
    let sweeps = params.dimension * wide;
    let grid = own.y / sweeps;
    if (grid >= family.grids) {
        return;
    }
    let sweep = own.y - grid * sweeps;
    let c = sweep / wide;
    let l = sweep - c * wide;
    let last = family.rows - 1u;
    // Putting zeros between points repeats their spectrum, mirrored.
    var p = family.spectrum + grid * family.rows * params.dimension * family.columns + c * family.columns + min(l, wide - 1u - l);
    let stride = params.dimension * family.columns;
    var place = family.v + grid * family.rows * sweeps + sweep;
    if (l == 0u) {
        // λ = 0, the mean of each row, whose system is singular.
        for (var row = 0u; row <= last; row++) {
            v[place] = spectrum[p];
            p += stride;
            place += sweeps;
        }
        return;
    }
    let lambda = tables[family.table + 2u * family.intervals + l * family.step];
    let diagonal = real(2) + lambda * (real(4) + lambda);
    // The first and the last equation, halved, make the system symmetric.
    var pivot = real(1) / (real(0.5) * diagonal);
    var y = real(0.5) * spectrum[p] * pivot;
    w[place] = pivot;
    v[place] = y;
    for (var row = 1u; row <= last; row++) {
        p += stride;
        place += sweeps;
        let weight = select(real(1), real(0.5), row == last);
        pivot = real(1) / (weight * diagonal - pivot);
        y = (weight * spectrum[p] + y) * pivot;
        w[place] = pivot;
        v[place] = y;
    }
    let of_p = (real(4) - lambda) / (real(4) + lambda);
    let of_bend = real(2) * lambda / (real(4) + lambda);
    var below = real(0);
    for (var row = last; row > 0u; row--) {
        let above = v[place - sweeps] + w[place - sweeps] * y;
        below = select(below, above, row == last);
        v[place] = of_p * spectrum[p] + of_bend * ((y - above) + (y - below));
        below = y;
        y = above;
        p -= stride;
        place -= sweeps;
    }
    v[place] = of_p * spectrum[p] + of_bend * ((y - below) + (y - below));
}

// W: a thread has one coordinate of a row and two columns, j and 2m − j.
//:include entry.wgsl ENTRY=inverse
    let own = family_task_of(workgroup, thread);
    let family = families[own.x];
    let m = family.columns - 1u;
    let line = own.y / (m + 1u);
    let j = own.y - line * (m + 1u);
    if (line >= family.grids * family.rows * params.dimension) {
        return;
    }
    let place = family.v + line * (2u * m + 1u);
    let sums = v_cosines(place, 1u, 2u * m, family.table, 2u * family.intervals, family.step * j);
    let scale = real(2) / real(m);
    w[place + j] = scale * (sums.x + sums.y);
    w[place + 2u * m - j] = scale * (sums.x - sums.y);
}

// One value of the fine grid from W.
//:include entry.wgsl ENTRY=combine
    let own = family_task_of(workgroup, thread);
    let family = families[own.x];
    let wide = 2u * family.columns - 1u;
    let width = params.dimension * wide;
    let values = (2u * family.rows - 1u) * width;
    let grid = own.y / values;
    if (grid >= family.grids) {
        return;
    }
    let value = own.y - grid * values;
    let row = value / width;
    let j = (value - row * width) / params.dimension;
    let c = value - row * width - j * params.dimension;
    let start = family.v + (grid * family.rows + row / 2u) * width + c * wide;
    let place = start + j;
    var x = real(0);
    if (row % 2u == 1u) {
        x = real(0.5) * (w[place] + w[place + width]);
    } else {
        // Beyond the border stands the mirror image.
        let left = select(place - 1u, place + 1u, j == 0u);
        let right = select(place + 1u, place - 1u, j == wide - 1u);
        x = real(2) * w[place] - real(0.5) * (w[left] + w[right]);
    }
    fine[family.fine + own.y] = x;
}
