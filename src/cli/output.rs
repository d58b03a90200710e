//! The files of a run: their names, and what is refused before any work is done.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use faircurve::io::{Format, WriteOptions, check_output, write_atomically};
use faircurve::{Error, Result};

use super::has_extension;

/// Checks every output before anything is computed: none may be there already (unless `force`),
/// each folder must take a file, and no two may be the same. `outputs` pairs the option with its
/// path.
///
/// # Errors
/// The first output that cannot be written, in the order given.
pub fn check(outputs: &[(&str, &Path)], force: bool) -> Result<()> {
    for (k, (option, path)) in outputs.iter().enumerate() {
        if let Some((other, _)) = outputs[..k].iter().find(|(_, earlier)| same(earlier, path)) {
            let path = path.display();
            return Err(Error::argument(format!("{other} and {option} both write {path}: give one another name")));
        }
        // Only the place is checked here. A report or a picture has another format.
        check_output(path, &WriteOptions { format: Some(Format::Csv), overwrite: force, ..WriteOptions::default() })?;
    }
    Ok(())
}

/// Checks that a picture's name ends in .svg.
///
/// # Errors
/// Another extension.
pub fn check_picture(picture: Option<&Path>) -> Result<()> {
    match picture.filter(|path| !has_extension(path, &["svg"]) && !is_stdio(path)) {
        Some(path) => {
            let path = path.display();
            Err(Error::argument(format!("--picture {path}: pictures are SVG, give a name that ends in .svg")))
        }
        None => Ok(()),
    }
}

/// Whether two paths name one file, as far as can be told before it exists.
fn same(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| -> Option<PathBuf> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(fs::canonicalize(folder).ok()?.join(path.file_name()?))
    };
    a == b || place(a).is_some_and(|place_a| Some(place_a) == place(b))
}

/// Writes a text file whole or not at all (`-`: standard output).
///
/// # Errors
/// The file cannot be written, or has appeared since it was checked and may not be replaced.
pub fn write(path: &Path, force: bool, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    write_atomically(path, force, |out| {
        let mut out = BufWriter::with_capacity(1 << 16, out);
        fill(&mut out)?;
        out.flush()
    })
}

/// Whether this is standard input or output.
pub fn is_stdio(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The file's name without folder and extensions; none for standard input.
pub fn title(input: &Path) -> Option<String> {
    let stem =
        if has_extension(input, &["gz"]) { Path::new(input.file_stem()?).file_stem()? } else { input.file_stem()? };
    (!is_stdio(input)).then(|| stem.to_string_lossy().into_owned())
}
