//! Splines on the integers on the GPU: coefficients, values, subdivision and energies, on
//! normalised coordinates.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::gpu::GROUP;
use super::packing::Frame;
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::gpu::source::definitions;
use crate::gpu::{Buffer, Gpu, KernelKey, Pending, Recording, once, pipeline, plan};
use crate::linalg::ring::{FLAG_CYCLIC, GIVEN, ROWS_UNIFORM, RingKernel, RowSource, Solve, System};
use crate::precision::Precision;

/// `UniformParams` of `uniform.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct UniformParams {
    pub curves: u32,
    pub points: u32,
    pub dimension: u32,
    pub blocks: u32,
}

/// `Block` of `energy.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Block {
    pub curve: u32,
    pub begin: u32,
    pub end: u32,
    pub padding: u32,
}

/// Points a thread sums over.
const BLOCK_POINTS: usize = 256;

/// `UniformCurve` of `uniform.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct UniformCurve {
    pub start: u32,
    pub count: u32,
    pub closed: u32,
    pub padding: u32,
}

/// What is computed of each curve's points.
#[derive(Clone, Copy)]
pub(super) enum Operation<'a> {
    /// N⁻¹ p
    Coefficients,
    /// N p
    Interpolated,
    /// S^k p for k rounds.
    Subdivide(u32),
    /// Σ |Δ²p|²
    DiscreteEnergy,
    /// p ᵀE₀N q with the curves of another batch of the same shape.
    ExactProduct(&'a CurveBatch),
}

impl Operation<'_> {
    /// Whether the result is one energy a curve, not points.
    pub fn is_energy(self) -> bool {
        matches!(self, Operation::DiscreteEnergy | Operation::ExactProduct(_))
    }

    fn rounds(self) -> u32 {
        if let Operation::Subdivide(rounds) = self { rounds } else { 0 }
    }
}

/// Runs an operation on every curve: coordinates of the results, curve after curve from `offsets`
/// (in points) on, or one energy a curve.
///
/// # Errors
/// Those of submissions; [`crate::Error::Limit`] for a curve larger than the device's largest array.
pub(super) fn run(
    gpu: &Gpu,
    precision: Precision,
    batch: &CurveBatch,
    operation: Operation<'_>,
    offsets: &[usize],
) -> Result<Vec<f64>> {
    let d = batch.dimension();
    let mut out = vec![0.0; if operation.is_energy() { batch.len() } else { offsets[batch.len()] * d }];
    let real = precision.bytes() * d as u64;
    let largest = real << operation.rounds();
    let points = (0..batch.len()).map(|i| batch.count(i));
    let chunks = plan::chunks(points, largest, 2 * real + 3 * largest, gpu.limits())?;
    let job = Job { batch, operation };
    pipeline(
        chunks,
        |curves| job.record(gpu.record(precision), curves)?.submit(),
        once(Pending::wait),
        |curves, results| {
            job.unpack(curves, &results[0].reals(), offsets, &mut out);
            Ok(())
        },
    )?;
    Ok(out)
}

struct Job<'a> {
    batch: &'a CurveBatch,
    operation: Operation<'a>,
}

impl Job<'_> {
    /// Both factors of a product are scaled alike.
    fn frame(&self, i: usize) -> Frame {
        let d = self.batch.dimension();
        let frame = Frame::of_points(self.batch.points(i), d);
        match self.operation {
            Operation::ExactProduct(other) => {
                Frame { size: frame.size.max(Frame::of_points(other.points(i), d).size), ..frame }
            }
            _ => frame,
        }
    }

    fn upload(&self, recording: &mut Recording<'_>, batch: &CurveBatch, curves: &Range<usize>) -> Buffer {
        let d = batch.dimension();
        let mut points = Vec::with_capacity((batch.offsets()[curves.end] - batch.offsets()[curves.start]) * d);
        for i in curves.clone() {
            let frame = self.frame(i);
            points.extend(batch.points(i).iter().enumerate().map(|(k, x)| (x - frame.center[k % d]) / frame.size));
        }
        recording.upload_reals(&points)
    }

    /// The blocks that energies are summed in, curve after curve.
    fn blocks(&self, curves: &Range<usize>) -> Vec<Block> {
        if !self.operation.is_energy() {
            return Vec::new();
        }
        let of_curve = |i: usize| {
            let (count, curve) = (self.batch.count(i), (i - curves.start) as u32);
            (0..count).step_by(BLOCK_POINTS).map(move |begin| {
                let end = (begin + BLOCK_POINTS).min(count) as u32;
                Block { curve, begin: begin as u32, end, padding: 0 }
            })
        };
        curves.clone().flat_map(of_curve).collect()
    }

    /// Curves and parameters at a round of subdivision.
    fn tables(&self, recording: &mut Recording<'_>, curves: &Range<usize>, round: u32) -> (Buffer, Buffer, usize) {
        let first = self.batch.offsets()[curves.start];
        let table: Vec<UniformCurve> = curves
            .clone()
            .map(|i| {
                let (count, spans) = (self.batch.count(i), self.batch.spans(i));
                UniformCurve {
                    start: ((self.batch.offsets()[i] - first) << round) as u32,
                    count: (count - spans + (spans << round)) as u32,
                    closed: self.batch.is_closed(i).into(),
                    padding: 0,
                }
            })
            .collect();
        let points = (self.batch.offsets()[curves.end] - first) << round;
        let blocks = self.blocks(curves).len() as u32;
        let (curves, dimension) = (curves.len() as u32, self.batch.dimension() as u32);
        let params = recording.uniform(&UniformParams { curves, points: points as u32, dimension, blocks });
        (recording.upload(&table), params, points)
    }

    fn record<'g>(&self, mut recording: Recording<'g>, curves: &Range<usize>) -> Result<Recording<'g>> {
        let (d, precision) = (self.batch.dimension(), recording.precision());
        let kernel = |path, entry| KernelKey { path, entry, precision, definitions: definitions([("GROUP", &GROUP)]) };
        let mut points = self.upload(&mut recording, self.batch, curves);
        let result = match self.operation {
            Operation::Coefficients => self.record_coefficients(&mut recording, curves, &points)?,
            Operation::Interpolated => {
                let (table, params, count) = self.tables(&mut recording, curves, 0);
                let values = recording.storage_reals(count * d);
                let buffers = [("params", &params), ("curves", &table), ("points", &points), ("fine", &values)];
                recording.dispatch(&kernel("spline/subdivide.wgsl", "interpolated"), count, GROUP, &buffers)?;
                values
            }
            Operation::Subdivide(rounds) => {
                for round in 0..rounds {
                    let (table, params, count) = self.tables(&mut recording, curves, round);
                    let fine = recording.storage_reals(2 * count * d);
                    let buffers = [("params", &params), ("curves", &table), ("points", &points), ("fine", &fine)];
                    recording.dispatch(&kernel("spline/subdivide.wgsl", "subdivide"), count, GROUP, &buffers)?;
                    points = fine;
                }
                points
            }
            Operation::DiscreteEnergy | Operation::ExactProduct(_) => {
                let other = match self.operation {
                    Operation::ExactProduct(other) => Some(self.upload(&mut recording, other, curves)),
                    _ => None,
                };
                let entry = if other.is_some() { "exact_product" } else { "discrete_energy" };
                let (table, params, _) = self.tables(&mut recording, curves, 0);
                let blocks = self.blocks(curves);
                let energies = recording.storage_reals(blocks.len());
                let buffers = [
                    ("params", &params),
                    ("curves", &table),
                    ("points", &points),
                    ("others", other.as_ref().unwrap_or(&points)),
                    ("energies", &energies),
                    ("blocks", &recording.upload(&blocks)),
                ];
                recording.dispatch(&kernel("spline/energy.wgsl", entry), blocks.len(), GROUP, &buffers)?;
                energies
            }
        };
        recording.download(&result);
        Ok(recording)
    }

    fn record_coefficients(
        &self,
        recording: &mut Recording<'_>,
        curves: &Range<usize>,
        points: &Buffer,
    ) -> Result<Buffer> {
        let first = self.batch.offsets()[curves.start];
        let solved = curves.clone().filter(|&i| self.batch.count(i) > 0);
        let systems: Vec<System> = solved
            .map(|i| System {
                start: (self.batch.offsets()[i] - first) as u32,
                rows: self.batch.count(i) as u32,
                flags: if self.batch.is_closed(i) { FLAG_CYCLIC } else { 0 },
                index: (i - curves.start) as u32,
            })
            .collect();
        let d = self.batch.dimension();
        let solution = recording.storage_reals((self.batch.offsets()[curves.end] - first) * d);
        let status = recording.storage(4 * curves.len() as u64);
        // The kernel reads only the right-hand sides.
        let buffers = ["diagonal", "lower", "upper", "right_hand_sides"].map(|name| (name, points)).to_vec();
        let source = RowSource { path: GIVEN, kind: ROWS_UNIFORM, buffers };
        let solve = Solve { systems: &systems, columns: d as u32, kernel: RingKernel::Auto };
        solve.record(recording, &source, &solution, &status)?;
        Ok(solution)
    }

    fn unpack(&self, curves: &Range<usize>, result: &[f64], offsets: &[usize], out: &mut [f64]) {
        let (d, rounds) = (self.batch.dimension(), self.operation.rounds());
        let first = self.batch.offsets()[curves.start];
        for (block, energy) in self.blocks(curves).iter().zip(result) {
            out[curves.start + block.curve as usize] += energy;
        }
        for i in curves.clone() {
            let frame = self.frame(i);
            match self.operation {
                Operation::DiscreteEnergy | Operation::ExactProduct(_) => {
                    out[i] *= frame.size * frame.size;
                }
                _ => {
                    let from = &result[((self.batch.offsets()[i] - first) << rounds) * d..];
                    frame.map_back(&mut out[offsets[i] * d..offsets[i + 1] * d], from, d);
                }
            }
        }
    }
}
