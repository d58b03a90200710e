//! Stand-ins for the types of the GPU, without the feature `gpu`.
//!
//! No value of these types can be made, and code that uses them compiles to nothing.

#![expect(missing_docs, reason = "documented where they are, with the feature")]

use std::borrow::Cow;

use bytemuck::Pod;

use super::key::KernelKey;
use super::plan::Limits;
use super::summary::AdapterSummary;
use crate::error::{Error, Result};
use crate::precision::{Precision, Reals};

/// A GPU that cannot exist: the feature `gpu` is off.
#[derive(Debug)]
pub enum Gpu {}

/// Returns no adapter.
pub fn adapters() -> Vec<AdapterSummary> {
    Vec::new()
}

/// Does something. No driver is there to print anything.
pub fn silently<T>(act: impl FnOnce() -> T) -> T {
    act()
}

impl Gpu {
    /// Opens no GPU.
    ///
    /// # Errors
    /// [`Error::NoGpu`], always.
    pub fn open(number: usize) -> Result<Self> {
        Err(Error::NoGpu(format!("gpu:{number} was asked for, but faircurve was built without the feature `gpu`")))
    }

    /// What the adapter is and can do.
    pub fn summary(&self) -> &AdapterSummary {
        match *self {}
    }

    pub(crate) fn lanes(&self) -> Option<usize> {
        match *self {}
    }

    pub(crate) fn note(&self, _: String) {
        match *self {}
    }

    /// Returns 0.
    pub fn take_kernel_seconds(&self) -> f64 {
        match *self {}
    }

    /// Returns nothing.
    pub fn take_notes(&self) -> Vec<String> {
        match *self {}
    }

    /// The limits that plans are made against.
    #[doc(hidden)]
    pub fn limits(&self) -> &Limits {
        match *self {}
    }

    #[doc(hidden)]
    pub fn record(&self, _: Precision) -> Recording<'_> {
        match *self {}
    }
}

// Boxes, since code after a value that cannot exist is a warning.
pub struct Buffer {
    _gpu: Box<Gpu>,
}

pub struct Downloaded(Box<Gpu>);

impl Downloaded {
    pub fn as_slice<T: Pod>(&self) -> &[T] {
        match *self.0 {}
    }

    pub fn reals(&self) -> Cow<'_, [f64]> {
        match *self.0 {}
    }

    pub(crate) fn numbers(&self) -> Reals<'_> {
        match *self.0 {}
    }
}

pub struct Recording<'g>(&'g Gpu);

impl<'g> Recording<'g> {
    pub fn upload<T: Pod>(&mut self, _: &[T]) -> Buffer {
        match *self.0 {}
    }

    pub fn upload_reals(&mut self, _: &[f64]) -> Buffer {
        match *self.0 {}
    }

    pub(crate) fn upload_parts(&mut self, _: &[usize], _: impl Fn(usize, &mut [f64]) + Sync) -> Buffer {
        match *self.0 {}
    }

    pub fn uniform<T: Pod>(&mut self, _: &T) -> Buffer {
        match *self.0 {}
    }

    pub(crate) fn upload_control<T: Pod>(&mut self, _: &T) -> Buffer {
        match *self.0 {}
    }

    pub fn storage(&mut self, _: u64) -> Buffer {
        match *self.0 {}
    }

    pub fn storage_reals(&mut self, _: usize) -> Buffer {
        match *self.0 {}
    }

    pub fn dispatch(&mut self, _: &KernelKey, _: usize, _: usize, _: &[(&str, &Buffer)]) -> Result<()> {
        match *self.0 {}
    }

    pub(crate) fn dispatch_listed(&mut self, _: &KernelKey, _: &Buffer, _: &[(&str, &Buffer)]) -> Result<()> {
        match *self.0 {}
    }

    pub fn download(&mut self, _: &Buffer) {
        match *self.0 {}
    }

    pub fn gpu(&self) -> &'g Gpu {
        self.0
    }

    pub fn precision(&self) -> Precision {
        match *self.0 {}
    }

    pub fn submit(self) -> Result<Pending<'g>> {
        match *self.0 {}
    }
}

pub struct Pending<'g>(&'g Gpu);

impl<'g> Pending<'g> {
    pub fn gpu(&self) -> &'g Gpu {
        self.0
    }

    pub fn precision(&self) -> Precision {
        match *self.0 {}
    }

    pub fn wait(self) -> Result<Vec<Downloaded>> {
        match *self.0 {}
    }
}
