//! Discrete energies on the GPU against the CPU: values, slopes, gradients and Hessians, in f32 and f64 against f64.

mod common;

use common::batches::{self, walks};
use common::conform::{Outcome, Unit, compare, conform};
use common::{device, epsilon, precisions, seeded, tolerance};
use faircurve::discrete::at::{At, Attachments, Found, GaugeOf, Want};
use faircurve::discrete::evaluate_gpu::evaluate;
use faircurve::discrete::{Custom, Energy, attachment, bending, length, tension, torsion, variation};
use faircurve::{CurveBatch, Device};
use glam::{DMat3, DVec3};
use rand::RngExt;
use rand::rngs::StdRng;

/// Vertices of curves around every block boundary, and some long ones.
fn sizes() -> Vec<usize> {
    (1..=40).chain(63..=66).chain([130, 257, 1000]).collect()
}

/// What is asked of the devices.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Value,
    Slope,
    Gradient,
    Hessian,
}

const PARTS: [Part; 4] = [Part::Value, Part::Slope, Part::Gradient, Part::Hessian];

/// A batch with a gauge, attachments and a direction.
#[derive(Clone)]
struct Case {
    batch: CurveBatch,
    gauge: Option<(Vec<f64>, Vec<bool>)>,
    points: Vec<f64>,
    weights: Vec<f64>,
    direction: Vec<f64>,
}

impl Case {
    fn new(batch: CurveBatch, rng: &mut StdRng) -> Self {
        let points: Vec<f64> = batch.coords().iter().map(|x| x * (1.0 + rng.random_range(-0.01..0.01))).collect();
        let direction: Vec<f64> = batch.coords().iter().map(|x| x * rng.random_range(-0.01..0.01)).collect();
        let weights = (0..batch.total_points()).map(|v| if v % 3 == 0 { rng.random_range(0.1..1.0) } else { 0.0 });
        let weights = weights.collect();
        Case { batch, gauge: None, points, weights, direction }
    }

    /// Every fifth vertex a data point, and a gauge that weighs about as much as bending does.
    fn with_gauge(mut self) -> Self {
        let (batch, d) = (&self.batch, self.batch.dimension());
        let weight = |i: usize| {
            let edges = batch.points(i).windows(2 * d).step_by(d);
            let total: f64 = edges.map(|w| (0..d).map(|c| (w[c + d] - w[c]).powi(2)).sum::<f64>().sqrt()).sum();
            let mean = total / batch.count(i).max(1) as f64;
            if mean > 0.0 && mean.is_finite() { mean.powi(-3) } else { 1.0 }
        };
        let weights = (0..batch.len()).map(weight).collect();
        self.gauge = Some((weights, (0..batch.total_points()).map(|v| v % 5 == 0).collect()));
        self
    }

    fn run(&self, energy: &Energy, part: Part, device: &Device) -> Found {
        let gauge = self.gauge.as_ref().map(|(weights, is_data)| GaugeOf { weights, is_data });
        let attachments = Some(Attachments { points: &self.points, weights: &self.weights });
        let at = At { energy, batch: &self.batch, gauge, attachments };
        let want = match part {
            Part::Value => Want::Value,
            Part::Slope => Want::Slope(&self.direction),
            Part::Gradient => Want::Gradient,
            Part::Hessian => Want::Hessian,
        };
        match device.as_gpu() {
            Some(gpu) => evaluate(gpu, device.precision(), at, want).unwrap(),
            None => at.on_cpu(want),
        }
    }

    fn outcome(&self, energy: &Energy, part: Part, device: &Device) -> Outcome {
        let found = self.run(energy, part, device);
        let d = self.batch.dimension();
        match part {
            Part::Value => {
                let both = found.energies.iter().zip(&found.gauges).map(|(energy, gauge)| energy + gauge);
                Outcome { names: self.names(), ..Outcome::of_numbers(both.collect()) }
            }
            Part::Slope => Outcome { names: self.names(), ..Outcome::of_numbers(found.slopes) },
            Part::Gradient => self.of_vertices(found.gradients, d),
            Part::Hessian => self.of_vertices(found.hessians, 4 * d * d),
        }
    }

    fn names(&self) -> Vec<String> {
        let closed = |i| if self.batch.is_closed(i) { "closed" } else { "open" };
        (0..self.batch.len())
            .map(|i| format!("{}, {} vertices, {}", self.batch.name(i), self.batch.count(i), closed(i)))
            .collect()
    }

    fn of_vertices(&self, values: Vec<f64>, a_vertex: usize) -> Outcome {
        let offsets: Vec<usize> = self.batch.offsets().iter().map(|k| k * a_vertex).collect();
        let status = Outcome::of_numbers(vec![0.0; self.batch.len()]).status;
        Outcome { values, offsets, status, names: self.names() }
    }

    /// The case with every edge, direction and offset changed by up to `relative` of its length.
    fn perturbed(&self, relative: f64, rng: &mut StdRng) -> Self {
        let d = self.batch.dimension();
        let mut coords = self.batch.coords().to_vec();
        for i in 0..self.batch.len() {
            let (points, count) = (self.batch.points(i), self.batch.count(i));
            let spans = self.batch.spans(i);
            let edge = |j: usize, c: usize| points[(j + 1) % count * d + c] - points[j * d + c];
            let length = |j: usize| (0..d).map(|c| edge(j, c).powi(2)).sum::<f64>().sqrt();
            let mut change: Vec<Vec<f64>> = (0..spans)
                .map(|j| (0..d).map(|_| relative * length(j) * rng.random_range(-1.0..1.0)).collect())
                .collect();
            if self.batch.is_closed(i) {
                // What is left over at the closing is spread over all edges, in proportion.
                let total: f64 = (0..spans).map(length).sum();
                for c in 0..d {
                    let sum: f64 = change.iter().map(|x| x[c]).sum();
                    (0..spans).for_each(|j| change[j][c] -= sum * length(j) / total);
                }
            }
            let mut sum = vec![0.0; d];
            for v in 1..count {
                for c in 0..d {
                    sum[c] += change[v - 1][c];
                    coords[(self.batch.offsets()[i] + v) * d + c] += sum[c];
                }
            }
        }
        let batch = CurveBatch::from_ragged(d, coords.clone(), self.batch.offsets().to_vec()).unwrap();
        let closed = (0..batch.len()).map(|i| self.batch.is_closed(i)).collect();
        let mut factor = |x: &f64| x * (1.0 + relative * rng.random_range(-1.0..1.0));
        // Offsets from data points are what the device rounds.
        let moved = self.batch.coords().iter().zip(&self.points).zip(&coords);
        let points = moved.map(|((x, p), moved)| moved - factor(&(x - p))).collect();
        let direction = self.direction.iter().map(&mut factor).collect();
        Case { batch: batch.closed_each(closed).unwrap(), points, direction, ..self.clone() }
    }

    /// A rounding of every edge, in units of ε: what it changes of a curve's numbers, and the largest of them.
    fn units(&self, energy: &Energy, part: Part) -> Vec<f64> {
        let relative = 1e-6;
        let here = self.outcome(energy, part, &Device::cpu());
        let mut units: Vec<f64> = (0..here.len()).map(|i| common::conform::largest(here.curve(i))).collect();
        let mut rng = seeded(999);
        for _ in 0..4 {
            let there = self.perturbed(relative, &mut rng).outcome(energy, part, &Device::cpu());
            for (i, unit) in units.iter_mut().enumerate() {
                let changes = here.curve(i).iter().zip(there.curve(i)).map(|(x, y)| (x - y).abs() / relative);
                *unit = unit.max(changes.filter(|x| x.is_finite()).fold(0.0, f64::max));
            }
        }
        units
    }

    fn conforms(&self, what: &str, energy: &Energy, parts: &[Part], device: &Device) {
        for &part in parts {
            let units = self.units(energy, part);
            let what = format!("{what}, {energy}, {}-D, {part:?}", self.batch.dimension());
            let operation = |device: &Device| self.outcome(energy, part, device);
            conform(&what, device, tolerance::DISCRETE, Unit::Each(&units), operation);
        }
    }
}

fn everything() -> Energy {
    length() + 0.3 * tension() + bending(3.0) + 0.1 * variation() + 0.2 * torsion() + 2.0 * attachment()
}

#[test]
fn every_energy_of_walks_open_and_closed() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(300 + dimension as u64);
        let case = Case::new(walks(dimension, &sizes(), &mut rng), &mut rng);
        for energy in [length(), tension(), bending(2.0), variation(), torsion(), attachment()] {
            if dimension == 3 || energy.to_string() != "torsion" {
                case.conforms("walks", &energy, &PARTS, &device);
            }
        }
        case.clone().with_gauge().conforms("walks with a gauge", &everything(), &PARTS, &device);
    }
}

#[test]
fn bending_by_any_exponent() {
    let Some(device) = device() else { return };
    let mut rng = seeded(310);
    let case = Case::new(walks(2, &sizes(), &mut rng), &mut rng);
    for exponent in [1.0, 1.5, 2.5, 2.7, 3.3, 4.0, 7.1] {
        case.conforms("walks", &bending(exponent), &[Part::Value, Part::Gradient, Part::Hessian], &device);
    }
}

#[test]
fn long_smooth_curves_whose_curvature_is_a_difference_of_close_tangents() {
    let Some(device) = device() else { return };
    let wave = |n: usize| -> Vec<[f64; 3]> {
        let at = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        (0..n).map(|k| [at(k).cos(), 1.3 * at(k).sin(), 0.2 * (3.0 * at(k)).sin()]).collect()
    };
    let curves = [wave(40), wave(200), wave(1000), wave(40), wave(200), wave(1000)];
    let closed = (0..6).map(|i| i > 2).collect();
    let batch = CurveBatch::from_slices(&curves.each_ref().map(|c| &c[..])).unwrap().closed_each(closed).unwrap();
    let case = Case::new(batch, &mut seeded(320));
    for energy in [bending(2.0), variation(), torsion()] {
        case.conforms("smooth", &energy, &PARTS, &device);
    }
}

#[test]
fn nasty_curves_beside_each_other() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let case = Case::new(batches::nasty(dimension), &mut seeded(330));
        for energy in [length(), tension(), bending(2.0), variation(), everything()] {
            case.conforms("nasty", &energy, &[Part::Value, Part::Gradient], &device);
        }
    }
}

#[test]
fn a_permuted_batch_gives_the_same_bits() {
    let Some(device) = device() else { return };
    let mut rng = seeded(340);
    let batch = walks(3, &sizes(), &mut rng);
    let mut order: Vec<usize> = (0..batch.len()).collect();
    (1..order.len()).for_each(|k| order.swap(k, rng.random_range(0..=k)));
    let energy = bending(2.0) + variation() + 0.1 * length();
    for precision in precisions(device.as_gpu().expect("a GPU")) {
        let device = device.clone().with_precision(precision);
        for part in PARTS {
            let found = |batch: CurveBatch| {
                let direction = batch.coords().iter().map(|x| x.cos()).collect();
                let (points, weights) = (batch.coords().to_vec(), vec![0.0; batch.total_points()]);
                Case { batch, gauge: None, points, weights, direction }.outcome(&energy, part, &device)
            };
            let (here, there) = (found(batch.clone()), found(batch.select(&order)));
            for (to, &from) in order.iter().enumerate() {
                assert_eq!(here.bits(from), there.bits(to), "{part:?}, {precision:?}, curve {from}");
            }
        }
    }
}

/// Bending with exponent 2 once more, as a user would write it.
#[derive(Debug)]
struct Elastica;

impl Custom for Elastica {
    fn name(&self) -> &str {
        "elastica"
    }

    fn edges(&self) -> usize {
        2
    }

    fn degree(&self) -> f64 {
        -1.0
    }

    fn value(&self, t: &[DVec3], s: &[f64]) -> f64 {
        (t[1] - t[0]).length_squared() * 2.0 / (s[0] + s[1])
    }

    fn gradient(&self, t: &[DVec3], s: &[f64], by_tangent: &mut [DVec3], by_length: &mut [f64]) {
        let (d, r) = (t[1] - t[0], 2.0 / (s[0] + s[1]));
        (by_tangent[0], by_tangent[1]) = (-2.0 * r * d, 2.0 * r * d);
        by_length[..2].fill(-0.5 * r * r * d.length_squared());
    }

    fn hessian(
        &self,
        t: &[DVec3],
        s: &[f64],
        by_tangents: &mut [[DMat3; 3]; 3],
        mixed: &mut [[DVec3; 3]; 3],
        by_lengths: &mut [[f64; 3]; 3],
    ) {
        let (d, r) = (t[1] - t[0], 2.0 / (s[0] + s[1]));
        for j in 0..2 {
            for k in 0..2 {
                by_tangents[j][k] = if j == k { 2.0 * r } else { -2.0 * r } * DMat3::IDENTITY;
                mixed[j][k] = if j == 0 { r * r * d } else { -r * r * d };
                by_lengths[j][k] = 0.5 * r * r * r * d.length_squared();
            }
        }
    }

    fn wgsl(&self) -> Option<String> {
        let text = "
            fn elastica_value(w: Window) -> real {
                let d = w.t1 - w.t0;
                return dot(d, d) * real(2) / (w.s0 + w.s1);
            }

            fn elastica_gradient(w: Window) -> Partials {
                let d = w.t1 - w.t0;
                let r = real(2) / (w.s0 + w.s1);
                var p = Partials();
                p.value = r * dot(d, d);
                p.t1 = (real(2) * r) * d;
                p.t0 = -p.t1;
                p.s0 = real(-0.5) * r * p.value;
                p.s1 = p.s0;
                return p;
            }

            fn elastica_hessian(w: Window) -> SecondPartials {
                let d = w.t1 - w.t0;
                let r = real(2) / (w.s0 + w.s1);
                var h = SecondPartials();
                h.t00 = diagonal(real(2) * r);
                h.t11 = h.t00;
                h.t01 = diagonal(real(-2) * r);
                h.m00 = (r * r) * d;
                h.m01 = h.m00;
                h.m10 = -h.m00;
                h.m11 = h.m10;
                h.s00 = real(0.5) * r * r * r * dot(d, d);
                h.s01 = h.s00;
                h.s11 = h.s00;
                return h;
            }";
        Some(text.to_string())
    }
}

#[test]
fn a_users_energy_is_evaluated_like_the_same_one_built_in() {
    let Some(device) = device() else { return };
    for dimension in [2, 3] {
        let mut rng = seeded(350);
        let case = Case::new(walks(dimension, &sizes(), &mut rng), &mut rng);
        let own = 0.7 * Energy::custom(Elastica) + 0.2 * length();
        let built_in = 0.7 * bending(2.0) + 0.2 * length();
        for part in PARTS {
            let units = case.units(&built_in, part);
            let wanted = case.outcome(&built_in, part, &Device::cpu());
            for device in [vec![Device::cpu()], both(&device)].concat() {
                let found = case.outcome(&own, part, &device);
                let epsilon = if device.as_gpu().is_some() { epsilon(device.precision()) } else { f64::EPSILON };
                let what = format!("a user's energy, {dimension}-D, {part:?}, {}", device.name());
                compare(&what, &found, &wanted, tolerance::DISCRETE, epsilon, Unit::Each(&units));
            }
        }
    }
}

/// A GPU in every precision it has.
fn both(device: &Device) -> Vec<Device> {
    let precisions = precisions(device.as_gpu().expect("a GPU"));
    precisions.into_iter().map(|precision| device.clone().with_precision(precision)).collect()
}

#[test]
fn an_energy_without_wgsl_is_refused_by_a_kernel_in_a_sentence() {
    let Some(device) = device() else { return };
    let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 0.0]][..]]).unwrap();
    let energy = Energy::custom(Elastica) + Energy::custom(Elastica);
    let at = At { energy: &energy, batch: &batch, gauge: None, attachments: None };
    let error = evaluate(device.as_gpu().unwrap(), device.precision(), at, Want::Value).unwrap_err().to_string();
    assert_eq!(error, "a kernel has room for one energy of a user's own, and elastica is the second: fit on the CPU");
}
