// Geodesic bending: |m|^ν Δa^(1−ν). The powers are those in bending.wgsl, with q = |m|².
// Twin: src/discrete/energy/geodesic_bending.rs.
//:once include discrete/energy/in_surface.wgsl
//:if POWER
//:once include linalg/power.wgsl
//:end

struct $NAME_Arguments {
    q: real,
    c: real,
    a: real,
}

fn $NAME_arguments(bend: Bend) -> $NAME_Arguments {
    let c = select(bend.square, real($ROUNDING), bend.square < real($ROUNDING));
    return $NAME_Arguments(bend.square, c, bend.measure);
}

fn $NAME_value(w: Window) -> real {
    let b = $NAME_arguments(bend_of(w));
    let q = b.q;
    let c = b.c;
    let a = b.a;
    return ($POWER_0) * ($MEASURE_0);
}

fn $NAME_gradient(w: Window) -> Partials {
    let bend = bend_of(w);
    let b = $NAME_arguments(bend);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let measure = $MEASURE_0;
    let value = ($POWER_0) * measure;
    // (1 − ν)/2
    return bend_gradient(
        bend,
        BendFirst(value, real($EXPONENT) * (($POWER_1) * measure), real($BY_LENGTH) * value / a),
    );
}

fn $NAME_hessian(w: Window) -> SecondPartials {
    let bend = bend_of(w);
    let b = $NAME_arguments(bend);
    let q = b.q;
    let c = b.c;
    let a = b.a;
    let slope = real($EXPONENT) * ($POWER_1);
    let measure = $MEASURE_0;
    var second = BendSecond();
    second.across = slope * measure;
//:if ALONG
    // ν (ν − 2)
    second.along = real($ALONG) * ($POWER_2) * measure;
//:end
    second.mixed = real($BY_LENGTH) * slope * ($MEASURE_1);
    // ν (ν − 1)/4
    second.by_lengths = real($BY_LENGTHS) * ($POWER_0) * ($MEASURE_2);
    return bend_hessian(w, bend, second);
}
