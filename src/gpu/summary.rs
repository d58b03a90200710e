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
    /// An adapter of a kind, without f64 and subgroups, for tests of what is chosen for it.
    #[cfg(test)]
    pub(crate) fn of_kind(kind: &'static str) -> Self {
        AdapterSummary {
            name: "a card".into(),
            driver: String::new(),
            backend: String::new(),
            kind,
            pci_bus_id: String::new(),
            has_f64: false,
            has_subgroups: false,
            subgroup_sizes: (32, 32),
            has_timestamps: false,
        }
    }

    /// Threads that the adapter works on at once, by its kind: an estimate, since no driver tells.
    ///
    /// Registers limit it: of the 65,536 of a multiprocessor a thread of a large kernel takes some
    /// 128. An NVIDIA H100 (132 multiprocessors) runs 67,584 threads, an RTX 4070 (46) 23,552:
    /// discrete GPUs count as 49,152, between both. An Apple M2 has 10 cores of some 1,024:
    /// integrated GPUs count as 10,240. Of software it is the width of a vector register.
    pub fn threads(&self) -> usize {
        match self.kind {
            "integrated GPU" => 10_240,
            "software" => 8,
            _ => 49_152,
        }
    }

    /// Whether the adapter is software that runs on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }
}
