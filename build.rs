//! Embeds every file below `shaders/`, so that a new kernel needs no second list.

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

fn collect(folder: &Path, prefix: &str, table: &mut String) {
    let mut entries: Vec<_> =
        fs::read_dir(folder).expect("shaders/ is readable").map(|entry| entry.expect("readable")).collect();
    entries.sort_by_key(|entry| entry.file_name());
    for entry in entries {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{name}/"), table);
        } else if name.ends_with(".wgsl") {
            writeln!(table, "    ({name:?}, include_str!({:?})),", entry.path()).expect("writing to a string");
        }
    }
}

fn main() {
    let folder = Path::new(&env::var("CARGO_MANIFEST_DIR").expect("set by cargo")).join("shaders");
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut table = String::from("const SHADER_FILES: &[(&str, &str)] = &[\n");
    collect(&folder, "", &mut table);
    table.push_str("];\n");
    let out = Path::new(&env::var("OUT_DIR").expect("set by cargo")).join("shader_files.rs");
    fs::write(out, table).expect("OUT_DIR is writable");
}
