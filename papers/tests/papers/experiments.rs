//! The program: its files, its exit codes, and that its tables agree with the papers.

use std::fs;

use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use tempfile::TempDir;

/// Runs the program in the folder; arguments are separated by blanks.
fn run(folder: &TempDir, arguments: &str) -> Assert {
    cargo_bin_cmd!("faircurve-papers").current_dir(folder).args(arguments.split_whitespace()).assert()
}

#[test]
fn toms828_reproduces_all_58_iterations_and_draws_every_data_set() {
    let folder = TempDir::new().unwrap();
    run(&folder, "toms828 -o made/here")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("58 of 58 published iterations compared").and(contains("converged after")))
        .stdout(predicate::function(|text: &str| text.matches("continued: unbounded after").count() == 2));
    let read = |name: &str| fs::read_to_string(folder.path().join("made/here").join(name)).unwrap();
    assert!(read("toms828.txt").contains("58 of 58"));
    let csv = read("toms828.csv");
    let mut rows = csv.lines();
    assert_eq!(
        rows.next().unwrap(),
        "set,iteration,phi,published_phi,phi_difference,step,published_step,step_difference"
    );
    let mut count = 0;
    for row in rows {
        let row: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let [_, _, ours, published, difference, ..] = row[..] else { panic!("{row:?}") };
        assert!((ours / published - 1.0).abs() < 1e-6 && difference < 1e-6, "{row:?}");
        count += 1;
    }
    assert_eq!(count, 58);
    for set in 1..=5 {
        let svg = read(&format!("toms828-{set}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap();
        let curves = picture.descendants().filter(|node| node.attribute("class") == Some("s")).count();
        assert!(curves >= 5 && svg.contains(&format!("TOMS 828, data set {set}")), "{set}: {curves} curves");
    }
    assert_eq!(fs::read_dir(folder.path().join("made/here")).unwrap().count(), 7);
}

#[test]
fn renka_reproduces_section_4_by_every_method_on_both_energies() {
    let folder = TempDir::new().unwrap();
    run(&folder, "renka -o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("a polygon of length 4.101358").and(contains("length 1.001 after 39000")));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("renka.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    assert_eq!(rows.headers().unwrap(), vec!["energy", "method", "iterations", "length", "value", "end"]);
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    let ends = |energy: &str, method: &str| -> Vec<(u32, f64, String)> {
        let chosen = rows.iter().filter(|row| &row[0] == energy && row[1].starts_with(method));
        chosen.map(|row| (row[2].parse().unwrap(), row[3].parse().unwrap(), row[5].into())).collect()
    };
    for (iterations, length, end) in ends("length", "ordinary") {
        assert!(iterations > 10 && length > 1.5 && end == "can reduce it no further", "{iterations} {length} {end}");
    }
    for (iterations, length, end) in ends("length", "Sobolev") {
        assert!(iterations == 1 && (length - 1.0).abs() < 1e-13 && end == "converged", "{iterations} {length} {end}");
    }
    assert!(
        ends("length", "Newton").iter().all(|(iterations, _, end)| *iterations == 0 && end == "Hessian is singular")
    );
    let slow = ends("tension", "ordinary gradient, step 0.5");
    assert!((31_000..=32_200).contains(&slow[0].0) && slow[0].1 < 1.001, "{slow:?}");
    assert_eq!((slow[1].0, format!("{:.5}", slow[1].1)), (39_000, "1.00016".to_string()));
    assert!(
        matches!(&ends("tension", "Newton")[..], [(1, length, end)] if (length - 1.0).abs() < 1e-13 && end == "converged")
    );
    let counts = ["length", "tension"].map(|energy| rows.iter().filter(|row| &row[0] == energy).count());
    assert_eq!(counts, [10, 9]);
    assert!(read("renka.txt").lines().count() > 25);
    for name in ["length-ordinary", "tension-ordinary", "length-sobolev"] {
        let svg = read(&format!("renka-{name}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap();
        let curves = picture.descendants().filter(|node| node.attribute("class") == Some("s")).count();
        assert!((10..40).contains(&curves), "{name}: {curves} curves");
    }
    assert_eq!(fs::read_dir(folder.path().join("made")).unwrap().count(), 5);
}

#[test]
fn bezier_finds_everything_as_eberly_says() {
    let folder = TempDir::new().unwrap();
    run(&folder, "bezier -o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("Everything is as the paper says.").and(contains("NOT").not()))
        .stdout(contains("P2 = 1/2 P1 + 1/2 P3").and(contains("P1 = 2/3 P0 + 1/3 P3")));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("bezier.csv");
    assert_eq!((csv.lines().count(), csv.lines().nth(1).unwrap().split(',').next()), (30, Some("2")));
    let svg = read("bezier.svg");
    let picture = roxmltree::Document::parse(&svg).unwrap();
    assert!(picture.descendants().filter(|node| node.has_tag_name("path")).count() > 20);
    assert!(svg.contains("elevated line") && svg.contains("Eigenvectors"));
}

#[test]
fn laplacian_finds_masks_and_optima_and_wider_windows_are_nearer() {
    let folder = TempDir::new().unwrap();
    run(&folder, "laplacian -o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("Everything is as it should be.").and(contains("NO").not()).and(contains("but:").not()))
        .stdout(contains("1.4535  0.4535 -0.1277 -0.0338").and(contains("s(0, 0) = 4 − 8/π")))
        .stdout(contains("s(2, 2) = 8 − 376/15π").and(contains("769 × 769 points")))
        .stdout(contains("1/8 3/4 1/8 and 1/2 1/2 leave no residual: yes"));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("laplacian.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 2 * 5 * 5);
    for reproduces in ["constants", "linear"] {
        for rounds in 1..=5 {
            let chosen = rows.iter().filter(|row| &row[0] == reproduces && row[2] == rounds.to_string());
            let chosen: Vec<(usize, f64)> =
                chosen.map(|row| (row[1].parse().unwrap(), row[3].parse().unwrap())).collect();
            assert_eq!(chosen.iter().map(|row| row.0).collect::<Vec<_>>(), [3, 5, 7, 9, 11]);
            assert!(chosen.windows(2).all(|pair| pair[1].1 < pair[0].1), "{reproduces}, {rounds} rounds: {chosen:?}");
        }
    }
    for (name, reliefs, plots) in [("basis", 9, 0), ("surfaces", 6, 0), ("plots", 0, 3)] {
        let svg = read(&format!("laplacian-{name}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap();
        let count = |class: &str| picture.descendants().filter(|node| node.attribute("class") == Some(class)).count();
        assert_eq!([count("relief"), count("plot")], [reliefs, plots], "{name}");
        assert!(!svg.contains("NaN"), "{name}");
    }
}

#[test]
fn scf_draws_figures_2_to_5_and_no_search_ends_below_newton() {
    let folder = TempDir::new().unwrap();
    // Without a name: all experiments.
    run(&folder, "-o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("TOMS 828").and(contains("Renka 2006")))
        .stdout(contains("no search ended lower than Newton's method from 32 starts").and(contains("NaN").not()));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("scf.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    assert_eq!(rows.headers().unwrap(), vec!["dots", "exponent", "method", "iteration", "segment_solves", "cost"]);
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    // The last of every history.
    let found = |dots: &str, exponent: &str, method: &str| -> (u64, f64) {
        let mut history = rows.iter().filter(|row| [&row[0], &row[1], &row[2]] == [dots, exponent, method]);
        let row = history.next_back().unwrap_or_else(|| panic!("{dots} {exponent} {method}"));
        (row[4].parse().unwrap(), row[5].parse().unwrap())
    };
    for dots in ["three", "four", "ten", "octopus-95", "octopus-58"] {
        // Those of which the table says that no minimum was found.
        let none = |exponent: &&str| [("three", "2"), ("octopus-58", "20")].contains(&(dots, *exponent));
        for exponent in ["2", "20"].into_iter().filter(|exponent| !none(exponent)) {
            let [greedy, adaptation, newton, thorough] =
                ["greedy", "Gaussian Adaptation", "Newton", "Newton from 32 starts"]
                    .map(|method| found(dots, exponent, method));
            for (search, slack) in [(greedy, 0.2), (adaptation, 0.01)] {
                let excess = search.1 / thorough.1 - 1.0;
                assert!((-1e-6..slack).contains(&excess), "{dots} {exponent}: {excess:.1e}");
                assert!(search.0 > 3 * newton.0, "{dots} {exponent}: {} solves, Newton {}", search.0, newton.0);
            }
            assert!(thorough.1 <= newton.1 && thorough.0 > newton.0, "{dots} {exponent}");
        }
    }
    let table = read("scf.txt");
    assert_eq!(table.matches("no minimum was found").count(), 2);
    for (name, panels, curves, plots) in [("fans", 6, 100, 0), ("dots", 9, 60, 3), ("octopus", 4, 50, 4)] {
        let svg = read(&format!("scf-{name}.svg"));
        let picture = roxmltree::Document::parse(&svg).unwrap();
        let count = |class: &str| picture.descendants().filter(|node| node.attribute("class") == Some(class)).count();
        assert_eq!([count("panel"), count("plot")], [panels, plots], "{name}");
        assert!(count("s") >= curves && !svg.contains("NaN"), "{name}: {} curves", count("s"));
    }
    assert_eq!(fs::read_dir(folder.path().join("made")).unwrap().count(), 5 + 3 + 5 + 5 + 5 + 4 + 7);
}

#[test]
fn shape_keeps_the_limits_of_rough_curves_and_draws_them() {
    let folder = TempDir::new().unwrap();
    run(&folder, "shape -o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("every curve that converged keeps its limits: yes").and(contains("NO").not()));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("shape.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    assert_eq!(
        rows.headers().unwrap().iter().take(6).collect::<Vec<_>>(),
        ["limit", "sigma", "curves", "met", "infeasible", "neither"]
    );
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 33);
    for row in &rows {
        let count = |k: usize| row[k].parse::<usize>().unwrap();
        assert_eq!(count(3) + count(4) + count(5), count(2), "{row:?}");
    }
    let svg = read("shape.svg");
    let picture = roxmltree::Document::parse(&svg).unwrap();
    let count = |class: &str| picture.descendants().filter(|node| node.attribute("class") == Some(class)).count();
    assert_eq!(count("panel"), 7);
    assert!(count("s") >= 14 + 8 + 3 && !svg.contains("NaN"), "{} curves", count("s"));
    let csv = read("shape-contours.csv");
    let mut rows = csv::Reader::from_reader(csv.as_bytes());
    let rows: Vec<csv::StringRecord> = rows.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 6);
    let sum = |k: usize| rows.iter().map(|row| row[k].parse::<usize>().unwrap()).sum::<usize>();
    // Crossings without the limit, with it, and lines fitted again.
    assert!(sum(3) > 30 && sum(4) == 0 && sum(5) > 20, "{rows:?}");
    let svg = read("shape-contours.svg");
    let picture = roxmltree::Document::parse(&svg).unwrap();
    assert_eq!(picture.descendants().filter(|node| node.attribute("class") == Some("panel")).count(), 4);
    assert!(!svg.contains("NaN"));
}

#[test]
fn surfaces_have_the_exact_geodesics_and_no_poles() {
    let folder = TempDir::new().unwrap();
    run(&folder, "surfaces -o made")
        .code(0)
        .stderr(is_empty())
        .stdout(contains("every length, extrapolated, is exact to 1e-7: yes").and(contains("NO").not()));
    let read = |name: &str| fs::read_to_string(folder.path().join("made").join(name)).unwrap();
    let csv = read("surfaces.csv");
    let rows = csv::Reader::from_reader(csv.as_bytes()).records().map(Result::unwrap).count();
    assert_eq!(rows, 8 * 3);
    let svg = read("surfaces.svg");
    let picture = roxmltree::Document::parse(&svg).unwrap();
    let count = |class: &str| picture.descendants().filter(|node| node.attribute("class") == Some(class)).count();
    assert_eq!(count("panel"), 6);
    assert!(count("s") >= 100 && !svg.contains("NaN"), "{} strokes", count("s"));
    // Lines of rows and columns, some hidden in part, and three ways.
    let svg = read("surfaces-terrain.svg");
    let picture = roxmltree::Document::parse(&svg).unwrap();
    let count = |class: &str| picture.descendants().filter(|node| node.attribute("class") == Some(class)).count();
    assert_eq!(count("panel"), 1);
    assert!(count("s") > 60 + 80 + 3 && !svg.contains("NaN"), "{} strokes", count("s"));
    assert!(read("surfaces.txt").contains("no way is shorter than the shortest: yes"));
}

#[test]
fn the_octopus_has_95_and_58_dots_and_turns_by_less_than_a_right_angle() {
    let octopus = faircurve::io::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/data/octopus.csv")).unwrap();
    assert_eq!((octopus.len(), octopus.count(0), octopus.count(1)), (2, 95, 58));
    for i in 0..2 {
        let dots = octopus.points(i).as_chunks::<2>().0;
        let dot = |k: usize| glam::DVec2::from(dots[k % dots.len()]);
        for k in 0..dots.len() {
            let turn = (dot(k + 1) - dot(k)).angle_to(dot(k + 2) - dot(k + 1)).to_degrees();
            assert!(turn.abs() < 90.0, "{}: {turn:.1}° at dot {}", octopus.name(i), k + 1);
        }
    }
}

#[test]
fn outputs_that_exist_are_kept_unless_forced() {
    let folder = TempDir::new().unwrap();
    let old = folder.path().join("toms828-3.svg");
    fs::write(&old, "precious").unwrap();
    run(&folder, "toms828 -o .")
        .code(2)
        .stdout(is_empty())
        .stderr(contains("toms828-3.svg exists already: give --force to replace it"));
    assert_eq!(fs::read_to_string(&old).unwrap(), "precious");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is written before everything is checked");
    run(&folder, "toms828 -o . --force").code(0).stdout(contains("TOMS 828"));
    assert!(fs::read_to_string(&old).unwrap().starts_with("<svg"));
}

#[test]
fn an_unknown_experiment_is_refused_with_the_names_there_are() {
    let folder = TempDir::new().unwrap();
    run(&folder, "toms829 -o .").code(2).stderr(
        contains("toms829")
            .and(contains("possible values: "))
            .and(contains("bezier, laplacian, renka, scf, shape, surfaces, toms828")),
    );
    run(&folder, "").code(2).stderr(contains("--output"));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn a_folder_that_cannot_be_made_is_an_error() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    run(&folder, "toms828 -o file/deep").code(2).stderr(contains("cannot write file/deep"));
}
