// The same small matrix applied to the data of many curves, one thread a curve, the curves of a
// workgroup sharing one matrix.
// Twin: src/bezier/operator.rs, whose blocks of four rows and order of sums these are; a test compares the results.

struct ApplyParams {
    groups: u32,
}

// Curves of one workgroup: number `at` of curve k stands at the start of the group's numbers + at ·
// curves + k.
struct ApplyGroup {
    // First block of the matrix.
    matrix: u32,
    rows: u32,
    columns: u32,
    // So many of the rows are handed out; the squares of the others are summed.
    points: u32,
    // First number of the data, point after point, and of the results.
    start: u32,
    out: u32,
    // At most one a thread.
    curves: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: ApplyParams;
@group(0) @binding(1) var<storage, read> groups: array<ApplyGroup>;
// Blocks of four rows, zeros after the last; in a block column after column.
@group(0) @binding(2) var<storage, read> matrices: array<vec4<real>>;
@group(0) @binding(3) var<storage, read> data: array<real>;
// Points, then their magnitude (in f32), then, where some rows are squared, the sum of squares and
// (in f32) of squared magnitudes.
@group(0) @binding(4) var<storage, read_write> found: array<real>;

const BLOCK: u32 = 4u;

//:include entry.wgsl ENTRY=apply
    if (workgroup >= params.groups) {
        return;
    }
    let group = groups[workgroup];
    if (thread >= group.curves) {
        return;
    }
    var energy = real(0);
    //:if F64
    //:else
    // The largest Σ|entry · datum| of points, whose rounding is what f32 loses, and the sum of
    // their squares for the others.
    var magnitude = real(0);
    var energy_magnitude = real(0);
    //:end
    for (var row = 0u; row < group.rows; row += BLOCK) {
        let block = group.matrix + row / BLOCK * group.columns;
        //:unroll c 0..$DIMENSION
        var sums$c = vec4<real>();
        //:if F64
        //:else
        var sizes$c = vec4<real>();
        //:end
        //:end
        for (var column = 0u; column < group.columns; column++) {
            let entries = matrices[block + column];
            let datum = group.start + column * $DIMENSIONu * group.curves + thread;
            //:unroll c 0..$DIMENSION
            let term$c = entries * data[datum + $cu * group.curves];
            sums$c += term$c;
            //:if F64
            //:else
            sizes$c += abs(term$c);
            //:end
            //:end
        }
        //:unroll k 0..4
        if (row + $ku < group.points) {
            let place = group.out + (row + $ku) * $DIMENSIONu * group.curves + thread;
            //:unroll c 0..$DIMENSION
            found[place + $cu * group.curves] = sums$c[$k];
            //:if F64
            //:else
            magnitude = max(magnitude, sizes$c[$k]);
            //:end
            //:end
        } else {
            // Rows of zeros after the last add nothing.
            var square = real(0);
            //:unroll c 0..$DIMENSION
            square += sums$c[$k] * sums$c[$k];
            //:if F64
            //:else
            energy_magnitude += sizes$c[$k] * sizes$c[$k];
            //:end
            //:end
            energy += square;
        }
        //:end
    }
    var place = group.out + group.points * $DIMENSIONu * group.curves + thread;
    //:if F64
    //:else
    found[place] = magnitude;
    place += group.curves;
    //:end
    if (group.points < group.rows) {
        found[place] = energy;
        //:if F64
        //:else
        found[place + group.curves] = energy_magnitude;
        //:end
    }
}
