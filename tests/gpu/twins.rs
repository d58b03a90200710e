//! A kernel and its twin, the CPU's code for the same, are held together.

use std::path::{Path, PathBuf};

use faircurve::gpu::source;

/// The comment that a file begins with.
fn head(text: &str) -> String {
    text.lines().map_while(|line| line.strip_prefix("//")).collect()
}

/// The twin of a shader file: that of its own path or, of a part, that of the file that its folder belongs to.
fn twin(path: &str) -> Option<PathBuf> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let stem = path.strip_suffix(".wgsl").expect("a shader file");
    let of_folder = stem.rsplit_once('/').map(|(folder, _)| folder);
    let whole = of_folder.and_then(|folder| {
        [folder.to_string(), format!("{folder}/mod")]
            .into_iter()
            .find(|own| source::file(&format!("{own}.wgsl")).is_some())
    });
    let twins = [Some(stem.to_string()), whole].into_iter().flatten().map(|stem| src.join(stem + ".rs"));
    twins.into_iter().find(|twin| twin.exists())
}

#[test]
fn every_shader_file_has_a_twin_or_says_why_not() {
    for path in source::files() {
        let excused = head(source::file(path).unwrap()).contains("No twin: ");
        match twin(path) {
            Some(twin) => assert!(!excused, "shaders/{path} says that it has no twin: {}", twin.display()),
            None => assert!(excused, "shaders/{path} has no twin in src; its head may say `No twin: why`"),
        }
    }
}
