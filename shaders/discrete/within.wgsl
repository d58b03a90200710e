// The surface that a curve lies in. A trial goes along the tangents and then back along the
// gradient.
// Twin: src/discrete/within.rs.

fn load_surface_vector(curve: Curve, number: u32) -> vector {
    let at = $SURFACEu + number;
    return vector(load_weight(curve, at), load_weight(curve, at + 1u), load_weight(curve, at + 2u));
}

// A surface F = 0 with the text SURFACE_WGSL, which has F and its derivatives in units of the
// input, at the position origin + size · y. With SURFACE_JET and SURFACE_PROJECT the text also has
// those functions.
//:if SURFACE_WGSL
// Twin: ../surface/mod.rs
const MOST_STEPS: u32 = 50u;
// No twin: 4 ε of f64, the precision of these kernels.
const LEAST_STEP: real = real(8.881784197001252e-16);

// F and its derivatives at a point.
struct SurfaceJet {
    value: real,
    gradient: vector,
    hessian: matrix,
}

// Whether the text has left the curve to the host.
var<private> is_left: bool;

// NaN: the trial is rejected.
fn surface_nowhere(x: vector) -> vector {
    return vector(sqrt(real(-1) - dot(x, x)));
}

// NaN for a curve that is left to the host.
fn surface_left(x: vector) -> vector {
    is_left = true;
    return surface_nowhere(x);
}

// The largest absolute coordinate.
fn surface_reach(x: vector) -> real {
    return max(max(abs(x.x), abs(x.y)), abs(x.z));
}

$SURFACE_WGSL

//:if SURFACE_JET
//:else
fn surface_jet(x: vector) -> SurfaceJet {
    return SurfaceJet(surface_value(x), surface_gradient(x), surface_hessian(x));
}

//:end
//:if SURFACE_PROJECT
//:else
fn surface_project(x: vector) -> vector {
    var foot = x;
    for (var k = 0u; k < MOST_STEPS; k++) {
        let gradient = surface_gradient(foot);
        let step = (-surface_value(foot) / dot(gradient, gradient)) * gradient;
        foot += step;
        if (sqrt(dot(step, step)) <= LEAST_STEP * surface_reach(foot)) {
            return foot;
        }
    }
    return surface_nowhere(x);
}

//:end
struct Surface {
    origin: vector,
    size: real,
}

struct Frame {
    // n and W = ∇²F/|∇F|.
    normal: vector,
    shape: matrix,
    // The position, and size²/|∇F|, the unit of third derivatives.
    place: vector,
    unit: real,
}

fn load_surface(curve: Curve) -> Surface {
    return Surface(load_surface_vector(curve, 0u), load_weight(curve, $SURFACEu + 3u));
}

fn frame_at(surface: Surface, y: vector) -> Frame {
    let x = surface.origin + surface.size * y;
    let jet = surface_jet(x);
    let inverse = real(1) / sqrt(dot(jet.gradient, jet.gradient));
    let unit = surface.size * inverse;
    return Frame(inverse * jet.gradient, unit * jet.hessian, x, surface.size * unit);
}

// The displacement from a position to its projection onto the surface.
fn way_back(surface: Surface, y: vector) -> vector {
    let x = surface.origin + surface.size * y;
    return (surface_project(x) - x) * (real(1) / surface.size);
}
//:else
// The quadric ½ yᵀA y + b·y + c = 0 in the coordinates of the curve.
struct Surface {
    matrix: matrix,
    linear: vector,
    constant: real,
}

// n and W = ∇²F/|∇F|.
struct Frame {
    normal: vector,
    shape: matrix,
}

fn load_surface(curve: Curve) -> Surface {
    let columns = matrix(load_surface_vector(curve, 0u), load_surface_vector(curve, 3u), load_surface_vector(curve, 6u));
    return Surface(columns, load_surface_vector(curve, 9u), load_weight(curve, $SURFACEu + 12u));
}

fn frame_at(surface: Surface, y: vector) -> Frame {
    let gradient = surface.matrix * y + surface.linear;
    let inverse = real(1) / sqrt(dot(gradient, gradient));
    return Frame(inverse * gradient, inverse * surface.matrix);
}

// The displacement from a position to the surface along ∇F: the root of ½ a t² + s t + F = 0, or
// NaN if it is missing.
fn way_back(surface: Surface, y: vector) -> vector {
    let product = surface.matrix * y;
    let gradient = product + surface.linear;
    let value = dot(y, real(0.5) * product + surface.linear) + surface.constant;
    let square = dot(gradient, gradient);
    let bend = dot(gradient, surface.matrix * gradient);
    let root = sqrt(square * square - real(2) * bend * value);
    return (real(-2) * value / (square + root)) * gradient;
}
//:end

// (I − a aᵀ) m (I − b bᵀ)
fn in_planes(a: vector, m: matrix, b: vector) -> matrix {
    let left = m - outer(a, a * m);
    return left - outer(left * b, b);
}
