// The torus (√(x² + y²) − R)² + z² = r² around the axis z. Twin: src/surface/torus.rs.

// No twin: the host writes the radii R and r.
const SURFACE_MAJOR: real = real($MAJOR);
const SURFACE_MINOR: real = real($MINOR);

// F = ½ ((ρ − R)² + z² − r²)/r with ρ = √(x² + y²).
fn surface_value(x: vector) -> real {
    let out = sqrt(x.x * x.x + x.y * x.y) - SURFACE_MAJOR;
    return real(0.5) * (out * out + x.z * x.z - SURFACE_MINOR * SURFACE_MINOR) / SURFACE_MINOR;
}

fn surface_gradient(x: vector) -> vector {
    let shrink = real(1) - SURFACE_MAJOR / sqrt(x.x * x.x + x.y * x.y);
    return vector(shrink * x.x, shrink * x.y, x.z) * (real(1) / SURFACE_MINOR);
}

fn surface_hessian(x: vector) -> matrix {
    // (1 − R/ρ) I + (R/ρ) ρ̂ ρ̂ᵀ in the plane of x and y.
    let inverse = real(1) / sqrt(x.x * x.x + x.y * x.y);
    let ratio = SURFACE_MAJOR * inverse;
    let out = vector(inverse * x.x, inverse * x.y, real(0));
    var hessian = ratio * outer(out, out);
    hessian[0].x += real(1) - ratio;
    hessian[1].y += real(1) - ratio;
    hessian[2].z += real(1);
    return (real(1) / SURFACE_MINOR) * hessian;
}

fn surface_third(x: vector, along: vector) -> matrix {
    // d[R/ρ (ρ̂ρ̂ᵀ − I)] = −(R/ρ²) (ρ̂·d)(ρ̂ρ̂ᵀ − I) + (R/ρ)(dρ̂ ρ̂ᵀ + ρ̂ dρ̂ᵀ), dρ̂ = φ̂ (φ̂·d)/ρ.
    let inverse = real(1) / sqrt(x.x * x.x + x.y * x.y);
    let out = vector(inverse * x.x, inverse * x.y, real(0));
    let round = vector(-out.y, out.x, real(0));
    let change = dot(out, along) * outer(round, round) + dot(round, along) * (outer(round, out) + outer(out, round));
    return (SURFACE_MAJOR * inverse * inverse / SURFACE_MINOR) * change;
}
