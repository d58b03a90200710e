//! What the GPU tests share: the adapter (required where FAIRCURVE_REQUIRE_GPU is set) and seeded numbers.

use faircurve::gpu::Gpu;
use rand::SeedableRng;
use rand::rngs::StdRng;

/// The first adapter. Without one the test fails where `FAIRCURVE_REQUIRE_GPU` is set, and says so where it is not.
pub fn gpu() -> Gpu {
    Gpu::open(0).inspect(|gpu| println!("adapter: {} ({})", gpu.summary().name, gpu.summary().driver)).unwrap()
}

/// A generator whose seed is printed.
pub fn seeded(seed: u64) -> StdRng {
    println!("seed {seed}");
    StdRng::seed_from_u64(seed)
}
