//! Energies, gradients and Hessians of discrete curves on the GPU, on normalised curves.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::at::{At, Found, Want};
use super::compose::{Composition, DeviceWeights};
use super::energy::{Energy, bending, tension};
use super::hessian::COUPLED;
use crate::error::{Error, Result};
use crate::gpu::{Downloaded, Gpu, KernelKey, Pending, Recording, pipeline, plan};
use crate::precision::Precision;

/// Threads a workgroup.
pub(crate) const GROUP: usize = 64;

/// Vertices a thread walks over; up to three more are computed twice.
const BLOCK_VERTICES: usize = 32;

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

/// Every form the kernels take, as far as one can tell: each energy by itself, some exponents, all
/// together, and one of a user's own.
pub(crate) fn evaluate_kernels(precision: Precision) -> Vec<KernelKey> {
    let named = || Energy::NAMES.iter().filter_map(|name| Energy::named(name));
    let all = named().fold(bending(3.0), |sum, energy| sum + energy);
    let alone = named().chain([bending(2.5), bending(2.7)]).map(|energy| (energy, false));
    let forms = alone.chain([(all, true), (tension(), true)]);
    let mut keys = Vec::new();
    for (energy, with_gauge) in forms {
        for dimension in [2, 3] {
            let composition = Composition::of(&energy, with_gauge, dimension, precision).expect("built in");
            keys.extend(["value", "slope", "gradient", "hessian"].map(|e| evaluate_kernel(&composition, e, precision)));
        }
    }
    // A user's, and the one that the list has for tests alone.
    let mut composition = Composition::of(&bending(2.0), false, 2, precision).expect("built in");
    for (k, name, from, text) in [(1, "own", "WGSL", OWN), (2, "toy", "FILE", "discrete/energy/toy.wgsl")] {
        let own = [("NAME", name), ("EDGES", "2"), ("WEIGHT", "0"), (from, text)];
        composition.definitions.extend(own.map(|(name, value)| (format!("TERM.{k}.{name}"), value.to_string())));
    }
    keys.extend(["gradient", "hessian"].map(|entry| evaluate_kernel(&composition, entry, precision)));
    keys
}

/// A user's energy for the tests of shaders.
const OWN: &str = "fn own_value(w: Window) -> real { return w.s0; }
fn own_gradient(w: Window) -> Partials { var p = Partials(); p.value = w.s0; p.s0 = real(1); return p; }
fn own_hessian(w: Window) -> SecondPartials { return SecondPartials(); }";

/// Evaluates an energy at every curve of a batch. A curve with an edge of no length, a coordinate
/// that is not finite, or closed with one or two vertices has NaN for an energy and zeros at its
/// vertices.
///
/// # Errors
/// [`Error::Argument`] for an energy that no kernel can be made of; those of submissions;
/// [`Error::Limit`] for a curve larger than the device's largest array.
pub fn evaluate(gpu: &Gpu, precision: Precision, at: At<'_>, want: Want<'_>) -> Result<Found> {
    let d = at.batch.dimension();
    let composition = Composition::of(at.energy, at.gauge.is_some(), d, precision).map_err(Error::Argument)?;
    let mut found = Found::new(&at, want);
    let job = Job { at, want, composition };
    let real = precision.bytes();
    let result = if let Want::Hessian = want { (COUPLED + 1) * d * d } else { d };
    let largest = real * result.max(d + 1) as u64;
    let total = real * (result + 2 * (d + 1)) as u64;
    let chunks = plan::chunks((0..at.batch.len()).map(|i| at.batch.count(i)), largest, 2 * total, gpu.limits())?;
    pipeline(
        chunks,
        |curves| job.record(gpu.record(precision), curves)?.submit(),
        Pending::wait,
        |curves, results| {
            job.unpack(curves, &results, &mut found);
            Ok(())
        },
    )?;
    Ok(found)
}

struct Job<'a> {
    at: At<'a>,
    want: Want<'a>,
    composition: Composition,
}

impl Job<'_> {
    /// Curves of a chunk that have an energy.
    fn evaluated(&self, curves: &Range<usize>) -> impl Iterator<Item = usize> {
        let at = self.at;
        curves.clone().filter(move |&i| at.is_evaluated(i))
    }

    fn weights(&self, i: usize) -> DeviceWeights {
        self.composition.weights(self.at.size(i), self.at.gauge(i), self.at.torsion_curvature(i))
    }

    fn blocks(&self, curves: &Range<usize>) -> Vec<VertexRange> {
        let of_curve = |i: usize| {
            let (count, curve) = (self.at.batch.count(i), (i - curves.start) as u32);
            (0..count).step_by(BLOCK_VERTICES).map(move |begin| {
                let end = (begin + BLOCK_VERTICES).min(count) as u32;
                VertexRange { curve, begin: begin as u32, end, padding: 0 }
            })
        };
        self.evaluated(curves).flat_map(of_curve).collect()
    }

    fn record<'g>(&self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<Recording<'g>> {
        let (batch, d) = (self.at.batch, self.at.batch.dimension());
        let first = batch.offsets()[curves.start];
        let points = batch.offsets()[curves.end] - first;
        let width = self.composition.width();
        let blocks = self.blocks(curves);
        let mut table = vec![EvaluateCurve::zeroed(); curves.len()];
        let mut weights = vec![0.0; curves.len() * width];
        // Differences are taken here, in f64: the device never sees a coordinate.
        let mut edges = vec![0.0; points * (d + 1)];
        let mut offsets = vec![0.0; if self.at.attachments.is_some() { points * (d + 1) } else { 0 }];
        let mut direction = vec![0.0; if let Want::Slope(_) = self.want { points * d } else { 0 }];
        for i in self.evaluated(curves) {
            let (index, count, size) = (i - curves.start, batch.count(i), self.at.size(i));
            let start = batch.offsets()[i] - first;
            let (start_word, segments) = (start as u32, batch.spans(i) as u32);
            let closed = batch.is_closed(i).into();
            table[index] = EvaluateCurve { start: start_word, segments, closed, index: index as u32 };
            let own = self.weights(i);
            let to = &mut weights[index * width..][..width];
            to.iter_mut().zip(own.entries).for_each(|(to, weight)| *to = weight);
            let vertices = batch.points(i);
            for j in 0..batch.spans(i) {
                let next = (j + 1) % count;
                let to = &mut edges[(start + j) * (d + 1)..][..d + 1];
                for c in 0..d {
                    to[c] = (vertices[next * d + c] - vertices[j * d + c]) / size;
                }
                let is_data = self.at.gauge.is_some_and(|gauge| gauge.is_data[batch.offsets()[i] + next]);
                to[d] = if is_data { 0.0 } else { 1.0 };
            }
            for v in 0..count {
                let vertex = batch.offsets()[i] + v;
                if let Some(attachments) = self.at.attachments {
                    let to = &mut offsets[(start + v) * (d + 1)..][..d + 1];
                    for c in 0..d {
                        to[c] = (vertices[v * d + c] - attachments.points[vertex * d + c]) / size;
                    }
                    to[d] = attachments.weights[vertex];
                }
                if let Want::Slope(p) = self.want {
                    let to = &mut direction[(start + v) * d..][..d];
                    to.iter_mut().zip(&p[vertex * d..]).for_each(|(to, p)| *to = p / size);
                }
            }
        }
        if self.at.attachments.is_none() && self.composition.definitions.contains_key("ATTACHMENT") {
            offsets = vec![0.0; points * (d + 1)];
        }
        let (count, weight_count) = (blocks.len(), width as u32);
        let params = EvaluateParams { blocks: count as u32, weights: weight_count };
        let sums = recording.storage_reals(3 * count);
        let gradients = match self.want {
            Want::Slope(_) => recording.upload_reals(&direction),
            Want::Gradient => recording.storage_reals(points * d),
            _ => recording.storage_reals(1),
        };
        let hessians = recording.storage_reals(match self.want {
            Want::Hessian => points * (COUPLED + 1) * d * d,
            _ => 1,
        });
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
        let kernel = evaluate_kernel(&self.composition, self.want.entry(), recording.precision());
        recording.dispatch(&kernel, count, GROUP, &buffers)?;
        match self.want {
            Want::Hessian => recording.download(&hessians),
            Want::Gradient => {
                recording.download(&sums);
                recording.download(&gradients);
            }
            _ => recording.download(&sums),
        }
        Ok(recording)
    }

    fn unpack(&self, curves: &Range<usize>, results: &[Downloaded], found: &mut Found) {
        let (batch, d) = (self.at.batch, self.at.batch.dimension());
        let first = batch.offsets()[curves.start];
        let to_input = |to: &mut [f64], from: &[f64], unit: f64| {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = unit * from);
        };
        let (sums, gradients) = (results[0].reals(), results.get(1).map(Downloaded::reals));
        for i in self.evaluated(curves) {
            let size = self.at.size(i);
            let unit = self.weights(i).unit;
            if let Want::Hessian = self.want {
                let a_vertex = (COUPLED + 1) * d * d;
                let to = &mut found.hessians[batch.offsets()[i] * a_vertex..batch.offsets()[i + 1] * a_vertex];
                let from = &sums[(batch.offsets()[i] - first) * a_vertex..];
                to_input(to, from, unit / size / size);
                continue;
            }
            (found.energies[i], found.gauges[i], found.slopes[i]) = (0.0, 0.0, 0.0);
            if let Some(gradients) = &gradients {
                let to = &mut found.gradients[batch.offsets()[i] * d..batch.offsets()[i + 1] * d];
                let from = &gradients[(batch.offsets()[i] - first) * d..];
                to_input(to, from, unit / size);
            }
        }
        if let Want::Hessian = self.want {
            return;
        }
        for (block, sums) in self.blocks(curves).iter().zip(sums.chunks_exact(3)) {
            let i = curves.start + block.curve as usize;
            found.energies[i] += sums[0];
            found.gauges[i] += sums[1];
            found.slopes[i] += sums[2];
        }
        for i in self.evaluated(curves) {
            let unit = self.weights(i).unit;
            found.energies[i] *= unit;
            found.gauges[i] *= unit;
            found.slopes[i] *= unit;
        }
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::CurveBatch;
    use crate::gpu::reflect::assert_layout;
    use crate::gpu::testing::{gpu, precisions};

    #[test]
    fn every_energy_of_the_list_is_on_the_device_what_it_is_on_the_cpu() {
        let Some(gpu) = gpu() else { return };
        let wave = |v: usize| (0.9 * v as f64, (1.7 * v as f64).sin(), 0.6 * (1.1 * v as f64).cos());
        let coords: Vec<f64> = (0..9).flat_map(|v| <[f64; 3]>::from(wave(v))).collect();
        let batch = CurveBatch::from_ragged(3, [coords.clone(), coords].concat(), vec![0, 9, 18]).unwrap();
        let batch = batch.closed_each(vec![false, true]).unwrap();
        for name in Energy::NAMES {
            let energy = Energy::named(name).unwrap();
            let at = At { energy: &energy, batch: &batch, gauge: None, attachments: None };
            for want in [Want::Value, Want::Gradient, Want::Hessian] {
                let all = |found: Found| [found.energies, found.gradients, found.hessians].concat();
                let wanted = all(at.on_cpu(want));
                let unit = wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                assert!(unit > 0.0 || *name == "attachment", "{name}, {want:?}");
                for precision in precisions(&gpu) {
                    let found = all(evaluate(&gpu, precision, at, want).unwrap());
                    let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
                    // Differences of tangents and of curvatures over edges of about 1: tens of
                    // roundings of the largest.
                    let is_near = |(x, y): (&f64, &f64)| (x - y).abs() <= 256.0 * epsilon * unit;
                    assert!(
                        found.iter().zip(&wanted).all(is_near),
                        "{name}, {precision:?}, {want:?}: {found:?} {wanted:?}"
                    );
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
