// Sine, cosine and arctangent by polynomials: WGSL's own are missing or wrong in f64.
// Twin: src/scf/trig.rs; a test compares the coefficients.

const PI: real = real(3.141592653589793);
const FRAC_PI_2: real = real(1.5707963267948966);
const FRAC_PI_4: real = real(0.7853981633974483);

const TANGENT: real = real(0.41421356237309515);

// sin(x)/x as a polynomial in x², |x| ≤ π/2.
fn sine_series(x: real) -> real {
    var sum = real(2.7215749422983443e-15);
    sum = sum * x + real(-7.643026557971632e-13);
    sum = sum * x + real(1.605894087848656e-10);
    sum = sum * x + real(-2.505210689056952e-08);
    sum = sum * x + real(2.7557319211229606e-06);
    sum = sum * x + real(-0.00019841269841208676);
    sum = sum * x + real(0.008333333333333186);
    sum = sum * x + real(-0.16666666666666666);
    sum = sum * x + real(1.0);
    return sum;
}

// (cos(x) − 1)/x² as a polynomial in x², |x| ≤ π/2.
fn cosine_series(x: real) -> real {
    var sum = real(4.6276759850181716e-14);
    sum = sum * x + real(-1.1464689885720029e-11);
    sum = sum * x + real(2.0876630867422994e-09);
    sum = sum * x + real(-2.755731776732053e-07);
    sum = sum * x + real(2.4801587292446213e-05);
    sum = sum * x + real(-0.0013888888888860709);
    sum = sum * x + real(0.04166666666666634);
    sum = sum * x + real(-0.5);
    return sum;
}

// atan(z)/z as a polynomial in z², |z| ≤ tan(π/8).
fn arctangent_series(x: real) -> real {
    var sum = real(-0.017805397205419446);
    sum = sum * x + real(0.03796525745386593);
    sum = sum * x + real(-0.05035102456601552);
    sum = sum * x + real(0.05846878297330872);
    sum = sum * x + real(-0.06662951813629191);
    sum = sum * x + real(0.07692045330902225);
    sum = sum * x + real(-0.09090896809064027);
    sum = sum * x + real(0.11111110744919658);
    sum = sum * x + real(-0.14285714279250245);
    sum = sum * x + real(0.19999999999940893);
    sum = sum * x + real(-0.3333333333333312);
    sum = sum * x + real(1.0);
    return sum;
}

// The larger of two; the second where the first is NaN.
fn larger(x: real, y: real) -> real {
    return select(y, x, x > y);
}

// The smaller of two.
fn smaller(x: real, y: real) -> real {
    return select(y, x, y - x > real(0));
}

struct SineCosine {
    sine: real,
    cosine: real,
}

// sin x and cos x for |x| ≤ π.
fn sine_cosine(x: real) -> SineCosine {
    let folds = abs(x) > FRAC_PI_2;
    let y = select(abs(x), PI - abs(x), folds);
    let square = y * y;
    let sine = y * sine_series(square);
    let cosine = real(1) + square * cosine_series(square);
    return SineCosine(select(sine, -sine, x < real(0)), select(cosine, -cosine, folds));
}

// The angle of the direction (x, y) from the x axis, x ≥ 0, y ≥ 0, not both 0.
fn first_quadrant_angle(y: real, x: real) -> real {
    let low = TANGENT * x - y > real(0);
    let high = TANGENT * y - x > real(0);
    let numerator = select(select(y - x, -x, high), y, low);
    let denominator = select(select(y + x, y, high), x, low);
    let offset = select(select(FRAC_PI_4, FRAC_PI_2, high), real(0), low);
    let z = numerator / denominator;
    return offset + z * arctangent_series(z * z);
}
