//! Energies, gradients and Hessians of discrete curves on a GPU.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::compose::{Composition, DeviceWeights};
use super::energy::{Energy, attachment, bending, length, tautness, tension, variation};
use super::evaluation::{Evaluate, Evaluating, Evaluation, PreparedCurve, Want};
use super::hessian::BLOCKS;
use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::gpu::{Downloaded, Gpu, KernelKey, Pending, Recording, once, pipeline, plan};
use crate::linalg::scalar::Vector;
use crate::precision::Precision;

/// Threads in a workgroup.
pub(crate) const GROUP: usize = 64;

/// Vertices per thread.
///
/// The kernel computes up to three more twice.
const BLOCK_VERTICES: usize = 32;

/// The order of the regularisation in evaluations.
const REGULARISATION: usize = 2;

/// `EvaluateParams` of `evaluate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct EvaluateParams {
    pub blocks: u32,
    pub weights: u32,
}

/// `EvaluateCurve` of `evaluate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct EvaluateCurve {
    pub start: u32,
    pub segments: u32,
    pub closed: u32,
    pub index: u32,
}

/// `VertexRange` of `evaluate.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct VertexRange {
    pub curve: u32,
    pub begin: u32,
    pub end: u32,
    pub padding: u32,
}

/// The kernel of a composition.
pub(crate) fn evaluate_kernel(composition: &Composition, entry: &'static str, precision: Precision) -> KernelKey {
    let mut definitions = composition.definitions.clone();
    definitions.insert("GROUP".into(), GROUP.to_string());
    KernelKey { path: "discrete/evaluate.wgsl", entry, precision, definitions }
}

/// Some variants of the kernels: all energies together, windows of every width, and a custom
/// energy.
pub(crate) fn evaluate_kernels(precision: Precision) -> Vec<KernelKey> {
    let named = || Energy::NAMES.iter().filter_map(|name| Energy::named(name)).filter(|energy| !energy.is_geodesic());
    let all = named().fold(bending(2.7), |sum, energy| sum + energy);
    let entries = ["gradient", "hessian", "value", "slope"];
    // A module has all entry points. All functions of values and slopes are in the sum of all
    // energies.
    let forms = [
        (all, REGULARISATION, &entries[..]),
        (tension(), REGULARISATION, &entries[..2]),
        (attachment(), 0, &entries[..2]),
        (length() + tautness(), 0, &entries[..2]),
        (bending(2.5) + bending(3.0), 0, &entries[..2]),
        (variation(), 0, &entries[..2]),
    ];
    let mut keys = Vec::new();
    for (energy, regularisation, entries) in forms {
        for dimension in [2, 3] {
            let composition = Composition::of(&energy, regularisation, dimension, precision).expect("built in");
            keys.extend(entries.iter().map(|entry| evaluate_kernel(&composition, entry, precision)));
        }
    }
    // A custom energy, and the toy energy, which is in the list for tests only.
    let mut composition = Composition::of(&bending(2.0), 0, 2, precision).expect("built in");
    for (k, name, from, text) in [(1, "own", "WGSL", OWN), (2, "toy", "FILE", "discrete/energy/toy.wgsl")] {
        let own = [("NAME", name), ("EDGES", "2"), ("WEIGHT", "0"), (from, text)];
        composition.definitions.extend(own.map(|(name, value)| (format!("TERM.{k}.{name}"), value.to_string())));
    }
    keys.extend(["gradient", "hessian"].map(|entry| evaluate_kernel(&composition, entry, precision)));
    keys
}

/// A custom energy for the tests of shaders.
const OWN: &str = "fn own_value(w: Window) -> real { return w.s0; }
fn own_gradient(w: Window) -> Partials { var p = Partials(); p.value = w.s0; p.s0 = real(1); return p; }
fn own_hessian(w: Window) -> SecondPartials { return SecondPartials(); }";

/// Evaluates an energy at curves on a GPU. Each curve is divided by half its largest extent.
///
/// # Errors
/// [`Error::Argument`] for an energy that cannot be compiled into a kernel. [`Error::Limit`] for a
/// curve larger than the device's largest array. Errors of submissions.
pub(super) fn evaluate_on_gpu<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    evaluating: &Evaluating<'_>,
    curves: &[&PreparedCurve<'_, D>],
) -> Result<Vec<Evaluation>> {
    let Evaluate { want, regularisation, .. } = evaluating.options;
    let regularisation = if regularisation.is_some() { REGULARISATION } else { 0 };
    let composition = Composition::of(evaluating.energy, regularisation, D, precision).map_err(Error::Argument)?;
    let job = Job { evaluating, curves, composition };
    let result = if want.has_hessian() { BLOCKS * D * D } else { D };
    let real = precision.bytes();
    let largest = real * result.max(D + 1) as u64;
    let total = real * (result + D + 2 * (D + 1)) as u64;
    let chunks = plan::chunks(curves.iter().map(|curve| curve.points.len()), largest, 2 * total, gpu.limits())?;
    let mut found = vec![Evaluation::default(); curves.len()];
    pipeline(
        chunks,
        |chunk| job.record(gpu.record(precision), chunk)?.submit(),
        once(Pending::wait),
        |chunk, results| {
            job.unpack(chunk, &results, &mut found[chunk.clone()]);
            Ok(())
        },
    )?;
    Ok(found)
}

struct Job<'a, const D: usize> {
    evaluating: &'a Evaluating<'a>,
    curves: &'a [&'a PreparedCurve<'a, D>],
    composition: Composition,
}

/// Half the largest extent of a curve, or 1 if the extent is 0.
///
/// The device computes in this unit.
fn size<const D: usize>(points: &[Vector<f64, D>]) -> f64 {
    let size = 0.5 * Bounds::of(points.iter().copied()).size();
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}

impl<const D: usize> Job<'_, D> {
    /// The curves of a chunk, and where each begins in the chunk's arrays.
    fn chunk(&self, chunk: &Range<usize>) -> impl Iterator<Item = (usize, &PreparedCurve<'_, D>)> {
        self.curves[chunk.clone()].iter().scan(0, |next, curve| {
            let start = *next;
            *next += curve.points.len();
            Some((start, *curve))
        })
    }

    fn weights(&self, curve: &PreparedCurve<'_, D>) -> DeviceWeights {
        let regularisation = self.evaluating.regularisation(curve.i).unwrap_or(0.0);
        self.composition.weights(size(curve.points), regularisation, curve.torsion_curvature)
    }

    fn blocks(&self, chunk: &Range<usize>) -> Vec<VertexRange> {
        let of_curve = |(index, (_, curve)): (usize, (usize, &PreparedCurve<'_, D>))| {
            let count = curve.points.len();
            (0..count).step_by(BLOCK_VERTICES).map(move |begin| {
                let end = (begin + BLOCK_VERTICES).min(count) as u32;
                VertexRange { curve: index as u32, begin: begin as u32, end, padding: 0 }
            })
        };
        self.chunk(chunk).enumerate().flat_map(of_curve).collect()
    }

    fn record<'g>(&self, mut recording: Recording<'g>, chunk: &Range<usize>) -> Result<Recording<'g>> {
        let (Evaluating { energy, batch, options }, width) = (self.evaluating, self.composition.width());
        let points: usize = self.chunk(chunk).map(|(_, curve)| curve.points.len()).sum();
        let mut table = Vec::with_capacity(chunk.len());
        let mut weights = Vec::with_capacity(chunk.len() * width);
        // The host takes differences in f64, so the device never gets a coordinate.
        let edge_numbers = D + 1 + usize::from(energy.is_taut());
        let mut edges = vec![0.0; points * edge_numbers];
        let mut offsets = vec![0.0; if energy.is_attached() { points * (D + 1) } else { 0 }];
        let mut directions = Vec::new();
        for (index, (start, curve)) in self.chunk(chunk).enumerate() {
            let (size, count) = (size(curve.points), curve.points.len());
            let (segments, closed) = (curve.base.len() as u32, batch.is_closed(curve.i).into());
            table.push(EvaluateCurve { start: start as u32, segments, closed, index: index as u32 });
            weights.extend(self.weights(curve).entries);
            let is_data = self.evaluating.is_data(curve.i);
            for (j, edge) in curve.base.iter().enumerate() {
                let to = &mut edges[(start + j) * edge_numbers..][..edge_numbers];
                (0..D).for_each(|c| to[c] = edge[c] / size);
                to[D] = if is_data.is_some_and(|is_data| is_data[(j + 1) % count]) { 0.0 } else { 1.0 };
                if let Some(taut) = curve.taut.get(j) {
                    to[D + 1] = taut * size * size;
                }
            }
            for &(vertex, target, weight) in &curve.attached {
                let to = &mut offsets[(start + vertex) * (D + 1)..][..D + 1];
                (0..D).for_each(|c| to[c] = (curve.points[vertex][c] - target[c]) / size);
                to[D] = weight;
            }
            directions
                .extend(self.evaluating.direction::<D>(curve.i).into_iter().flatten().flatten().map(|p| p / size));
        }
        let blocks = self.blocks(chunk);
        let params = EvaluateParams { blocks: blocks.len() as u32, weights: width as u32 };
        let sums = recording.storage_reals(3 * blocks.len());
        let gradients = match options.want {
            Want::Slope(_) => recording.upload_reals(&directions),
            want => recording.storage_reals(if want.has_gradient() { points * D } else { 1 }),
        };
        let hessians = recording.storage_reals(if options.want.has_hessian() { points * BLOCKS * D * D } else { 1 });
        let buffers = [
            ("params", &recording.uniform(&params)),
            ("curves", &recording.upload(&table)),
            ("blocks", &recording.upload(&blocks)),
            ("weight_table", &recording.upload_reals(&weights)),
            ("edges", &recording.upload_reals(&edges)),
            ("offsets", &recording.upload_reals(&offsets)),
            ("sums", &sums),
            ("gradients", &gradients),
            ("hessians", &hessians),
        ];
        let entries: &[&str] = match options.want {
            Want::Value => &["value"],
            Want::Slope(_) => &["slope"],
            Want::Gradient => &["gradient"],
            Want::Hessian | Want::Blocks => &["gradient", "hessian"],
        };
        for entry in entries {
            let kernel = evaluate_kernel(&self.composition, entry, recording.precision());
            recording.dispatch(&kernel, blocks.len(), GROUP, &buffers)?;
        }
        let wanted =
            [(true, &sums), (options.want.has_gradient(), &gradients), (options.want.has_hessian(), &hessians)];
        wanted.iter().filter(|(is_wanted, _)| *is_wanted).for_each(|(_, array)| recording.download(array));
        Ok(recording)
    }

    fn unpack(&self, chunk: &Range<usize>, results: &[Downloaded], found: &mut [Evaluation]) {
        let in_units = |from: &[f64], unit: f64| from.iter().map(|x| unit * x).collect::<Vec<_>>();
        let [sums, gradients, hessians] = [0, 1, 2].map(|k| results.get(k).map(Downloaded::reals));
        let mut totals = vec![[0.0; 3]; chunk.len()];
        for (block, sums) in self.blocks(chunk).iter().zip(sums.iter().flat_map(|sums| sums.chunks_exact(3))) {
            totals[block.curve as usize].iter_mut().zip(sums).for_each(|(total, x)| *total += x);
        }
        for (((start, curve), [energy, regularisation, slope]), found) in self.chunk(chunk).zip(totals).zip(found) {
            let (size, unit, rows) = (size(curve.points), self.weights(curve).unit, start..start + curve.points.len());
            let of_rows = |numbers: &[f64], a_row: usize, unit: f64| {
                in_units(&numbers[rows.start * a_row..rows.end * a_row], unit)
            };
            let hessian = hessians.as_ref().map_or(vec![], |all| of_rows(all, BLOCKS * D * D, unit / size / size));
            *found = Evaluation {
                value: unit * energy + unit * regularisation,
                slope: unit * slope,
                gradient: gradients.as_ref().map_or(vec![], |all| of_rows(all, D, unit / size)),
                hessian: self.evaluating.hessian::<D>(curve.i, hessian),
                problem: None,
            };
        }
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::reflect::assert_layout;
    use crate::gpu::testing::{gpu, precisions};
    use crate::{CurveBatch, Device};

    #[test]
    fn every_energy_of_the_list_is_on_the_device_what_it_is_on_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let wave = |v: usize| (0.9 * v as f64, (1.7 * v as f64).sin(), 0.6 * (1.1 * v as f64).cos());
        let coords: Vec<f64> = (0..9).flat_map(|v| <[f64; 3]>::from(wave(v))).collect();
        let batch = CurveBatch::from_ragged(3, [coords.clone(), coords].concat(), vec![0, 9, 18]).unwrap();
        let batch = batch.closed_each(vec![false, true]).unwrap();
        let device = Device::from_gpu(gpu);
        let on = |energy: &Energy, want: Want<'_>, device: &Device| {
            let options = Evaluate { want, targets: Some(&batch), ..Evaluate::default() };
            let found = energy.evaluate(&batch, options, device).unwrap();
            found.into_iter().map(|f| [vec![f.value], f.gradient, f.hessian].concat()).collect::<Vec<_>>().concat()
        };
        for name in Energy::NAMES {
            let energy = Energy::named(name).unwrap();
            if energy.is_geodesic() {
                continue;
            }
            for want in [Want::Value, Want::Gradient, Want::Hessian] {
                let wanted = on(&energy, want, &Device::cpu());
                let unit = wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                assert!(unit > 0.0 || *name == "attachment", "{name}, {want:?}");
                for precision in precisions(device.as_gpu().unwrap()) {
                    let found = on(&energy, want, &device.clone().with_precision(precision));
                    let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
                    // Differences of tangents and of curvatures over edges of about 1 carry tens of
                    // roundings of the largest.
                    let is_near = |(x, y): (&f64, &f64)| (x - y).abs() <= 256.0 * epsilon * unit;
                    let (near, what) =
                        (found.iter().zip(&wanted).all(is_near), format!("{name}, {precision:?}, {want:?}"));
                    assert!(near && found.len() == wanted.len(), "{what}: {found:?} {wanted:?}");
                }
            }
        }
    }

    #[test]
    fn structs_are_laid_out_as_the_kernel_has_them() {
        for key in evaluate_kernels(Precision::F32) {
            assert_layout!(key, EvaluateParams { blocks, weights });
            assert_layout!(key, EvaluateCurve { start, segments, closed, index });
            assert_layout!(key, VertexRange { curve, begin, end, padding });
        }
    }
}
