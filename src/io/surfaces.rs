//! Surfaces by their words, or from files ([`surface_of`]).

use std::sync::Arc;

use super::{grids, read_mesh};
use crate::error::{Error, Result, quoted};
use crate::surface::{HeightField, Surface, is_named, named};

/// A reader of surfaces: what stands after its word, and the whole.
type Reader = fn(&str, &str) -> Result<Arc<dyn Surface>>;

/// The words of surfaces that are read from files, with how each is written.
const FILES: [(&str, &str, Reader); 2] = [("grid", "grid:FILE", grid), ("mesh", "mesh:FILE.obj", mesh)];

/// Whether a text names a surface that [`surface_of`] reads from a file.
pub fn is_file(text: &str) -> bool {
    reader(text).is_some()
}

fn reader(text: &str) -> Option<(Reader, &str)> {
    let (word, rest) = text.split_once(':').unwrap_or((text, ""));
    FILES.iter().find(|(own, ..)| *own == word).map(|(_, _, read)| (*read, rest))
}

/// The surface of a word and its sizes, or of a file.
///
/// | word | surface |
/// |---|---|
/// | `grid:FILE` | the [height field](HeightField) of the grid in a file, CSV or NPZ, with column 0 of row 0 at (0, 0) |
/// | `grid:FILE,D` | that with nodes D apart, 1 if it is not given |
/// | `grid:FILE,DX,DY` | that with columns DX and rows DY apart; DY below 0 where rows go from north to south |
/// | `grid:FILE,DX,DY,X0,Y0` | that with column 0 of row 0 at (X0, Y0) |
/// | `mesh:FILE.obj` | the [smooth surface](crate::surface::Mesh) through the vertices of triangles, as [`read_mesh`] reads them |
/// | others | as [`named`] reads them |
///
/// The name of a file ends at the first comma. The file holds one [grid](grids) with one value a
/// point.
///
/// ```
/// use faircurve::io::surfaces::surface_of;
/// let terrain = surface_of("grid:examples/data/heights.csv,30")?;
/// assert_eq!(terrain.name(), "the terrain of examples/data/heights.csv");
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - Those of [`named`].
/// - A file that cannot be read, holds no grid, several grids, or several values a point.
/// - Those of [`read_mesh`].
/// - Numbers after the file that are none, or another number of them than 1, 2 or 4.
/// - Those of [`HeightField`]: no heights at all, fewer than two rows or columns, a spacing of 0.
pub fn surface_of(text: &str) -> Result<Arc<dyn Surface>> {
    match reader(text) {
        Some((read, rest)) => read(rest, text),
        None if is_named(text) => named(text),
        None => named(text).map_err(|error| match error {
            Error::Argument(why) => {
                let forms: Vec<&str> = FILES.iter().map(|(_, form, _)| *form).collect();
                Error::Argument(format!("{why}, {}", forms.join(", ")))
            }
            other => other,
        }),
    }
}

fn grid(rest: &str, text: &str) -> Result<Arc<dyn Surface>> {
    let refuse = |why: String| Err(Error::Argument(why));
    let mut parts = rest.split(',').map(str::trim);
    let file = parts.next().unwrap_or_default();
    if file.is_empty() {
        return refuse(format!("{} names no file: write grid:FILE, such as grid:heights.csv,30", quoted(text)));
    }
    let mut numbers = Vec::new();
    for part in parts {
        match part.parse::<f64>() {
            Ok(number) => numbers.push(number),
            Err(_) => {
                return refuse(format!(
                    "{} in {} is no number: write grid:FILE,DX,DY,X0,Y0, with a file whose name has no comma",
                    quoted(part),
                    quoted(text)
                ));
            }
        }
    }
    let (spacing, origin) = match numbers[..] {
        [] => ([1.0; 2], [0.0; 2]),
        [d] => ([d; 2], [0.0; 2]),
        [dx, dy] => ([dx, dy], [0.0; 2]),
        [dx, dy, x, y] => ([dx, dy], [x, y]),
        _ => {
            return refuse(format!(
                "{} has {} numbers after its file: give one spacing, two spacings, or two spacings and the place of \
                 row 0 and column 0, as in grid:FILE,DX,DY,X0,Y0",
                quoted(text),
                numbers.len()
            ));
        }
    };
    let field = heights(file)?.with_spacing(spacing)?.with_origin(origin)?;
    Ok(Arc::new(field.with_name(format!("the terrain of {file}"))))
}

fn mesh(rest: &str, text: &str) -> Result<Arc<dyn Surface>> {
    match rest.trim() {
        "" => Err(Error::Argument(format!("{} names no file: write mesh:FILE.obj", quoted(text)))),
        file => Ok(Arc::new(read_mesh(file)?)),
    }
}

/// The height field of the one grid in a file.
fn heights(file: &str) -> Result<HeightField> {
    let wrong = |message: String| Error::Parse { file: file.into(), line: None, message };
    let grids = grids::read(file, None)?;
    if grids.len() != 1 {
        let message = format!("it holds {} grids, and a surface is made of one: keep one of them", grids.len());
        return Err(wrong(message));
    }
    if grids.dimension() != 1 {
        return Err(wrong(format!(
            "its points have {} values each, and heights are one value a point: keep the heights alone",
            grids.dimension()
        )));
    }
    HeightField::new(grids.shape(0), grids.grid(0).to_vec()).map_err(|error| wrong(error.to_string()))
}
