//! The Rust version that Cargo.toml and README.md promise is honest.
//!
//! Clippy's `incompatible_msrv` (on in Cargo.toml) watches our own code; these tests watch the
//! dependencies and the words.

use std::collections::{BTreeSet, HashMap};
use std::process::Command;

use serde_json::Value;

/// `"1.71.1"` as `[1, 71, 1]`; missing parts count as 0.
fn version(text: &str) -> [u64; 3] {
    let mut parts = [0; 3];
    for (part, word) in parts.iter_mut().zip(text.split('.')) {
        *part = word.parse().unwrap_or_else(|_| panic!("{text:?} is no Rust version"));
    }
    parts
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("cargo metadata has no {key}"))
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("cargo metadata has no {key}"))
}

/// The resolved graph for all platforms, since the promise is made for all of them.
fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo can be run");
    assert!(output.status.success(), "cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON")
}

/// The ids of all packages that a user of the crate compiles: reached from `root` over normal and
/// build dependencies. Development dependencies are exempt: they are compiled by those who work on
/// the crate, with a current toolchain.
fn compiled_packages<'a>(metadata: &'a Value, root: &'a str) -> BTreeSet<&'a str> {
    let nodes: HashMap<&str, &Value> =
        list(&metadata["resolve"], "nodes").iter().map(|node| (text(node, "id"), node)).collect();
    let mut reached = BTreeSet::from([root]);
    let mut open = vec![root];
    while let Some(id) = open.pop() {
        for dependency in list(nodes[id], "deps") {
            let development_only = list(dependency, "dep_kinds").iter().all(|kind| kind["kind"] == "dev");
            let id = text(dependency, "pkg");
            if !development_only && reached.insert(id) {
                open.push(id);
            }
        }
    }
    reached
}

/// A sentence for every compiled package that needs a newer Rust than `stated`.
fn too_new(stated: [u64; 3]) -> Vec<String> {
    let metadata = metadata();
    let root = text(&metadata["resolve"], "root");
    let packages: HashMap<&str, &Value> =
        list(&metadata, "packages").iter().map(|package| (text(package, "id"), package)).collect();
    compiled_packages(&metadata, root)
        .iter()
        .map(|id| packages[id])
        .filter_map(|package| Some((package, package["rust_version"].as_str()?)))
        .filter(|(_, needed)| version(needed) > stated)
        .map(|(package, needed)| format!("{} {} needs Rust {needed}", text(package, "name"), text(package, "version")))
        .collect()
}

#[test]
fn no_dependency_needs_a_newer_rust_than_stated() {
    let stated = env!("CARGO_PKG_RUST_VERSION");
    let too_new = too_new(version(stated)).join(", ");
    assert!(
        too_new.is_empty(),
        "Cargo.toml states Rust {stated}, but {too_new}: raise rust-version, or hold the dependency back"
    );
}

#[test]
fn a_promise_that_is_too_old_would_be_caught() {
    let too_new = too_new([1, 64, 0]);
    let names_wgpu = |sentence: &String| sentence.starts_with("wgpu ") && sentence.contains(" needs Rust 1.");
    assert!(too_new.iter().any(names_wgpu), "wgpu, which needs a newer Rust than 1.64, is not among {too_new:?}");
}

#[test]
fn the_readme_states_the_same_rust_version_as_cargo_toml() {
    let promise = format!("Rust {}", env!("CARGO_PKG_RUST_VERSION"));
    let readme = include_str!("../../README.md");
    assert!(readme.contains(&promise), "README.md does not say {promise:?}, which Cargo.toml states");
}

#[test]
fn versions_compare_part_by_part() {
    assert!(version("1.9") < version("1.10"));
    assert!(version("1.89") < version("1.89.1"));
    assert_eq!(version("1.89"), version("1.89.0"));
}
