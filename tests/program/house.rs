//! The house: its rooms use each other one way.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The rooms from the ground up, as files or folders of `src`. Each uses only those before it.
const ROOMS: [&str; 39] = [
    "dct",
    "error",
    "words",
    "bounds",
    "width",
    "sides",
    "ragged",
    "numbers",
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
    "ground",
    "spline",
    "tracks",
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

/// A source without its comments and its tests.
fn code(source: &str) -> String {
    let product = source.split("\nmod tests {").next().unwrap_or_default();
    product.lines().filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{line}\n")).collect()
}

/// The modules after `crate::` in a source.
fn used(source: &str) -> BTreeSet<String> {
    let code = code(source);
    let names = code.split("crate::").skip(1);
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

fn is_test(file: &Path) -> bool {
    file.file_stem().is_some_and(|stem| stem == "tests" || stem == "testing")
}

#[test]
fn rooms_use_only_those_below_them() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 200, "{} sources found", files.len());
    let floor = |room: &str| ROOMS.iter().position(|&other| other == room);
    for file in files.iter().filter(|file| !is_test(file)) {
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

/// The first names after a prefix of paths: one name, or every name of a group in braces.
fn names_after<'a>(prefix: &str, code: &'a str) -> Vec<&'a str> {
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let begins = |at: usize| !code[..at].ends_with(|c| is_of_name(c) || c == ':');
    let rest = code.match_indices(prefix).filter(|&(at, _)| begins(at)).map(|(at, _)| &code[at + prefix.len()..]);
    let names = rest.flat_map(|rest| match rest.strip_prefix('{') {
        Some(group) => group.split('}').next().unwrap().split(',').map(str::trim).collect(),
        None => vec![rest],
    });
    names.map(|name| name.split(|c| !is_of_name(c)).next().unwrap()).collect()
}

/// What every file or folder of a room names of the others, there or as what the room's own file passes on.
fn named_in(room: &Path, src: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut paths = Vec::new();
    sources(room, &mut paths);
    paths.retain(|path| !is_test(path) && *path != room.join("mod.rs"));
    let inside = |path: &Path| path.strip_prefix(room).unwrap().to_str().unwrap().to_string();
    let file_of = |path: &Path| inside(path).split(['/', '.']).next().unwrap().to_string();
    let mut named: BTreeMap<String, BTreeSet<String>> =
        paths.iter().map(|path| (file_of(path), BTreeSet::new())).collect();
    let mut files: BTreeMap<String, String> = named.keys().map(|file| (file.clone(), file.clone())).collect();
    let own = [room.join("mod.rs"), room.with_extension("rs")].iter().find_map(|own| std::fs::read_to_string(own).ok());
    let own = code(&own.unwrap_or_default());
    for file in named.keys() {
        for name in names_after(&format!("{file}::"), &own) {
            files.entry(name.to_string()).or_insert(file.clone());
        }
    }
    let from_crate = format!("crate::{}::", room.strip_prefix(src).unwrap().to_str().unwrap().replace('/', "::"));
    for path in &paths {
        let code = code(&std::fs::read_to_string(path).unwrap());
        let depth = inside(path).split('/').count() - usize::from(path.ends_with("mod.rs"));
        let names = [&"super::".repeat(depth), &from_crate].map(|prefix| names_after(prefix, &code)).concat();
        let own = file_of(path);
        let others = names.into_iter().filter_map(|name| files.get(name)).filter(|&other| *other != own);
        named.get_mut(&own).unwrap().extend(others.cloned());
    }
    named
}

#[test]
fn no_file_names_one_above_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let rooms: BTreeSet<&Path> = files.iter().map(|file| file.parent().unwrap()).filter(|&room| room != src).collect();
    assert!(rooms.len() > 30, "{} rooms found", rooms.len());
    for room in rooms {
        let mut left = named_in(room, &src);
        // From the ground up: what names nothing that is left can be laid.
        while let Some(laid) = left.iter().find(|(_, named)| named.iter().all(|file| !left.contains_key(file))) {
            let laid = laid.0.clone();
            left.remove(&laid);
        }
        assert!(left.is_empty(), "files of {} that use each other, or those that do: {left:#?}", room.display());
    }
}

#[test]
fn the_reader_of_uses_sees_names_and_passes_over_comments() {
    let source = "use crate::io::Format;\n// crate::scf\nlet x = crate::linalg::solve(crate::Device::cpu());\n#[cfg(test)]\nmod tests {\n    use crate::cli;";
    assert_eq!(used(source), BTreeSet::from(["io".to_string(), "linalg".to_string()]));
}
