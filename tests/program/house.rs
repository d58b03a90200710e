//! The house: its rooms use each other one way.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The rooms from the ground up, as files or folders of `src`. Each uses only those before it.
const ROOMS: [&str; 38] = [
    "dct",
    "error",
    "words",
    "bounds",
    "width",
    "sides",
    "ragged",
    "parallel",
    "sort",
    "memory",
    "precision",
    "status",
    "constraint",
    "grids",
    "batch",
    "deviation",
    "arclength",
    "motion",
    "gpu",
    "device",
    "linalg",
    "surface",
    "damping",
    "curve",
    "report",
    "topology",
    "tracks",
    "ground",
    "spline",
    "discrete",
    "scf",
    "bezier",
    "laplacian",
    "catalogue",
    "picture",
    "io",
    "lib",
    "cli",
];

/// The modules after `crate::` in a source, without its comments and its tests.
fn used(source: &str) -> BTreeSet<String> {
    let product = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code = product.lines().filter(|line| !line.trim_start().starts_with("//"));
    let names = code.flat_map(|line| line.split("crate::").skip(1));
    let first =
        |name: &str| name.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or_default().to_string();
    names.map(first).filter(|name| name.starts_with(|c: char| c.is_lowercase())).collect()
}

fn sources(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() && !entry.ends_with("tests") {
            sources(&entry, found);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
}

#[test]
fn rooms_use_only_those_below_them() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 200, "{} sources found", files.len());
    let floor = |room: &str| ROOMS.iter().position(|&other| other == room);
    let tests = |file: &Path| file.file_stem().is_some_and(|stem| stem == "tests" || stem == "testing");
    for file in files.iter().filter(|file| !tests(file)) {
        let inside = file.strip_prefix(&src).unwrap();
        let room = inside.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        if room == "main" {
            continue;
        }
        let own = floor(room).unwrap_or_else(|| panic!("src/{room} has no floor: give it one in ROOMS"));
        for other in used(&std::fs::read_to_string(file).unwrap()) {
            let below = floor(&other).is_some_and(|other| other <= own);
            assert!(below, "src/{} uses {other}, which stands above it", inside.display());
        }
    }
}

/// The files of a room that a source uses, which lies this many folders inside of it.
fn beside(source: &str, room: &str, depth: usize, files: &BTreeSet<String>) -> BTreeSet<String> {
    let product = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code: String =
        product.lines().filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect();
    let up = format!("{}super::", "super::".repeat(depth));
    let mut used = BTreeSet::new();
    for prefix in [up, format!("crate::{room}::")] {
        for (at, _) in code.match_indices(&prefix) {
            // Longer chains of `super` lead out of the room.
            if code[..at].ends_with("::") {
                continue;
            }
            let rest = &code[at + prefix.len()..];
            let names = match rest.strip_prefix('{') {
                Some(group) => group.split('}').next().unwrap_or_default().split(',').map(str::trim).collect(),
                None => vec![rest],
            };
            for name in names {
                let end = name.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(name.len());
                used.extend(files.get(&name[..end]).cloned());
            }
        }
    }
    used
}

#[test]
fn no_file_of_discrete_names_one_above_it() {
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/discrete");
    let mut paths = Vec::new();
    sources(&room, &mut paths);
    let file_of = |path: &Path| {
        let first = path.strip_prefix(&room).unwrap().iter().next().unwrap().to_str().unwrap();
        first.trim_end_matches(".rs").to_string()
    };
    let files: BTreeSet<String> = paths.iter().map(|path| file_of(path)).collect();
    let mut left: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in paths.iter().filter(|path| !["mod", "tests"].contains(&path.file_stem().unwrap().to_str().unwrap())) {
        let depth = path.strip_prefix(&room).unwrap().components().count() - 1;
        let depth = if path.file_name().unwrap() == "mod.rs" { depth - 1 } else { depth };
        let own = file_of(path);
        let mut used = beside(&std::fs::read_to_string(path).unwrap(), "discrete", depth, &files);
        used.remove(&own);
        left.entry(own).or_default().extend(used);
    }
    assert!(left.len() > 40, "{} files found", left.len());
    // From the ground up: what uses nothing that is left can be laid.
    loop {
        let laid: Vec<String> = left
            .iter()
            .filter(|(_, used)| used.iter().all(|file| !left.contains_key(file)))
            .map(|(f, _)| f.clone())
            .collect();
        if laid.is_empty() {
            break;
        }
        laid.iter().for_each(|file| _ = left.remove(file));
    }
    assert!(left.is_empty(), "files that use each other: {left:#?}");
}

#[test]
fn the_reader_of_uses_sees_names_and_passes_over_comments() {
    let source = "use crate::io::Format;\n// crate::scf\nlet x = crate::linalg::solve(crate::Device::cpu());\n#[cfg(test)]\nmod tests {\n    use crate::cli;";
    assert_eq!(used(source), BTreeSet::from(["io".to_string(), "linalg".to_string()]));
}
