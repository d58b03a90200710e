// The system (H + λL) p = −g of a curve, where H is the Hessian of its energy and regularisation
// over windows of two edges, L the inner product of order 1 or 2 without projections, and λ ≥ 0.
// Twin: src/discrete/newton.rs, with src/linalg/banded.rs.
//
// One walk along the curve assembles and eliminates. A front holds the blocks of the three vertices
// that a window touches. After the last window of a vertex has been added, the vertex is eliminated
// and the front moves on by one. Only what back substitution needs is stored. On a closed curve the
// first two vertices, the border, are kept for the end. The walk continues past the last vertex to
// two more, which are the border again and are added to it.
//:include discrete/newton/damping.wgsl

struct Front {
    // With respect to the vertices v, v + 1 and v + 2; a01: rows of v, columns of v + 1.
    a00: matrix,
    a01: matrix,
    a02: matrix,
    a11: matrix,
    a12: matrix,
    a22: matrix,
    // With respect to them (rows) and the two vertices of the border.
    b00: matrix,
    b01: matrix,
    b10: matrix,
    b11: matrix,
    b20: matrix,
    b21: matrix,
    // With respect to the vertices of the border.
    c00: matrix,
    c01: matrix,
    c11: matrix,
    // Right-hand sides, also of the border.
    r0: vector,
    r1: vector,
    r2: vector,
    s0: vector,
    s1: vector,
    // Whether all pivots were positive.
    sound: bool,
}

struct Inverse {
    inverse: matrix,
    sound: bool,
}

// The inverse of a symmetric block as Σ rᵀ r / pivot over the rows r of L⁻¹, where m = L D Lᵀ; and
// whether all pivots are positive.
fn positive_inverse(m: matrix) -> Inverse {
    let p0 = m[0][0];
    let l10 = m[0][1] / p0;
    let p1 = m[1][1] - l10 * m[0][1];
    var sound = is_pivot(p0) && is_pivot(p1);
//:if SPATIAL
    let l20 = m[0][2] / p0;
    let c21 = m[1][2] - l20 * m[0][1];
    let l21 = c21 / p1;
    let p2 = m[2][2] - l20 * m[0][2] - l21 * c21;
    sound = sound && is_pivot(p2);
    let row1 = vector(-l10, real(1), real(0));
    let row2 = vector(l10 * l21 - l20, -l21, real(1));
    let first = outer(vector(real(1) / p0, real(0), real(0)), vector(real(1), real(0), real(0)));
    return Inverse(first + outer(row1 / p1, row1) + outer(row2 / p2, row2), sound);
//:else
    let row1 = vector(-l10, real(1));
    return Inverse(outer(vector(real(1) / p0, real(0)), vector(real(1), real(0))) + outer(row1 / p1, row1), sound);
//:end
}

fn is_pivot(x: real) -> bool {
    return x > real(0) && !is_out_of_range(x);
}

// 1 if vertex v, which may be past the end, may move, else 0.
fn takes_part(curve: Curve, v: u32) -> real {
    if (v >= curve.vertices && curve.closed == 0u) {
        return real(0);
    }
    let own = select(v, v - curve.vertices, v >= curve.vertices);
    return select(real(0), real(1), is_movable(curve, own));
}

// Adds the blocks of the window from vertex v, for the vertices that may move.
fn add_window(front: ptr<function, Front>, blocks: VertexBlocks, damping: vec3<real>, part: vec3<real>) {
    (*front).a00 += part.x * (blocks.v00 + diagonal(damping.x * damping.x));
    (*front).a01 += (part.x * part.y) * (blocks.v01 + diagonal(damping.x * damping.y));
    (*front).a02 += (part.x * part.z) * (blocks.v02 + diagonal(damping.x * damping.z));
    (*front).a11 += part.y * (blocks.v11 + diagonal(damping.y * damping.y));
    (*front).a12 += (part.y * part.z) * (blocks.v12 + diagonal(damping.y * damping.z));
    (*front).a22 += part.z * (blocks.v22 + diagonal(damping.z * damping.z));
}

// Eliminates the front's first vertex, v.
fn eliminate(front: ptr<function, Front>, curve: Curve, v: u32) {
    let pivot = positive_inverse((*front).a00);
    (*front).sound = (*front).sound && pivot.sound;
    let next = transpose((*front).a01);
    let after = transpose((*front).a02);
    let y = pivot.inverse * (*front).r0;
    let u1 = pivot.inverse * (*front).a01;
    let u2 = pivot.inverse * (*front).a02;
    (*front).a11 -= next * u1;
    (*front).a12 -= next * u2;
    (*front).a22 -= after * u2;
    (*front).r1 -= next * y;
    (*front).r2 -= after * y;
    store_vector(curve.p, v, y);
    store_matrix(curve.factor, 2u * v, u1);
    store_matrix(curve.factor, 2u * v + 1u, u2);
    if (curve.closed != 0u) {
        let w0 = pivot.inverse * (*front).b00;
        let w1 = pivot.inverse * (*front).b01;
        let first = transpose((*front).b00);
        let second = transpose((*front).b01);
        (*front).b10 -= next * w0;
        (*front).b11 -= next * w1;
        (*front).b20 -= after * w0;
        (*front).b21 -= after * w1;
        (*front).c00 -= first * w0;
        (*front).c01 -= first * w1;
        (*front).c11 -= second * w1;
        (*front).s0 -= first * y;
        (*front).s1 -= second * y;
        store_matrix(curve.border, 2u * v, w0);
        store_matrix(curve.border, 2u * v + 1u, w1);
    }
}

// Stores the front's first vertex, v, for the border.
fn keep(front: ptr<function, Front>, v: u32) {
    if (v == 0u) {
        (*front).c00 = (*front).a00;
        (*front).b10 = transpose((*front).a01);
        (*front).b20 = transpose((*front).a02);
        (*front).s0 = (*front).r0;
    } else {
        (*front).c11 = (*front).a00;
        (*front).c01 = transpose((*front).b00);
        (*front).b11 = transpose((*front).a01);
        (*front).b21 = transpose((*front).a02);
        (*front).s1 = (*front).r0;
    }
}

// Moves the front on by one vertex.
fn move_on(front: ptr<function, Front>) {
    (*front).a00 = (*front).a11;
    (*front).a01 = (*front).a12;
    (*front).a02 = matrix();
    (*front).a11 = (*front).a22;
    (*front).a12 = matrix();
    (*front).a22 = matrix();
    (*front).b00 = (*front).b10;
    (*front).b01 = (*front).b11;
    (*front).b10 = (*front).b20;
    (*front).b11 = (*front).b21;
    (*front).b20 = matrix();
    (*front).b21 = matrix();
    (*front).r0 = (*front).r1;
    (*front).r1 = (*front).r2;
    (*front).r2 = vector();
}

// Assembles and eliminates all vertices except the border.
fn walk(curve: Curve, weights: Weights, lambda: real) -> Front {
    var front = Front();
    front.sound = true;
    var w = shifted(window_of(curve, weights), current_edge(curve, 0u));
    var part = vec3<real>(real(0), takes_part(curve, 0u), takes_part(curve, 1u));
//:if SURFACE
    let surface = load_surface(curve);
    var frame = current_frame(curve, surface, 0);
    var next = current_frame(curve, surface, 1);
//:end
    for (var v = 0u; v < curve.vertices; v++) {
        let j = i32(v);
        var edge = unit_edge();
        if (has_edge(curve, j + 1)) {
            edge = current_edge(curve, wrapped(curve, j + 1));
        }
        w = shifted(w, edge);
        w = placed(w, curve, j);
        part = vec3<real>(part.y, part.z, takes_part(curve, v + 2u));
        let edges = edges_from(curve, j);
//:if SURFACE
        w = framed(w, next);
        let after = current_frame(curve, surface, j + 2);
        let row = damping_row(curve, w, edges, lambda);
        let normals = array<vector, 3>(frame.normal, next.normal, after.normal);
        let blocks = in_tangent_planes(curve, w, edges, blocks_of(curve, w, weights, edges), row, normals);
        add_window(&front, blocks, vec3<real>(), part);
//:else
        add_window(&front, blocks_of(curve, w, weights, edges), damping_row(curve, w, edges, lambda), part);
//:end
        // The row of a vertex that may not move is a unit row.
        var own = real(1) - part.x;
//:if ATTACHMENT
        own += part.x * share_of(lambda) * load_stiffness(curve, v);
//:end
//:if SOBOLEV
//:else
//:if ATTACHMENT
        let held = anchor_hessian(load_anchor(curve, v), current_offset(curve, v));
//:if SURFACE
        front.a00 += part.x * in_planes(frame.normal, held, frame.normal);
//:else
        front.a00 += part.x * held;
//:end
//:end
//:if REGIONS
        front.a00 += part.x * regions_hessian(curve, v, displacement(curve, v));
//:end
//:end
//:if SURFACE
        front.a00 += part.x * bend_of_surface(curve, v, frame);
        frame = next;
        next = after;
//:end
        front.a00 += diagonal(own);
        front.r0 -= work_vector(curve.g, v);
        if (v < 2u && curve.closed != 0u) {
            keep(&front, v);
        } else {
            eliminate(&front, curve, v);
        }
        move_on(&front);
    }
    return front;
}

// The unknowns of the border.
struct Border {
    x0: vector,
    x1: vector,
    sound: bool,
}

fn solve_border(front: Front) -> Border {
    let c00 = front.c00 + front.a00 + front.b00 + transpose(front.b00);
    let c01 = front.c01 + front.a01 + front.b01 + transpose(front.b10);
    let c11 = front.c11 + front.a11 + front.b11 + transpose(front.b11);
    let first = positive_inverse(c00);
    let both = transpose(c01);
    let y = first.inverse * (front.s0 + front.r0);
    let u = first.inverse * c01;
    let second = positive_inverse(c11 - both * u);
    let x1 = second.inverse * (front.s1 + front.r1 - both * y);
    return Border(y - u * x1, x1, first.sound && second.sound);
}

// p at the current curve.
fn newton_direction(curve: Curve, weights: Weights, lambda: real) -> Found {
    let is_closed = curve.closed != 0u;
    let front = walk(curve, weights, lambda);
    var border = Border(vector(), vector(), true);
    if (is_closed) {
        border = solve_border(front);
    }
    var found = Found(front.sound && border.sound, real(0), real(0));
    var next = border.x0;
    var after = border.x1;
    for (var k = curve.vertices; k > 0u; k--) {
        let v = k - 1u;
        var x = select(border.x0, border.x1, v == 1u);
        if (v >= 2u || !is_closed) {
            x = work_vector(curve.p, v);
            x -= work_matrix(curve.factor, 2u * v) * next + work_matrix(curve.factor, 2u * v + 1u) * after;
            if (is_closed) {
                x -= work_matrix(curve.border, 2u * v) * border.x0 + work_matrix(curve.border, 2u * v + 1u) * border.x1;
            }
        }
        store_vector(curve.p, v, x);
        found.slope += dot(work_vector(curve.g, v), x);
        if (v < curve.segments) {
            found.largest_square = max(found.largest_square, relative_change(curve, v, next - x));
        }
        after = next;
        next = x;
    }
    return found;
}

fn aim(lane: ptr<function, Lane>, curve: Curve, weights: Weights) -> real {
    let found = newton_direction(curve, weights, (*lane).lambda);
    end_before(lane, curve, found);
    return aimed(lane, found);
}
