//! [`Method`]: one of the library's, as its options were given.

use faircurve::discrete::Fair;
use faircurve::scf::Smooth;
use faircurve::spline::{Band, Natural, Smoothing, SurfaceSpline};
use faircurve::surface::Surface;
use faircurve::{CurveBatch, Device, Fit, Result, Sampling, Work};

use super::obstacles::polygons;

/// A method with its options.
#[derive(Debug)]
pub enum Method {
    Natural(Natural),
    Smoothing(Smoothing),
    Band(Band),
    InSurface(Box<SurfaceSpline>),
    Fair(Box<Fair>),
    Scf(Smooth),
}

impl Method {
    /// The work of a batch with this number of points, read and written together.
    pub fn work(&self, points: usize) -> Work {
        match self {
            Method::Natural(natural) => natural.work(points),
            Method::Smoothing(smoothing) => smoothing.work(points),
            Method::Band(band) => band.work(points),
            Method::InSurface(spline) => spline.work(points),
            Method::Fair(fair) => fair.work(points),
            Method::Scf(smooth) => smooth.work(points),
        }
    }

    /// What is worth a line about curves that are usable.
    pub fn notes(&self, fit: &Fit) -> Vec<String> {
        match self {
            Method::Smoothing(smoothing) => smoothing.notes(fit.reports()),
            Method::Fair(fair) => fair.notes(fit.reports()),
            Method::Band(band) => band.notes(fit.reports()),
            Method::Natural(_) | Method::InSurface(_) | Method::Scf(_) => Vec::new(),
        }
    }

    /// The polygons that curves stay out of, with discs among them, and the half-width of their corridor.
    pub fn areas(&self) -> (Vec<Vec<[f64; 2]>>, Option<f64>) {
        match self {
            Method::Fair(fair) => (polygons(&fair.limits), fair.limits.corridor),
            _ => (vec![], None),
        }
    }

    /// The surface that curves lie in.
    pub fn surface(&self) -> Option<&dyn Surface> {
        match self {
            Method::InSurface(spline) => Some(&*spline.surface),
            Method::Fair(fair) => fair.surface.as_deref(),
            Method::Natural(_) | Method::Smoothing(_) | Method::Band(_) | Method::Scf(_) => None,
        }
    }

    /// The dimension of the curves. Planar points rise onto a terrain.
    pub fn dimension(&self, batch: &CurveBatch) -> usize {
        let rises = self.surface().is_some_and(|surface| surface.over(0.0, 0.0).is_some());
        if rises { 3 } else { batch.dimension() }
    }

    pub fn fit(&self, batch: &CurveBatch, device: &Device) -> Result<Fit> {
        match self {
            Method::Natural(natural) => natural.fit(batch, device),
            Method::Smoothing(smoothing) => smoothing.fit(batch, device),
            Method::Band(band) => band.fit(batch, device),
            Method::InSurface(spline) => spline.fit(batch, device),
            Method::Fair(fair) => fair.fit(batch, device),
            Method::Scf(smooth) => smooth.fit(batch, device),
        }
    }

    /// Fits and samples on the device.
    pub fn fit_sampled(&self, batch: &CurveBatch, sampling: Sampling, device: &Device) -> Result<(Fit, CurveBatch)> {
        match self {
            Method::Natural(natural) => natural.fit_sampled(batch, sampling, device),
            Method::Smoothing(smoothing) => smoothing.fit_sampled(batch, sampling, device),
            Method::Band(band) => band.fit_sampled(batch, sampling, device),
            Method::InSurface(spline) => spline.fit_sampled(batch, sampling, device),
            Method::Fair(fair) => fair.fit_sampled(batch, sampling, device),
            Method::Scf(smooth) => smooth.fit_sampled(batch, sampling, device),
        }
    }
}
