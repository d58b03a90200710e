// The smooth surface of a triangle mesh, a partition of unity of patches. Twin: src/surface/mesh.rs.

// Twin: mesh/cells.rs
const MOST_CUTS: u32 = 64u;
// No twin: where nodes begin in the table, behind the box around them, how long each is, and the axis of those that are no
// cuts. Lists of the patches of cells follow, and then the patches (src/surface/mesh/cells.rs, src/surface/mesh/patch.rs).
const SURFACE_NODES: u32 = 6u;
const SURFACE_NODE: u32 = 4u;
const SURFACE_NO_AXIS: u32 = 3u;

// Some of the patches, and the largest reach of them.
struct SurfaceCell {
    first: u32,
    count: u32,
    reach: real,
}

// A function with its derivatives at a point, the third along a vector.
struct SurfaceJets {
    value: real,
    gradient: vector,
    hessian: matrix,
    third: matrix,
}

// The weight of a patch and its F.
struct SurfacePatch {
    weight: SurfaceJets,
    own: SurfaceJets,
}

fn surface_vector(at: u32) -> vector {
    return vector(surface_table[at], surface_table[at + 1u], surface_table[at + 2u]);
}

// The patches that reach into the cell of a point. None out of reach of all.
fn surface_cell(x: vector) -> SurfaceCell {
    if (!(all(x >= surface_vector(0u)) && all(x <= surface_vector(3u)))) {
        return SurfaceCell();
    }
    var node = SURFACE_NODES;
    for (var cuts = 0u; cuts < MOST_CUTS; cuts++) {
        let axis = u32(surface_table[node]);
        if (axis == SURFACE_NO_AXIS) {
            break;
        }
        let along = select(select(x.z, x.y, axis == 1u), x.x, axis == 0u);
        let above = u32(surface_table[node + 2u]);
        node = select(above, node + SURFACE_NODE, along < surface_table[node + 1u]);
    }
    return SurfaceCell(u32(surface_table[node + 2u]), u32(surface_table[node + 3u]), surface_table[node + 1u]);
}

// a bᵀ + b aᵀ
fn surface_both(a: vector, b: vector) -> matrix {
    return outer(a, b) + outer(b, a);
}

// The weight and F of a patch at a point within its reach, with derivatives up to an order.
fn surface_patch(at: u32, s: vector, rest: real, along: vector, order: u32) -> SurfacePatch {
    let reach = surface_table[at + 3u];
    let scale = real(1) / reach;
    let normal = surface_vector(at + 4u);
    let xy = surface_table[at + 8u];
    let xz = surface_table[at + 9u];
    let yz = surface_table[at + 11u];
    let bend = matrix(
        vector(surface_table[at + 7u], xy, xz),
        vector(xy, surface_table[at + 10u], yz),
        vector(xz, yz, surface_table[at + 12u]),
    );
    let e = surface_vector(at + 13u);
    let f = surface_vector(at + 16u);
    let a = surface_table[at + 19u];
    let b = surface_table[at + 20u];
    let c = surface_table[at + 21u];
    let d = surface_table[at + 22u];
    let bent = bend * s;
    let u = dot(e, s);
    let v = dot(f, s);
    // Half of the second derivatives along s.
    let uu = a * u + b * v;
    let uv = b * u + c * v;
    let vv = c * u + d * v;
    let by_u = real(0.5) * (uu * u + uv * v);
    let by_v = real(0.5) * (uv * u + vv * v);
    let square = rest * rest;
    var jets = SurfacePatch();
    jets.weight.value = square * square;
    jets.own.value = reach * (dot(normal, s) + real(0.5) * dot(s, bent) + (by_u * u + by_v * v) / real(3));
    if (order >= 1u) {
        jets.weight.gradient = (real(-8) * square * rest * scale) * s;
        jets.own.gradient = normal + bent + by_u * e + by_v * f;
    }
    let ss = outer(s, s);
    if (order >= 2u) {
        jets.weight.hessian = (scale * scale) * (real(48) * square * ss - diagonal(real(8) * square * rest));
        jets.own.hessian = scale * (bend + surface_form(e, f, vector(uu, uv, vv)));
    }
    if (order >= 3u) {
        let way = scale * along;
        let on = dot(s, way);
        let turn = surface_both(s, way) + diagonal(on);
        jets.weight.third = (scale * scale) * ((real(-192) * rest * on) * ss + (real(48) * square) * turn);
        let p = dot(e, way);
        let q = dot(f, way);
        jets.own.third = scale * surface_form(e, f, vector(a * p + b * q, b * p + c * q, c * p + d * q));
    }
    return jets;
}

fn surface_form(e: vector, f: vector, by: vector) -> matrix {
    return by.x * outer(e, e) + by.y * surface_both(e, f) + by.z * outer(f, f);
}

// What the third derivative of a product has of first and second derivatives of both, but for those that change places.
fn surface_half(a: SurfaceJets, b: SurfaceJets, along: vector) -> matrix {
    return dot(a.gradient, along) * b.hessian + surface_both(a.gradient, b.hessian * along);
}

// f g
fn surface_times(f: SurfaceJets, g: SurfaceJets, along: vector, order: u32) -> SurfaceJets {
    var product = SurfaceJets();
    product.value = f.value * g.value;
    if (order >= 1u) {
        product.gradient = g.value * f.gradient + f.value * g.gradient;
    }
    if (order >= 2u) {
        product.hessian = surface_both(f.gradient, g.gradient) + g.value * f.hessian + f.value * g.hessian;
    }
    if (order >= 3u) {
        product.third = surface_half(f, g, along) + surface_half(g, f, along) + g.value * f.third + f.value * g.third;
    }
    return product;
}

// f/g
fn surface_over(f: SurfaceJets, g: SurfaceJets, along: vector, order: u32) -> SurfaceJets {
    let inverse = real(1) / g.value;
    var ratio = SurfaceJets();
    ratio.value = f.value / g.value;
    if (order >= 1u) {
        ratio.gradient = inverse * (f.gradient - ratio.value * g.gradient);
    }
    if (order >= 2u) {
        let mixed = surface_both(ratio.gradient, g.gradient);
        ratio.hessian = inverse * (f.hessian - ratio.value * g.hessian - mixed);
    }
    if (order >= 3u) {
        let mixed = surface_half(ratio, g, along) + surface_half(g, ratio, along);
        ratio.third = inverse * (f.third - ratio.value * g.third - mixed);
    }
    return ratio;
}

// Σ w F / Σ w, with derivatives up to an order. Numbers that are none where nothing reaches.
fn surface_jets(x: vector, along: vector, order: u32) -> SurfaceJets {
    let cell = surface_cell(x);
    var weights = SurfaceJets();
    var sum = SurfaceJets();
    for (var k = 0u; k < cell.count; k++) {
        let at = u32(surface_table[cell.first + k]);
        let s = (real(1) / surface_table[at + 3u]) * (x - surface_vector(at));
        let rest = real(1) - dot(s, s);
        if (rest > real(0)) {
            let jets = surface_patch(at, s, rest, along, order);
            let part = surface_times(jets.weight, jets.own, along, order);
            weights.value += jets.weight.value;
            weights.gradient += jets.weight.gradient;
            weights.hessian += jets.weight.hessian;
            weights.third += jets.weight.third;
            sum.value += part.value;
            sum.gradient += part.gradient;
            sum.hessian += part.hessian;
            sum.third += part.third;
        }
    }
    return surface_over(sum, weights, along, order);
}

fn surface_value(x: vector) -> real {
    return surface_jets(x, vector(), 0u).value;
}

fn surface_gradient(x: vector) -> vector {
    return surface_jets(x, vector(), 1u).gradient;
}

fn surface_hessian(x: vector) -> matrix {
    return surface_jets(x, vector(), 2u).hessian;
}

fn surface_jet(x: vector) -> SurfaceJet {
    let jet = surface_jets(x, vector(), 2u);
    return SurfaceJet(jet.value, jet.gradient, jet.hessian);
}

fn surface_third(x: vector, along: vector) -> matrix {
    return surface_jets(x, along, 3u).third;
}

// Where the way along ∇F ends. The CPU knows the closest point where it leads out of reach.
fn surface_project(x: vector) -> vector {
    let size = surface_cell(x).reach;
    var foot = x;
    for (var k = 0u; k < MOST_STEPS; k++) {
        let jet = surface_jets(foot, vector(), 1u);
        let step = (-jet.value / dot(jet.gradient, jet.gradient)) * jet.gradient;
        foot += step;
        if (sqrt(dot(step, step)) <= LEAST_STEP * max(surface_reach(foot), size)) {
            return foot;
        }
        if (is_no_number(dot(step, step))) {
            break;
        }
    }
    return surface_left(x);
}
