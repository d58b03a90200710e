// Discrete and exact bending energies of splines on the integers, one thread a block of a curve's
// points; the host adds the blocks up. A thread for a whole curve would be slow for long ones, and
// llvmpipe ends a thread's loops, without a word, after 65,535 iterations all told.
// Twin: src/spline/energy.rs.
//:include spline/uniform.wgsl

// The second factor of an inner product; the same array again for an energy.
@group(0) @binding(3) var<storage, read> others: array<real>;
@group(0) @binding(4) var<storage, read_write> energies: array<real>;

struct Block {
    curve: u32,
    // Points begin … end − 1 of the curve.
    begin: u32,
    end: u32,
    padding: u32,
}

@group(0) @binding(5) var<storage, read> blocks: array<Block>;

fn difference(curve: UniformCurve, i: u32, axis: u32) -> real {
    if (is_end(curve, i)) {
        return real(0);
    }
    let d = params.dimension;
    let here = points[(curve.start + i) * d + axis];
    return (points[next_of(curve, i) * d + axis] - here) - (here - points[previous_of(curve, i) * d + axis]);
}

fn other_difference(curve: UniformCurve, i: u32, axis: u32) -> real {
    if (is_end(curve, i)) {
        return real(0);
    }
    let d = params.dimension;
    let here = others[(curve.start + i) * d + axis];
    return (others[next_of(curve, i) * d + axis] - here) - (here - others[previous_of(curve, i) * d + axis]);
}

// Σ |d_i|²
//:include entry.wgsl ENTRY=discrete_energy TASKS=params.blocks
    let block = blocks[task];
    let curve = curves[block.curve];
    var sum = real(0);
    for (var i = block.begin; i < block.end; i++) {
        for (var axis = 0u; axis < params.dimension; axis++) {
            let d = difference(curve, i, axis);
            sum += d * d;
        }
    }
    energies[task] = sum;
}

// Σ (4 d_i·e_i + d_i·e_{i+1} + d_{i+1}·e_i) / 6
//:include entry.wgsl ENTRY=exact_product TASKS=params.blocks
    let block = blocks[task];
    let curve = curves[block.curve];
    var sum = real(0);
    for (var i = block.begin; i < block.end; i++) {
        let next = next_of(curve, i) - curve.start;
        for (var axis = 0u; axis < params.dimension; axis++) {
            let d = difference(curve, i, axis);
            let e = other_difference(curve, i, axis);
            let d_next = difference(curve, next, axis);
            let e_next = other_difference(curve, next, axis);
            sum += real(4) * (d * e) + (d * e_next + d_next * e);
        }
    }
    energies[task] = sum / real(6);
}
