// x^y for x ≥ 0 and a constant y. In f32 this is WGSL's pow, for normal x and results. WGSL has no pow
// in f64: x = 2^k m, √½ ≤ m ≤ √2, ln m by the series of artanh, the product y log₂ x in two parts, of
// which the large one is exact, and e^f by its series. Relative error about 4 (1 + |y|) ε if x is 0 or
// 2.3e−308 < x < 3.4e38, and the result within 1e±300. 0 for x = 0 < y.
// No twin: the CPU has `powf`.

//:if F64
// 2^n, −126 ≤ n ≤ 127
fn power_of_two(n: i32) -> real {
    return real(bitcast<f32>(u32(n + 127) << 23u));
}

fn power(x: real, y: real) -> real {
    // Up by 2^512, 2^256 and 2^128, as need be, into the range of f32.
    let is_least = x < real(2.9833362924800834e-154);
    let from_least = select(x, x * real(1.3407807929942597e154), is_least);
    let is_less = from_least < real(3.454467422037778e-77);
    let from_less = select(from_least, from_least * real(1.157920892373162e77), is_less);
    let is_small = from_less < real(1.1754943508222875e-38);
    let raised = select(from_less, from_less * real(3.402823669209385e38), is_small);
    let lowered = select(0, 512, is_least) + select(0, 256, is_less) + select(0, 128, is_small);
    // Half a binade up, so that m is between √½ and √2 and logarithms near x = 1 keep their digits.
    let bits = bitcast<u32>(f32(raised)) + 0x004afb0du;
    let binade = i32(bits >> 23u) - 127;
    let m = raised * power_of_two(-binade);
    let k = binade - lowered;
    let s = (m - real(1)) / (m + real(1));
    let q = s * s;
    // artanh(s)/s, s² ≤ 0.0295
    var a = real(0.04);
    a = a * q + real(0.043478260869565216);
    a = a * q + real(0.047619047619047616);
    a = a * q + real(0.052631578947368418);
    a = a * q + real(0.058823529411764705);
    a = a * q + real(0.066666666666666667);
    a = a * q + real(0.076923076923076923);
    a = a * q + real(0.090909090909090909);
    a = a * q + real(0.11111111111111111);
    a = a * q + real(0.14285714285714286);
    a = a * q + real(0.2);
    a = a * q + real(0.33333333333333333);
    // log₂ m = 2/ln 2 (s + s³ a)
    let logarithm = real(2.8853900817779268) * (s + s * q * a);
    // y k, exact for the leading digits of y.
    let high = real(f32(y));
    let whole = high * real(k);
    let rest = (y - high) * real(k) + y * logarithm;
    let n = round(f32(whole) + f32(rest));
    let f = real(0.69314718055994531) * ((whole - real(n)) + rest);
    // e^f, |f| ≤ 0.35
    var e = real(1.6059043836821613e-10);
    e = e * f + real(2.08767569878681e-9);
    e = e * f + real(2.505210838544172e-8);
    e = e * f + real(2.755731922398589e-7);
    e = e * f + real(2.7557319223985893e-6);
    e = e * f + real(2.48015873015873e-5);
    e = e * f + real(1.984126984126984e-4);
    e = e * f + real(1.388888888888889e-3);
    e = e * f + real(8.333333333333333e-3);
    e = e * f + real(4.1666666666666664e-2);
    e = e * f + real(0.16666666666666667);
    e = e * f + real(0.5);
    e = e * f + real(1);
    e = e * f + real(1);
    let exponent = clamp(i32(n), -1000, 1000);
    let eighth = exponent / 8;
    let root = power_of_two(eighth);
    let square = root * root;
    let fourth = square * square;
    let result = e * (fourth * fourth) * power_of_two(exponent - 8 * eighth);
    return select(result, real(0), x == real(0));
}
//:else
fn power(x: real, y: real) -> real {
    return select(pow(x, y), real(0), x == real(0));
}
//:end
