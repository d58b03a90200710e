// Curves on the integers: `count` points from `start` on, `dimension` numbers each.

struct UniformParams {
    // Curves of this dispatch, points of all of them together (with the room between them), numbers
    // a point, and blocks that energies are summed in.
    curves: u32,
    points: u32,
    dimension: u32,
    blocks: u32,
}

struct UniformCurve {
    start: u32,
    count: u32,
    closed: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: UniformParams;
@group(0) @binding(1) var<storage, read> curves: array<UniformCurve>;
@group(0) @binding(2) var<storage, read> points: array<real>;

//:include search.wgsl NAME=last_curve AT=curves[middle].start

// The last curve that starts at or before a point.
fn curve_of(point: u32) -> u32 {
    return last_curve(0u, params.curves, point);
}

fn next_of(curve: UniformCurve, i: u32) -> u32 {
    return curve.start + select(i + 1u, 0u, i + 1u == curve.count);
}

fn previous_of(curve: UniformCurve, i: u32) -> u32 {
    return curve.start + select(i, curve.count, i == 0u) - 1u;
}

fn is_end(curve: UniformCurve, i: u32) -> bool {
    return curve.closed == 0u && (i == 0u || i + 1u == curve.count);
}
