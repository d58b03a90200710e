//! What compilers of hardware say of every kernel: registers, spills, scratch memory, waves.
//!
//! Mesa's driver of AMD's cards compiles for a card that is not there: `RADV_FORCE_FAMILY` opens a device without
//! hardware, and VK_KHR_pipeline_executable_properties tells what became of a pipeline. wgpu cannot open that device,
//! so this goes through Vulkan itself. A process of its own compiles for a family, and goes on behind a form at which
//! the compiler ends it.

#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;

use ash::vk;
use faircurve::gpu::KernelKey;
use faircurve::gpu::reflect::{Access, parse, reflect};
use faircurve::kernels;
use naga::back::spv;

/// Set for a process that compiles: the number of the first form.
const FIRST: &str = "FAIRCURVE_COMPILE_FROM";

/// The driver file of AMD's cards, beside that of the driver the tests run on.
fn radv() -> Option<PathBuf> {
    let own = std::env::var_os("VK_DRIVER_FILES").map(PathBuf::from);
    let folder = own.as_deref().and_then(|file| file.parent()).unwrap_or("/usr/share/vulkan/icd.d".as_ref()).to_owned();
    let file = folder.join(format!("radeon_icd.{}.json", std::env::consts::ARCH));
    file.exists().then_some(file)
}

/// What a compiler says of a form.
#[derive(Clone, Debug, Default)]
struct Compiled {
    statistics: BTreeMap<String, u64>,
}

impl Compiled {
    fn of(&self, name: &str) -> u64 {
        self.statistics.get(name).copied().unwrap_or(0)
    }
}

/// A Vulkan device that compiles and does nothing else.
struct Compiler {
    _entry: ash::Entry,
    device: ash::Device,
    executables: ash::khr::pipeline_executable_properties::Device,
}

impl Compiler {
    fn open() -> Option<Self> {
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

    fn compile(&self, key: &KernelKey) -> Result<Compiled, String> {
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
            let made = device.create_compute_pipelines(vk::PipelineCache::null(), &[pipeline], None);
            let pipeline = made.map_err(|(_, error)| error)?[0];
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
            let statistics = found.iter().map(|own| (word(own), number(own))).collect();
            device.destroy_pipeline(pipeline, None);
            device.destroy_shader_module(module, None);
            device.destroy_pipeline_layout(layout, None);
            device.destroy_descriptor_set_layout(sets[0], None);
            Ok(Compiled { statistics })
        }
    }
}

/// Compiles all forms from the one whose number the environment says, a line each. It is a test for this program to be
/// able to start itself; alone it does nothing.
#[test]
fn compiles_for_the_process_that_asks() {
    let Some(first) = std::env::var(FIRST).ok().and_then(|number| number.parse::<usize>().ok()) else { return };
    let Some(compiler) = Compiler::open() else { return println!("NO DEVICE") };
    for (k, key) in kernels().iter().enumerate().skip(first) {
        // Before the compiler is asked: it may not return.
        println!("FORM {k}");
        match compiler.compile(key) {
            Ok(found) => found.statistics.iter().for_each(|(name, number)| println!("STAT {number} {name}")),
            Err(error) => println!("REFUSED {error}"),
        }
    }
    println!("DONE");
}

/// What a family's compiler says of all forms: statistics, or why there are none.
fn compiled_for(family: &str) -> Option<Vec<Result<Compiled, String>>> {
    let icd = radv()?;
    let forms = kernels().len();
    let mut found: Vec<Result<Compiled, String>> = Vec::with_capacity(forms);
    while found.len() < forms {
        let ended = Command::new(std::env::current_exe().unwrap())
            .args(["compilers::compiles_for_the_process_that_asks", "--exact", "--nocapture"])
            .env("VK_DRIVER_FILES", &icd)
            .env("RADV_FORCE_FAMILY", family)
            .env(FIRST, found.len().to_string())
            .output()
            .unwrap();
        for line in String::from_utf8_lossy(&ended.stdout).lines() {
            // The first line has what the test harness says before it.
            let line = line.rsplit_once("... ").map_or(line, |(_, rest)| rest);
            if line == "NO DEVICE" {
                return None;
            } else if line.starts_with("FORM ") {
                found.push(Ok(Compiled::default()));
            } else if let Some((number, name)) = line.strip_prefix("STAT ").and_then(|own| own.split_once(' ')) {
                if let Some(Ok(last)) = found.last_mut() {
                    last.statistics.insert(name.to_string(), number.parse().unwrap_or(0));
                }
            } else if let Some(why) = line.strip_prefix("REFUSED ") {
                *found.last_mut()? = Err(why.to_string());
            }
        }
        if !ended.status.success() {
            *found.last_mut()? = Err(format!("the compiler ended its process: {}", ended.status));
        }
    }
    Some(found)
}

/// The worst of a kernel's forms.
#[derive(Default)]
struct Worst {
    forms: usize,
    registers: u64,
    spilled: u64,
    scratch: u64,
    waves: Option<u64>,
    refused: Vec<String>,
}

/// A row a kernel and precision.
fn table(found: &[Result<Compiled, String>]) -> BTreeMap<(String, String), Worst> {
    let mut rows = BTreeMap::<(String, String), Worst>::new();
    for (key, found) in kernels().iter().zip(found) {
        let row = rows.entry((format!("{}:{}", key.path, key.entry), format!("{:?}", key.precision))).or_default();
        row.forms += 1;
        match found {
            Ok(own) => {
                row.registers = row.registers.max(own.of("VGPRs"));
                row.spilled = row.spilled.max(own.of("Spilled VGPRs"));
                row.scratch = row.scratch.max(own.of("Scratch size"));
                let waves = own.of("Subgroups per SIMD");
                row.waves = Some(row.waves.map_or(waves, |least| least.min(waves)));
            }
            Err(why) => row.refused.push(format!("{}: {why}", key.name())),
        }
    }
    rows
}

/// Registers of a thread in f32 with which two waves share what executes them, on 64 lanes.
const REGISTERS_F32: u64 = 128;

/// Kernels that spill, need scratch memory or too many registers in some form, and why. All others must not.
const BEYOND: [(&str, &str); 5] = [
    (
        "discrete/descent.wgsl:descend",
        "a thread keeps a curve's whole state: spatial curves need 200 registers, f64 spills",
    ),
    ("discrete/evaluate.wgsl:hessian", "a thread keeps all blocks of a window"),
    ("linalg/block_ring/lanes.wgsl:solve", "a lane keeps the blocks of all its kept vertices"),
    ("linalg/ring/lanes.wgsl:solve", "a lane keeps 32 rows with up to 4 right-hand sides"),
    ("linalg/ring/long.wgsl:substitute", "rows are indexed by a number that is not known when it is compiled"),
];

/// Forms at which a family's compiler ends its own process (Mesa 22.3.6).
const CRASHES: [(&str, &str); 1] = [("navi21", "linalg/ring/lanes.wgsl:solve")];

#[test]
fn compilers_of_cards_that_are_not_here_take_every_kernel() {
    let families = ["vega20", "navi21"];
    let found: Vec<_> = std::thread::scope(|scope| {
        let runs: Vec<_> = families.iter().map(|family| scope.spawn(|| compiled_for(family))).collect();
        runs.into_iter().map(|run| run.join().unwrap()).collect()
    });
    let mut faults = Vec::new();
    for (family, found) in families.into_iter().zip(found) {
        let Some(found) = found else { return eprintln!("skipped: there is no driver of AMD's cards") };
        println!("{family}: kernel, precision, forms, registers, spilled, scratch bytes a wave, waves");
        for ((kernel, precision), row) in table(&found) {
            let Worst { forms, registers, spilled, scratch, waves, refused } = row;
            println!("{kernel} {precision} {forms} {registers} {spilled} {scratch} {}", waves.unwrap_or(0));
            refused.iter().for_each(|why| println!("  {why}"));
            let is_known = BEYOND.iter().any(|(name, _)| *name == kernel);
            let is_wide = precision == "F32" && registers > REGISTERS_F32;
            if !is_known && (is_wide || spilled > 0 || scratch > 0) {
                faults.push(format!("{family}: {kernel} {precision}: {registers} registers, {spilled} spilled, {scratch} bytes of scratch"));
            }
            if !refused.is_empty() && !CRASHES.contains(&(family, kernel.as_str())) {
                faults.push(format!("{family}: {refused:?}"));
            }
        }
    }
    assert!(faults.is_empty(), "beyond the budget, and not in the list of those that are known to be: {faults:#?}");
}
