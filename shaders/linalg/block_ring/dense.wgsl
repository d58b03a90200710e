// Small blocks by rows: block[i] is row i, a column in WGSL.
// Twin: src/linalg/block_ring/dense.rs.

// aᵀ b
fn block_product(a: matrix, b: matrix) -> matrix {
    return b * transpose(a);
}

// aᵀ x
fn block_transposed(a: matrix, x: vector) -> vector {
    return a * x;
}

// a x
fn block_applied(a: matrix, x: vector) -> vector {
    return x * a;
}

fn block_unit() -> matrix {
    var a = matrix();
//:unroll c 0..$DIM
    a[$c][$c] = real(1);
//:end
    return a;
}

// The lower triangle C with C Cᵀ = a, of which the lower triangle is read, with 1/c on the diagonal.
// `smallest` is lowered to the smallest pivot. A pivot that is not positive is reported and counts as
// infinite: it holds its unknown at 0 and keeps the factors from growing. A pivot that is not a finite
// number of f32 is reported as 0.
fn block_cholesky(a: matrix, smallest: ptr<function, real>) -> matrix {
    var c = matrix();
    var pivot = real(0);
//:unroll i 0..$DIM
//:unroll j 0..$i
    c[$i][$j] = a[$i][$j];
//:unroll k 0..$j
    c[$i][$j] -= c[$i][$k] * c[$j][$k];
//:end
    c[$i][$j] *= c[$j][$j];
//:end
    pivot = a[$i][$i];
//:unroll k 0..$i
    pivot -= c[$i][$k] * c[$i][$k];
//:end
    if ((bitcast<u32>(f32(pivot)) & 0x7f800000u) == 0x7f800000u) {
        pivot = real(0);
    }
    *smallest = min(*smallest, pivot);
    if (pivot > real(0)) {
        c[$i][$i] = real(1) / sqrt(pivot);
    }
//:end
    return c;
}

// C⁻¹ b
fn block_under(c: matrix, b: matrix) -> matrix {
    var y = b;
//:unroll i 0..$DIM
//:unroll k 0..$i
    y[$i] -= c[$i][$k] * y[$k];
//:end
    y[$i] *= c[$i][$i];
//:end
    return y;
}

// C⁻¹ x
fn block_under_vector(c: matrix, x: vector) -> vector {
    var y = x;
//:unroll i 0..$DIM
//:unroll k 0..$i
    y[$i] -= c[$i][$k] * y[$k];
//:end
    y[$i] *= c[$i][$i];
//:end
    return y;
}

// C⁻ᵀ x, by columns of Cᵀ.
fn block_over_vector(c: matrix, x: vector) -> vector {
    var y = x;
//:unroll i $DIM..0
    y[$i] *= c[$i][$i];
//:unroll k 0..$i
    y[$k] -= c[$i][$k] * y[$i];
//:end
//:end
    return y;
}
