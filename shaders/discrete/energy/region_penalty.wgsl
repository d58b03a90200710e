// Region penalties, which keep single vertices within a region, for a displacement u.
// Twin: src/discrete/energy/region_penalty.rs.

struct RegionPenalty {
    foot: vector,
    axis: vector,
    span: real,
    plane: real,
    bend: real,
    reach: real,
    stiffness: real,
}

// q and its gradient, at u.
struct RegionQuantity {
    value: real,
    by_place: vector,
}

fn region_quantity(penalty: RegionPenalty, u: vector) -> RegionQuantity {
    let o = u - penalty.foot;
    let along = dot(penalty.axis, o);
    let nearest = min(max(along, real(0)), penalty.span);
    let away = o - nearest * penalty.axis;
    let q = penalty.plane * along + real(0.5) * penalty.bend * dot(away, away);
    return RegionQuantity(q, penalty.plane * penalty.axis + penalty.bend * away);
}

// s
fn region_beyond(penalty: RegionPenalty, q: real) -> real {
    return max(penalty.reach + q, real(0));
}

fn region_value(penalty: RegionPenalty, u: vector) -> real {
    let beyond = region_beyond(penalty, region_quantity(penalty, u).value);
    return real(0.5) * penalty.stiffness * beyond * beyond;
}

fn region_gradient(penalty: RegionPenalty, u: vector) -> vector {
    let q = region_quantity(penalty, u);
    return (penalty.stiffness * region_beyond(penalty, q.value)) * q.by_place;
}

// [s > 0] ρ ∇q∇qᵀ + ρ s b (I − [0 < v·o < ℓ] v vᵀ)
fn region_hessian(penalty: RegionPenalty, u: vector) -> matrix {
    let q = region_quantity(penalty, u);
    let beyond = region_beyond(penalty, q.value);
    let first = select(real(0), penalty.stiffness, beyond > real(0));
    let second = penalty.stiffness * beyond * penalty.bend;
    let along = dot(penalty.axis, u - penalty.foot);
    let within = select(real(0), second, along > real(0) && along < penalty.span);
    return outer(first * q.by_place, q.by_place) - outer(within * penalty.axis, penalty.axis) + diagonal(second);
}
