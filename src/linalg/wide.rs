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

/// Whether the processor has wide registers.
pub(crate) fn has_wide_registers() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        pulp::x86::V3::try_new().is_some()
    }
    #[cfg(not(target_arch = "x86_64"))]
    true
}

/// A part of a computation over a [`Scalar`](super::Scalar), compiled as a function of its own by
/// [`Scalar::run`](super::Scalar::run).
///
/// Only what is inlined into [`run`](Self::run) uses the wide registers of lanes. A computation is a
/// sequence of operations of some hundred lines each. One function of all of them takes compilers
/// many times longer: their time grows faster than the function.
#[doc(hidden)]
pub trait Operation {
    /// Its result.
    type Output;

    /// Computes the result. Implementations are `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

/// Runs an operation with the registers of the target.
#[inline(never)]
pub(super) fn apart<Op: Operation>(operation: Op) -> Op::Output {
    operation.run()
}

/// Runs an operation with wide registers.
pub(super) fn apart_in_wide_registers<Op: Operation>(operation: Op) -> Op::Output {
    struct Wide<Op>(Op);
    impl<Op: Operation> pulp::WithSimd for Wide<Op> {
        type Output = Op::Output;

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> Op::Output {
            self.0.run()
        }
    }
    let Ok(output) = with_wide_registers(Wide(operation)) else {
        unreachable!("lanes compute only where has_wide_registers()")
    };
    output
}
