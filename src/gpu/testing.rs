//! What unit tests of kernels share: the adapter and its precisions.

use super::Gpu;
use crate::precision::Precision;

/// The first adapter, with arrays filled with what must not be read.
///
/// `None` if there is no adapter and none is required.
pub(crate) fn gpu() -> Option<Gpu> {
    match Gpu::open(0) {
        Ok(gpu) => Some(gpu.with_poisoned_arrays()),
        Err(error) if std::env::var_os("FAIRCURVE_REQUIRE_GPU").is_some() => panic!("{error}"),
        Err(_) => None,
    }
}

/// The precisions that an adapter has.
pub(crate) fn precisions(gpu: &Gpu) -> Vec<Precision> {
    let mut precisions = vec![Precision::F32];
    precisions.extend(gpu.summary().has_f64.then_some(Precision::F64));
    precisions
}
