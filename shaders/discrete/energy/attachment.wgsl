// What holds a vertex f near its data point p: a spring, a wall around a disc, and a rail. The offset is f − p.
// Twin: src/discrete/energy/attachment.rs.

struct Hold {
    spring: real,
    wall: real,
    reach: real,
    rail: vector,
    place: real,
}

// s, of f − p.
fn hold_beyond(hold: Hold, offset: vector) -> real {
    return max(real(0.5) * (dot(offset, offset) - hold.reach), real(0));
}

fn hold_value(hold: Hold, offset: vector) -> real {
    let beyond = hold_beyond(hold, offset);
    let along = dot(hold.rail, offset) - hold.place;
    return real(0.5) * (hold.spring * dot(offset, offset) + hold.wall * beyond * beyond + along * along);
}

fn hold_gradient(hold: Hold, offset: vector) -> vector {
    let pull = hold.spring + hold.wall * hold_beyond(hold, offset);
    return pull * offset + (dot(hold.rail, offset) - hold.place) * hold.rail;
}

fn hold_hessian(hold: Hold, offset: vector) -> matrix {
    let beyond = hold_beyond(hold, offset);
    let wall = select(real(0), hold.wall, beyond > real(0));
    return outer(wall * offset, offset) + outer(hold.rail, hold.rail) + diagonal(hold.spring + hold.wall * beyond);
}
