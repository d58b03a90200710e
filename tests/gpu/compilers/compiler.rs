//! Mesa's compiler for AMD's cards without a card, through Vulkan: `RADV_FORCE_FAMILY` opens a device without
//! hardware, and VK_KHR_pipeline_executable_properties tells what became of a pipeline. wgpu cannot open that device.

#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::time::Instant;

use ash::vk;
use faircurve::gpu::KernelKey;
use faircurve::gpu::reflect::{Access, parse, reflect};
use naga::back::spv;

/// What a compiler says of a form.
#[derive(Clone, Debug, Default)]
pub struct Compiled {
    /// Numbers by the names that the driver gives them; and `SPIR-V size` in bytes, `Compilation` in
    /// milliseconds.
    pub statistics: BTreeMap<String, u64>,
}

impl Compiled {
    /// A number by the name that the driver gives it.
    pub fn of(&self, name: &str) -> u64 {
        self.statistics.get(name).copied().unwrap_or(0)
    }
}

/// A Vulkan device that compiles and does nothing else.
pub struct Compiler {
    _entry: ash::Entry,
    device: ash::Device,
    executables: ash::khr::pipeline_executable_properties::Device,
}

impl Compiler {
    /// The first device there is, for which the environment says which.
    pub fn open() -> Option<Self> {
        // SAFETY: handles are used while their parents live, and structures while what they point to does.
        unsafe {
            let entry = ash::Entry::load().ok()?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let instance = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&instance, None).ok()?;
            let physical = *instance.enumerate_physical_devices().ok()?.first()?;
            let queue = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [ash::khr::pipeline_executable_properties::NAME.as_ptr(), c"VK_EXT_robustness2".as_ptr()];
            let features = vk::PhysicalDeviceFeatures {
                shader_float64: 1,
                shader_int64: 1,
                robust_buffer_access: 1,
                ..Default::default()
            };
            let mut executables =
                vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
            let mut robust = vk::PhysicalDeviceRobustness2FeaturesEXT::default().robust_buffer_access2(true);
            let device = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queue)
                .enabled_extension_names(&extensions)
                .enabled_features(&features)
                .push_next(&mut executables)
                .push_next(&mut robust);
            let device = instance.create_device(physical, &device, None).ok()?;
            let executables = ash::khr::pipeline_executable_properties::Device::new(&instance, &device);
            Some(Compiler { _entry: entry, device, executables })
        }
    }

    /// What becomes of a kernel.
    pub fn compile(&self, key: &KernelKey) -> Result<Compiled, String> {
        let wgsl = key.wgsl();
        let (module, info) = parse(&key.name(), &wgsl).map_err(|error| error.to_string())?;
        // As wgpu has it on a device with VK_EXT_robustness2.
        let options = spv::Options {
            lang_version: (1, 5),
            flags: spv::WriterFlags::empty(),
            bounds_check_policies: naga::proc::BoundsCheckPolicies {
                index: naga::proc::BoundsCheckPolicy::Restrict,
                ..Default::default()
            },
            zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
            ..Default::default()
        };
        let stage =
            spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: key.entry.to_string() };
        let words = spv::write_vec(&module, &info, &options, Some(&stage)).map_err(|error| error.to_string())?;
        let reflection = reflect(&key.name(), &wgsl, key.entry).map_err(|error| error.to_string())?;
        let kind = |access| match access {
            Access::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
            Access::Read | Access::ReadWrite => vk::DescriptorType::STORAGE_BUFFER,
        };
        let bindings: Vec<_> = reflection
            .bindings
            .iter()
            .map(|own| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(own.binding)
                    .descriptor_type(kind(own.access))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let name = std::ffi::CString::new(key.entry).map_err(|error| error.to_string())?;
        // SAFETY: as in `open`; what is made is destroyed before the device is.
        unsafe { self.statistics(&words, &bindings, &name) }.map_err(|error| error.to_string())
    }

    unsafe fn statistics(
        &self,
        words: &[u32],
        bindings: &[vk::DescriptorSetLayoutBinding],
        entry: &std::ffi::CStr,
    ) -> Result<Compiled, vk::Result> {
        let device = &self.device;
        // SAFETY: the caller's.
        unsafe {
            let set = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
            let sets = [device.create_descriptor_set_layout(&set, None)?];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = device.create_pipeline_layout(&layout, None)?;
            let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(words), None)?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(entry);
            let pipeline = vk::ComputePipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stage(stage)
                .layout(layout);
            let start = Instant::now();
            let made = device.create_compute_pipelines(vk::PipelineCache::null(), &[pipeline], None);
            let pipeline = made.map_err(|(_, error)| error)?[0];
            let own = [("SPIR-V size", 4 * words.len() as u64), ("Compilation", start.elapsed().as_millis() as u64)];
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(0);
            let found = self.executables.get_pipeline_executable_statistics(&executable)?;
            let number = |own: &vk::PipelineExecutableStatisticKHR| match own.format {
                vk::PipelineExecutableStatisticFormatKHR::UINT64 => own.value.u64,
                vk::PipelineExecutableStatisticFormatKHR::INT64 => own.value.i64.max(0) as u64,
                vk::PipelineExecutableStatisticFormatKHR::FLOAT64 => own.value.f64 as u64,
                _ => u64::from(own.value.b32),
            };
            let word = |own: &vk::PipelineExecutableStatisticKHR| {
                own.name_as_c_str().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
            };
            let own = own.into_iter().map(|(name, number)| (name.to_string(), number));
            let statistics = found.iter().map(|own| (word(own), number(own))).chain(own).collect();
            device.destroy_pipeline(pipeline, None);
            device.destroy_shader_module(module, None);
            device.destroy_pipeline_layout(layout, None);
            device.destroy_descriptor_set_layout(sets[0], None);
            Ok(Compiled { statistics })
        }
    }
}
