//! Where TRK's coordinates are: from the corner of the first voxel, in millimetres along its axes.

use super::Bytes;
use super::CutOff;
use glam::{DAffine3, DMat3, DVec3};
use nalgebra::{Matrix3, SVD};

pub(super) const HEADER_BYTES: usize = 1000;

/// Places in the header.
const DIMENSIONS: usize = 6;
const VOXEL_SIZE: usize = 12;
const MATRIX: usize = 440;
const VOXEL_ORDER: usize = 948;

/// The axes that letters name, and whether they lead up them.
const LETTERS: [(u8, usize, bool); 6] =
    [(b'L', 0, false), (b'R', 0, true), (b'P', 1, false), (b'A', 1, true), (b'I', 2, false), (b'S', 2, true)];

/// The map from a file's coordinates to millimetres (RAS+). `None` if the header gives no map that
/// can be undone.
///
/// Coordinates divided by the sizes of voxels, less one half, are voxels in the order that the
/// header names. Axes are exchanged or turned round to the order of the matrix, which leads to
/// millimetres.
pub(super) fn to_millimetres(header: Bytes, version: i32) -> Result<Option<DAffine3>, CutOff> {
    let at = |at: usize| Bytes { at, ..header };
    let mut sizes = at(VOXEL_SIZE);
    let size = DVec3::new(sizes.f32()?, sizes.f32()?, sizes.f32()?);
    let mut shape = at(DIMENSIONS);
    let shape = [f64::from(shape.i16()?), f64::from(shape.i16()?), f64::from(shape.i16()?)];
    let mut matrix = at(MATRIX);
    let mut rows = [[0.0; 4]; 4];
    for number in rows.iter_mut().flatten() {
        *number = matrix.f32()?;
    }
    // Without a matrix voxels are where they are.
    let plain = version < 2 || rows[3][3] == 0.0;
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let to_ras = match plain {
        true => DAffine3::IDENTITY,
        false => DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) },
    };
    let mut order = header.bytes[VOXEL_ORDER..].first_chunk::<3>().copied().unwrap_or_default();
    order.make_ascii_uppercase();
    let named = order.map(|letter| LETTERS.iter().find(|(own, ..)| *own == letter));
    let named = match named {
        [Some(a), Some(b), Some(c)] => [a, b, c].map(|&(_, axis, up)| (axis, up)),
        // TrackVis' own order.
        _ => [(0, false), (1, false), (2, true)],
    };
    let voxels = DAffine3::from_translation(DVec3::splat(-0.5)) * DAffine3::from_scale(size.recip());
    let whole = to_ras * reordered(named, axes(to_ras.matrix3), shape) * voxels;
    let usable = whole.is_finite() && whole.matrix3.determinant() != 0.0 && whole.inverse().is_finite();
    Ok(usable.then_some(whole))
}

/// The axis that each column of a matrix is nearest to, no two the same one, and whether it leads
/// up it.
///
/// The nearest rotation is looked at, as nibabel's `io_orientation` does.
fn axes(matrix: DMat3) -> [(usize, bool); 3] {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|column| column.normalize_or_zero().to_array());
    let svd = SVD::new(Matrix3::from_fn(|row, column| columns[column][row]), true, true);
    let Some(mut rotation) = svd.u.zip(svd.v_t).map(|(u, v)| u * v) else { return [(0, true), (1, true), (2, true)] };
    std::array::from_fn(|column| {
        let of = |row: usize| rotation[(row, column)].abs();
        let axis = (0..3).max_by(|&a, &b| of(a).total_cmp(&of(b))).unwrap_or(column);
        let up = rotation[(axis, column)] >= 0.0;
        // The next columns are near other axes.
        (0..3).for_each(|column| rotation[(axis, column)] = 0.0);
        (axis, up)
    })
}

/// The map from voxels along some axes to voxels along others, which may lead the other way.
fn reordered(from: [(usize, bool); 3], to: [(usize, bool); 3], shape: [f64; 3]) -> DAffine3 {
    let (mut matrix, mut translation) = ([[0.0; 3]; 3], [0.0; 3]);
    for (k, &(axis, up)) in to.iter().enumerate() {
        let Some(own) = from.iter().position(|(other, _)| *other == axis) else { continue };
        if from[own].1 == up {
            matrix[own][k] = 1.0;
        } else {
            matrix[own][k] = -1.0;
            translation[k] = shape[own] - 1.0;
        }
    }
    DAffine3 { matrix3: DMat3::from_cols_array_2d(&matrix), translation: translation.into() }
}

/// A header for voxels of a millimetre, along x, y and z.
pub(super) fn plain_header() -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"TRACK");
    for k in 0..3 {
        put(DIMENSIONS + 2 * k, &1i16.to_le_bytes());
        put(VOXEL_SIZE + 4 * k, &1f32.to_le_bytes());
    }
    (0..4).for_each(|k| put(MATRIX + 20 * k, &1f32.to_le_bytes()));
    put(VOXEL_ORDER, b"RAS");
    put(992, &2i32.to_le_bytes());
    put(996, &1000i32.to_le_bytes());
    header
}
