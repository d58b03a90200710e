// The cost of a segment of unit chord, with its first and second derivatives by its end angles.
// Twin: src/scf/evaluation.rs, which gives the formulas.

// If both angles are below this they count as 0: √ of the smallest normal number.
//:if F64
const ROOT_SMALLEST_NORMAL: real = real(1.4916681462400413e-154);
//:else
const ROOT_SMALLEST_NORMAL: real = real(1.0842021724855044e-19);
//:end

fn evaluation_of(index: u32, segment: Segment, a: real, b: real) -> Evaluation {
    let ends = segment.kind & 3u;
    if (ends == ENDS_STRAIGHT) {
        return Evaluation(real(0), real(0), real(0), real(0), real(0), real(0), real(1));
    }
    let curve = universal_of(segment.kind / 4u);
    if (ends == ENDS_DIRECTED) {
        return evaluate_directed(curve, a, b);
    }
    // Reversed and mirrored if the start is the directed end.
    let own = evaluate_free(curve, select(b, -a, ends == ENDS_FREE_END));
    if (ends == ENDS_FREE_END) {
        return Evaluation(own.cost, -own.by_b, real(0), own.by_bb, real(0), real(0), own.exists);
    }
    return own;
}

// The cheapest segment with end angles a and b from its unit chord.
fn evaluate_directed(curve: Universal, a: real, b: real) -> Evaluation {
    if (!(larger(abs(a), abs(b)) - ROOT_SMALLEST_NORMAL > real(0))) {
        // Cost of a nearly straight segment for ν = 2: 4 (a² + ab + b²).
        let flat = select(real(0), real(4), curve.exponent == real(2));
        return Evaluation(real(0), real(0), real(0), real(2) * flat, flat, real(2) * flat, real(1));
    }
    let canonical = canonical_of(a, b);
    let best = cheapest(curve, canonical.a, canonical.b);
    let own = at_piece(curve, best.piece, canonical.a, canonical.b);
    let sign = canonical.mirrored * select(real(1), real(-1), canonical.swapped);
    return Evaluation(
        own.cost,
        sign * select(own.by_a, own.by_b, canonical.swapped),
        sign * select(own.by_b, own.by_a, canonical.swapped),
        select(own.by_aa, own.by_bb, canonical.swapped),
        own.by_ab,
        select(own.by_bb, own.by_aa, canonical.swapped),
        select(real(0), real(1), best.exists),
    );
}

fn at_piece(curve: Universal, piece: Piece, a: real, b: real) -> Evaluation {
    let nu = curve.exponent;
    let q = curve.q;
    let side = select(real(-1), real(1), piece.plain);
    let first = sine_cosine(a);
    let last = sine_cosine(b);
    // dS(t₁)/dt₁ = q stiff cos t₁
    let stiff = piece.moment1 / piece.sine1;
    let late = stiff * last.sine / piece.chord;
    let early = side * first.sine / piece.chord;
    // S(t₀)/sin t₀ · dt₀, and dt₁, for da and db.
    let start_a = -(real(1) + late) / piece.slope;
    let start_b = late / piece.slope;
    let end_a = -early / piece.slope;
    let end_b = -(piece.soft - early) / piece.slope;
    // d ln D
    let stretch_a = (stiff * last.cosine * end_a - side * first.cosine * start_a) / piece.chord;
    let stretch_b = (stiff * last.cosine * end_b - side * first.cosine * start_b) / piece.chord;
    let nu_less = nu - real(1);
    let factor = power(piece.chord, nu_less);
    let at_start_a = nu * side * factor * (nu_less * piece.moment0 * stretch_a + q * piece.cosine0 * start_a);
    let at_start_b = nu * side * factor * (nu_less * piece.moment0 * stretch_b + q * piece.cosine0 * start_b);
    let at_end_b = -(nu * factor * (nu_less * piece.moment1 * stretch_b + q * stiff * piece.cosine1 * end_b));
    return Evaluation(
        factor * piece.along,
        nu * side * factor * piece.moment0,
        -(nu * factor * piece.moment1),
        at_start_a,
        at_start_b,
        at_end_b,
        real(1),
    );
}

// The segment with a free start that ends at the angle b from its unit chord.
fn evaluate_free(curve: Universal, b: real) -> Evaluation {
    let nu = curve.exponent;
    if (!(abs(b) - ROOT_SMALLEST_NORMAL > real(0))) {
        let flat = select(real(0), real(6), nu == real(2));
        return Evaluation(real(0), real(0), real(0), real(0), real(0), flat, real(1));
    }
    let mirrored = select(real(1), real(-1), b > real(0));
    let angle = mirrored * b;
    let best = from_inflection(curve, angle);
    let piece = best.piece;
    let last = sine_cosine(angle);
    let stiff = piece.moment1 / piece.sine1;
    let end = -(real(1) / (real(1) + stiff * last.sine / piece.chord));
    let stretch = stiff * last.cosine / piece.chord * end;
    let nu_less = nu - real(1);
    let factor = power(piece.chord, nu_less);
    let by_bb = -(nu * factor * (nu_less * piece.moment1 * stretch + curve.q * stiff * piece.cosine1 * end));
    return Evaluation(
        factor * piece.along,
        real(0),
        -(mirrored * nu * factor * piece.moment1),
        real(0),
        real(0),
        by_bb,
        select(real(0), real(1), best.exists),
    );
}
