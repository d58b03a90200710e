//! The adapters of the machine, their order, and what each can do.

use std::sync::{Mutex, PoisonError};

use wgpu::{Adapter, DeviceType, Features, Instance};

use super::summary::AdapterSummary;
use crate::sort;

/// Lanes for each curve in the subgroup kernels. No subgroup may be smaller.
pub(crate) const SUBGROUP_LANES: u32 = 8;

/// The connection to the drivers. Each process, forked ones too, opens one and keeps it.
///
/// NVIDIA's library takes static thread-local storage whenever it is loaded, and never gives it
/// back. After some 28 connections a process could open no more.
pub(crate) fn instance() -> Instance {
    static OPEN: Mutex<Vec<(u32, Instance)>> = Mutex::new(Vec::new());
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, instance)) = open.iter().find(|(of, _)| *of == process) {
        return instance.clone();
    }
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    let instance = Instance::new(descriptor);
    open.push((process, instance.clone()));
    instance
}

/// All adapters of the machine, in the order of `gpu:N` and [`Device::gpu`](crate::Device::gpu).
///
/// Hardware comes before software, then faster kinds first. The rest is by PCI bus address and
/// name.
pub(crate) fn sorted(instance: &Instance) -> Vec<Adapter> {
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let key = |adapter: &Adapter| {
        let info = adapter.get_info();
        let rank = match info.device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        (rank, info.device_pci_bus_id, info.name)
    };
    sort::by(&mut adapters, |a, b| key(a).cmp(&key(b)));
    adapters
}

pub(crate) fn summarise(info: &wgpu::AdapterInfo, features: Features) -> AdapterSummary {
    AdapterSummary {
        name: info.name.clone(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_string(),
        backend: info.backend.to_string(),
        kind: match info.device_type {
            DeviceType::DiscreteGpu => "discrete GPU",
            DeviceType::IntegratedGpu => "integrated GPU",
            DeviceType::VirtualGpu => "virtual GPU",
            DeviceType::Cpu => "software",
            DeviceType::Other => "other",
        },
        pci_bus_id: info.device_pci_bus_id.clone(),
        has_f64: features.contains(Features::SHADER_F64),
        has_subgroups: features.contains(Features::SUBGROUP) && info.subgroup_min_size >= SUBGROUP_LANES,
        subgroup_sizes: (info.subgroup_min_size, info.subgroup_max_size),
        has_timestamps: features.contains(Features::TIMESTAMP_QUERY),
    }
}

/// What every adapter of the machine is and can do, in the order of `gpu:N`.
pub fn adapters() -> Vec<AdapterSummary> {
    sorted(&instance()).iter().map(|adapter| summarise(&adapter.get_info(), adapter.features())).collect()
}
