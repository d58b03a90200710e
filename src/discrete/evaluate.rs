//! [`Energy::evaluate`]: energies, gradients and Hessians of given curves, on the CPU or a GPU.

use super::energy::Energy;
use super::evaluate_gpu::evaluate_on_gpu;
use super::evaluation::{Evaluate, Evaluating, Evaluation, PreparedCurve};
use crate::batch::CurveBatch;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::parallel;

impl Energy {
    /// The energy at every curve of the batch, with the [wanted](Evaluate::want) derivatives.
    ///
    /// The points of a curve are its vertices. The CPU computes in f64, on all threads. Energies of
    /// two or three edges are 0 on curves with fewer edges.
    ///
    /// The result is NaN with an [`Unfitted`](crate::Unfitted) if the batch marks the curve as
    /// unfit, or in one of these cases:
    ///
    /// - Two neighbouring vertices coincide, so that their edge has no tangent.
    /// - The curve is closed and has one or two vertices.
    /// - Its data points do not fit its vertices.
    ///
    /// ```
    /// use faircurve::{CurveBatch, Device, discrete::{Evaluate, bending, length}};
    /// let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    /// let batch = CurveBatch::from_slices(&[&corner[..]])?;
    /// let energy = bending(2.0) + 0.5 * length();
    /// let found = energy.evaluate(&batch, Evaluate::default(), &Device::cpu())?;
    /// // |K|² Δa with |K| = √2, Δa = 1, and half the length 2.
    /// assert!((found[0].value - 3.0).abs() < 1e-15);
    /// assert_eq!(found[0].gradient.len(), 6);
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    ///
    /// # Errors
    /// - A weight that is negative or not finite, or an exponent below 1.
    /// - A custom energy of no edges or too many.
    /// - Geodesic bending, which needs a surface.
    /// - An attachment without targets, or with targets of another dimension or number of curves.
    /// - A torsion curvature that is not positive.
    /// - A direction whose length is not that of the coordinates.
    /// - On a GPU, an energy that cannot be compiled into a kernel, and errors of submissions.
    pub fn evaluate(&self, batch: &CurveBatch, options: Evaluate, device: &Device) -> Result<Vec<Evaluation>> {
        self.check()?;
        if self.is_geodesic() {
            return Err(Error::argument(
                "geodesic bending is that of curves in a surface, which evaluations know nothing of",
            ));
        }
        options.validate(self, batch)?;
        let evaluating = Evaluating { energy: self, batch, options };
        match batch.dimension() {
            2 => run::<2>(&evaluating, device),
            _ => run::<3>(&evaluating, device),
        }
    }
}

fn run<const D: usize>(evaluating: &Evaluating, device: &Device) -> Result<Vec<Evaluation>> {
    let ready: Vec<_> = parallel::map(evaluating.batch.len(), 1, |i| evaluating.ready::<D>(i));
    let able: Vec<&PreparedCurve<D>> = ready.iter().flatten().collect();
    let found = match device.as_gpu() {
        Some(gpu) => evaluate_on_gpu(gpu, device.kernel_precision(gpu, false)?, evaluating, &able)?,
        None => evaluating.on_cpu(&able),
    };
    let mut evaluations: Vec<Option<Evaluation>> = vec![None; evaluating.batch.len()];
    able.iter().zip(found).for_each(|(curve, found)| evaluations[curve.i] = Some(found));
    let problem = |i: usize| ready[i].as_ref().err().expect("what is able was evaluated").clone();
    let all = evaluations.into_iter().enumerate();
    Ok(all.map(|(i, found)| found.unwrap_or_else(|| evaluating.nothing(i, problem(i)))).collect())
}

#[cfg(test)]
mod tests;
