// Points of cubic splines, from edges and second derivatives at the knots, each as its displacement
// from the point at the knot before it: the host adds that point in f64.
// Twin: src/spline/sample.rs.
//
// In the span after knot k, of length h, between the points p, q with second derivatives m, n, at
// its fraction u:
//     p(u) − p = u (A + u (B + u C)),   A = (q − p) − h² (2m + n)/6,   B = h² m/2,   C = h² (n − m)/6.

struct SampleParams {
    // Samples of this dispatch.
    count: u32,
    // Samples per span, or per curve, if all have as many.
    each: u32,
    dimension: u32,
}

@group(0) @binding(0) var<uniform> params: SampleParams;
@group(0) @binding(1) var<storage, read> spans: array<real>;
// q − p, after a curve's last knot 0.
@group(0) @binding(2) var<storage, read> edges: array<real>;
@group(0) @binding(3) var<storage, read> second: array<real>;
@group(0) @binding(4) var<storage, read_write> samples: array<real>;
// The knot before each sample, and the fraction of the span after it. For `evenly` the first sample
// of the span after each knot, and the fraction there with the step to the next.
@group(0) @binding(5) var<storage, read> site_knots: array<u32>;
@group(0) @binding(6) var<storage, read> site_fractions: array<real>;
// For `evenly` the first knot of each curve, and the number of all at the end.
@group(0) @binding(7) var<storage, read> curves: array<u32>;

fn evaluate(sample: u32, knot: u32, u: real) {
    let h = spans[knot];
    // After a curve's last knot there is no span: the only point is the knot itself.
    let next = select(knot, knot + 1u, h > real(0));
    for (var c = 0u; c < params.dimension; c++) {
        let k = knot * params.dimension + c;
        let n = next * params.dimension + c;
        let start = h * (h * second[k]);
        let end = h * (h * second[n]);
        let a = edges[k] - (real(2) * start + end) / real(6);
        let b = real(0.5) * start;
        samples[sample * params.dimension + c] = u * (a + u * (b + u * ((end - start) / real(6))));
    }
}

// Every span at the fractions 0, 1/N, …: sample k N + j is fraction j/N of the span after knot k.
//:include entry.wgsl ENTRY=per_span TASKS=params.count
    let j = task % params.each;
    evaluate(task, task / params.each, real(j) / real(params.each));
}

//:include search.wgsl NAME=last_knot AT=site_knots[middle]

// Every curve at equal steps of its parameter.
//:include entry.wgsl ENTRY=evenly TASKS=params.count
    let j = task % params.each;
    let curve = task / params.each;
    let knot = last_knot(curves[curve], curves[curve + 1u] - 1u, j);
    let u = site_fractions[2u * knot] + real(j - site_knots[knot]) * site_fractions[2u * knot + 1u];
    evaluate(task, knot, min(u, real(1)));
}

// Any samples, each at a site of its own.
//:include entry.wgsl ENTRY=at_sites TASKS=params.count
    evaluate(task, site_knots[task], site_fractions[task]);
}
