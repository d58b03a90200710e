// Walls: what keeps single vertices within a region, for a displacement u. Twin: src/discrete/energy/wall.rs.

struct Wall {
    foot: vector,
    axis: vector,
    span: real,
    plane: real,
    bend: real,
    reach: real,
    stiffness: real,
}

// q and its gradient, at u.
struct WallQuantity {
    value: real,
    by_place: vector,
}

fn wall_quantity(wall: Wall, u: vector) -> WallQuantity {
    let o = u - wall.foot;
    let along = dot(wall.axis, o);
    let nearest = min(max(along, real(0)), wall.span);
    let away = o - nearest * wall.axis;
    let q = wall.plane * along + real(0.5) * wall.bend * dot(away, away);
    return WallQuantity(q, wall.plane * wall.axis + wall.bend * away);
}

// s
fn wall_beyond(wall: Wall, q: real) -> real {
    return max(wall.reach + q, real(0));
}

fn wall_value(wall: Wall, u: vector) -> real {
    let beyond = wall_beyond(wall, wall_quantity(wall, u).value);
    return real(0.5) * wall.stiffness * beyond * beyond;
}

fn wall_gradient(wall: Wall, u: vector) -> vector {
    let q = wall_quantity(wall, u);
    return (wall.stiffness * wall_beyond(wall, q.value)) * q.by_place;
}

// [s > 0] ρ ∇q∇qᵀ + ρ s b (I − [0 < v·o < ℓ] v vᵀ)
fn wall_hessian(wall: Wall, u: vector) -> matrix {
    let q = wall_quantity(wall, u);
    let beyond = wall_beyond(wall, q.value);
    let first = select(real(0), wall.stiffness, beyond > real(0));
    let second = wall.stiffness * beyond * wall.bend;
    let along = dot(wall.axis, u - wall.foot);
    let within = select(real(0), second, along > real(0) && along < wall.span);
    return outer(first * q.by_place, q.by_place) - outer(within * wall.axis, wall.axis) + diagonal(second);
}
