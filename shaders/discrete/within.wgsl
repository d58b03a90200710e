// The quadric ½ yᵀA y + b·y + c = 0 that a curve lies in, in its own coordinates. A trial goes along the tangents and then
// back along the gradient. Twin: src/discrete/within.rs.

struct Quadric {
    matrix: matrix,
    linear: vector,
    constant: real,
}

// n and W = ∇²F/|∇F|.
struct Frame {
    normal: vector,
    shape: matrix,
}

fn load_surface_vector(curve: Curve, number: u32) -> vector {
    let at = $SURFACEu + number;
    return vector(load_weight(curve, at), load_weight(curve, at + 1u), load_weight(curve, at + 2u));
}

fn load_surface(curve: Curve) -> Quadric {
    let columns = matrix(load_surface_vector(curve, 0u), load_surface_vector(curve, 3u), load_surface_vector(curve, 6u));
    return Quadric(columns, load_surface_vector(curve, 9u), load_weight(curve, $SURFACEu + 12u));
}

fn frame_at(surface: Quadric, y: vector) -> Frame {
    let gradient = surface.matrix * y + surface.linear;
    let inverse = real(1) / sqrt(dot(gradient, gradient));
    return Frame(inverse * gradient, inverse * surface.matrix);
}

// The way from a place to the surface along ∇F: the root of ½ a t² + s t + F = 0. Where there is none it is no number.
fn way_back(surface: Quadric, y: vector) -> vector {
    let product = surface.matrix * y;
    let gradient = product + surface.linear;
    let value = dot(y, real(0.5) * product + surface.linear) + surface.constant;
    let square = dot(gradient, gradient);
    let bend = dot(gradient, surface.matrix * gradient);
    let root = sqrt(square * square - real(2) * bend * value);
    return (real(-2) * value / (square + root)) * gradient;
}

// (I − a aᵀ) m (I − b bᵀ)
fn in_planes(a: vector, m: matrix, b: vector) -> matrix {
    let left = m - outer(a, a * m);
    return left - outer(left * b, b);
}
