//! Splines on the integers on the GPU: coefficients, values, subdivision and energies, on normalised coordinates.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::gpu::GROUP;
use super::packing::Frame;
use crate::batch::CurveBatch;
use crate::error::Result;
use crate::gpu::source::{Definitions, definitions};
use crate::gpu::{Buffer, Downloaded, Gpu, KernelKey, Pending, Recording, pipeline, plan};
use crate::linalg::Real;
use crate::linalg::ring::{FLAG_CYCLIC, RingKernel, RowSource, Solve, System, real_bytes};
use crate::precision::Precision;

/// `UniformParams` of `uniform/points.wgsl`.
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

/// `UniformCurve` of `uniform/points.wgsl`.
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

/// Runs an operation on every curve: coordinates of the results, curve after curve from `offsets` (in points) on, or
/// one energy a curve.
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
    let real = real_bytes(precision) * d as u64;
    let largest = real << operation.rounds();
    let points = (0..batch.len()).map(|i| batch.count(i));
    let chunks = plan::chunks(points, largest, 2 * real + 3 * largest, gpu.limits())?;
    let job = Job { gpu, precision, batch, operation };
    pipeline(
        chunks,
        |curves| match precision {
            Precision::F64 => job.record::<f64>(curves)?.submit(),
            _ => job.record::<f32>(curves)?.submit(),
        },
        Pending::wait,
        |curves, results| {
            match precision {
                Precision::F64 => job.unpack::<f64>(curves, &results, offsets, &mut out),
                _ => job.unpack::<f32>(curves, &results, offsets, &mut out),
            }
            Ok(())
        },
    )?;
    Ok(out)
}

struct Job<'a> {
    gpu: &'a Gpu,
    precision: Precision,
    batch: &'a CurveBatch,
    operation: Operation<'a>,
}

impl<'a> Job<'a> {
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

    fn upload<S: Real + Pod>(
        &self,
        recording: &mut Recording<'_>,
        batch: &CurveBatch,
        curves: &Range<usize>,
    ) -> Buffer {
        let d = batch.dimension();
        let mut points = Vec::with_capacity((batch.offsets()[curves.end] - batch.offsets()[curves.start]) * d);
        for i in curves.clone() {
            let frame = self.frame(i);
            points.extend(
                batch.points(i).iter().enumerate().map(|(k, x)| S::from_f64((x - frame.center[k % d]) / frame.size)),
            );
        }
        recording.upload(&points)
    }

    fn kernel(&self, path: &'static str, entry: &'static str) -> Result<std::sync::Arc<crate::gpu::Kernel>> {
        let definitions = definitions([("GROUP", &GROUP)]);
        self.gpu.kernel(&KernelKey { path, entry, precision: self.precision, definitions })
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

    fn record<S: Real + Pod>(&self, curves: &Range<usize>) -> Result<Recording<'a>> {
        let mut recording = self.gpu.record();
        let d = self.batch.dimension();
        let real = real_bytes(self.precision);
        let mut points = self.upload::<S>(&mut recording, self.batch, curves);
        let groups = |tasks: usize| plan::workgroups(tasks, GROUP as usize, self.gpu.limits());
        let result = match self.operation {
            Operation::Coefficients => self.record_coefficients(&mut recording, curves, &points)?,
            Operation::Interpolated => {
                let kernel = self.kernel("spline/subdivide.wgsl", "interpolated")?;
                let (table, params, count) = self.tables(&mut recording, curves, 0);
                let values = recording.storage((count * d) as u64 * real);
                let buffers = [("params", &params), ("curves", &table), ("points", &points), ("fine", &values)];
                recording.dispatch(&kernel, groups(count)?, &buffers)?;
                values
            }
            Operation::Subdivide(rounds) => {
                let kernel = self.kernel("spline/subdivide.wgsl", "subdivide")?;
                for round in 0..rounds {
                    let (table, params, count) = self.tables(&mut recording, curves, round);
                    let fine = recording.storage((2 * count * d) as u64 * real);
                    let buffers = [("params", &params), ("curves", &table), ("points", &points), ("fine", &fine)];
                    recording.dispatch(&kernel, groups(count)?, &buffers)?;
                    points = fine;
                }
                points
            }
            Operation::DiscreteEnergy | Operation::ExactProduct(_) => {
                let other = match self.operation {
                    Operation::ExactProduct(other) => Some(self.upload::<S>(&mut recording, other, curves)),
                    _ => None,
                };
                let entry = if other.is_some() { "exact_product" } else { "discrete_energy" };
                let kernel = self.kernel("spline/energy.wgsl", entry)?;
                let (table, params, _) = self.tables(&mut recording, curves, 0);
                let blocks = self.blocks(curves);
                let energies = recording.storage(blocks.len() as u64 * real);
                let block_table = recording.upload(&blocks);
                let others = other.as_ref().unwrap_or(&points);
                let buffers = [
                    ("params", &params),
                    ("curves", &table),
                    ("points", &points),
                    ("others", others),
                    ("energies", &energies),
                    ("blocks", &block_table),
                ];
                recording.dispatch(&kernel, groups(blocks.len())?, &buffers)?;
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
        let solution =
            recording.storage(((self.batch.offsets()[curves.end] - first) * d) as u64 * real_bytes(self.precision));
        let status = recording.storage(4 * curves.len() as u64);
        let source = RowSource {
            path: "spline/uniform.wgsl",
            definitions: Definitions::new(),
            buffers: vec![("values", points)],
        };
        let columns = d as u32;
        let solve = Solve { systems: &systems, columns, precision: self.precision, kernel: RingKernel::Auto };
        solve.record(recording, &source, &solution, &status)?;
        Ok(solution)
    }

    fn unpack<S: Real + Pod>(&self, curves: &Range<usize>, results: &[Downloaded], offsets: &[usize], out: &mut [f64]) {
        let result = results[0].as_slice::<S>();
        let (d, rounds) = (self.batch.dimension(), self.operation.rounds());
        let first = self.batch.offsets()[curves.start];
        for (block, energy) in self.blocks(curves).iter().zip(result) {
            out[curves.start + block.curve as usize] += energy.to_f64();
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
