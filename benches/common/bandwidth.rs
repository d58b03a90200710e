//! What bounds everything that streams.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

/// Bytes a second that all threads copy, reading and writing counted: the bound of everything that
/// streams.
pub fn copy_bandwidth() -> f64 {
    let source = vec![1.0_f64; 4 << 20];
    let mut target = vec![0.0_f64; source.len()];
    let best = (0..20)
        .map(|_| {
            let start = Instant::now();
            target
                .par_chunks_mut(1 << 16)
                .zip(source.par_chunks(1 << 16))
                .for_each(|(to, from)| to.copy_from_slice(from));
            black_box(&target);
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    16.0 * source.len() as f64 / best
}
