//! Completion and transformation of control polygons on a GPU.

use std::collections::BTreeMap;

use super::complete::{Job, Outcome, Solved};
use super::operator::Operator;
use super::polygons::{Controls, Polygons};
use crate::device::Precision;
use crate::error::{Error, Result};
use crate::gpu::Gpu;

fn not_yet() -> Error {
    Error::NoGpu("Béziers are completed by the CPU so far; use --device cpu".into())
}

pub(super) fn complete_on_gpu<const D: usize>(_: &Gpu, _: Precision, _: &Job, _: &mut Solved) -> Result<Vec<Outcome>> {
    Err(not_yet())
}

pub(super) fn transform_on_gpu<const D: usize>(
    _: &Gpu,
    _: Precision,
    _: &Polygons,
    _: &BTreeMap<usize, Operator<f64>>,
    _: &mut Controls,
) -> Result<()> {
    Err(not_yet())
}
