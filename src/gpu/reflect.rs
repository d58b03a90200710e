//! What naga knows of a composed kernel: bindings by name, workgroup size and memory, struct
//! layouts.

use naga::proc::Layouter;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Module, StorageAccess, TypeInner};

use crate::error::{Error, Result};
use crate::sort;

/// How an entry point uses a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `var<uniform>`
    Uniform,
    /// `var<storage, read>`
    Read,
    /// `var<storage, read_write>`
    ReadWrite,
}

/// A buffer that an entry point uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// The variable's name in the source.
    pub name: String,
    /// Its `@binding`. The group is always 0.
    pub binding: u32,
    /// How it is used.
    pub access: Access,
    /// Bytes of the type, or of one element of a run-time sized array.
    pub element_bytes: u32,
}

/// What one entry point needs of the host and of the device.
#[derive(Clone, Debug)]
pub struct Reflection {
    /// The buffers it uses, by binding number.
    pub bindings: Vec<Binding>,
    /// Threads of a workgroup.
    pub workgroup_size: u32,
    /// Workgroup memory it uses.
    pub workgroup_bytes: u32,
}

/// Name, offset and size in bytes of every member of a WGSL struct, and the size of the struct.
pub type StructLayout = (Vec<(String, u32, u32)>, u32);

/// Parses and validates a composed kernel.
///
/// # Errors
/// [`Error::Kernel`] with naga's message and the place in the composed source.
pub fn parse(kernel: &str, wgsl: &str) -> Result<(Module, ModuleInfo)> {
    let refused = |message: String| Error::Kernel { kernel: kernel.to_string(), message };
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|error| refused(error.emit_to_string(wgsl)))?;
    let capabilities = Capabilities::FLOAT64 | Capabilities::SUBGROUP;
    let mut validator = Validator::new(ValidationFlags::all(), capabilities);
    validator
        .subgroup_stages(naga::valid::ShaderStages::COMPUTE)
        .subgroup_operations(naga::valid::SubgroupOperationSet::all());
    let info = validator.validate(&module).map_err(|error| refused(error.emit_to_string(wgsl)))?;
    Ok((module, info))
}

/// Reflects one entry point of a composed kernel.
///
/// # Errors
/// Errors of [`parse`], and a missing entry point.
pub fn reflect(kernel: &str, wgsl: &str, entry: &str) -> Result<Reflection> {
    let (module, info) = parse(kernel, wgsl)?;
    let index = module.entry_points.iter().position(|point| point.name == entry);
    let index =
        index.ok_or_else(|| Error::Kernel { kernel: kernel.into(), message: format!("no entry point {entry}") })?;
    let uses = info.get_entry_point(index);
    let mut layouter = Layouter::default();
    layouter
        .update(module.to_ctx())
        .map_err(|error| Error::Kernel { kernel: kernel.into(), message: error.to_string() })?;

    let mut bindings = Vec::new();
    let mut workgroup_bytes = 0;
    for (_, variable) in module.global_variables.iter().filter(|(handle, _)| !uses[*handle].is_empty()) {
        let access = match variable.space {
            AddressSpace::WorkGroup => {
                workgroup_bytes += layouter[variable.ty].size.next_multiple_of(16);
                continue;
            }
            AddressSpace::Uniform => Access::Uniform,
            AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => Access::ReadWrite,
            AddressSpace::Storage { .. } => Access::Read,
            _ => continue,
        };
        let element = match module.types[variable.ty].inner {
            TypeInner::Array { base, .. } => base,
            _ => variable.ty,
        };
        bindings.push(Binding {
            name: variable.name.clone().unwrap_or_default(),
            binding: variable.binding.map_or(0, |binding| binding.binding),
            access,
            element_bytes: layouter[element].size,
        });
    }
    sort::by(&mut bindings, |a, b| a.binding.cmp(&b.binding));
    let workgroup_size = module.entry_points[index].workgroup_size.iter().product();
    Ok(Reflection { bindings, workgroup_size, workgroup_bytes })
}

/// The layout of the struct called `name`.
///
/// # Errors
/// Errors of [`parse`], and a missing struct.
pub fn struct_layout(kernel: &str, wgsl: &str, name: &str) -> Result<StructLayout> {
    let (module, _) = parse(kernel, wgsl)?;
    let mut layouter = Layouter::default();
    layouter
        .update(module.to_ctx())
        .map_err(|error| Error::Kernel { kernel: kernel.into(), message: error.to_string() })?;
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    match found.map(|(_, ty)| &ty.inner) {
        Some(TypeInner::Struct { members, span }) => {
            let layout = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset, layouter[m.ty].size));
            Ok((layout.collect(), *span))
        }
        _ => Err(Error::Kernel { kernel: kernel.into(), message: format!("no struct {name}") }),
    }
}

/// Asserts that a Rust struct has the members, offsets and size of a kernel's WGSL struct of that
/// name.
#[cfg(test)]
macro_rules! assert_layout {
    ($key:expr, $type:ident { $($field:ident),+ $(,)? }) => {{
        let name = stringify!($type);
        let (members, size) = $crate::gpu::reflect::struct_layout(&$key.name(), &$key.wgsl(), name).unwrap();
        let zero: $type = bytemuck::Zeroable::zeroed();
        let own = vec![$((
            stringify!($field).to_string(),
            std::mem::offset_of!($type, $field) as u32,
            std::mem::size_of_val(&zero.$field) as u32,
        )),+];
        assert_eq!(members, own, "members of {name}: name, offset, bytes");
        assert_eq!(size as usize, std::mem::size_of::<$type>(), "bytes of {name}");
    }};
}
#[cfg(test)]
pub(crate) use assert_layout;
