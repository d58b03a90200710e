//! What README and docs say of the program is what it does.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin_cmd;

const COMMANDS: [&str; 11] =
    ["map", "draw", "track", "path", "tracts", "fit", "bezier", "grid", "exponent", "compare", "doctor"];

/// The reference of all options, from the program's own help.
fn reference() -> String {
    let help = |arguments: &[&str]| {
        let output = cargo_bin_cmd!("faircurve").args(arguments).arg("--help").output().unwrap();
        String::from_utf8(output.stdout).unwrap().trim_end().to_string()
    };
    let mut text =
        "# Options\n\nThe help of the program, command by command: `faircurve COMMAND --help` prints the same.\n"
            .to_string();
    for command in COMMANDS {
        text += &format!("\n## faircurve {command}\n\n```text\n{}\n```\n", help(&[command]));
    }
    text
}

#[test]
fn the_reference_of_options_is_the_programs_help() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/options.md");
    let reference = reference();
    if std::env::var_os("FAIRCURVE_WRITE_DOCS").is_some() {
        fs::write(&path, &reference).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap();
    assert_eq!(
        found, reference,
        "docs/options.md is old: FAIRCURVE_WRITE_DOCS=1 cargo test --test program reference writes it"
    );
}

/// README and the pages of the site, but for those that are generated.
fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = vec![root.join("README.md")];
    for folder in ["docs", "docs/jobs"] {
        let entries = fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path());
        found.extend(entries.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    }
    found.retain(|path| !path.ends_with("options.md") && !path.ends_with("gallery.md"));
    found
}

/// The commands of pages that run the program, with their arguments: lines of blocks of sh.
fn commands() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for page in pages() {
        let text = fs::read_to_string(page).unwrap();
        let mut in_block = false;
        for line in text.lines().map(str::trim) {
            if let Some(language) = line.strip_prefix("```") {
                in_block = language == "sh";
            } else if in_block {
                let command = line.strip_prefix("cargo run --release -- ").or_else(|| line.strip_prefix("faircurve "));
                found.extend(command.map(|line| line.split(" #").next().unwrap().trim().to_string()));
            }
        }
    }
    found
}

#[test]
fn every_command_of_the_pages_runs_on_data_that_ships() {
    let folder = tempfile::tempdir().unwrap();
    let copied = folder.path().join("examples/data");
    fs::create_dir_all(&copied).unwrap();
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data")).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), copied.join(entry.file_name())).unwrap();
    }
    let commands = commands();
    assert!(commands.len() >= 25, "{commands:?}");
    for command in commands {
        let mut run = cargo_bin_cmd!("faircurve");
        let output = run.current_dir(folder.path()).args(command.split_whitespace()).arg("--force").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {said}");
        let options: Vec<&str> = command.split_whitespace().collect();
        for pair in options.windows(2).filter(|pair| ["-o", "--picture", "--report"].contains(&pair[0])) {
            let written = folder.path().join(pair[1]);
            assert!(fs::metadata(&written).is_ok_and(|file| file.len() > 100), "{command} wrote no {}", pair[1]);
        }
    }
}
