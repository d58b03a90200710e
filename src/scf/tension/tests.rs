use super::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};

#[test]
fn random() {
    let mut rng = StdRng::seed_from_u64(1);
    let mut failed = 0;
    let start = std::time::Instant::now();
    let mut arounds = 0;
    let mut kinds = [0; 6];
    for _ in 0..2000 {
        let nu = 1.2 * (20.0f64 / 1.2).powf(rng.random::<f64>());
        let lambda = 10f64.powf(rng.random_range(-3.0..3.0));
        let a = rng.random_range(-170.0..170.0f64);
        let b = rng.random_range(-170.0..170.0f64);
        match TensionSegment::between(1.0, [a.to_radians(), b.to_radians()], nu, lambda) {
            Some(s) => {
                let k = match s.shape.pull { Pull::Below(_) => 0, Pull::Critical => 2, Pull::Above(_) => 4 } + s.has_inflection() as usize; let around = matches!(s.shape.course, Course::Around(_)) as usize; arounds += around;
                kinds[k] += 1;
            }
            None => {
                failed += 1;
                if failed < 20 {
                    eprintln!("{a} {b} nu {nu} lambda {lambda}");
                }
            }
        }
    }
    eprintln!("failed {failed} {kinds:?} {arounds} {:?}", start.elapsed());
}
