//! Béziers completed, elevated, reduced, divided and evaluated on the GPU: the CPU's points,
//! energies and refusals.

use faircurve::bezier::{
    Complete, Controls, Energy, Given, Polygons, Refusal, Solved, complete, elevate, evaluate, reduce, split,
};
use faircurve::gpu::plan::Limits;
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Precision};
use rand::RngExt;
use rand::rngs::StdRng;

use crate::common;
use crate::common::conform::{Outcome, Unit, compare, largest};
use crate::common::tolerance::{BEZIER, ENERGY, Tolerance};
use crate::common::{device, epsilon, precisions, seeded};

/// The GPU, in every precision that it has.
fn devices() -> Option<Vec<(Device, Precision)>> {
    let device = device()?;
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    Some(precisions.into_iter().map(|precision| (device.clone().with_precision(precision), precision)).collect())
}

/// Control polygons, and which of their points are known.
#[derive(Clone, Default)]
struct Batch {
    dimension: usize,
    coords: Vec<f64>,
    offsets: Vec<usize>,
    known: Vec<bool>,
}

impl Batch {
    fn new(dimension: usize) -> Self {
        Batch { dimension, offsets: vec![0], ..Batch::default() }
    }

    /// Adds a curve; unknown points are NaN.
    fn push(&mut self, known: &[bool], mut coordinate: impl FnMut() -> f64) {
        for &is_known in known {
            self.coords.extend((0..self.dimension).map(|_| if is_known { coordinate() } else { f64::NAN }));
        }
        self.known.extend(known);
        self.offsets.push(self.known.len());
    }

    fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    fn polygons(&self) -> Polygons<'_> {
        Polygons { dimension: self.dimension, coords: &self.coords, offsets: &self.offsets }
    }

    fn points(&self, i: usize) -> &[f64] {
        &self.coords[self.offsets[i] * self.dimension..self.offsets[i + 1] * self.dimension]
    }

    fn given(&self) -> Given<'_> {
        Given { known: Some(&self.known), ..Given::default() }
    }

    /// The curves of these numbers, in this order.
    fn select(&self, curves: &[usize]) -> Batch {
        let mut selected = Batch::new(self.dimension);
        for &i in curves {
            selected.coords.extend(self.points(i));
            selected.known.extend(&self.known[self.offsets[i]..self.offsets[i + 1]]);
            selected.offsets.push(selected.known.len());
        }
        selected
    }
}

/// Patterns of degrees 3 to 10 with so many known points at least.
fn patterns(count: usize, least: usize, random: &mut StdRng) -> Vec<Vec<bool>> {
    (0..count)
        .map(|slot| {
            loop {
                let known: Vec<bool> = (0..4 + slot % 8).map(|_| random.random_bool(0.5)).collect();
                if known.iter().filter(|known| **known).count() >= least {
                    break known;
                }
            }
        })
        .collect()
}

/// Curves of these patterns, each of its own size, whose coordinates lie about 0.
fn random_curves(dimension: usize, patterns: &[Vec<bool>], curves: usize, random: &mut StdRng) -> Batch {
    let mut batch = Batch::new(dimension);
    for i in 0..curves {
        let size = 10_f64.powf(random.random_range(-6.0..6.0));
        batch.push(&patterns[i % patterns.len()], || size * random.random_range(-1.0..1.0));
    }
    batch
}

fn outcome(offsets: &[usize], dimension: usize, coords: &[f64], status: Vec<CurveStatus>) -> Outcome {
    let names = (0..status.len()).map(|i| i.to_string()).collect();
    Outcome {
        values: coords.to_vec(),
        offsets: offsets.iter().map(|k| k * dimension).collect(),
        status,
        names,
        along: vec![],
    }
}

fn points_of(batch: &Batch, solved: &Solved) -> Outcome {
    outcome(&batch.offsets, batch.dimension, &solved.coords, solved.statuses.clone())
}

fn made(controls: &Controls) -> Outcome {
    let status = vec![CurveStatus::Converged; controls.offsets.len() - 1];
    outcome(&controls.offsets, controls.dimension, &controls.coords, status)
}

fn half_extents(controls: Polygons) -> Vec<f64> {
    let d = controls.dimension;
    let of = |i: usize| {
        let axis = |c: usize| {
            let values = || controls.points(i).iter().skip(c).step_by(d).filter(|x| x.is_finite());
            let low = values().fold(f64::INFINITY, |low, x| low.min(*x));
            0.5 * (values().fold(f64::NEG_INFINITY, |high, x| high.max(*x)) - low)
        };
        (0..d).map(axis).fold(0.0, f64::max)
    };
    (0..controls.len()).map(of).collect()
}

/// Completes on the CPU and everywhere else, and compares points, energies, refusals; known points
/// to the bit.
fn compare_completions(
    what: &str,
    batch: &Batch,
    given: &Given,
    energy: &Energy,
    devices: &[(Device, Precision)],
) -> Solved {
    let polygons = batch.polygons();
    let wanted = complete(&polygons, given, energy, &Device::cpu()).unwrap();
    let completed = Polygons { coords: &wanted.coords, ..polygons };
    // An energy is a sum of squares of differences of numbers as large as the polygon: a rounding of these, which a device
    // makes where it contracts, changes the energy E of an almost straight polygon of size s by s√E. What is straight has
    // an energy of rounding.
    let unit = |(energy, size): (&f64, f64)| energy.max(size * energy.sqrt()).max(1e-9 * size * size);
    let units: Vec<f64> = wanted.energies.iter().zip(half_extents(completed)).map(unit).collect();
    for (device, precision) in devices {
        let what = format!("{what}, {}-D, {}", batch.dimension, precision.word());
        let found = complete(&polygons, given, energy, device).unwrap();
        let epsilon = epsilon(*precision);
        let unit = Unit::Size(batch.dimension);
        compare(&what, &points_of(batch, &found), &points_of(batch, &wanted), BEZIER, epsilon, unit);
        let energies = [&found, &wanted].map(|solved| Outcome::of_numbers(solved.energies.clone()));
        compare(&format!("{what}, energies"), &energies[0], &energies[1], ENERGY, epsilon, Unit::Each(&units));
        assert_eq!(format!("{:?}", found.refusals), format!("{:?}", wanted.refusals), "{what}");
        for (k, point) in batch.coords.chunks_exact(batch.dimension).enumerate().filter(|(k, _)| batch.known[*k]) {
            let bits = |point: &[f64]| point.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
            let same = bits(&found.coords[k * batch.dimension..][..batch.dimension]);
            assert_eq!(same, bits(point), "{what}: known point {k}");
        }
    }
    wanted
}

#[test]
fn mixed_batches_of_degrees_and_patterns_are_completed_as_by_the_cpu() {
    let Some(devices) = devices() else { return };
    for dimension in 1..=4 {
        let mut random = seeded(1200 + dimension as u64);
        let patterns = patterns(48, 2, &mut random);
        let batch = random_curves(dimension, &patterns, 3000, &mut random);
        let solved = compare_completions("mixed", &batch, &batch.given(), &Energy::bending(), &devices);
        assert!(solved.statuses.iter().all(|&status| status == CurveStatus::Converged));
        let mixture = Energy { weights: [0.3, 1.0, 0.01] };
        let some = batch.select(&(0..500).collect::<Vec<usize>>());
        compare_completions("mixture", &some, &some.given(), &mixture, &devices);
        compare_completions("stretching", &some, &some.given(), &Energy::of_order(1), &devices);
    }
}

#[test]
fn what_is_not_unique_is_the_smallest_and_says_so() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1210);
    let mut patterns = patterns(16, 0, &mut random);
    // None, one of many, all, one of one.
    patterns.extend([
        vec![false; 5],
        vec![false, false, true, false],
        vec![true; 8],
        vec![true],
        vec![false],
        vec![true; 2],
    ]);
    let batch = random_curves(2, &patterns, 300, &mut random);
    for order in 2..=3 {
        let solved = compare_completions("not unique", &batch, &batch.given(), &Energy::of_order(order), &devices);
        let count = |status| solved.statuses.iter().filter(|own| **own == status).count();
        assert!(count(CurveStatus::NotUnique) > 40 && count(CurveStatus::Converged) > 100);
    }
}

#[test]
fn derivatives_and_directions_at_the_ends_are_met_as_by_the_cpu() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1220);
    let patterns = patterns(12, 3, &mut random);
    let batch = random_curves(3, &patterns, 600, &mut random);
    let mut column = |most: f64| -> Vec<f64> {
        let vector =
            |_| if random.random_bool(0.3) { [f64::NAN; 3] } else { [0; 3].map(|_| random.random_range(-most..most)) };
        (0..batch.len()).map(vector).collect::<Vec<[f64; 3]>>().into_flattened()
    };
    let columns = [column(3.0), column(9.0), column(3.0)];
    for directions in [false, true] {
        let derivatives = [[Some(&columns[0][..]), Some(&columns[1][..]), None], [Some(&columns[2][..]), None, None]];
        let given = Given { derivatives, directions, ..batch.given() };
        let solved = compare_completions("derivatives", &batch, &given, &Energy::bending(), &devices);
        let still = solved.refusals.iter().any(|(_, refusal)| matches!(refusal, Refusal::Still(_)));
        let again = solved.refusals.iter().any(|(_, refusal)| *refusal == Refusal::Contradiction);
        assert!(still == directions && again, "{:?}", solved.refusals);
    }
}

#[test]
fn curves_that_are_refused_leave_the_bits_of_their_neighbours() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1230);
    let patterns = patterns(20, 2, &mut random);
    let good = random_curves(2, &patterns, 400, &mut random);
    let mut mixed = Batch::new(2);
    for i in 0..good.len() {
        match i % 50 {
            10 => mixed.push(&[], || 0.0),
            20 => mixed.push(&[true; 40], || 1.0),
            30 => mixed.push(&patterns[i % 20], || f64::NAN),
            31 => mixed.push(&patterns[i % 20], || f64::INFINITY),
            40 => mixed.push(&[true, true, false, false], {
                let mut next = [1e308, 0.0, -1e308, 0.0].into_iter();
                move || next.next().expect("two points")
            }),
            _ => {}
        }
        let mut own = good.points(i).iter().copied().filter(|x| !x.is_nan());
        mixed.push(&patterns[i % 20], || own.next().expect("as many as are known"));
    }
    let given = mixed.given();
    let wanted = compare_completions("bad between good", &mixed, &given, &Energy::bending(), &devices);
    assert_eq!(wanted.refusals.len(), 40);
    let is_good: Vec<usize> = (0..mixed.len()).filter(|&i| wanted.statuses[i].is_usable()).collect();
    assert_eq!(is_good.len(), good.len());
    for (device, precision) in &devices {
        let solve = |batch: &Batch| complete(&batch.polygons(), &batch.given(), &Energy::bending(), device).unwrap();
        let (here, there) = (points_of(&good, &solve(&good)), points_of(&mixed, &solve(&mixed)));
        for (i, &k) in is_good.iter().enumerate() {
            assert_eq!(here.bits(i), there.bits(k), "curve {i} in {precision:?}");
        }
    }
}

#[test]
fn a_curve_has_the_same_bits_in_any_order_chunk_and_repetition() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1240);
    let patterns = patterns(20, 2, &mut random);
    let batch = random_curves(3, &patterns, 700, &mut random);
    let mut order: Vec<usize> = (0..batch.len()).collect();
    (1..order.len()).for_each(|k| order.swap(k, random.random_range(0..=k)));
    let shuffled = batch.select(&order);
    for (device, precision) in &devices {
        let solve = |batch: &Batch, device: &Device| {
            let solved = complete(&batch.polygons(), &batch.given(), &Energy::bending(), device).unwrap();
            (points_of(batch, &solved), solved.energies)
        };
        let (found, energies) = solve(&batch, device);
        let gpu = common::gpu().expect("there was one");
        let limits = Limits { chunk_bytes: 20_000, ..*gpu.limits() };
        let small = Device::from_gpu(gpu.with_limits(limits)).with_precision(*precision);
        for device in [device, &small] {
            let (again, energies_again) = solve(&batch, device);
            assert!((0..batch.len()).all(|i| again.bits(i) == found.bits(i)), "{precision:?}");
            assert_eq!(energies_again, energies, "{precision:?}");
        }
        let (elsewhere, energies_elsewhere) = solve(&shuffled, device);
        for (k, &i) in order.iter().enumerate() {
            assert_eq!(
                (elsewhere.bits(k), energies_elsewhere[k]),
                (found.bits(i), energies[i]),
                "{i} in {precision:?}"
            );
        }
    }
}

#[test]
fn curves_that_f32_is_hard_on_are_as_good_as_others() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1250);
    // Few known points, together at one end: what is far from them is a difference of large numbers.
    let first: Vec<Vec<bool>> =
        [(5, 3), (8, 4), (10, 5), (10, 9), (7, 2)].map(|(d, n)| (0..=d).map(|i| i < n).collect()).to_vec();
    let batch = random_curves(2, &first, 2000, &mut random);
    compare_completions("known at one end", &batch, &batch.given(), &Energy::bending(), &devices);
    let high = [2, 3, 7].map(|step| (0..=30).map(|i| i % step == 0).collect::<Vec<bool>>());
    let batch = random_curves(2, &high, 600, &mut random);
    compare_completions("degree 30", &batch, &batch.given(), &Energy::bending(), &devices);
    let patterns = patterns(16, 2, &mut random);
    let mut batch = Batch::new(2);
    for i in 0..1600 {
        let known = &patterns[i % 16];
        let places =
            known.iter().enumerate().filter(|(_, known)| **known).flat_map(|(k, _)| [k as f64, -0.3 * k as f64]);
        let mut places = places.collect::<Vec<f64>>().into_iter();
        // Almost straight, on a parabola, far from the origin, tiny, huge.
        let mut shape = |k: usize| {
            let (x, noise) = (places.next().expect("as many as are known"), random.random_range(-1.0..1.0));
            match k % 5 {
                0 => x + 1e-4 * noise,
                1 => x * x + 1e-3 * noise,
                2 => 1e6 + noise,
                3 => 1e-300 * noise,
                _ => 1e140 * noise,
            }
        };
        batch.push(known, || shape(i / 16));
    }
    compare_completions("hard", &batch, &batch.given(), &Energy::bending(), &devices);
}

/// Compares what an operation makes of polygons, in units of their half extents or those of what is
/// made.
fn compare_transformed(
    what: &str,
    batch: &Batch,
    devices: &[(Device, Precision)],
    operation: impl Fn(&Device) -> Controls,
) {
    let wanted = operation(&Device::cpu());
    let extents = half_extents(batch.polygons()).into_iter().zip(half_extents(wanted.polygons()));
    // The CPU sums where the curve lies, the GPU about its first point.
    let reach = |i: usize| 32.0 * largest(batch.points(i));
    for (device, precision) in devices {
        let units: Vec<f64> = extents.clone().map(|(given, made)| if made > given { made } else { given }).collect();
        let units: Vec<f64> =
            (0..units.len()).map(|i| units[i] + f64::EPSILON / epsilon(*precision) * reach(i)).collect();
        let what = format!("{what}, {}-D, {}", batch.dimension, precision.word());
        compare(&what, &made(&operation(device)), &made(&wanted), BEZIER, epsilon(*precision), Unit::Each(&units));
    }
}

#[test]
fn curves_are_elevated_reduced_divided_and_evaluated_as_by_the_cpu() {
    let Some(devices) = devices() else { return };
    for dimension in 1..=4 {
        let mut random = seeded(1260 + dimension as u64);
        let mut batch = Batch::new(dimension);
        for i in 0..900 {
            let size = 10_f64.powf(random.random_range(-6.0..6.0));
            let shift = if i % 7 == 0 { 1e4 * size } else { 0.0 };
            batch.push(&vec![true; 4 + i % 8], || shift + size * random.random_range(-1.0..1.0));
            match i % 90 {
                20 => batch.push(&[], || 0.0),
                40 => batch.push(&[true; 6], || f64::NAN),
                60 => batch.push(&[true; 31], || random.random_range(-1.0..1.0)),
                80 => batch.push(&[true; 4], || 7.0),
                _ => {}
            }
        }
        let polygons = batch.polygons();
        let parameters: Vec<f64> = (-2..=12).map(|k| 0.1 * f64::from(k)).collect();
        compare_transformed("evaluated", &batch, &devices, |device| evaluate(&polygons, &parameters, device).unwrap());
        compare_transformed("reduced", &batch, &devices, |device| reduce(&polygons, 2, device).unwrap().0);
        for half in 0..2 {
            compare_transformed("divided", &batch, &devices, |device| {
                split(&polygons, 0.3, device).unwrap()[half].clone()
            });
        }
        let low: Vec<usize> = (0..batch.len()).filter(|&i| polygons.count(i) <= 11).collect();
        let low = batch.select(&low);
        compare_transformed("elevated", &low, &devices, |device| elevate(&low.polygons(), 5, device).unwrap());
        for (device, precision) in &devices {
            let elevated = elevate(&low.polygons(), 3, device).unwrap();
            let (_, bounds) = reduce(&elevated.polygons(), 3, device).unwrap();
            let sizes = half_extents(low.polygons());
            for i in (0..low.len()).filter(|&i| low.polygons().count(i) > 0) {
                let (given, own) = (low.points(i), elevated.points(i));
                let ends = |points: &[f64]| [&points[..dimension], &points[points.len() - dimension..]].concat();
                let bits = |points: &[f64]| ends(points).iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
                if !given[0].is_nan() {
                    assert_eq!(bits(own), bits(given), "ends of {i} in {precision:?}");
                    let lost = 100.0 * (epsilon(*precision) * sizes[i] + f64::EPSILON * largest(given));
                    assert!(bounds[i] <= lost, "{i} in {precision:?}: {} for {lost}", bounds[i]);
                }
            }
        }
    }
}

#[test]
fn curves_are_evaluated_at_thousands_of_parameters() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1270);
    let mut batch = Batch::new(2);
    for points in [4, 31, 4, 11] {
        batch.push(&vec![true; points], || random.random_range(-1.0..1.0));
    }
    let parameters: Vec<f64> = (0..=20_000).map(|k| f64::from(k) / 20_000.0).collect();
    compare_transformed("many parameters", &batch, &devices, |device| {
        evaluate(&batch.polygons(), &parameters, device).unwrap()
    });
}

#[test]
fn batches_of_curves_are_completed_and_elevated_with_the_cpus_reports() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1280);
    let patterns = patterns(10, 2, &mut random);
    let curves = random_curves(2, &patterns, 100, &mut random);
    let known = Constraints { known: Some(curves.known.clone()), ..Constraints::default() };
    let batch = CurveBatch::from_ragged(2, curves.coords, curves.offsets).unwrap().with_constraints(known).unwrap();
    let cpu = Complete::default().fit(&batch, &Device::cpu()).unwrap();
    for (device, precision) in &devices {
        let gpu = Complete::default().fit(&batch, device).unwrap();
        assert_eq!((gpu.device().is_gpu, gpu.device().precision), (true, *precision));
        for raise in [0, 4] {
            let [found, wanted] = [(&gpu, device), (&cpu, &Device::cpu())].map(|(completed, device)| {
                let raised = completed.clone().elevate(raise, device).unwrap();
                Outcome::of_curves(raised.control_points(), raised.reports())
            });
            let twice = Tolerance { roundings: 2.0 * BEZIER.roundings, ..BEZIER };
            compare("batch", &found, &wanted, twice, epsilon(*precision), Unit::Size(2));
        }
    }
}

#[test]
fn a_million_curves_are_completed_in_one_call() {
    let Some(devices) = devices() else { return };
    let mut random = seeded(1290);
    let patterns = patterns(64, 2, &mut random);
    let batch = random_curves(2, &patterns, 1_000_000, &mut random);
    compare_completions("a million", &batch, &batch.given(), &Energy::bending(), &devices[..1]);
}

#[test]
fn no_parameters_give_no_points_on_a_gpu_either() {
    let Some(devices) = devices() else { return };
    let polygons = Polygons { dimension: 2, coords: &[0.0, 0.0, 1.0, 2.0, 3.0, 0.0], offsets: &[0, 0, 3] };
    for (device, _) in devices {
        assert_eq!(evaluate(&polygons, &[], &device).unwrap().offsets, [0, 0, 0]);
    }
}
