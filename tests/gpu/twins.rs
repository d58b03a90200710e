//! A kernel and its twin, the CPU's code for the same, are held together: files by their paths,
//! constants by their names.
//!
//! A constant of a kernel stands in its twin under the same name, with the same value. Three kinds
//! stand there in other words: what counts ε of the precision (`REFINED`: `REFINED_EPSILONS`), the
//! words of an enum (`TERMINATION_STATUS_RUNNING`: `TerminationStatus::Running`), and what a number's type tells
//! (`EPSILON`). One that stands in another file is preceded by a comment with `Twin: FILE`, that
//! file's path from the twin's folder; one that stands nowhere by `No twin: why`. Such a comment
//! counts up to the next one, the next blank line or the end of its block. What the host defines
//! (`$NAME`) is its own.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use faircurve::gpu::source;

/// The comment that a file begins with.
fn head(text: &str) -> String {
    text.lines().map_while(|line| line.strip_prefix("//")).collect()
}

/// The twin of a shader file: that of its own path or, of a part, that of the file that its folder
/// belongs to.
fn twin(path: &str) -> Option<PathBuf> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let stem = path.strip_suffix(".wgsl").expect("a shader file");
    let whole = stem.rsplit_once('/').and_then(|(folder, _)| {
        let owners = [folder.to_string(), format!("{folder}/mod")];
        owners.into_iter().find(|owner| source::file(&format!("{owner}.wgsl")).is_some())
    });
    let twins = [Some(stem.to_string()), whole].into_iter().flatten().map(|stem| src.join(stem + ".rs"));
    twins.into_iter().find(|twin| twin.exists())
}

/// What a comment above constants says of their twins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Told<'a> {
    Nothing,
    Twin(&'a str),
    NoTwin,
}

/// A constant's name, its value as it is written, and what is told of its twin.
type Constant<'a> = (&'a str, &'a str, Told<'a>);

/// The constants of a kernel in a precision.
fn of_kernel(text: &str, is_f64: bool) -> Vec<Constant<'_>> {
    // Of every open block, whether it is one of precision, whether it counts, and what was told
    // before it.
    let mut blocks = Vec::new();
    let (mut told, mut found) = (Told::Nothing, Vec::new());
    for line in text.lines().map(str::trim) {
        let directive = line.strip_prefix("//:").map(|line| line.split_whitespace().collect::<Vec<_>>());
        match directive.as_deref() {
            Some(["if", "F64"]) => blocks.push((true, is_f64, told)),
            Some(["if" | "unroll" | "each", ..]) => blocks.push((false, true, told)),
            Some(["else"]) => {
                let (is_precision, counts, before) = blocks.last_mut().expect("a block");
                (*counts, told) = (*counts != *is_precision, *before);
            }
            Some(["end"]) => (.., told) = blocks.pop().expect("a block"),
            _ => {}
        }
        if line.is_empty() {
            told = Told::Nothing;
        } else if let Some(comment) = line.strip_prefix("//") {
            if comment.contains("No twin: ") {
                told = Told::NoTwin;
            } else if let Some((_, file)) = comment.split_once("Twin: ") {
                told = Told::Twin(file.trim_end_matches('.'));
            }
        } else if let Some((name, value)) = constant(line)
            && blocks.iter().all(|(_, counts, _)| *counts)
        {
            found.push((name, value, told));
        }
    }
    found
}

/// The name of a line `const NAME: TYPE = VALUE;` of Rust or WGSL, and its value as it is written.
fn constant(line: &str) -> Option<(&str, &str)> {
    let (left, value) = line.trim().strip_suffix(';')?.split_once(" = ")?;
    let (left, _) = left.split_once(": ")?;
    let (before, name) = left.rsplit_once("const ")?;
    (before.is_empty() || before.starts_with("pub")).then_some((name, value))
}

/// The value of a product of numbers and constants; none where a definition of the host is in it.
fn value(written: &str, known: &HashMap<&str, f64>) -> Option<f64> {
    let factor = |text: &str| {
        let text = text.trim().trim_start_matches("real(").trim_end_matches([')', 'u']).replace('_', "");
        text.parse::<f64>().ok()
    };
    written.split(" * ").map(|text| known.get(text).copied().or_else(|| factor(text))).product()
}

/// What a file of Rust, without its tests, says of constants.
struct Rust {
    path: PathBuf,
    text: String,
}

impl Rust {
    fn read(path: PathBuf) -> Self {
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let text = text.split("#[cfg(test)]").next().expect("there is a first part").to_string();
        Rust { path, text }
    }

    fn constants(&self) -> HashMap<&str, f64> {
        let mut known = HashMap::new();
        for (name, written) in self.text.lines().filter_map(constant) {
            value(written, &known).map(|value| known.insert(name, value));
        }
        known
    }

    /// The number of a word of an enum.
    fn word(&self, name: &str) -> Option<f64> {
        name.match_indices('_').find_map(|(at, _)| self.word_of(&name[..at], &name[at + 1..]))
    }

    fn word_of(&self, own: &str, variant: &str) -> Option<f64> {
        let [own, variant] = [own, variant].map(|words| {
            let capital = |word: &str| word[..1].to_string() + &word[1..].to_lowercase();
            words.split('_').map(capital).collect::<String>()
        });
        let (_, body) = self.text.split_once(&format!("enum {own} {{"))?;
        let variants = body.split_once("\n}")?.0.lines().filter_map(|line| line.trim().strip_suffix(','));
        let mut next = 0.0;
        for (name, number) in variants.map(|line| line.split_once(" = ").map_or((line, None), |(a, b)| (a, Some(b)))) {
            let number = number.map_or(next, |number| number.parse().expect("a number"));
            if name == variant {
                return Some(number);
            }
            next = number + 1.0;
        }
        None
    }

    fn value(&self, name: &str, is_f64: bool) -> Option<f64> {
        let (epsilon, smallest) = match is_f64 {
            true => (f64::EPSILON, f64::MIN_POSITIVE),
            false => (f32::EPSILON.into(), f32::MIN_POSITIVE.into()),
        };
        let known = self.constants();
        let in_epsilons = || known.get(format!("{name}_EPSILONS").as_str()).map(|count| count * epsilon);
        let of_number = || match name {
            "EPSILON" => Some(epsilon),
            "ROOT_EPSILON" => Some(epsilon.sqrt()),
            "ROOT_SMALLEST_NORMAL" => Some(smallest.sqrt()),
            "PI" => Some(std::f64::consts::PI),
            "FRAC_PI_2" => Some(std::f64::consts::FRAC_PI_2),
            "FRAC_PI_4" => Some(std::f64::consts::FRAC_PI_4),
            _ => None,
        };
        known.get(name).copied().or_else(in_epsilons).or_else(|| self.word(name)).or_else(of_number)
    }
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

#[test]
fn constants_of_kernels_are_those_of_their_twins() {
    let mut compared = 0;
    for (path, is_f64) in source::files().flat_map(|path| [(path, false), (path, true)]) {
        let (mut own, mut of_host) = (HashMap::new(), Vec::new());
        for (name, written, told) in of_kernel(source::file(path).unwrap(), is_f64) {
            let Some(found) = value(written, &own) else {
                let is_of_host = written.contains('$') || of_host.iter().any(|name| written.contains(name));
                assert!(is_of_host, "shaders/{path}: {name} is no product of numbers: {written}");
                of_host.push(name);
                continue;
            };
            own.insert(name, found);
            let twin = match (told, twin(path)) {
                (Told::NoTwin, _) => continue,
                (Told::Twin(file), Some(twin)) => twin.with_file_name(file),
                (_, Some(twin)) => twin,
                (_, None) => panic!("shaders/{path}: {name}, but the file has no twin"),
            };
            let twin = Rust::read(twin);
            let place = format!("shaders/{path}: {name} = {written}, {}", twin.path.display());
            let wanted = twin.value(name, is_f64).unwrap_or_else(|| panic!("{place} has none"));
            // Literals of f32 are written with as many digits as tell them apart.
            let is_same = if is_f64 { found == wanted } else { found as f32 == wanted as f32 };
            assert!(is_same, "{place}: {wanted:e}");
            compared += 1;
        }
    }
    assert!(compared > 100, "only {compared} constants were compared");
}

#[test]
fn numbers_of_twins_are_those_of_their_kernels() {
    let mut of_twins: HashMap<PathBuf, Vec<&str>> = HashMap::new();
    for (path, twin) in source::files().filter_map(|path| Some((path, twin(path)?))) {
        let names = of_kernel(source::file(path).unwrap(), true).into_iter().map(|(name, ..)| name);
        of_twins.entry(twin).or_default().extend(names);
    }
    for (path, names) in of_twins {
        let twin = Rust::read(path);
        let mut is_excused = false;
        for line in twin.text.lines().map(str::trim) {
            match line.strip_prefix("//") {
                Some(comment) => is_excused |= comment.contains("Not in the kernel: "),
                None => {
                    let number = constant(line).filter(|_| !is_excused && line.contains(": f64 = "));
                    let name = number.map(|(name, _)| name.trim_end_matches("_EPSILONS"));
                    let path = twin.path.display();
                    assert!(name.is_none_or(|name| names.contains(&name)), "{path}: no kernel has {name:?}");
                    is_excused = false;
                }
            }
        }
    }
}

#[test]
fn the_reader_sees_precisions_products_words_and_comments() {
    let kernel = "// Twin: a.rs\nconst A: i32 = 3;\n\nconst B: i32 = -2 * A;\n//:if F64\n// No twin: none.\n\
                  const C: real = real(1e-3);\n//:else\nconst C: real = real(2.5);\n//:end\nconst D: u32 = $NAMEu;\n\
                  fn f() {\n    let e: f64 = 1.0;\n}";
    let common = [("A", "3", Told::Twin("a.rs")), ("B", "-2 * A", Told::Nothing)];
    let last = ("D", "$NAMEu", Told::Nothing);
    assert_eq!(of_kernel(kernel, true), [&common[..], &[("C", "real(1e-3)", Told::NoTwin), last]].concat());
    assert_eq!(of_kernel(kernel, false), [&common[..], &[("C", "real(2.5)", Told::Nothing), last]].concat());
    let known = HashMap::from([("A", 3.0)]);
    assert_eq!(
        ["-2 * A", "real(2.5)", "1_000u", "$NAMEu"].map(|x| value(x, &known)),
        [Some(-6.0), Some(2.5), Some(1e3), None]
    );
    let text =
        "pub(super) const WIDE_EPSILONS: f64 = 4.0;\nenum Standing {\n    /// All.\n    Running = 1,\n    FarOff,\n}\n";
    let rust = Rust { path: PathBuf::new(), text: text.into() };
    let values = ["WIDE", "STANDING_FAR_OFF", "EPSILON", "OTHER"].map(|name| rust.value(name, true));
    assert_eq!(values, [Some(4.0 * f64::EPSILON), Some(2.0), Some(f64::EPSILON), None]);
}
