//! SVG: a sheet of shaded pictures, one panel per grid.

use std::io::{self, Write};

use super::GridWrite;
use crate::grids::Grids;
use crate::picture::{Net, Relief, ReliefSheet};

/// Draws the grids with their nets.
pub(super) fn write(out: &mut dyn Write, grids: &Grids, options: &GridWrite) -> io::Result<()> {
    let net = |i: usize| {
        let net = options.net.filter(|net| i < net.len() && net.dimension() == grids.dimension())?;
        Some(Net { shape: net.shape(i), values: net.grid(i) })
    };
    let relief = |i: usize| Relief {
        title: if grids.len() > 1 { format!("grid {i}") } else { String::new() },
        dimension: grids.dimension(),
        shape: grids.shape(i),
        values: grids.grid(i),
        net: net(i),
        range: None,
    };
    let sheet = ReliefSheet {
        title: options.title.clone(),
        caption: options.caption.clone(),
        reliefs: (0..grids.len()).map(relief).collect(),
        ..ReliefSheet::default()
    };
    sheet.write(out)
}
