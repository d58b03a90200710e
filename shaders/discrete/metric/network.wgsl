// The tridiagonal network K + excess of the inner products of orders 1 and 2: see metric/mod.wgsl.

// Half the lengths of the edges at a vertex.
fn mass_at(curve: Curve, v: u32) -> real {
    var mass = real(0);
    if (v > 0u || curve.closed != 0u) {
        mass += real(0.5) * length_at(curve, select(v, curve.segments, v == 0u) - 1u);
    }
    if (v < curve.segments) {
        mass += real(0.5) * length_at(curve, v);
    }
    return mass;
}

struct Network {
    // Weight of an edge: this over its length.
    weight: real,
    // α: the excess at a vertex is α times its mass, or (order 1) its stiffness.
    density: real,
}

fn excess_at(curve: Curve, network: Network, v: u32) -> real {
//:if ATTACHMENT
//:if SECOND
    return network.density * mass_at(curve, v);
//:else
    return load_stiffness(curve, v);
//:end
//:else
    return real(0);
//:end
}
