//! Files written whole or not at all.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use crate::error::{Error, Result};

/// Where bytes go while a file is written.
#[non_exhaustive]
pub enum Output {
    /// Standard output.
    Stdout(io::Stdout),
    /// A file that is not yet in its place, or a device or pipe.
    File(File),
}

impl Output {
    /// The file behind the output, if it can seek.
    pub(crate) fn seekable(&mut self) -> Option<&mut File> {
        match self {
            Output::File(file) if file.metadata().is_ok_and(|data| data.is_file()) => Some(file),
            _ => None,
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Output::Stdout(out) => out.write(bytes),
            Output::File(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Output::Stdout(out) => out.flush(),
            Output::File(file) => file.flush(),
        }
    }
}

/// Writes a file whole or not at all.
///
/// The bytes go to a temporary file in the same folder. It is flushed to the disk, then renamed.
/// Until that last step nothing is seen at `path`. After a failure nothing new is left in the
/// folder, and what stood at `path` is untouched.
///
/// - `-` is standard output.
/// - A device or a pipe is written to directly, whatever `overwrite` says.
/// - A symbolic link is followed.
/// - A file that is replaced keeps its permissions.
///
/// ```
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("report.json");
/// use std::io::Write;
/// faircurve::io::write_atomically(&path, false, |out| out.write_all(b"{}"))?;
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// - [`Error::Exists`] if `path` exists and `overwrite` is false.
/// - [`Error::Write`] with the error of the system or of `fill`.
/// - [`Error::Stream`] for standard output.
pub fn write_atomically(
    path: impl AsRef<Path>,
    overwrite: bool,
    fill: impl FnOnce(&mut Output) -> io::Result<()>,
) -> Result<()> {
    let mut fill = Some(fill);
    write_whole(path.as_ref(), overwrite, &mut |out| fill.take().expect("a file is filled once")(out))
}

/// Writes all of a file's bytes.
type Fill<'a> = &'a mut dyn FnMut(&mut Output) -> io::Result<()>;

fn write_whole(path: &Path, overwrite: bool, fill: Fill) -> Result<()> {
    let failed = |source| Error::Write { path: path.to_path_buf(), source };
    match target(path, overwrite)? {
        Target::Stdout => {
            let mut out = Output::Stdout(io::stdout());
            fill(&mut out).and_then(|()| out.flush()).map_err(|source| Error::Stream { source })
        }
        Target::Device => {
            let mut out = Output::File(File::options().write(true).open(path).map_err(failed)?);
            fill(&mut out).and_then(|()| out.flush()).map_err(failed)
        }
        Target::File(place) => replace(&place, overwrite, fill).map_err(|source| {
            if source.kind() == io::ErrorKind::AlreadyExists && !overwrite {
                Error::Exists { path: path.to_path_buf() }
            } else {
                failed(source)
            }
        }),
    }
}

enum Target {
    Stdout,
    Device,
    File(PathBuf),
}

/// What stands behind the path, or why it cannot be written.
///
/// This is all that can be known before there are bytes to write.
fn target(path: &Path, overwrite: bool) -> Result<Target> {
    if path == Path::new("-") {
        return Ok(Target::Stdout);
    }
    let failed = |source| Error::Write { path: path.to_path_buf(), source };
    match std::fs::metadata(path) {
        Ok(data) if data.is_dir() => Err(failed(io::ErrorKind::IsADirectory.into())),
        Ok(data) if !data.is_file() => Ok(Target::Device),
        Ok(_) if !overwrite => Err(Error::Exists { path: path.to_path_buf() }),
        Ok(_) => std::fs::canonicalize(path).map(Target::File).map_err(failed),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let folder = folder(path);
            match folder.is_dir() {
                true => Ok(Target::File(path.to_path_buf())),
                false => Err(failed(io::Error::new(
                    io::ErrorKind::NotFound,
                    format!("there is no folder {}", folder.display()),
                ))),
            }
        }
        Err(error) => Err(failed(error)),
    }
}

/// Whether a file could be written there, before anything is computed.
pub(super) fn check(path: &Path, overwrite: bool) -> Result<()> {
    target(path, overwrite).map(drop)
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// The temporary files of all writes under way.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is half written, then ends the process.
///
/// Meanwhile no write begins, and none comes to its end.
#[cfg(all(unix, feature = "cli"))]
pub(crate) fn give_up(end: impl FnOnce()) {
    let unfinished = unfinished();
    for path in &*unfinished {
        // Nothing is left to be done about a file that cannot be removed.
        let _ = std::fs::remove_file(path);
    }
    end();
}

fn replace(place: &Path, overwrite: bool, fill: Fill) -> io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".faircurve-").suffix(".part");
    // The mode of any new file, less the umask, instead of the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut listed = unfinished();
    let (file, temporary) = builder.tempfile_in(folder(place))?.into_parts();
    let path = temporary.to_path_buf();
    listed.push(path.clone());
    drop(listed);
    let written = write_through(file, temporary, place, overwrite, fill);
    unfinished().retain(|other| *other != path);
    written
}

/// Fills a temporary file, and brings it to its place.
fn write_through(file: File, temporary: TempPath, place: &Path, overwrite: bool, fill: Fill) -> io::Result<()> {
    let mut out = Output::File(file);
    fill(&mut out)?;
    let Output::File(file) = out else { unreachable!("made four lines above") };
    file.sync_all()?;
    // WebAssembly has no permissions.
    #[cfg(not(target_os = "wasi"))]
    if overwrite && let Ok(data) = std::fs::metadata(place) {
        file.set_permissions(data.permissions())?;
    }
    drop(file);
    let _no_end_meanwhile = unfinished();
    if overwrite {
        return temporary.persist(place).map_err(|error| error.error);
    }
    match temporary.persist_noclobber(place) {
        // Some file systems cannot rename without clobbering. There the code looks first, and then
        // renames.
        Err(error) if error.error.kind() != io::ErrorKind::AlreadyExists && !place.exists() => {
            error.path.persist(place).map_err(|error| error.error)
        }
        result => result.map_err(|error| error.error),
    }
}
