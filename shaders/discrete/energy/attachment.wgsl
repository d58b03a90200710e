// The anchor that holds a vertex f near its data point p: a spring, the penalty of a disc, and a
// tangential anchor. The offset is f − p.
// Twin: src/discrete/energy/attachment.rs.

struct Anchor {
    spring: real,
    stiffness: real,
    reach: real,
    tangent: vector,
    along: real,
}

// s for the offset f − p.
fn anchor_beyond(anchor: Anchor, offset: vector) -> real {
    return max(real(0.5) * (dot(offset, offset) - anchor.reach), real(0));
}

fn anchor_value(anchor: Anchor, offset: vector) -> real {
    let beyond = anchor_beyond(anchor, offset);
    let along = dot(anchor.tangent, offset) - anchor.along;
    return real(0.5) * (anchor.spring * dot(offset, offset) + anchor.stiffness * beyond * beyond + along * along);
}

fn anchor_gradient(anchor: Anchor, offset: vector) -> vector {
    let pull = anchor.spring + anchor.stiffness * anchor_beyond(anchor, offset);
    return pull * offset + (dot(anchor.tangent, offset) - anchor.along) * anchor.tangent;
}

fn anchor_hessian(anchor: Anchor, offset: vector) -> matrix {
    let beyond = anchor_beyond(anchor, offset);
    let stiffness = select(real(0), anchor.stiffness, beyond > real(0));
    return outer(stiffness * offset, offset) + outer(anchor.tangent, anchor.tangent) + diagonal(anchor.spring + anchor.stiffness * beyond);
}
