// The layout of a curve's rows in the arrays of descent.wgsl, and access to the trial and to the
// current curve.

//:if ATTACHMENT
const TAUT_AT: u32 = 3u * $DIMu + 7u;
//:else
const TAUT_AT: u32 = $DIMu + 2u;
//:end
//:if TAUT
const PENALTIES_AT: u32 = TAUT_AT + 1u;
//:else
const PENALTIES_AT: u32 = TAUT_AT;
//:end
// The penalties of a vertex are stored one after the other, then its region penalties.
//:if PENALTIES
const REGIONS_AT: u32 = PENALTIES_AT + 3u * $PENALTIESu;
//:else
const REGIONS_AT: u32 = PENALTIES_AT;
//:end
// Numbers per row of `fixed`.
//:if REGIONS
const REGION_NUMBERS: u32 = 2u * $DIMu + 5u;
const PLACE_AT: u32 = REGIONS_AT + $REGIONSu * REGION_NUMBERS;
//:else
const PLACE_AT: u32 = REGIONS_AT;
//:end
//:if SURFACE
const FIXED: u32 = PLACE_AT + $DIMu;
//:else
const FIXED: u32 = PLACE_AT;
//:end

fn load_curve(slot: u32) -> Curve {
    let table = curves[slot];
    let section = table.stride * $SIDEu;
    var curve = Curve();
    curve.slot = slot;
    curve.segments = table.segments;
    curve.closed = table.closed;
    curve.vertices = table.segments + 1u - table.closed;
    curve.fixed_start = table.fixed_start;
    curve.u = table.displacement_start;
    curve.p = table.work_start;
    curve.g = curve.p + $DIMu * section;
    curve.x = curve.g + $DIMu * section;
    curve.length = curve.x + $DIMu * section;
    var rest = curve.length + section;
//:if SURFACE
    curve.push = rest;
    curve.trial_push = rest + section;
    curve.moved = rest + 2u * section;
    rest += (2u + $DIMu) * section;
//:end
//:if LANES
    curve.blocks = rest;
    curve.scratch = rest + $VERTICESu * $DIMu * $DIMu * section;
//:else
    curve.border = table.work_start - 2u * $DIMu * $DIMu * section;
    curve.factor = rest;
//:end
    curve.highest = lanes[slot * params.numbers + GIVEN_HIGHEST];
    return curve;
}

fn work_vector(section: u32, v: u32) -> vector {
    let at = section + v * $DIMu * $SIDEu;
//:if SPATIAL
    return vector(work[at], work[at + $SIDEu], work[at + 2u * $SIDEu]);
//:else
    return vector(work[at], work[at + $SIDEu]);
//:end
}

fn store_vector(section: u32, v: u32, x: vector) {
    let at = section + v * $DIMu * $SIDEu;
//:unroll c 0..$DIM
    work[at + $cu * $SIDEu] = x[$c];
//:end
}

// Matrix k of a section, column by column.
fn work_matrix(section: u32, k: u32) -> matrix {
//:if SPATIAL
    return matrix(
        work_vector(section, 3u * k),
        work_vector(section, 3u * k + 1u),
        work_vector(section, 3u * k + 2u),
    );
//:else
    return matrix(work_vector(section, 2u * k), work_vector(section, 2u * k + 1u));
//:end
}

fn store_matrix(section: u32, k: u32, x: matrix) {
//:unroll c 0..$DIM
    store_vector(section, $DIMu * k + $cu, x[$c]);
//:end
}

fn displacement(curve: Curve, v: u32) -> vector {
    let at = curve.u + v * $DIMu * $SIDEu;
//:if SPATIAL
    return vector(displacements[at], displacements[at + $SIDEu], displacements[at + 2u * $SIDEu]);
//:else
    return vector(displacements[at], displacements[at + $SIDEu]);
//:end
}

fn store_displacement(curve: Curve, v: u32, x: vector) {
    let at = curve.u + v * $DIMu * $SIDEu;
//:unroll c 0..$DIM
    displacements[at + $cu * $SIDEu] = x[$c];
//:end
}

fn fixed_at(curve: Curve, v: u32, number: u32) -> u32 {
    return curve.fixed_start + (v * FIXED + number) * $SIDEu;
}

fn fixed_vector(curve: Curve, v: u32, number: u32) -> vector {
    let at = fixed_at(curve, v, number);
//:if SPATIAL
    return vector(fixed[at], fixed[at + $SIDEu], fixed[at + 2u * $SIDEu]);
//:else
    return vector(fixed[at], fixed[at + $SIDEu]);
//:end
}

fn length_at(curve: Curve, j: u32) -> real {
    return work[curve.length + j * $SIDEu];
}

fn is_movable(curve: Curve, v: u32) -> bool {
    return fixed[fixed_at(curve, v, $DIMu + 1u)] > real(0);
}

fn end_of(curve: Curve, j: u32) -> u32 {
    return select(j + 1u, 0u, curve.closed != 0u && j + 1u == curve.segments);
}

//:if SURFACE
// Moves vertices first … last − 1 of u + αp back to the surface.
fn move_back(curve: Curve, first: u32, last: u32) {
    let surface = load_surface(curve);
    for (var v = first; v < last; v++) {
        let u = displacement(curve, v) + curve.alpha * work_vector(curve.p, v);
        let moved = select(u, u + way_back(surface, load_place(curve, v) + u), is_movable(curve, v));
        store_vector(curve.moved, v, moved);
    }
}

// The trial, after it has been moved back.
fn trial(curve: Curve, v: u32) -> vector {
    return work_vector(curve.moved, v);
}

fn load_place(curve: Curve, v: u32) -> vector {
    return fixed_vector(curve, v, PLACE_AT);
}

fn store_push(curve: Curve, v: u32, push: real) {
    work[curve.trial_push + v * $SIDEu] = select(real(0), push, is_movable(curve, v));
}

// Replaces n·g of the curve by n·g of the trial.
fn take_push(curve: Curve, v: u32) {
    work[curve.push + v * $SIDEu] = work[curve.trial_push + v * $SIDEu];
}

// The frame of the current curve at vertex v, which may be past the last.
fn current_frame(curve: Curve, surface: Surface, v: i32) -> Frame {
    let row = vertex_row(curve, v);
    return frame_at(surface, load_place(curve, row) + displacement(curve, row));
}

// The block that the surface adds to the diagonal at vertex v: −(n·g) W in the tangent plane, and 1
// along the normal, where a vertex without a window has no other stiffness.
fn bend_of_surface(curve: Curve, v: u32, frame: Frame) -> matrix {
    let push = work[curve.push + v * $SIDEu];
    return in_planes(frame.normal, -push * frame.shape, frame.normal) + outer(frame.normal, frame.normal);
}
//:else
// u + αp
fn trial(curve: Curve, v: u32) -> vector {
    return displacement(curve, v) + curve.alpha * work_vector(curve.p, v);
}
//:end

fn load_edge(curve: Curve, j: u32) -> vector {
    return fixed_vector(curve, j, 0u) + (trial(curve, end_of(curve, j)) - trial(curve, j));
}

// An edge of the current curve.
fn current_edge(curve: Curve, j: u32) -> vector {
    return fixed_vector(curve, j, 0u) + (displacement(curve, end_of(curve, j)) - displacement(curve, j));
}

fn load_free(curve: Curve, j: u32) -> real {
    return fixed[fixed_at(curve, j, $DIMu)];
}

//:if TAUT
fn load_taut(curve: Curve, j: u32) -> real {
    return fixed[fixed_at(curve, j, TAUT_AT)];
}
//:end

fn load_penalty(curve: Curve, j: u32, k: u32) -> Penalty {
    let first = PENALTIES_AT + 3u * k;
    var penalty = Penalty();
    penalty.slope = fixed[fixed_at(curve, j, first)];
    penalty.reach = fixed[fixed_at(curve, j, first + 1u)];
    penalty.stiffness = fixed[fixed_at(curve, j, first + 2u)];
    return penalty;
}

//:if REGIONS
fn load_region(curve: Curve, v: u32, layer: u32) -> RegionPenalty {
    let first = REGIONS_AT + layer * REGION_NUMBERS;
    let numbers = first + 2u * $DIMu;
    var penalty = RegionPenalty();
    penalty.foot = fixed_vector(curve, v, first);
    penalty.axis = fixed_vector(curve, v, first + $DIMu);
    penalty.span = fixed[fixed_at(curve, v, numbers)];
    penalty.plane = fixed[fixed_at(curve, v, numbers + 1u)];
    penalty.bend = fixed[fixed_at(curve, v, numbers + 2u)];
    penalty.reach = fixed[fixed_at(curve, v, numbers + 3u)];
    penalty.stiffness = fixed[fixed_at(curve, v, numbers + 4u)];
    return penalty;
}
//:end

//:if ATTACHMENT
fn load_offset(curve: Curve, v: u32) -> vector {
    return trial(curve, v) - fixed_vector(curve, v, $DIMu + 2u);
}

// f − p of the current curve.
fn current_offset(curve: Curve, v: u32) -> vector {
    return displacement(curve, v) - fixed_vector(curve, v, $DIMu + 2u);
}

// The stiffness of vertex v in the inner product.
fn load_stiffness(curve: Curve, v: u32) -> real {
    return fixed[fixed_at(curve, v, 2u * $DIMu + 2u)];
}

fn load_anchor(curve: Curve, v: u32) -> Anchor {
    let first = 2u * $DIMu + 3u;
    var anchor = Anchor();
    anchor.spring = fixed[fixed_at(curve, v, first)];
    anchor.stiffness = fixed[fixed_at(curve, v, first + 1u)];
    anchor.reach = fixed[fixed_at(curve, v, first + 2u)];
    anchor.along = fixed[fixed_at(curve, v, first + 3u)];
    anchor.tangent = fixed_vector(curve, v, first + 4u);
    return anchor;
}
//:end

// Stores the trial's gradient in x until the step is accepted. If it is not, the next trial needs
// g.
fn store_gradient(curve: Curve, v: u32, gradient: vector) {
    store_vector(curve.x, v, select(vector(), gradient, is_movable(curve, v)));
}

fn load_edge_direction(curve: Curve, j: u32) -> vector {
    return work_vector(curve.p, end_of(curve, j)) - work_vector(curve.p, j);
}

fn load_direction(curve: Curve, v: u32) -> vector {
    return work_vector(curve.p, v);
}
