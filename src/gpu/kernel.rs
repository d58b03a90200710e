//! Compiled kernels: composed, reflected, checked against the device's limits, and cached.

use std::sync::Arc;

use super::context::{Gpu, Kernel};
use super::key::KernelKey;
use super::reflect::reflect;
use crate::error::{Error, Result};

impl Gpu {
    /// Compiles a kernel, unless it is cached.
    ///
    /// # Errors
    /// - [`Error::Kernel`] if the compiler refuses it.
    /// - [`Error::Limit`] if it needs more workgroup memory or threads than the device has. wgpu does
    ///   not check that.
    pub(super) fn kernel(&self, key: &KernelKey) -> Result<Arc<Kernel>> {
        let name = key.name();
        if let Some(kernel) = self.kernels.lock().expect("no panic while held").get(&name) {
            return Ok(Arc::clone(kernel));
        }
        let kernel = Arc::new(self.compile(key, name.clone())?);
        self.kernels.lock().expect("no panic while held").insert(name, Arc::clone(&kernel));
        Ok(kernel)
    }

    fn compile(&self, key: &KernelKey, name: String) -> Result<Kernel> {
        let wgsl = key.wgsl();
        let reflection = reflect(&name, &wgsl, key.entry)?;
        let limits = self.limits();
        for (what, asked, allowed) in [
            ("workgroup memory", reflection.workgroup_bytes, limits.workgroup_bytes),
            ("threads a workgroup", reflection.workgroup_size, limits.workgroup_threads),
        ] {
            if asked > allowed {
                let (what, remedy) = (format!("kernel {name}: {what}"), "use the CPU".into());
                return Err(Error::Limit { what, asked: asked.into(), allowed: allowed.into(), remedy });
            }
        }
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&name),
            source: wgpu::ShaderSource::Wgsl(wgsl.as_str().into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&name),
            layout: None,
            module: &module,
            entry_point: Some(key.entry),
            compilation_options: wgpu::PipelineCompilationOptions {
                // Every kernel writes its workgroup memory before it reads it.
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(self.failure(Error::Kernel { kernel: name, message: error.to_string() }));
        }
        Ok(Kernel { name, wgsl, entry: key.entry, pipeline, reflection })
    }
}
