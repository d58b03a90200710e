//! [`AdapterSummary`]: an adapter in words and numbers.

/// What an adapter is and can do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Name of the hardware.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan, Metal or DirectX 12.
    pub backend: String,
    /// `discrete GPU`, `integrated GPU`, `software` …
    pub kind: &'static str,
    /// Bus address, if the backend knows it.
    pub pci_bus_id: String,
    /// Whether kernels can compute in f64.
    pub has_f64: bool,
    /// Whether lanes can exchange values without memory, eight or more at a time.
    pub has_subgroups: bool,
    /// Smallest and largest subgroup.
    pub subgroup_sizes: (u32, u32),
    /// Whether kernels can be timed on the device.
    pub has_timestamps: bool,
}

impl AdapterSummary {
    /// Whether the adapter is software that runs on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }
}
