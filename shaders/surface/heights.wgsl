// Terrain over a grid, the bicubic spline z = h(x, y). Twin: src/surface/heights.rs.

const DESCENT_STEPS: u32 = 100u;
const MOST_HALVINGS: u32 = 40u;

// No twin: where rows, columns, Δx, Δy, x₀ and y₀ stand in the table, and behind them h, h_uu, h_vv and h_uuvv of every node.
const SURFACE_ROWS: u32 = 0u;
const SURFACE_COLUMNS: u32 = 1u;
const SURFACE_SPACING: u32 = 2u;
const SURFACE_ORIGIN: u32 = 4u;
const SURFACE_NODES: u32 = 6u;

// A place along one axis: its span, and by what the value and the bend at both ends of the span count there.
struct SurfacePlace {
    span: u32,
    // t within the span, from 0 to 1, and by how much the place is beyond the grid.
    t: real,
    beyond: real,
    // 1/Δ
    rate: real,
}

fn surface_along(x: real, origin: real, spacing: real, count: real) -> SurfacePlace {
    let u = (x - origin) / spacing;
    let inside = clamp(u, real(0), count - real(1));
    let span = min(u32(inside), u32(count) - 2u);
    return SurfacePlace(span, inside - real(span), u - inside, real(1) / spacing);
}

// The weights, for a derivative by x, of f₀, f₀″, f₁ and f₁″.
fn surface_weights(place: SurfacePlace, order: u32) -> vec4<real> {
    let rate = place.rate;
    var scale = real(1);
    switch order {
        case 0u: {}
        case 1u: { scale = rate; }
        case 2u: { scale = rate * rate; }
        default: { scale = rate * (rate * rate); }
    }
    return scale * surface_within(place, order);
}

// Those by u. Beyond the grid the tangent goes on.
fn surface_within(place: SurfacePlace, order: u32) -> vec4<real> {
    let a = real(1) - place.t;
    let b = place.t;
    let slopes = vec4<real>(
        real(-1),
        -(real(3) * a * a - real(1)) / real(6),
        real(1),
        (real(3) * b * b - real(1)) / real(6),
    );
    switch order {
        case 0u: {
            let own = vec4<real>(a, (a * a - real(1)) * a / real(6), b, (b * b - real(1)) * b / real(6));
            return own + place.beyond * slopes;
        }
        case 1u: {
            return slopes;
        }
        default: {}
    }
    let second = vec4<real>(real(0), a, real(0), b);
    let third = vec4<real>(real(0), real(-1), real(0), real(1));
    return select(select(third, second, order == 2u), vec4<real>(), place.beyond != real(0));
}

// The patch of a place.
struct SurfaceCell {
    // Its first node, and the one in the next row.
    first: u32,
    next: u32,
    x: SurfacePlace,
    y: SurfacePlace,
}

fn surface_cell(x: vector) -> SurfaceCell {
    let columns = surface_table[SURFACE_COLUMNS];
    let at = SURFACE_ORIGIN;
    let along = surface_along(x.x, surface_table[at], surface_table[SURFACE_SPACING], columns);
    let across = surface_along(x.y, surface_table[at + 1u], surface_table[SURFACE_SPACING + 1u], surface_table[SURFACE_ROWS]);
    let first = SURFACE_NODES + 4u * (across.span * u32(columns) + along.span);
    return SurfaceCell(first, first + 4u * u32(columns), along, across);
}

fn surface_row(x: vec4<real>, left: u32) -> real {
    let right = left + 4u;
    return x.x * surface_table[left] + x.y * surface_table[left + 1u]
        + (x.z * surface_table[right] + x.w * surface_table[right + 1u]);
}

// ∂ⁱ⁺ʲh/∂xⁱ∂yʲ
fn surface_derivative(cell: SurfaceCell, i: u32, j: u32) -> real {
    let x = surface_weights(cell.x, i);
    let y = surface_weights(cell.y, j);
    return y.x * surface_row(x, cell.first) + y.y * surface_row(x, cell.first + 2u)
        + (y.z * surface_row(x, cell.next) + y.w * surface_row(x, cell.next + 2u));
}

fn surface_slope(cell: SurfaceCell) -> vector {
    return vector(-surface_derivative(cell, 1u, 0u), -surface_derivative(cell, 0u, 1u), real(1));
}

// Minus the symmetric matrix of h_xx, h_xy and h_yy, which has no part along z.
fn surface_sheet(bend: vector) -> matrix {
    return matrix(vector(-bend.x, -bend.y, real(0)), vector(-bend.y, -bend.z, real(0)), vector());
}

// h_xx, h_xy, h_yy
fn surface_bend(cell: SurfaceCell) -> vector {
    return vector(
        surface_derivative(cell, 2u, 0u),
        surface_derivative(cell, 1u, 1u),
        surface_derivative(cell, 0u, 2u),
    );
}

fn surface_height(x: vector) -> real {
    return surface_derivative(surface_cell(x), 0u, 0u);
}

// The point of the terrain straight below or above a place.
fn surface_plumb(x: vector) -> vector {
    return vector(x.x, x.y, surface_height(x));
}

fn surface_value(x: vector) -> real {
    return x.z - surface_height(x);
}

fn surface_gradient(x: vector) -> vector {
    return surface_slope(surface_cell(x));
}

fn surface_hessian(x: vector) -> matrix {
    return surface_sheet(surface_bend(surface_cell(x)));
}

fn surface_jet(x: vector) -> SurfaceJet {
    let cell = surface_cell(x);
    let value = x.z - surface_derivative(cell, 0u, 0u);
    return SurfaceJet(value, surface_slope(cell), surface_sheet(surface_bend(cell)));
}

// It jumps where nodes are crossed.
fn surface_third(x: vector, along: vector) -> matrix {
    let cell = surface_cell(x);
    let xxx = surface_derivative(cell, 3u, 0u);
    let xxy = surface_derivative(cell, 2u, 1u);
    let xyy = surface_derivative(cell, 1u, 2u);
    let yyy = surface_derivative(cell, 0u, 3u);
    return surface_sheet(along.x * vector(xxx, xxy, xyy) + along.y * vector(xxy, xyy, yyy));
}

// Where the way along ∇F ends. Steps that would lead up and down between slopes are halved.
fn surface_project(x: vector) -> vector {
    var foot = x;
    var value = surface_value(x);
    for (var k = 0u; k < DESCENT_STEPS; k++) {
        let gradient = surface_gradient(foot);
        var step = (-value / dot(gradient, gradient)) * gradient;
        let is_small = sqrt(dot(step, step)) <= LEAST_STEP * surface_reach(foot);
        // Along ∇F, which is never 0, |F| falls at first.
        var next = value;
        var falls = false;
        for (var halvings = 0u; halvings < MOST_HALVINGS; halvings++) {
            next = surface_value(foot + step);
            falls = is_small || abs(next) <= real(0.9) * abs(value);
            if (falls) {
                break;
            }
            step = real(0.5) * step;
        }
        // Where it does not it is rounding.
        if (!falls) {
            break;
        }
        foot += step;
        value = next;
        if (is_small) {
            break;
        }
        if (k + 1u == DESCENT_STEPS) {
            return surface_nowhere(x);
        }
    }
    return surface_plumb(foot);
}
