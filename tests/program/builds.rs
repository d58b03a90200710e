//! Programs, tests, benches and the wheel are made of the same builds of dependencies.

use std::collections::BTreeMap;
use std::process::Command;

/// The features that each dependency is built with, as these arguments of `cargo tree` ask for it.
fn features(arguments: &[&str]) -> BTreeMap<String, String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--prefix", "none", "--no-dedupe", "--format", "{p}|{f}"])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo can be run");
    assert!(output.status.success(), "cargo tree failed: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("cargo tree prints text");
    let pair = |line: &str| line.split_once('|').map(|(name, features)| (name.to_string(), features.to_string()));
    text.lines().filter_map(pair).collect()
}

#[test]
fn all_that_is_built_asks_for_the_same_features() {
    let tests = features(&["--edges", "normal,build,dev"]);
    for (what, arguments) in [
        ("programs", &["--edges", "normal,build"][..]),
        ("the wheel", &["--edges", "normal,build", "--package", "faircurve-python"]),
    ] {
        let own = features(arguments);
        assert!(own.len() > 100, "{what}: {} dependencies", own.len());
        for (name, features) in own {
            assert_eq!(tests[&name], features, "{name} is built for {what} and again for tests");
        }
    }
}
