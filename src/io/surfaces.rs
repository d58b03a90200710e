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
/// | others | those of [`named`] |
///
/// The name of a file ends at the first comma. The file holds one [grid](grids) with one value a point.
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

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::DVec3;
    use tempfile::TempDir;

    use super::*;
    use crate::grids::Grids;

    fn folder() -> TempDir {
        let folder = TempDir::new().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("one.csv", "0,1,2\n3,4,5\n");
        write("two.csv", "0,1\n3,4\n\n5,6\n7,8\n");
        write("gap.csv", "nan,nan\n,nan\n");
        write("row.csv", "0,1,4\n");
        write("words.csv", "a,b\n1,2\n");
        let points = Grids::uniform(3, [2, 2], vec![0.0; 12]).unwrap();
        grids::write(folder.path().join("points.npz"), &points, &grids::GridWrite::default()).unwrap();
        let heights = Grids::uniform(1, [2, 3], (0..6).map(f64::from).collect()).unwrap();
        grids::write(folder.path().join("one.npz"), &heights, &grids::GridWrite::default()).unwrap();
        folder
    }

    #[test]
    fn grids_of_files_stand_where_their_numbers_say() {
        let folder = folder();
        let of = |name: &str| surface_of(&format!("grid:{}/{name}", folder.path().display())).unwrap();
        for (name, x, y) in [
            ("one.csv", 1.0, 1.0),
            ("one.npz", 1.0, 1.0),
            ("one.csv,30", 30.0, 30.0),
            ("one.csv, 30, -20", 30.0, -20.0),
            ("one.csv,30,-20,1e5,2e5", 100_030.0, 199_980.0),
        ] {
            // h = column + 3 row
            assert_eq!(of(name).value(DVec3::new(x, y, 10.0)), 6.0, "{name}");
        }
        assert!(of("one.csv,30").unknown(DVec3::new(61.0, 0.0, 0.0)).is_some());
        assert!(of("one.csv").name().starts_with("the terrain of ") && of("one.csv").name().ends_with("one.csv"));
    }

    #[test]
    fn words_are_passed_on_and_an_unknown_one_is_told_of_files_too() {
        assert_eq!(surface_of("torus:2,1").unwrap().name(), "the torus of radii 2 and 1");
        assert!(is_file("grid:a.csv") && !is_file("torus:2,1"));
        let error = |text: &str| surface_of(text).unwrap_err().to_string();
        assert!(error("ball").starts_with("there is no surface 'ball': use sphere:R"), "{}", error("ball"));
        assert!(error("ball").ends_with(", cone:degrees, grid:FILE, mesh:FILE.obj"), "{}", error("ball"));
        assert!(error("torus:2").ends_with("write torus:R,r"), "{}", error("torus:2"));
    }

    #[test]
    fn files_that_make_no_surface_are_refused_with_their_name() {
        let folder = folder();
        let path = folder.path().display().to_string();
        for (name, what) in [
            ("none.csv", "none.csv: "),
            ("two.csv", "two.csv: it holds 2 grids, and a surface is made of one"),
            ("points.npz", "points.npz: its points have 3 values each, and heights are one value a point"),
            ("gap.csv", "gap.csv: none of the 2 × 2 heights of a height field is a finite number"),
            ("row.csv", "row.csv: a height field of 1 × 3 heights is no surface"),
            ("words.csv", "words.csv, line 1: the row holds \"a\", \"b\" as a header does"),
            ("one.txt", "one.txt"),
            ("one.csv,0", "the spacing of columns is 0"),
            ("one.csv,north", "\"north\" in "),
            ("one.csv,1,2,3", "has 3 numbers after its file"),
        ] {
            let error = surface_of(&format!("grid:{path}/{name}")).unwrap_err().to_string();
            assert!(error.contains(what) && !error.contains("panicked"), "{name}: {error}");
        }
        assert!(surface_of("mesh:").unwrap_err().to_string().contains("names no file: write mesh:FILE.obj"));
        assert!(surface_of("mesh:none.obj").unwrap_err().to_string().contains("none.obj"));
        for text in ["grid", "grid:", "grid:,30"] {
            let error = surface_of(text).unwrap_err().to_string();
            assert!(error.contains("names no file: write grid:FILE"), "{error}");
        }
    }
}
