//! Files are written whole or not at all.

use std::io::{self, Write};
use std::path::Path;

use faircurve::Error;
use faircurve::io::{Output, WriteOptions, check_output, write_atomically};

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_failure_leaves_nothing_behind_and_the_old_file_untouched() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.csv");
    let fail = |out: &mut Output| {
        out.write_all(b"half")?;
        Err(io::ErrorKind::StorageFull.into())
    };
    let error = write_atomically(&path, false, fail).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("cannot write {}: no storage space; nothing was left half-written", path.display())
    );
    assert!(entries(folder.path()).is_empty());
    std::fs::write(&path, "old").unwrap();
    assert!(matches!(write_atomically(&path, true, fail), Err(Error::Write { .. })));
    assert_eq!((entries(folder.path()), std::fs::read(&path).unwrap()), (vec!["out.csv".into()], b"old".to_vec()));
}

#[test]
fn an_existing_file_is_replaced_only_when_allowed_even_if_it_appears_meanwhile() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.csv");
    let racing = |out: &mut Output| {
        std::fs::write(&path, "other")?;
        out.write_all(b"mine")
    };
    let sentence = format!("{} exists already: give `overwrite` to replace it, or another name", path.display());
    assert_eq!(write_atomically(&path, false, racing).unwrap_err().to_string(), sentence);
    assert_eq!(write_atomically(&path, false, |_| Ok(())).unwrap_err().to_string(), sentence);
    assert_eq!((entries(folder.path()).len(), std::fs::read(&path).unwrap()), (1, b"other".to_vec()));
    write_atomically(&path, true, |out| out.write_all(b"mine")).unwrap();
    assert_eq!((entries(folder.path()).len(), std::fs::read(&path).unwrap()), (1, b"mine".to_vec()));
}

#[test]
fn a_missing_folder_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no").join("out.csv");
    let sentence = format!(
        "cannot write {}: there is no folder {}; nothing was left half-written",
        path.display(),
        folder.path().join("no").display()
    );
    assert_eq!(write_atomically(&path, false, |_| Ok(())).unwrap_err().to_string(), sentence);
    let options = WriteOptions { overwrite: true, ..WriteOptions::default() };
    assert_eq!(check_output(&path, &options).unwrap_err().to_string(), sentence);
}

#[cfg(unix)]
#[test]
fn links_are_followed_permissions_kept_and_devices_written_straight() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (folder.path().join("real"), folder.path().join("link"));
    write_atomically(&path, false, |out| out.write_all(b"1")).unwrap();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&path) & 0o600, 0o600);
    std::fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
    symlink(&path, &link).unwrap();
    write_atomically(&link, true, |out| out.write_all(b"2")).unwrap();
    assert!(link.is_symlink());
    assert_eq!((std::fs::read(&path).unwrap(), mode(&path)), (b"2".to_vec(), 0o640));
    write_atomically("/dev/null", false, |out| out.write_all(b"3")).unwrap();
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_sentence() {
    let error = write_atomically("/dev/full", false, |out| out.write_all(b"1")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot write /dev/full: No space left on device (os error 28); nothing was left half-written"
    );
}
