//! A kernel and its twin stop, count and search by the same numbers.
//!
//! Another pair is another row of [`TWINS`].

use std::collections::HashMap;

use faircurve::gpu::source;

/// A constant by its name in the kernel and in its twin. What the twin counts in ε of the precision (`_EPSILONS`), the kernel
/// has multiplied out.
struct Twins {
    kernel: &'static str,
    twin: &'static str,
    constants: &'static [[&'static str; 2]],
    /// Constants of the kernel that differ in f32, for reasons given there.
    only_f64: &'static [&'static str],
}

const TWINS: [Twins; 2] = [
    Twins {
        kernel: "spline/reinsch.wgsl",
        twin: "src/spline/reinsch.rs",
        constants: &[
            ["MAX_REFINEMENTS", "MAX_REFINEMENTS"],
            ["REFINED", "REFINED_EPSILONS"],
            ["FAILED", "FAILED_EPSILONS"],
        ],
        only_f64: &[],
    },
    Twins {
        kernel: "spline/reinsch.wgsl",
        twin: "src/spline/smoother/search.rs",
        constants: &[
            ["STEPS_PER_OCTAVE", "STEPS_PER_OCTAVE"],
            ["STRIDE", "STRIDE"],
            ["FIRST_STEP", "FIRST_STEP"],
            ["LAST_STEP", "LAST_STEP"],
        ],
        only_f64: &["FIRST_STEP"],
    },
];

/// The lines of a precision: what stands between `//:if F64`, `//:else` and `//:end`.
fn of_precision(source: &str, f64: bool) -> String {
    let mut live = true;
    let mut out = String::new();
    for line in source.lines() {
        match line.trim() {
            "//:if F64" => live = f64,
            "//:else" => live = !live,
            "//:end" => live = true,
            _ if live => out.extend([line, "\n"]),
            _ => {}
        }
    }
    out
}

/// The constants of a source that are numbers, or products of numbers and constants before them.
fn constants(source: &str) -> HashMap<&str, f64> {
    let mut found = HashMap::new();
    for line in source.lines() {
        let Some((left, value)) = line.split_once(" = ") else { continue };
        let Some((left, _)) = left.split_once(':') else { continue };
        let Some(name) = left.rsplit_once("const ").map(|(_, name)| name.trim()) else { continue };
        let factor = |text: &str| {
            let text = text.trim().trim_start_matches("real(").trim_end_matches([')', 'u']).replace('_', "");
            text.parse::<f64>().ok()
        };
        let factors = value.trim_end_matches(';').split('*');
        let product: Option<f64> = factors.map(|x| found.get(x.trim()).copied().or_else(|| factor(x))).product();
        product.map(|product| found.insert(name, product));
    }
    found
}

#[test]
fn kernels_have_the_constants_of_their_twins() {
    for Twins { kernel, twin, constants: names, only_f64 } in TWINS {
        let path = format!("{}/{twin}", env!("CARGO_MANIFEST_DIR"));
        let rust = std::fs::read_to_string(path).unwrap();
        let rust = constants(&rust);
        for (precision, epsilon) in [(false, f64::from(f32::EPSILON)), (true, f64::EPSILON)] {
            let wgsl = of_precision(source::file(kernel).unwrap(), precision);
            let wgsl = constants(&wgsl);
            for [there, here] in names.iter().filter(|[there, _]| precision || !only_f64.contains(there)) {
                let found = wgsl.get(there).unwrap_or_else(|| panic!("{kernel} has no number {there}"));
                let wanted = rust.get(here).unwrap_or_else(|| panic!("{twin} has no number {here}"));
                let wanted = if here.ends_with("_EPSILONS") { wanted * epsilon } else { *wanted };
                // Literals of f32 are written with as many digits as tell them apart.
                assert!(
                    (found - wanted).abs() <= 1e-7 * wanted.abs(),
                    "{kernel}: {there} is {found}, {twin}: {wanted}"
                );
            }
        }
    }
}

#[test]
fn the_reader_of_constants_sees_products_precisions_and_differences() {
    let source = "const A: i32 = 3;\npub(super) const B: i32 = -2 * A;\n//:if F64\nconst C: real = real(1e-3);\n\
                  //:else\nconst C: real = real(2.5);\n//:end\nconst D: u32 = 1_000u;\nlet e: f64 = 1.0;\nconst F: u32 = G;";
    for (f64, c) in [(true, 1e-3), (false, 2.5)] {
        let source = of_precision(source, f64);
        assert_eq!(constants(&source), HashMap::from([("A", 3.0), ("B", -6.0), ("C", c), ("D", 1000.0)]));
    }
}
