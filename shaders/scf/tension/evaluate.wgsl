// The cost of a segment under tension, with its first and second derivatives by its end angles. The
// segment is followed from its shape at the last trial. If this fails the kernel asks the host.
// Twin: src/scf/tension/evaluate.rs
// The CPU's code has no f32: nested roots, which alone distinguish kinds of shapes, need f64. Tests
// compare this kernel in both precisions with the CPU in f64.

//:include damping/verdict.wgsl
//:include scf/tension/quadrature.wgsl
//:include scf/tension/solve/near.wgsl
//:include scf/tension/hessian.wgsl

const FOLLOWED_NOTHING: u32 = 0u;
const FOLLOWED_BELOW: u32 = 1u;
const FOLLOWED_FLAT: u32 = 2u;
const FOLLOWED_ABOVE: u32 = 3u;
const FOLLOWED_FREE_FLAT: u32 = 4u;
const FOLLOWED_FREE_ABOVE: u32 = 5u;

// No twin: the kind, its two unknowns, and 1 if the host has written the evaluation of the next
// trial into `found`.
const SHAPE_KIND: u32 = 0u;
const SHAPE_FIRST: u32 = 1u;
const SHAPE_SECOND: u32 = 2u;
const SHAPE_GIVEN: u32 = 3u;
const SHAPE_NUMBERS: u32 = 4u;

// No twin: the host is asked.
const ASKED: real = real(-1);

fn asked() -> Evaluation {
    return Evaluation(real(0), real(0), real(0), real(0), real(0), real(0), ASKED);
}

// |κ|^{ν−1} at an end of this radius of curvature.
fn bending(law: Law, end: End, radius: real) -> real {
    return select(real(0), end.excess / (law.nu - real(1)) * radius, end.excess > real(0));
}

fn evaluation_of(index: u32, segment: Segment, a: real, b: real) -> Evaluation {
    let ends = segment.kind & 3u;
    let law = law_of(segment.kind / 4u);
    let chord = angles[3u * index + 2u];
    if (ends == ENDS_STRAIGHT) {
        return Evaluation(chord, real(0), real(0), real(0), real(0), real(0), real(1));
    }
    let at = SHAPE_NUMBERS * index;
    let kind = u32(shapes[at + SHAPE_KIND]);
    let largest = larger(abs(a), abs(b));
    if (kind == FOLLOWED_NOTHING || !(largest <= PI) || largest < STRAIGHT) {
        return asked();
    }
    // Mirrored so that a + b ≤ 0, or so that a free end is the upper one.
    let is_free = ends != ENDS_DIRECTED;
    let given = select(a, b, ends == ENDS_FREE_START);
    let mirror = select(real(1), real(-1), select(a + b, given, is_free) > real(0));
    let forwards = select(mirror * a <= mirror * b, ends == ENDS_FREE_END, is_free);
    let low = select(smaller(mirror * a, mirror * b), -abs(given), is_free);
    let high = larger(mirror * a, mirror * b);
    let here = near(law, chord, kind, low, high, shapes[at + SHAPE_FIRST], shapes[at + SHAPE_SECOND]);
    if (!here.found) {
        return asked();
    }
    let hessian = hessian_of(kind, here);
    // P·chord
    let gap = select(real(0), here.u, kind == FOLLOWED_BELOW);
    let pull = (real(1) - gap) * here.cosine - here.lift * here.sine;
    let cost = (law.nu * here.length - pull) / (law.nu - real(1));
    let low_by = -law.nu * mirror * bending(law, here.low, here.low.radius);
    // If the turn comes back to the upper end, the curvature there has the other sign.
    let back = select(-here.side, real(1), kind == FOLLOWED_BELOW);
    let radius = here.high.radius / select(real(1), here.scale, kind == FOLLOWED_ABOVE);
    let high_by = select(back * law.nu * mirror * bending(law, here.high, radius), real(0), is_free);
    let high_high = select(hessian.high, real(0), is_free);
    let both = select(hessian.both, real(0), is_free);
    let sum = abs(cost) + abs(low_by) + abs(high_by) + abs(hessian.low) + abs(both) + abs(high_high);
    if (is_no_number(sum)) {
        return asked();
    }
    shapes[at + SHAPE_FIRST] = here.u;
    shapes[at + SHAPE_SECOND] = here.v;
    if (forwards) {
        return Evaluation(cost, low_by, high_by, hessian.low, both, high_high, real(1));
    }
    return Evaluation(cost, high_by, low_by, high_high, both, hessian.low, real(1));
}

// Whether the host has found the segment at this trial. Clears the mark.
fn is_answered(index: u32) -> bool {
    let given = SHAPE_NUMBERS * index + SHAPE_GIVEN;
    let answered = shapes[given] > real(0);
    shapes[given] = real(0);
    return answered;
}
