// Points of cubic splines, from values and second derivatives at the knots. Twin: src/spline/sample.rs.
//
// In the span after knot k, of length h, at its fraction u, with a = 1 − u:
//     p = a y_k + u y_{k+1} + h²/6 ((a³ − a) M_k + (u³ − u) M_{k+1}).

struct SampleParams {
    // Samples of this dispatch.
    count: u32,
    // Samples a span, where every span has as many.
    per_span: u32,
    dimension: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: SampleParams;
@group(0) @binding(1) var<storage, read> spans: array<real>;
@group(0) @binding(2) var<storage, read> values: array<real>;
@group(0) @binding(3) var<storage, read> second: array<real>;
@group(0) @binding(4) var<storage, read_write> samples: array<real>;
// The knot before each sample, and the fraction of the span after it.
@group(0) @binding(5) var<storage, read> site_knots: array<u32>;
@group(0) @binding(6) var<storage, read> site_fractions: array<real>;

fn evaluate(sample: u32, knot: u32, u: real) {
    let h = spans[knot];
    // After a curve's last knot there is no span: the only point is the knot itself.
    let next = select(knot, knot + 1u, h > real(0));
    let a = real(1) - u;
    let wa = (a * a * a - a) * (h * h / real(6));
    let wu = (u * u * u - u) * (h * h / real(6));
    for (var c = 0u; c < params.dimension; c++) {
        let k = knot * params.dimension + c;
        let n = next * params.dimension + c;
        samples[sample * params.dimension + c] = a * values[k] + u * values[n] + (wa * second[k] + wu * second[n]);
    }
}

fn sample_index(workgroup: vec3<u32>, workgroups: vec3<u32>, thread: u32) -> u32 {
    return (workgroup.x + workgroup.y * workgroups.x) * $GROUPu + thread;
}

// Every span at the fractions 0, 1/N, …: sample k N + j is fraction j/N of the span after knot k.
@compute @workgroup_size($GROUP)
fn per_span(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let sample = sample_index(workgroup, workgroups, thread);
    if (sample < params.count) {
        let j = sample % params.per_span;
        evaluate(sample, sample / params.per_span, real(j) / real(params.per_span));
    }
}

// Any samples, each at a site of its own.
@compute @workgroup_size($GROUP)
fn at_sites(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let sample = sample_index(workgroup, workgroups, thread);
    if (sample < params.count) {
        evaluate(sample, site_knots[sample], site_fractions[sample]);
    }
}
