// Bounded-domain cubic subdivision, one round, and values from coefficients. One thread a coarse
// point. The finer points of a curve start at twice its start. Twin: src/spline/subdivide.rs.
//:include spline/uniform.wgsl

@group(0) @binding(3) var<storage, read_write> fine: array<real>;

//:include entry.wgsl ENTRY=subdivide TASKS=params.points
    let point = task;
    let curve = curves[curve_of(point)];
    let i = point - curve.start;
    if (i >= curve.count) {
        return;
    }
    let d = params.dimension;
    let next = next_of(curve, i);
    let previous = previous_of(curve, i);
    for (var axis = 0u; axis < d; axis++) {
        let here = points[point * d + axis];
        let after = points[next * d + axis];
        var old = here;
        if (!is_end(curve, i)) {
            old = real(0.75) * here + real(0.125) * (points[previous * d + axis] + after);
        }
        fine[2u * point * d + axis] = old;
        // Also after an open curve's last point, where nobody reads it.
        fine[(2u * point + 1u) * d + axis] = real(0.5) * (here + after);
    }
}

// N p: the curve's points on the integers.
//:include entry.wgsl ENTRY=interpolated TASKS=params.points
    let point = task;
    let curve = curves[curve_of(point)];
    let i = point - curve.start;
    if (i >= curve.count) {
        return;
    }
    let d = params.dimension;
    let next = next_of(curve, i);
    let previous = previous_of(curve, i);
    for (var axis = 0u; axis < d; axis++) {
        var value = points[point * d + axis];
        if (!is_end(curve, i)) {
            value = (real(4) * value + (points[previous * d + axis] + points[next * d + axis])) / real(6);
        }
        fine[point * d + axis] = value;
    }
}
