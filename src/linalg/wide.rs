//! Wide vector registers, where the processor has them.

/// Runs an operation compiled for AVX2 (on ARM for NEON); gives it back where the processor lacks
/// that.
///
/// What is worth this is large, and takes the compiler long: so it is compiled once more, not for
/// every level there is.
pub(crate) fn with_wide_registers<Op: pulp::WithSimd>(operation: Op) -> Result<Op::Output, Op> {
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::Simd;
        match pulp::x86::V3::try_new() {
            Some(registers) => Ok(Simd::vectorize(registers, operation)),
            None => Err(operation),
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    Ok(pulp::Arch::new().dispatch(operation))
}
