//! All kernels in all variants, for the shader tests.

use crate::gpu::KernelKey;
use crate::gpu::source::definitions;
use crate::precision::Precision;
use crate::{bezier, discrete, laplacian, linalg, scf, spline};

/// All kernels in all variants: paths, entry points, precisions, definitions.
pub fn kernels() -> Vec<KernelKey> {
    let mut keys = Vec::new();
    for precision in [Precision::F32, Precision::F64] {
        keys.extend(linalg::ring::kernels(precision, spline::ROW_SOURCE));
        keys.extend(linalg::block_ring::block_ring_kernels(precision));
        keys.extend([2, 3].map(|dimension| spline::smoothing_kernel(precision, dimension)));
        keys.extend(discrete::evaluate_kernels(precision));
        keys.extend(discrete::descent_kernels(precision));
        keys.extend(discrete::resident_kernels(precision));
        keys.extend(scf::scf_kernels(precision));
        keys.extend(bezier::bezier_kernels(precision));
        keys.extend(laplacian::laplacian_kernels(precision));
        for (path, entries) in spline::KERNELS {
            let definitions = definitions([("GROUP", &spline::GROUP)]);
            keys.extend(entries.iter().map(|entry| KernelKey {
                path,
                entry,
                precision,
                definitions: definitions.clone(),
            }));
        }
    }
    keys
}
