//! The command line as scripts rely on it: exit codes, sentences, files, counts.

use std::fs;
use std::path::{Path, PathBuf};

use super::ran::{folder, refused, run};
use assert_cmd::assert::Assert;
use assert_cmd::cargo::cargo_bin_cmd;
use predicates::prelude::*;
use predicates::str::{contains, is_empty};
use serde_json::Value;
use tempfile::TempDir;

const TWO: &str = "curve,x,y\na,0,0\na,1,2\na,3,1\nb,0,5\nb,2,6\nb,3,4\nb,5,5\n";

/// Two good curves, and between them one whose second point is NaN.
const BAD: &str = "curve,x,y\na,0,0\na,1,2\na,3,1\nbad,0,0\nbad,nan,1\nbad,2,2\nb,0,5\nb,2,6\nb,3,4\nb,5,5\n";

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

fn json(folder: &TempDir, name: &str) -> Value {
    serde_json::from_str(&read(folder, name)).unwrap()
}

fn files(folder: &TempDir) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into()).collect();
    files.sort();
    files
}

/// The rows of a CSV file that belong to a curve.
fn rows<'a>(text: &'a str, curve: &str) -> Vec<&'a str> {
    text.lines().filter(|line| line.split(',').next() == Some(curve)).collect()
}

#[test]
fn all_curves_usable_is_exit_code_0_and_one_line_says_which_device_did_the_work() {
    let folder = folder(TWO);
    run(&folder, "fit in.csv -o out.csv --device cpu")
        .code(0)
        .stdout(is_empty())
        .stderr(predicate::str::is_match(r"^faircurve: 2 curves, 7 points: .*CPU.*\n$").unwrap());
    assert_eq!(files(&folder), [Path::new("in.csv"), Path::new("out.csv")]);
}

#[test]
fn k_points_become_n_times_k_minus_1_plus_1_and_closed_ones_n_times_k_and_the_first_again() {
    let folder = folder(TWO);
    for n in [1, 3, 16] {
        run(&folder, &format!("fit in.csv -o out.csv --force --samples {n}")).code(0);
        let out = read(&folder, "out.csv");
        assert_eq!((rows(&out, "a").len(), rows(&out, "b").len()), (n * 2 + 1, n * 3 + 1), "{n} samples");
        run(&folder, &format!("fit in.csv -o out.csv --force --closed yes --samples {n}")).code(0);
        let out = read(&folder, "out.csv");
        assert_eq!((rows(&out, "a").len(), rows(&out, "b").len()), (n * 3 + 1, n * 4 + 1), "{n} samples, closed");
    }
    run(&folder, "fit in.csv -o default.csv").code(0);
    assert_eq!(rows(&read(&folder, "default.csv"), "a").len(), 33);
}

#[test]
fn the_data_points_are_among_the_samples() {
    let folder = folder(TWO);
    run(&folder, "fit in.csv -o out.csv --samples 4").code(0);
    let out = read(&folder, "out.csv");
    let point = |row: &str| row.split(',').skip(1).take(2).map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let points: Vec<_> = rows(&out, "a").into_iter().step_by(4).map(point).collect();
    assert_eq!(points, [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]]);
}

#[test]
fn spacing_gives_samples_at_equal_arc_length() {
    let folder = folder("curve,x,y\na,0,0\na,1,0\na,4,0\n");
    run(&folder, "fit in.csv -o out.csv --spacing 0.5").code(0);
    assert_eq!(rows(&read(&folder, "out.csv"), "a").len(), 9);
}

#[test]
fn a_geojson_ring_repeats_its_first_point_and_keeps_its_properties() {
    let folder = TempDir::new().unwrap();
    let ring = r#"{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"name": "islet", "n": 7},
        "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 1], [0, 1], [0, 0]]]}}]}"#;
    fs::write(folder.path().join("in.geojson"), ring).unwrap();
    run(&folder, "fit in.geojson -o out.geojson --samples 5 --report report.json").code(0);
    let out = json(&folder, "out.geojson");
    let feature = &out["features"][0];
    let points = feature["geometry"]["coordinates"][0].as_array().unwrap();
    assert_eq!(points.len(), 5 * 4 + 1);
    assert_eq!(points[0], points[20]);
    assert_eq!(feature["properties"], serde_json::json!({"name": "islet", "n": 7}));
    let curve = &json(&folder, "report.json")["curves"][0];
    assert_eq!((&curve["points_in"], &curve["points_out"]), (&4.into(), &20.into()));
}

#[test]
fn beziers_are_three_control_points_a_span_and_drawn_in_svg() {
    let folder = folder(TWO);
    run(&folder, "fit in.csv -o out.csv --as bezier").code(0);
    let out = read(&folder, "out.csv");
    assert_eq!((rows(&out, "a").len(), rows(&out, "b").len()), (3 * 2 + 1, 3 * 3 + 1));
    run(&folder, "fit in.csv -o closed.csv --as bezier --closed yes").code(0);
    assert_eq!(rows(&read(&folder, "closed.csv"), "a").len(), 3 * 3 + 1);
    run(&folder, "fit in.csv -o out.svg --as bezier").code(0);
    let text = read(&folder, "out.svg");
    let document = roxmltree::Document::parse(&text).unwrap();
    let paths: Vec<_> = document.descendants().filter_map(|node| node.attribute("d")).collect();
    assert_eq!(paths.len(), 2);
    assert!(paths.iter().all(|d| d.contains(['C', 'c'])), "{paths:?}");
    refused(&folder, "fit in.csv -o out.geojson --as bezier", "GeoJSON holds straight lines");
    refused(&folder, "fit in.csv -o more.svg --as bezier --samples 8", "leave --samples and --spacing out");
}

#[test]
fn standard_input_and_output_can_be_piped_with_a_format() {
    let folder = folder(TWO);
    let piped = cargo_bin_cmd!("faircurve")
        .args(["fit", "-", "--from", "csv", "-o", "-", "--to", "csv", "--samples", "2"])
        .write_stdin(TWO)
        .assert()
        .code(0)
        .stderr(contains("2 curves"));
    run(&folder, "fit in.csv -o out.csv --samples 2").code(0);
    assert_eq!(String::from_utf8(piped.get_output().stdout.clone()).unwrap(), read(&folder, "out.csv"));
    refused(&folder, "fit - -o new.csv", "--from");
    refused(&folder, "fit in.csv -o -", "--to");
    refused(&folder, "fit in.csv -o - --to csv --report -", "--output and --report both write -");
}

#[test]
fn an_output_that_exists_is_refused_before_anything_is_read_and_stays_as_it_is() {
    let folder = TempDir::new().unwrap();
    for name in ["out.csv", "report.json", "picture.svg"] {
        fs::write(folder.path().join(name), "precious").unwrap();
        let options = match name {
            "out.csv" => "-o out.csv",
            "report.json" => "-o new.csv --report report.json",
            _ => "-o new.csv --picture picture.svg",
        };
        // The input does not exist: that the sentence is about the output shows what is checked
        // first.
        refused(
            &folder,
            &format!("fit in.csv {options}"),
            &format!("{name} exists already: give --force to replace it"),
        );
        assert_eq!(read(&folder, name), "precious");
    }
    fs::write(folder.path().join("in.csv"), TWO).unwrap();
    run(&folder, "fit in.csv -o out.csv --report report.json --picture picture.svg --force").code(0);
    for name in ["out.csv", "report.json", "picture.svg"] {
        assert_ne!(read(&folder, name), "precious");
    }
}

#[test]
fn a_run_that_fails_leaves_nothing_behind() {
    let folder = folder("curve,x,y\na,0,0\na,1\n");
    run(&folder, "fit in.csv -o out.csv --report report.json").code(2);
    fs::write(folder.path().join("in.csv"), "").unwrap();
    run(&folder, "fit in.csv -o out.csv").code(2).stderr(contains("in.csv"));
    assert_eq!(files(&folder), [Path::new("in.csv")]);
    refused(&folder, "fit gone.csv -o out.csv", "cannot read gone.csv");
}

#[test]
fn outputs_that_cannot_be_written_are_refused() {
    let folder = folder(TWO);
    refused(&folder, "fit in.csv -o no/such/folder/out.csv", "cannot write no/such/folder/out.csv: there is no folder");
    refused(&folder, "fit in.csv -o out.csv --report none/r.json", "cannot write none/r.json");
    refused(&folder, "fit in.csv -o out.txt", "the format of out.txt is not known from its extension");
    refused(&folder, "fit in.csv -o out.csv --picture p.png", "pictures are SVG, give a name that ends in .svg");
    refused(&folder, "fit in.csv -o same.svg --picture ./same.svg", "--output and --picture both write ./same.svg");
    assert_eq!(files(&folder), [Path::new("in.csv")]);
}

#[test]
fn options_out_of_range_are_sentences_with_the_value_and_an_example() {
    let folder = folder(TWO);
    for (options, sentence) in [
        ("--samples 0", "--samples is 0; 1 to 1,000,000 segments a span are possible, such as --samples 16"),
        ("--spacing -2", "--spacing is -2; it must be a positive length in units of the input, such as --spacing 0.5"),
        ("--method smoothing", "give --smoothing λ (such as --smoothing 0.1) or --deviation D"),
        ("--method smoothing --smoothing -1", "--smoothing is -1; λ must be 0 or a positive number"),
        (
            "--method smoothing --deviation 0",
            "--deviation is 0; it must be a positive number, such as --deviation 0.01",
        ),
        (
            "--method natural --smoothing 0.5",
            "--smoothing 0.5 belongs to --method smoothing; natural splines go through every point",
        ),
        ("--pin none", "--pin none belongs to --method smoothing"),
        (
            "--picture p.svg --comb 0",
            "--comb is 0; the scale of its quills must be a positive number, such as --comb 2",
        ),
    ] {
        refused(&folder, &format!("fit in.csv -o out.csv {options}"), sentence);
    }
    assert_eq!(files(&folder), [Path::new("in.csv")]);
}

#[test]
fn what_a_sentence_of_the_library_names_is_an_option_of_the_program() {
    let space = folder("x,y,z\n0,0,0\n1,2,1\n3,1,0\n");
    refused(&space, "fit in.csv -o out.csv --method scf", "leave z out, or choose --method fair");
    let columns = folder("lon,y,when\n0,0,0\n1,2,1\n");
    refused(&columns, "fit in.csv -o out.csv", "map them with --columns, as in x=lon,y=lat");
    fs::write(columns.path().join("out.csv"), "precious").unwrap();
    refused(&columns, "fit in.csv -o out.csv", "out.csv exists already: give --force to replace it, or another name");
    refused(&columns, "fit in -o new.csv", "the format of in is not known from its extension: give --from with csv");
    refused(&columns, "fit in.csv -o new", "the format of new is not known from its extension: give --to with csv");
    refused(&columns, "grid in -o new.csv", "the format of in is not known from its extension: give --from with csv");
    let no_gpu = "no usable GPU: .*(--device cpu|`faircurve doctor`)";
    run(&columns, "fit in.csv -o new.csv --columns x=lon --device gpu:99")
        .code(2)
        .stderr(predicate::str::is_match(no_gpu).unwrap());
    // Of one curve, too: on standard error and in the report.
    let coincident = folder("curve,x,y,t\na,0,0,0\na,1,2,1\na,3,1,1\n");
    let remedy = "remove one of them, or use --method smoothing, which averages them";
    run(&coincident, "fit in.csv -o out.csv --report report.json").code(1).stderr(contains(remedy));
    let message = json(&coincident, "report.json")["curves"][0]["message"].to_string();
    assert!(message.contains(remedy), "{message}");
}

#[test]
fn usage_errors_are_exit_code_2_and_list_what_there_is() {
    let folder = folder(TWO);
    let usage = |arguments: &str, words: &str| {
        run(&folder, arguments).code(2).stdout(is_empty()).stderr(contains(words));
    };
    usage("fit in.csv -o out.csv --method bezier", "possible values: natural, smoothing");
    usage("fit in.csv", "--output <OUTPUT>");
    usage("knit in.csv -o out.csv", "unrecognized subcommand");
    usage("fit in.csv -o out.csv --comb", "--picture <FILE.svg>");
    usage("fit in.csv -o out.csv --device tpu", "use auto, cpu, gpu, or gpu:N");
    usage("fit in.csv -o out.csv --samples 4 --spacing 1", "cannot be used with");
    usage("fit in.csv -o out.csv --method smoothing --smoothing 1 --deviation 1", "cannot be used with");
    usage("fit in.csv -o out.csv --columns x:lon", "x=lon");
    usage("fit in.csv -o out.csv --columns x=a=b,w=c", "there is no \"w\"");
    run(&folder, "--version").code(0).stdout(contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_mistyped_subcommand_is_answered_with_the_one_that_was_meant() {
    let folder = folder(TWO);
    for (typed, meant) in [("fti", "fit"), ("ift", "fit"), ("beizer", "bezier"), ("gird", "grid"), ("docter", "doctor")]
    {
        run(&folder, typed).code(2).stdout(is_empty()).stderr(contains(format!("'{meant}'")));
    }
    run(&folder, "knit in.csv").code(2).stderr(contains("unrecognized subcommand").and(contains("'fit'")));
    run(&folder, "polish in.csv").code(2).stderr(contains("unrecognized subcommand").and(contains("tip").not()));
}

#[test]
fn help_says_what_the_exit_status_means() {
    let folder = folder(TWO);
    for command in ["--help", "fit --help", "bezier --help", "grid --help", "compare --help", "doctor --help"] {
        run(&folder, command).code(0).stdout(contains("Exit status:").and(contains("--strict")));
    }
}

#[test]
fn a_deviation_alone_asks_for_smoothing() {
    let folder = folder("curve,x,y\na,0,0\na,1,1\na,2,0\na,3,1\na,4,0\n");
    run(&folder, "fit in.csv -o short.csv --deviation 0.2 --report short.json").code(0);
    run(&folder, "fit in.csv -o long.csv --method smoothing --deviation 0.2").code(0);
    assert_eq!(read(&folder, "short.csv"), read(&folder, "long.csv"));
    assert_eq!(json(&folder, "short.json")["method"], "smoothing");
    run(&folder, "fit in.csv -o lambda.csv --smoothing 0.1 --report lambda.json").code(0);
    assert_eq!(json(&folder, "lambda.json")["method"], "smoothing");
    refused(
        &folder,
        "fit in.csv -o natural.csv --method natural --deviation 0.2",
        "natural splines go through every point",
    );
}

#[test]
fn single_points_stay_as_they_are_and_are_counted_and_strict_makes_them_a_failure() {
    let folder = folder("curve,x,y\na,0,0\na,1,2\na,3,1\np,1,1\nq,2,2\nq,2,2\n");
    for method in ["natural", "smoothing --smoothing 1", "fair", "scf"] {
        run(&folder, &format!("fit in.csv -o out.csv --force --report r.json --method {method}"))
            .code(0)
            .stderr(contains("2 curves are single points and stay as they are").and(contains("not usable").not()));
        let out = read(&folder, "out.csv");
        assert_eq!((rows(&out, "p").len(), rows(&out, "q").len()), (1, 2), "{method}: {out}");
        assert_eq!(json(&folder, "r.json")["curves"][1]["status"], "degenerate", "{method}");
        run(&folder, &format!("fit in.csv -o out.csv --force --strict --method {method}"))
            .code(1)
            .stderr(contains("2 of 3 curves are not usable").and(contains("single points").not()));
    }
    fs::write(folder.path().join("one.csv"), "curve,x,y\na,0,0\na,1,2\na,3,1\np,1,1\n").unwrap();
    run(&folder, "fit one.csv -o one-out.csv").code(0).stderr(contains("1 curve is a single point and stays as it is"));
    run(&folder, "fit one.csv -o one-out.csv --force -q").code(0).stderr(is_empty());
}

#[test]
fn the_data_that_ships_is_fitted_with_status_0_and_nothing_but_faircurve_says_anything() {
    let folder = TempDir::new().unwrap();
    let borders = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/countries-110m.geojson");
    let ours = || predicate::function(|said: &str| said.lines().all(|line| line.starts_with("faircurve: ")));
    let fit = |options: &str| {
        let mut program = cargo_bin_cmd!("faircurve");
        program.current_dir(&folder).env_remove("XDG_RUNTIME_DIR").args([
            "fit",
            borders,
            "-o",
            "fair.geojson",
            "--force",
        ]);
        program.args(options.split_whitespace()).assert()
    };
    fit("--picture fair.svg")
        .code(0)
        .stderr(ours().and(contains("595 curves, 8,131 points")).and(contains("1 curve is a single point")));
    // Drivers may say what they like while a GPU is opened, whether there is one or not.
    fit("--device gpu").stderr(ours());
}

#[test]
fn a_gpu_that_is_not_there_is_an_error_and_never_a_silent_fallback() {
    let folder = folder(TWO);
    run(&folder, "fit in.csv -o out.csv --device gpu:99")
        .code(2)
        .stderr(predicate::str::starts_with("faircurve: no usable GPU: ").and(contains("gpu:0 … gpu:0").not()));
    assert_eq!(files(&folder), [Path::new("in.csv")]);
}

#[test]
fn the_report_has_one_line_a_curve_with_the_promised_keys() {
    let folder = folder(BAD);
    run(&folder, "fit in.csv -o out.csv --samples 4 --device cpu --report report.json").code(1);
    let report = json(&folder, "report.json");
    let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(keys(&report), ["faircurve", "method", "device", "precision", "curves", "totals"]);
    assert_eq!(keys(&report["device"]), ["kind", "name", "driver"]);
    assert_eq!(keys(&report["totals"]), ["curves", "usable", "seconds"]);
    assert_eq!(keys(&report["totals"]["seconds"]), ["read", "fit", "write"]);
    assert!(report["totals"]["seconds"]["fit"].as_f64().unwrap() > 0.0);
    assert_eq!(
        (&report["faircurve"], &report["method"], &report["device"]["kind"], &report["precision"]),
        (&env!("CARGO_PKG_VERSION").into(), &"natural".into(), &"cpu".into(), &"f64".into())
    );
    assert_eq!((&report["totals"]["curves"], &report["totals"]["usable"]), (&3.into(), &2.into()));

    let promised = [
        "curve",
        "status",
        "points_in",
        "points_out",
        "energy",
        "length",
        "iterations",
        "gradient_norm",
        "max_curvature",
        "max_deviation",
    ];
    let [a, bad, _] = &report["curves"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!(keys(a), promised);
    assert_eq!(keys(bad), [&promised[..], &["message"]].concat());
    assert_eq!((&a["curve"], &a["status"]), (&"a".into(), &"converged".into()));
    assert_eq!((&a["points_in"], &a["points_out"]), (&3.into(), &9.into()));
    assert!(a["energy"].as_f64().unwrap() > 0.0 && a["max_curvature"].as_f64().unwrap() > 0.0, "{a}");
    // Longer than the polyline √5 + √5 that it goes through.
    assert!(a["length"].as_f64().unwrap() > 20f64.sqrt(), "{a}");
    assert_eq!((&bad["status"], &bad["energy"]), (&"invalid".into(), &Value::Null));
    assert!(bad["message"].as_str().unwrap().contains("x is NaN"), "{bad}");
    // One line a curve, for tools that read lines.
    assert_eq!(read(&folder, "report.json").lines().filter(|line| line.starts_with("{\"curve\":")).count(), 3);
}

#[test]
fn smoothing_reports_its_lambda_and_keeps_the_deviation_and_the_ends() {
    let folder = folder("curve,x,y\na,0,0\na,1,1\na,2,0\na,3,1\na,4,0\n");
    run(&folder, "fit in.csv -o out.csv --method smoothing --deviation 0.2 --samples 4 --report report.json").code(0);
    let curve = json(&folder, "report.json")["curves"][0].clone();
    assert!(curve["smoothing"].as_f64().unwrap() > 0.0, "{curve}");
    let deviation = curve["max_deviation"].as_f64().unwrap();
    assert!(deviation > 0.1 && deviation <= 0.2, "{deviation}");
    let out = read(&folder, "out.csv");
    let ends = [rows(&out, "a")[0].to_string(), rows(&out, "a")[16].to_string()];
    assert!(ends[0].starts_with("a,0,0,") || ends[0].starts_with("a,0.0,0.0,"), "{ends:?}");
    assert!(ends[1].starts_with("a,4,0,") || ends[1].starts_with("a,4.0,0.0,"), "{ends:?}");
    run(&folder, "fit in.csv -o free.csv --method smoothing --smoothing 1e9 --pin none --samples 4").code(0);
    let free = read(&folder, "free.csv");
    assert_ne!(rows(&free, "a")[0], ends[0]);
}

#[test]
fn some_curves_not_usable_is_exit_code_1_and_they_are_listed() {
    let folder = folder(BAD);
    run(&folder, "fit in.csv -o out.csv")
        .code(1)
        .stderr(contains("1 of 3 curves is not usable:\n  invalid: in.csv, line 6, curve bad, point 1: x is NaN"));
    let out = read(&folder, "out.csv");
    // It comes out as its input polyline, and its neighbours as if it were not there.
    assert_eq!(rows(&out, "bad").len(), 3);
    fs::write(folder.path().join("good.csv"), TWO).unwrap();
    run(&folder, "fit good.csv -o good-out.csv").code(0);
    let good = read(&folder, "good-out.csv");
    // Beside it they have a status.
    let out = out.replace(",converged\n", "\n");
    assert_eq!((rows(&out, "a"), rows(&out, "b")), (rows(&good, "a"), rows(&good, "b")));
}

#[test]
fn twenty_unusable_curves_are_listed_then_a_count_and_verbose_lists_all() {
    let bad = (0..25).map(|k| format!("bad{k},0,0\nbad{k},inf,1\n"));
    let folder = folder(&std::iter::once("curve,x,y\n".to_string()).chain(bad).collect::<String>());
    run(&folder, "fit in.csv -o out.csv")
        .code(1)
        .stderr(contains("curve bad19").and(contains("curve bad20").not()).and(contains("and 5 more")));
    run(&folder, "fit in.csv -o out.csv --force -v")
        .code(1)
        .stderr(contains("curve bad24").and(contains("read in")).and(contains("more:").not()));
}

#[test]
fn a_report_can_be_a_page_that_needs_nothing_else() {
    let folder = folder(BAD);
    run(&folder, "fit in.csv -o out.csv --report report.html --device cpu").code(1);
    let page = read(&folder, "report.html");
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
    for part in ["How they ended", "<td>invalid", "largest curvature", "<figcaption><b>curve ", "<svg"] {
        assert!(page.contains(part), "{part}");
    }
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!["http", "<script", "<link", "src=", "href="].iter().any(|link| outside.contains(link)), "{outside}");
    run(&folder, "compare in.csv --device cpu --report page.html").code(2).stderr(contains("compare writes JSON"));
}

#[test]
fn quiet_says_nothing_but_errors_and_one_line_about_what_is_not_usable() {
    let folder = folder(BAD);
    let one_line =
        |text: &str| text.starts_with("faircurve: ") && text.ends_with(" not usable\n") && text.lines().count() == 1;
    run(&folder, "fit in.csv -o out.csv -q").code(1).stderr(predicate::function(one_line)).stdout(is_empty());
    run(&folder, "fit in.csv -o out.csv -q").code(2).stderr(contains("exists already"));
    run(&folder, "fit in.csv -o out.csv -q -v").code(2).stderr(contains("cannot be used with"));
}

#[test]
fn columns_are_mapped_and_unknown_ones_named() {
    let folder = folder("id,lon,lat,hours,wind\na,10,20,0,5\na,11,21,6,5\na,12,20,12,5\n");
    refused(&folder, "fit in.csv -o out.csv", "unknown columns");
    run(&folder, "fit in.csv -o out.csv --columns x=lon,y=lat,curve=id,t=hours --samples 2").code(0);
    let out = read(&folder, "out.csv");
    let parameters: Vec<f64> =
        rows(&out, "a").iter().map(|row| row.split(',').nth(3).unwrap().parse().unwrap()).collect();
    assert_eq!(parameters, [0.0, 3.0, 6.0, 9.0, 12.0]);
}

#[test]
fn the_picture_shows_every_curve_and_the_comb_on_demand() {
    let folder = folder(BAD);
    run(&folder, "fit in.csv -o out.csv --picture plain.svg").code(1);
    run(&folder, "fit in.csv -o out.csv --force --picture comb.svg --comb 2").code(1);
    let (plain, comb) = (read(&folder, "plain.svg"), read(&folder, "comb.svg"));
    for text in [&plain, &comb] {
        let document = roxmltree::Document::parse(text).unwrap();
        let titles: Vec<_> =
            document.descendants().filter(|n| n.has_tag_name("title")).filter_map(|n| n.text()).collect();
        assert!(titles.contains(&"a") && titles.contains(&"b") && titles.iter().any(|t| t.starts_with("bad: invalid")));
    }
    assert!(!plain.contains("curvature comb") && comb.contains("curvature comb"));
}

#[test]
fn compare_measures_every_curve_and_passes_where_the_bounds_hold() {
    let folder = folder(BAD);
    run(&folder, "compare in.csv --device cpu --report differences.json")
        .code(0)
        .stdout(contains("CPU f64").and(contains("pass")).and(contains("curves/s")))
        .stdout(contains("usable on neither side, and in no statistic: 1 curve"));
    let report = json(&folder, "differences.json");
    let outcome = &report["comparisons"][0];
    // The CPU against itself: the same bits.
    assert_eq!((outcome["bound"].as_f64(), outcome["worst"].as_f64()), (Some(1e-12), Some(0.0)));
    assert_eq!((outcome["unusable"].as_u64(), outcome["pass"].as_bool()), (Some(1), Some(true)));
    let curves = report["curves"].as_array().unwrap();
    let differences: Vec<_> = curves.iter().map(|curve| curve["differences"]["f64"].as_f64()).collect();
    assert_eq!(differences, [Some(0.0), None, Some(0.0)]);
    assert_eq!((&curves[1]["curve"], &curves[1]["status"]), (&"bad".into(), &"invalid".into()));
    refused(&folder, "compare in.csv --report differences.json", "exists already");
    refused(&folder, "compare in.csv --device cpu --precision f32", "--precision f32 belongs to a GPU");
}

#[test]
fn doctor_tests_itself() {
    let folder = TempDir::new().unwrap();
    run_with_cache(&folder, "doctor").code(0).stdout(
        contains(env!("CARGO_PKG_VERSION"))
            .and(contains("thread"))
            .and(contains("passed"))
            .and(contains("FAILED").not()),
    );
}

/// [`run`] with the folder's own `cache` for the cache folder, where the system lets that be said.
fn run_with_cache(folder: &TempDir, arguments: &str) -> Assert {
    let mut command = cargo_bin_cmd!("faircurve");
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.path().join("cache"));
    command.args(arguments.split_whitespace()).assert()
}

#[cfg(target_os = "linux")]
#[test]
fn doctor_keeps_what_it_measured_of_every_adapter_once_and_mends_a_damaged_file() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("cache/faircurve/devices.json");
    for attempt in 0..3 {
        let done = run_with_cache(&folder, "doctor").code(0);
        let said = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
        if said.contains("GPU: none") {
            return;
        }
        assert!(said.contains("a point of natural splines takes"), "{said}");
        assert!(said.contains(&format!("kept for --device auto in {}", file.display())), "{said}");
        let kept: Vec<Value> = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        assert_eq!(kept.len(), said.matches("kept for --device auto").count());
        for seconds in ["open", "cpu", "transfer"] {
            assert!(kept[0][seconds].as_f64().unwrap() > 0.0, "{seconds}: {}", kept[0]);
        }
        if attempt == 1 {
            fs::write(&file, "{").unwrap();
        }
    }
}
