// What is said of a trial. Twin: `Verdict` of src/damping.rs.

const VERDICT_ACCEPT: u32 = 0u;
const VERDICT_AGAIN: u32 = 1u;
const VERDICT_FAIL: u32 = 2u;

// NaN or infinite, by its bits: comparisons with NaN are not to be relied on. Beyond the range of
// f32 counts as infinite.
fn is_out_of_range(x: real) -> bool {
    return (bitcast<u32>(f32(x)) & 0x7f800000u) == 0x7f800000u;
}

// NaN or infinite: also of numbers beyond the range of f32.
fn is_no_number(x: real) -> bool {
//:if F64
    return is_out_of_range(x * real(1.1830521861667747e-271));
//:else
    return is_out_of_range(x);
//:end
}
