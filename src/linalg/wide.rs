//! Wide vector registers, where the processor has them, and computations as sequences of operations.

/// A part of a computation, compiled as a separate function by [`Scalar::run`](super::Scalar::run) and
/// [`run`].
///
/// Only what is inlined into [`run`](Self::run) uses wide registers. Operations have some hundred
/// lines each. One function of a whole computation takes compilers many times longer, since their
/// time grows faster than the function.
#[doc(hidden)]
pub trait Operation {
    /// The type of the result.
    type Output;

    /// Computes the result. Implementations are `#[inline(always)]`.
    fn run(self) -> Self::Output;
}

/// Declares an [`Operation`] by its fields and the expression that it computes of them.
macro_rules! operation {
    (
        $(#[$about:meta])*
        $Name:ident<$($life:lifetime),+ $(, $T:ident: $Bound:path)*; $($N:ident),+> { $($field:ident: $type:ty),+ $(,)? }
            -> $Output:ty { $result:expr }
    ) => {
        $(#[$about])*
        struct $Name<$($life,)+ $($T: $Bound,)* $(const $N: usize),+> {
            $($field: $type,)+
        }

        impl<$($life,)+ $($T: $Bound,)* $(const $N: usize),+> $crate::linalg::Operation
            for $Name<$($life,)+ $($T,)* $($N),+>
        {
            type Output = $Output;

            #[inline(always)]
            fn run(self) -> $Output {
                let $Name { $($field),+ } = self;
                $result
            }
        }
    };
}

pub(crate) use operation;

/// Runs an operation in wide registers if the processor has any, else in the target's registers.
pub(crate) fn run<Op: Operation>(operation: Op) -> Op::Output {
    with_wide_registers(operation).unwrap_or_else(apart)
}

/// Runs an operation compiled for AVX2 (on ARM for NEON). Gives it back where the processor lacks
/// that.
///
/// It is compiled for no other level, and not again for processors without wide registers.
pub(crate) fn with_wide_registers<Op: Operation>(operation: Op) -> Result<Op::Output, Op> {
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::Simd;
        match pulp::x86::V3::try_new() {
            Some(registers) => Ok(Simd::vectorize(registers, Wide(operation))),
            None => Err(operation),
        }
    }
    // Every WebAssembly engine that has SIMD has the 16 bytes of the target, and few have more.
    #[cfg(target_arch = "wasm32")]
    return Ok(apart(operation));
    #[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
    Ok(pulp::Arch::new().dispatch(Wide(operation)))
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

#[cfg(not(target_arch = "wasm32"))]
struct Wide<Op>(Op);

#[cfg(not(target_arch = "wasm32"))]
impl<Op: Operation> pulp::WithSimd for Wide<Op> {
    type Output = Op::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Op::Output {
        self.0.run()
    }
}

/// Runs an operation in the registers of the target.
#[inline(never)]
pub(super) fn apart<Op: Operation>(operation: Op) -> Op::Output {
    operation.run()
}

/// Runs an operation on lanes in wide registers.
pub(super) fn in_wide_registers<Op: Operation>(operation: Op) -> Op::Output {
    let Ok(output) = with_wide_registers(operation) else {
        unreachable!("lanes compute only where has_wide_registers()")
    };
    output
}
