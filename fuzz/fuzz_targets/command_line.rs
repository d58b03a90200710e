#![no_main]

use std::sync::OnceLock;

use tempfile::TempDir;

/// The folder that all runs share: the files that they read, and whatever they write.
static FOLDER: OnceLock<TempDir> = OnceLock::new();

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let folder = FOLDER.get_or_init(|| {
        let folder = TempDir::new().expect("a folder for temporary files");
        std::env::set_current_dir(&folder).expect("a folder that was just made");
        folder
    });
    let Some(arguments) = faircurve_fuzz::arguments(data, folder.path()) else { return };
    faircurve::cli::run(arguments);
});
