//! Dispatches with their buffers, so that another WGSL compiler can replay any kernel.

use super::reflect::Access;

/// One buffer of a captured dispatch.
#[derive(Clone, Debug)]
pub struct CapturedBuffer {
    /// Its `@binding` in group 0.
    pub binding: u32,
    /// Its name in the source.
    pub name: String,
    /// How the kernel uses it.
    pub access: Access,
    /// Its contents before the dispatch.
    pub before: Vec<u8>,
    /// Its contents after the dispatch, if the kernel may have written it.
    pub after: Option<Vec<u8>>,
}

/// One dispatch, with everything needed to run it again elsewhere.
#[derive(Clone, Debug)]
pub struct CapturedDispatch {
    /// The kernel's name.
    pub kernel: String,
    /// The composed source.
    pub wgsl: String,
    /// The entry point.
    pub entry: String,
    /// Workgroups.
    pub groups: [u32; 3],
    /// Its buffers.
    pub buffers: Vec<CapturedBuffer>,
}
