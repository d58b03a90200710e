//! Fair curves on the GPU are those of the CPU: the same statuses, energies within 1e-10 (f64) and
//! 1e-5 (f32) of themselves, and curves within 1e-9 and 1e-5 of their size. These bounds are of
//! iterations that stop at a gradient, not of roundings: a curve's distance from the minimum is of
//! the order of that gradient.

use glam::DVec3;

use faircurve::discrete::{
    Energy, Fair, Limits, Pins, Region, Segments, Solver, attachment, bending, length, tautness, tension, torsion,
    variation,
};
use faircurve::{Constraints, CurveBatch, CurveStatus, Device, Precision, Sampling};
use rand::RngExt;
use rand::rngs::StdRng;

use crate::common::{batches, device, precisions, seeded};
use crate::rough::Family;

const SEGMENTS: usize = 16;

/// Largest distance over size, and of energies over energies.
fn bounds(precision: Precision) -> (f64, f64) {
    if precision == Precision::F64 { (1e-9, 1e-10) } else { (1e-5, 1e-5) }
}

/// A number of the normal distribution, by the sum of twelve uniform ones.
fn normal(rng: &mut StdRng) -> f64 {
    (0..12).map(|_| rng.random_range(-0.5..0.5)).sum()
}

/// Open curves at unit steps with normal heights, closed ones around a circle with points at unit
/// steps; every second closed.
fn gentle(dimension: usize, count: usize, points: impl Fn(usize) -> usize, sigma: f64, rng: &mut StdRng) -> CurveBatch {
    let (mut coords, mut offsets, mut closed) = (Vec::new(), vec![0], Vec::new());
    for i in 0..count {
        let (n, is_closed) = (points(i).max(2 + 2 * (i % 2)), i % 2 == 1);
        for k in 0..n {
            let turn = std::f64::consts::TAU * k as f64 / n as f64;
            let radius = n as f64 / std::f64::consts::TAU;
            let at = if is_closed { [radius * turn.cos(), radius * turn.sin()] } else { [k as f64, 0.0] };
            let mut point: Vec<f64> = at.into_iter().chain([0.0]).take(dimension).collect();
            let from = usize::from(!is_closed);
            // Closed curves turn as it is: a fourth of the noise is as gentle for them.
            let own = if is_closed { 0.25 * sigma } else { sigma };
            point[from..].iter_mut().for_each(|x| *x += own * normal(rng));
            coords.extend(point);
        }
        offsets.push(coords.len() / dimension);
        closed.push(is_closed);
    }
    CurveBatch::from_ragged(dimension, coords, offsets).unwrap().closed_each(closed).unwrap()
}

fn size(batch: &CurveBatch, i: usize) -> f64 {
    let d = batch.dimension();
    let extent = |c: usize| {
        let axis = || batch.points(i).iter().skip(c).step_by(d);
        axis().fold(f64::NEG_INFINITY, |high, &x| high.max(x)) - axis().fold(f64::INFINITY, |low, &x| low.min(x))
    };
    (0..d).map(|c| extent(c).powi(2)).sum::<f64>().sqrt()
}

/// Fits on both, and asserts statuses, energies and distances.
fn conform(what: &str, fair: &Fair, batch: &CurveBatch, device: &Device) {
    conform_in(&precisions(device.as_gpu().expect("a GPU")), what, fair, batch, device);
}

/// [`conform`] in these precisions alone.
fn conform_in(precisions: &[Precision], what: &str, fair: &Fair, batch: &CurveBatch, device: &Device) {
    let sampling = Sampling::PerSpan(SEGMENTS);
    let (cpu, wanted) = fair.fit_sampled(batch, sampling, &Device::cpu()).unwrap();
    for &precision in precisions {
        let device = device.clone().with_precision(precision);
        let (gpu, found) = fair.fit_sampled(batch, sampling, &device).unwrap();
        assert_eq!(gpu.device().precision, precision, "{what}: done by {}", gpu.device());
        let (distance_bound, energy_bound) = bounds(precision);
        let (mut worst, mut worst_energy) = ((0.0, 0), 0.0f64);
        for i in 0..batch.len() {
            let (a, b) = (&cpu.reports()[i], &gpu.reports()[i]);
            assert_eq!(a.status, b.status, "{what}, {precision:?}, curve {i}: {:?}, {:?}", a.message, b.message);
            assert_eq!(wanted.count(i), found.count(i), "{what}, {precision:?}, curve {i}");
            let pairs = wanted.points(i).iter().zip(found.points(i));
            let distance = pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size(batch, i);
            assert!(distance <= distance_bound, "{what}, {precision:?}, curve {i}: {distance:e} of its size");
            let energy = if a.energy == b.energy { 0.0 } else { (a.energy - b.energy).abs() / a.energy };
            assert!(energy <= energy_bound, "{what}, {precision:?}, curve {i}: energies differ by {energy:e}");
            worst = if distance > worst.0 { (distance, i) } else { worst };
            worst_energy = worst_energy.max(energy);
        }
        println!(
            "{what}, {}: curve {} is off by {:.1e} of its size, energies by {worst_energy:.1e} at most, {} of {} converged",
            precision.word(),
            worst.1,
            worst.0,
            gpu.usable(),
            gpu.len()
        );
    }
}

fn fair(energy: Energy) -> Fair {
    Fair { energy, segments: Segments::PerSpan(SEGMENTS), ..Fair::default() }
}

#[test]
fn gentle_curves_of_65_vertices_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let batch = gentle(2, 400, |_| 5, 0.2, &mut seeded(41));
    conform("bending + 0.1 length, 2-D", &fair(bending(2.0) + 0.1 * length()), &batch, &device);
    let batch = gentle(3, 100, |_| 5, 0.2, &mut seeded(42));
    conform("bending + 0.1 length, 3-D", &fair(bending(2.0) + 0.1 * length()), &batch, &device);
}

#[test]
fn ragged_batches_of_every_energy_of_the_kernels_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let batch = gentle(2, 60, |i| 2 + i % 13, 0.15, &mut seeded(43));
    for (what, energy) in [
        ("length", length()),
        ("tension", tension()),
        ("bending, ν = 3, + length", bending(3.0) + length()),
        ("bending, ν = 2.5, + tension", bending(2.5) + 0.1 * tension()),
        ("bending + tautness", bending(2.0) + tautness()),
    ] {
        conform(what, &fair(energy), &batch, &device);
    }
    for pins in [Pins::Ends, Pins::None] {
        let energy = bending(2.0) + length() + 100.0 * attachment();
        conform(&format!("attached, pins {pins:?}"), &Fair { pins, ..fair(energy) }, &batch, &device);
        let taut = bending(2.0) + tautness() + 100.0 * attachment();
        conform(&format!("attached and taut, pins {pins:?}"), &Fair { pins, ..fair(taut) }, &batch, &device);
    }
}

#[test]
fn a_curve_keeps_its_bits_whatever_stands_beside_it() {
    let Some(device) = device() else { return };
    let batch = gentle(2, 40, |i| 2 + i % 7, 0.2, &mut seeded(44));
    let fair = fair(bending(2.0) + 0.1 * length());
    let order: Vec<usize> = (0..batch.len()).rev().filter(|i| i % 3 != 1).collect();
    let some = batch.select(&order);
    let some = some.closed_each(order.iter().map(|&i| batch.is_closed(i)).collect()).unwrap();
    for device in [Device::cpu(), device.clone().with_precision(Precision::F32)] {
        let sample = |batch: &CurveBatch| fair.fit_sampled(batch, Sampling::PerSpan(SEGMENTS), &device).unwrap().1;
        let (all, part) = (sample(&batch), sample(&some));
        for (k, &i) in order.iter().enumerate() {
            let bits = |batch: &CurveBatch, i: usize| batch.points(i).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&part, k), bits(&all, i), "curve {i} on {}", device.name());
        }
    }
}

#[test]
fn curves_of_order_3_end_in_f64_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let mut precisions = precisions(device.as_gpu().expect("a GPU"));
    precisions.retain(|precision| *precision == Precision::F64);
    let batch = gentle(2, 40, |i| 2 + i % 7, 0.05, &mut seeded(49));
    for energy in [variation() + length(), torsion() + bending(2.0) + length()] {
        conform_in(&precisions, &energy.to_string(), &fair(energy.clone()), &batch, &device);
    }
}

#[test]
fn what_no_kernel_can_do_is_done_by_the_cpu_which_says_so() {
    let Some(device) = device() else { return };
    let batch = gentle(2, 4, |_| 4, 0.1, &mut seeded(45));
    let narrow = fair(variation() + length()).fit(&batch, &device.clone().with_precision(Precision::F32)).unwrap();
    let gradients = Fair { solver: Solver::Sobolev, ..fair(variation() + length()) }.fit(&batch, &device).unwrap();
    for fit in [narrow, gradients] {
        assert!(!fit.device().is_gpu, "{}", fit.device());
        assert_eq!(fit.usable(), fit.len());
    }
}

#[test]
fn areas_are_kept_by_the_cpu_on_every_device() {
    let Some(device) = device() else { return };
    let batch = gentle(2, 6, |_| 7, 0.1, &mut seeded(47));
    let limits = Limits { area: true, ..Limits::default() };
    let fair = Fair { limits, deviation: Some(0.1.into()), ..fair(bending(2.0) + length()) };
    let wanted = fair.fit(&batch, &Device::cpu()).unwrap();
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        // Discs are smaller in f32.
        let within = if precision == Precision::F64 { 1e-6 } else { 1e-3 };
        let found = fair.fit(&batch, &device.clone().with_precision(precision)).unwrap();
        let reports = wanted.reports().iter().zip(found.reports()).enumerate();
        let both = reports.filter(|(_, (wanted, _))| wanted.status == CurveStatus::Converged);
        // One stalls just above its tolerance.
        assert!(both.clone().count() >= 5, "{:?}", wanted.reports());
        for (i, (wanted, found)) in both {
            assert_eq!(found.status, CurveStatus::Converged, "{precision}, curve {i}");
            assert_eq!(found.limits.unwrap().violation, 0.0, "curve {i}");
            let away = (found.energy / wanted.energy - 1.0).abs();
            assert!(away < within, "{precision}, curve {i}: {} {}", found.energy, wanted.energy);
        }
    }
}

#[test]
fn curves_with_given_tangents_end_where_the_cpu_ends() {
    let Some(device) = device() else { return };
    let every = precisions(device.as_gpu().expect("a GPU"));
    let in_f64: Vec<Precision> = every.iter().copied().filter(|precision| *precision == Precision::F64).collect();
    let mut random = seeded(51);
    for (dimension, energy) in [
        (2, bending(2.0) + 0.1 * length()),
        (3, bending(2.0) + tautness()),
        (2, bending(3.0) + length()),
        (2, variation() + bending(2.0) + length()),
        (3, variation() + length()),
    ] {
        let batch = gentle(dimension, 40, |i| 3 + i % 5, 0.05, &mut random);
        // Along the way to the next point, turned a little; with a curvature across it under energies of order 3.
        let (mut tangents, mut curvatures) = (vec![], vec![]);
        for i in 0..batch.len() {
            let (points, count) = (batch.points(i), batch.count(i));
            for k in 0..count {
                let (from, to) = if k + 1 < count { (k, k + 1) } else { (k - 1, k) };
                let mut way: Vec<f64> =
                    (0..dimension).map(|c| points[to * dimension + c] - points[from * dimension + c]).collect();
                let turn = random.random_range(-0.3..0.3);
                (way[0], way[1]) = (way[0] - turn * way[1], way[1] + turn * way[0]);
                let has_one = (i + k) % 3 == 0;
                let square = way[0] * way[0] + way[1] * way[1];
                let across = [-0.2 * way[1] / square, 0.2 * way[0] / square, 0.0];
                tangents.extend(way.iter().map(|x| if has_one { *x } else { f64::NAN }));
                let has_bend = has_one && (i + k) % 2 == 0;
                curvatures.extend((0..dimension).map(|c| if has_bend { across[c] } else { f64::NAN }));
            }
        }
        let is_third = energy.to_string().contains("variation");
        let constraints = Constraints {
            tangents: Some(tangents),
            curvatures: is_third.then_some(curvatures),
            ..Constraints::default()
        };
        let held = batch.with_constraints(constraints).unwrap();
        let precisions = if is_third { &in_f64 } else { &every };
        let what = format!("{dimension}-D {energy}, tangents");
        conform_in(precisions, &what, &fair(energy.clone()), &held, &device);
        let fit = fair(energy).fit(&held, &device.clone().with_precision(Precision::F64)).unwrap();
        assert_eq!(fit.device().finished_on_cpu, 0, "{}", fit.device());
    }
}

#[test]
fn planar_curves_of_65_vertices_agree_to_a_millionth_of_their_size_in_single_precision() {
    let Some(device) = device() else { return };
    let batch = Family { dimension: 2, closed: false, points: 5, sigma: 0.2 }.batch(500, 46);
    let fair = fair(bending(2.0) + 0.1 * length());
    let [(cpu, wanted), (gpu, found)] = [Device::cpu(), device.with_precision(Precision::F32)]
        .map(|device| fair.fit_sampled(&batch, Sampling::PerSpan(SEGMENTS), &device).unwrap());
    for i in 0..batch.len() {
        let statuses = [&cpu, &gpu].map(|fit| fit.reports()[i].status);
        assert_eq!(statuses, [CurveStatus::Converged; 2], "curve {i}");
        let pairs = wanted.points(i).iter().zip(found.points(i));
        let distance = pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size(&batch, i);
        assert!(distance <= 1e-6, "curve {i}: {distance:e}");
    }
}

#[test]
fn what_single_precision_cannot_finish_is_finished_by_the_cpu_unless_it_was_asked_for() {
    let Some(device) = device() else { return };
    let batch = Family { dimension: 2, closed: false, points: 5, sigma: 1.2 }.batch(60, 47);
    let fair = Fair { segments: Segments::PerSpan(128), ..fair(bending(2.0) + 0.1 * length()) };
    let left = fair.fit(&batch, &device.clone().with_precision(Precision::F32)).unwrap();
    let finished = fair.fit(&batch, &device.with_precision(Precision::Auto)).unwrap();
    println!("{} of {} without help; {}", left.usable(), left.len(), finished.device());
    assert!(left.usable() < left.len(), "{}", left.device());
    assert_eq!((left.device().precision, left.device().finished_on_cpu), (Precision::F32, 0));
    assert!(left.device().to_string().ends_with(", f32"), "{}", left.device());
    assert_eq!(finished.usable(), finished.len());
    let said = format!("f32; {} of its curves finished on the CPU in f64", left.len() - left.usable());
    assert_eq!(finished.device().finished_on_cpu, left.len() - left.usable());
    assert!(finished.device().to_string().ends_with(&said), "{}", finished.device());
}

#[test]
fn the_fairest_curves_within_a_deviation_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        for (dimension, closed, sigma, energy) in [
            (2, false, 0.2, bending(2.0) + length()),
            (2, true, 0.2, bending(2.0) + tautness()),
            (3, false, 0.2, bending(2.0) + tautness()),
            (2, false, 1.2, bending(2.0) + tautness()),
        ] {
            let batch = Family { dimension, closed, points: 7, sigma }.batch(20, 48);
            let fair = Fair { deviation: Some(0.05.into()), ..fair(energy) };
            let on_gpu = device.clone().with_precision(precision);
            let [cpu, gpu] =
                [Device::cpu(), on_gpu].map(|on| fair.fit_sampled(&batch, Sampling::PerSpan(16), &on).unwrap());
            // f32 keeps away from the discs by 1e-5 of the size.
            let near = if precision == Precision::F64 { 1e-7 } else { 1e-3 };
            for (i, (a, b)) in cpu.0.reports().iter().zip(gpu.0.reports()).enumerate() {
                let what = format!(
                    "{precision:?}, dimension {dimension}, closed {closed}, sigma {sigma}, curve {i}: {a:?} {b:?}"
                );
                if precision == Precision::F64 {
                    assert_eq!(a.status, b.status, "{what}");
                }
                assert!(b.max_deviation <= 0.05, "{what}");
                if [a, b].iter().all(|report| report.status == CurveStatus::Converged) {
                    let farthest =
                        cpu.1.points(i).iter().zip(gpu.1.points(i)).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
                    assert!(farthest <= near * size(&batch, i), "{what}: {farthest:e}");
                }
            }
            let usable = [&cpu, &gpu].map(|fit| fit.0.usable());
            println!(
                "{precision:?} dimension {dimension}, closed {closed}, sigma {sigma}: {usable:?} of {}",
                batch.len()
            );
            assert!(usable[1] + 2 >= usable[0], "{usable:?}");
        }
    }
}

#[test]
fn the_cheapest_of_several_starts_is_that_of_the_cpu() {
    let Some(device) = device() else { return };
    let batch = Family { dimension: 2, closed: false, points: 7, sigma: 1.2 }.batch(40, 49);
    let fair = Fair { starts: 6, ..fair(bending(2.0) + 0.1 * length()) };
    let cpu = fair.fit(&batch, &Device::cpu()).unwrap();
    let on_gpu = device.with_precision(Precision::F64);
    let gpu = fair.fit(&batch, &on_gpu).unwrap();
    let found = |fit: &faircurve::Fit| fit.reports().iter().filter(|report| report.gain > Some(0.01)).count();
    println!("cheaper by more than 1 %: {} on the CPU, {} on the GPU, of {}", found(&cpu), found(&gpu), batch.len());
    assert!(found(&cpu) >= 10, "{}", found(&cpu));
    // Rounding may lead a descent from far off to another minimum.
    let other = cpu.reports().iter().zip(gpu.reports()).filter(|(a, b)| (a.energy / b.energy - 1.0).abs() > 1e-9);
    let other = other.count();
    assert!(other <= 2, "{other} of {} ended elsewhere", batch.len());
}

#[test]
fn what_single_precision_leaves_after_stages_of_exponents_goes_on_from_where_it_was() {
    let Some(device) = device() else { return };
    let batch = Family { dimension: 2, closed: false, points: 5, sigma: 0.4 }.batch(40, 50);
    let fair = fair(bending(20.0) + length());
    let [(cpu, wanted), (gpu, found)] = [Device::cpu(), device.with_precision(Precision::Auto)]
        .map(|device| fair.fit_sampled(&batch, Sampling::PerSpan(SEGMENTS), &device).unwrap());
    println!("{}", gpu.device());
    let mut finished = 0;
    for i in 0..batch.len() {
        let [a, b] = [&cpu, &gpu].map(|fit| &fit.reports()[i]);
        // What f32 has finished has a larger gradient.
        if [a, b].iter().all(|report| report.status == CurveStatus::Converged && report.gradient_norm <= fair.tolerance)
        {
            finished += 1;
            let pairs = wanted.points(i).iter().zip(found.points(i));
            let distance = pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size(&batch, i);
            assert!(distance <= 1e-6, "curve {i}: {distance:e} {a:?} {b:?}");
        }
    }
    assert!(finished <= gpu.device().finished_on_cpu, "{finished}, {}", gpu.device());
    // Hardware whose f32 is enough for all of them leaves nothing to finish.
    assert_eq!(finished > 0, gpu.device().finished_on_cpu > 0, "{finished}, {}", gpu.device());
}

/// Largest curvatures of 1.2 times the largest turn over a chord of each curve's polygon, and blanks at every third point.
fn bounded(batch: CurveBatch) -> CurveBatch {
    let d = batch.dimension();
    let bound = |i: usize, k: usize| {
        let points: Vec<DVec3> =
            batch.points(i).chunks_exact(d).map(|p| DVec3::new(p[0], p[1], p.get(2).copied().unwrap_or(0.0))).collect();
        let turn = |w: &[DVec3]| {
            2.0 * ((w[2] - w[1]).normalize() - (w[1] - w[0]).normalize()).length()
                / ((w[2] - w[1]).length() + (w[1] - w[0]).length())
        };
        if k % 3 == 2 { f64::NAN } else { 1.2 * points.windows(3).map(turn).fold(0.0, f64::max) }
    };
    let column = (0..batch.len())
        .flat_map(|i| (0..batch.count(i)).map(move |k| (i, k)).collect::<Vec<_>>())
        .map(|(i, k)| bound(i, k));
    let largest_curvatures = Some(column.collect());
    batch.with_constraints(Constraints { largest_curvatures, ..Constraints::default() }).unwrap()
}

#[test]
fn curves_with_limits_of_places_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let of_all = [
        (2, bending(2.0) + length(), Limits { corridor: Some(0.1), curvature: Some(20.0), ..Limits::default() }),
        (3, bending(2.0) + tautness(), Limits { corridor: Some(0.05), ..Limits::default() }),
        (2, bending(2.0) + tautness(), Limits { monotone: vec![[0.0, 1.0, 0.0]], ..Limits::default() }),
        (3, bending(2.0) + tautness(), Limits { monotone: vec![[0.0, 0.6, 0.8]], ..Limits::default() }),
        (
            3,
            bending(2.0) + tautness(),
            Limits { monotone: vec![[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], curvature: Some(30.0), ..Limits::default() },
        ),
        (3, variation() + length(), Limits { shape: true, ..Limits::default() }),
        (2, bending(2.0) + tautness(), Limits { curvature_rate: Some(3.0), ..Limits::default() }),
        (3, bending(2.0) + tautness(), Limits { climb: Some(0.5), ..Limits::default() }),
        (2, bending(2.0), Limits { stretch: Some(1.02), ..Limits::default() }),
        // The host finds these.
        (2, length(), Limits { curvature: Some(3.0), ..Limits::default() }),
    ];
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        for (dimension, energy, limits) in &of_all {
            // Curves whose torsion keeps its sign take software Vulkan a second each.
            let curves = if limits.shape { 12 } else { 40 };
            let batch = Family { dimension: *dimension, closed: false, points: 6, sigma: 0.4 }.batch(curves, 33);
            let mut limits = limits.clone();
            if limits.corridor.is_some() {
                // Of every curve one stretch is in the way; none is in that of a point.
                let center = |i: usize| {
                    let points = batch.points(i).as_chunks::<2>().0;
                    [0.5 * (points[0][0] + points[1][0]), 0.5 * (points[0][1] + points[1][1]) + 0.05, 0.0]
                };
                if *dimension == 2 {
                    limits.regions.push(Region::Outside { center: center(0), radius: 0.04 });
                    limits.regions.push(Region::HalfSpace { normal: [0.0, 1.0, 0.0], offset: 3.0 });
                }
            }
            let fair = Fair { limits: limits.clone(), ..fair(energy.clone()) };
            let on_gpu = device.clone().with_precision(precision);
            let [cpu, gpu] =
                [Device::cpu(), on_gpu].map(|on| fair.fit_sampled(&batch, Sampling::PerSpan(16), &on).unwrap());
            let near = if precision == Precision::F64 { 1e-9 } else { 1e-6 };
            let (mut held, mut farthest) = (0, 0.0f64);
            for (i, (a, b)) in cpu.0.reports().iter().zip(gpu.0.reports()).enumerate() {
                assert_eq!(a.status, b.status, "{precision:?}, {limits:?}, curve {i}: {a:?} {b:?}");
                if a.status == CurveStatus::Converged {
                    held += usize::from(b.limits.unwrap().active > 0);
                    let both = cpu.1.points(i).iter().zip(gpu.1.points(i));
                    let away = both.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
                    farthest = farthest.max(away / size(&batch, i));
                }
            }
            println!("{precision:?} dimension {dimension}, {limits:?}: {held} held, apart {farthest:.1e}");
            // A length holds a curve as a whole.
            assert!(farthest <= near && (held >= 4 || limits.stretch.is_some()), "{held} held, {farthest:e}");
        }
    }
}

#[test]
fn curves_that_may_not_cross_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    let few = Family { dimension: 2, closed: false, points: 6, sigma: 0.4 }.batch(16, 35);
    let (mut coords, mut offsets) = (Vec::new(), vec![0]);
    for i in 0..few.len() {
        // Close above each one of the same polygon, with a point in the middle of every span: it swings out less.
        let points: Vec<[f64; 2]> =
            few.points(i).as_chunks::<2>().0.iter().map(|[x, y]| [*x, y + 9.0 * i as f64]).collect();
        let middles = points.windows(2).flat_map(|ends| [ends[0], [0, 1].map(|c| 0.5 * (ends[0][c] + ends[1][c]))]);
        let above: Vec<[f64; 2]> = middles.chain([points[5]]).map(|[x, y]| [x, y + 0.06]).collect();
        for points in [points, above] {
            coords.extend(points.as_flattened());
            offsets.push(coords.len() / 2);
        }
    }
    let batch = CurveBatch::from_ragged(2, coords, offsets).unwrap();
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        for deviation in [None, Some(0.02.into())] {
            let limits = Limits { no_crossing: true, ..Limits::default() };
            let fair = Fair { limits, deviation, ..fair(bending(2.0) + tautness()) };
            let on_gpu = device.clone().with_precision(precision);
            let [cpu, gpu] =
                [Device::cpu(), on_gpu].map(|on| fair.fit_sampled(&batch, Sampling::PerSpan(16), &on).unwrap());
            // Half-planes stand where the curves without them lie.
            let (near, _) = bounds(precision);
            let near = near * if deviation.is_some() { 100.0 } else { 1.0 };
            let (mut held, mut farthest) = (0, 0.0f64);
            for (i, (a, b)) in cpu.0.reports().iter().zip(gpu.0.reports()).enumerate() {
                assert_eq!(a.status, b.status, "{precision:?}, {deviation:?}, curve {i}: {a:?} {b:?}");
                let [of_a, of_b] = [a, b].map(|report| report.limits.unwrap());
                assert_eq!(of_a.neighbours, of_b.neighbours, "{precision:?}, {deviation:?}, curve {i}: {a:?} {b:?}");
                held += usize::from(of_b.active > 0);
                let both = cpu.1.points(i).iter().zip(gpu.1.points(i));
                farthest = farthest.max(both.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / size(&batch, i));
            }
            println!("{precision:?}, {deviation:?}: {held} held, {} usable, apart {farthest:.1e}", gpu.0.usable());
            assert!(farthest <= near && held >= 8, "{held} held, {farthest:e}");
        }
    }
}

#[test]
fn curves_with_limits_are_those_of_the_cpu() {
    let Some(device) = device() else { return };
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        for (dimension, closed, sigma, shape, energy) in [
            (2, false, 0.2, true, bending(2.0) + length()),
            (2, false, 0.6, false, bending(2.0) + tautness()),
            (2, true, 0.2, true, bending(2.0) + tautness()),
            (3, false, 0.6, false, bending(2.0) + tautness()),
            (2, false, 0.2, false, variation() + length()),
        ] {
            let batch = bounded(Family { dimension, closed, points: 7, sigma }.batch(40, 21));
            let fair = Fair { limits: Limits { shape, ..Limits::default() }, ..fair(energy) };
            let on_gpu = device.clone().with_precision(precision);
            let [cpu, gpu] =
                [Device::cpu(), on_gpu].map(|on| fair.fit_sampled(&batch, Sampling::PerSpan(16), &on).unwrap());
            // The descents between penalties are in f64, from where those of f32 ended.
            let near = if precision == Precision::F64 { 1e-9 } else { 1e-6 };
            let (mut alike, mut farthest) = (0, 0.0f64);
            for (i, (a, b)) in cpu.0.reports().iter().zip(gpu.0.reports()).enumerate() {
                let what = format!(
                    "{precision:?}, dimension {dimension}, closed {closed}, sigma {sigma}, curve {i}: {a:?} {b:?}"
                );
                assert_eq!(a.status, b.status, "{what}");
                if [a, b].iter().all(|report| report.status == CurveStatus::Converged) {
                    alike += 1;
                    assert_eq!(b.limits.unwrap().violation, 0.0, "{what}");
                    let away =
                        cpu.1.points(i).iter().zip(gpu.1.points(i)).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
                    farthest = farthest.max(away / size(&batch, i));
                }
            }
            let usable = [&cpu, &gpu].map(|fit| fit.0.usable());
            println!(
                "{precision:?} dimension {dimension}, closed {closed}, sigma {sigma}: {usable:?} of {}, both {alike}, apart {farthest:.1e}",
                batch.len()
            );
            // Bounds hold curves, on the device in f64 and on the host in f32.
            let held = gpu.0.reports().iter().filter(|report| report.limits.unwrap().active > 0).count();
            let did = gpu.0.device();
            println!("{held} held, {} finished on the CPU", did.finished_on_cpu);
            assert!(held >= 4);
            // In f64 the host repeats the few that the first penalty leaves. It searches for curves of
            // variation in another way too.
            let varies = fair.energy.order() > 2;
            assert!(varies || (did.finished_on_cpu < held) == (precision == Precision::F64), "{did:?}");
            assert!(farthest <= near && 2 * alike >= batch.len(), "{alike} curves, {farthest:e}");
        }
    }
}

/// A tolerance of the rounding of f32 is no licence: a coast of uneven spans was called converged at
/// a gradient of 3e-2.
#[test]
fn borders_that_converge_in_f32_have_the_energy_of_f64() {
    let Some(device) = device() else { return };
    let batch = batches::countries();
    let on_gpu = device.clone().with_precision(Precision::F32);
    let [exact, found] = [Device::cpu(), on_gpu].map(|on| Fair::default().fit(&batch, &on).unwrap());
    let (mut alike, mut worst) = (0, 0.0f64);
    for (a, b) in exact.reports().iter().zip(found.reports()) {
        if [a, b].iter().all(|report| report.status == CurveStatus::Converged) {
            assert!(b.gradient_norm <= 1e-3, "{b:?}");
            alike += 1;
            worst = worst.max((a.energy - b.energy).abs() / a.energy);
        }
    }
    println!("{alike} of {} converge in both, energies {worst:.1e} apart at most", batch.len());
    assert!(100 * alike >= 95 * exact.usable() && worst <= 1e-5, "{alike}, {worst:e}");
}
