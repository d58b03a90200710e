//! Curves that could not be fitted come out as they came in, and change nothing for their
//! neighbours.

use assert_cmd::cargo::cargo_bin_cmd;
use faircurve::discrete::{Fair, bending, length};
use faircurve::scf::Smooth;
use faircurve::spline::{Natural, Parametrisation, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, CurveStatus, Device, Fit, Sampling};
use proptest::prelude::*;

const NAN: f64 = f64::NAN;

type FitSampled<'a> = Box<dyn Fn(&CurveBatch, Sampling) -> (Fit, CurveBatch) + 'a>;

/// Every method with its samples; scf only in the plane.
fn methods(dimension: usize) -> Vec<(&'static str, FitSampled<'static>)> {
    let cpu = Device::cpu();
    let with = |parametrisation| Natural { parametrisation, ..Natural::default() };
    let devices: Vec<Device> = (0..6).map(|_| cpu.clone()).collect();
    let [a, b, c, d, e, f]: [Device; 6] = devices.try_into().ok().unwrap();
    let smoothing = |target| Smoothing { target, ..Smoothing::default() };
    let (lambda, deviation) =
        (smoothing(SmoothingTarget::Lambda(0.01)), smoothing(SmoothingTarget::Deviation(0.1.into())));
    let fair = Fair { energy: bending(2.0) + length(), ..Fair::default() };
    let (auto, uniform) = (with(Parametrisation::Auto), with(Parametrisation::Uniform));
    let mut all: Vec<(&'static str, FitSampled)> = vec![
        ("natural", Box::new(move |batch, sampling| auto.fit_sampled(batch, sampling, &a).unwrap())),
        ("uniform", Box::new(move |batch, sampling| uniform.fit_sampled(batch, sampling, &b).unwrap())),
        ("smoothing", Box::new(move |batch, sampling| lambda.fit_sampled(batch, sampling, &c).unwrap())),
        ("deviation", Box::new(move |batch, sampling| deviation.fit_sampled(batch, sampling, &d).unwrap())),
        ("fair", Box::new(move |batch, sampling| fair.fit_sampled(batch, sampling, &e).unwrap())),
    ];
    if dimension == 2 {
        let smooth = Smooth::default();
        all.push(("scf", Box::new(move |batch, sampling| smooth.fit_sampled(batch, sampling, &f).unwrap())));
    }
    all
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// Ring and line that cannot be fitted, a single point of both kinds, and one good line; with
/// parameters that are nobody's guess.
fn broken() -> CurveBatch {
    let curves: [&[[f64; 2]]; 5] = [
        &[[0.0, 0.0], [1.0, NAN], [2.0, 0.0], [1.0, -1.0]],
        &[[0.0, 0.0], [f64::INFINITY, 1.0], [2.0, 0.0]],
        &[[3.0, 4.0]],
        &[[5.0, 6.0]],
        &[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]],
    ];
    let batch = CurveBatch::from_slices(&curves).unwrap();
    let t = vec![0.5, 1.5, 7.0, 7.25, -3.0, 2.0, 2.5, 11.0, 13.0, 1.0, 2.0, 4.0];
    let batch = batch.with_parameters(t).unwrap().with_closing_spans(vec![0.75, NAN, NAN, 2.5, NAN]).unwrap();
    batch.closed_each(vec![true, false, false, true, false]).unwrap()
}

#[test]
fn curves_that_were_not_fitted_keep_their_parameters() {
    let batch = broken();
    for (method, fit_sampled) in methods(2) {
        for sampling in [Sampling::PerSpan(8), Sampling::Count(5), Sampling::Spacing(0.3)] {
            let (fit, samples) = fit_sampled(&batch, sampling);
            for i in 0..4 {
                assert!(!fit.reports()[i].status.is_usable(), "{method} {i}");
                assert_eq!(bits(samples.points(i)), bits(batch.points(i)), "{method} {i}");
                assert_eq!(samples.parameters(i), batch.parameters(i), "{method} {i}");
                assert_eq!(samples.closing_span(i), batch.closing_span(i), "{method} {i}");
                let curve = fit.curve(i);
                assert_eq!(curve.knots()[..batch.count(i)], *batch.parameters(i).unwrap(), "{method} {i}");
            }
        }
    }
}

#[test]
fn without_parameters_those_of_curves_that_were_not_fitted_count_their_points() {
    let points = [[0.0, 0.0], [1.0, NAN], [2.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
    for (method, fit_sampled) in methods(2) {
        let (_, samples) = fit_sampled(&batch, Sampling::PerSpan(4));
        assert_eq!(samples.parameters(0), Some(&[0.0, 1.0, 2.0][..]), "{method}");
        assert_eq!(samples.closing_span(0), Some(1.0), "{method}");
    }
}

#[test]
fn fair_curves_have_the_parameters_given() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0]];
    let fair = Fair { energy: bending(2.0) + length(), ..Fair::default() };
    let given = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(vec![1.0, 2.0, 2.0, 6.0]).unwrap();
    let plain = CurveBatch::from_slices(&[&points[..]]).unwrap();
    let fits = [&given, &plain].map(|batch| fair.fit(batch, &Device::cpu()).unwrap());
    let [timed, counted] = [0, 1].map(|k| fits[k].curve(0));
    assert_eq!((timed.knots(), counted.knots()), (&[1.0, 2.0, 2.0, 6.0][..], &[0.0, 1.0, 2.0, 3.0][..]));
    let samples = fits[0].polylines(Sampling::PerSpan(4));
    assert_eq!(samples.points(0), fits[1].polylines(Sampling::PerSpan(4)).points(0));
    let t = samples.parameters(0).unwrap();
    assert_eq!(t, [1.0, 1.25, 1.5, 1.75, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    for u in [0.0, 0.3, 1.0] {
        // The last span is four times as long; the middle one has no length, and derivatives by its
        // fraction.
        for (span, pace) in [(0, 1.0), (1, 1.0), (2, 4.0)] {
            let (a, b) = (timed.jet(span, u), counted.jet(span, u));
            assert!((a.first * pace - b.first).length() <= 1e-12 * b.first.length());
            assert!((a.second * pace * pace - b.second).length() <= 1e-12 * b.second.length());
            assert!((a.third * pace * pace * pace - b.third).length() <= 1e-12 * b.third.length());
            assert!((a.curvature(2) - b.curvature(2)).abs() <= 1e-9 * b.curvature(2).abs().max(1.0));
        }
    }
    assert_eq!((timed.length(), timed.max_curvature()), (counted.length(), counted.max_curvature()));
    assert_eq!(timed.beziers(1e-4).len(), counted.beziers(1e-4).len());
    assert_eq!(timed.sites(Sampling::Spacing(0.1)), counted.sites(Sampling::Spacing(0.1)));
}

#[test]
fn closed_fair_curves_have_the_closing_span_given() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let batch = CurveBatch::from_slices(&[&square[..]]).unwrap().with_parameters(vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let fair = Fair { energy: bending(2.0) + length(), ..Fair::default() };
    for (stated, end) in [(Some(2.5), 5.5), (None, 4.0)] {
        let spans = vec![stated.unwrap_or(NAN)];
        let batch = batch.clone().with_closing_spans(spans).unwrap().closed(true);
        let (fit, samples) = fair.fit_sampled(&batch, Sampling::PerSpan(2), &Device::cpu()).unwrap();
        assert_eq!(fit.curve(0).domain(), (0.0, end));
        assert_eq!(samples.parameters(0).unwrap()[7], 0.5 * (3.0 + end));
        assert_eq!(samples.closing_span(0), Some(0.5 * (end - 3.0)));
    }
}

/// Numbers of every size: ordinary ones, the largest, the smallest, and neighbours that differ by
/// rounding.
fn extreme() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0f64,
        1 => (-308..308i32, -9.9..9.9f64).prop_map(|(exponent, x)| x * 10f64.powi(exponent)),
        1 => Just(0.0),
        1 => Just(1e300),
        1 => Just(-1e300),
        1 => Just(1e-300),
        1 => (1..4u64).prop_map(|k| f64::from_bits(1f64.to_bits() + k)),
    ]
}

/// Steps of parameters, of any size.
fn steps() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => 0.1..2.0f64,
        1 => (-308..300i32).prop_map(|exponent| 10f64.powi(exponent)),
        1 => Just(0.0),
        1 => Just(f64::EPSILON),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_invalid_or_degenerate_comes_out_as_it_came_in(
        points in prop::collection::vec([extreme(), extreme()], 1..7),
        increments in prop::collection::vec(steps(), 7),
        timed in any::<bool>(),
        closed in any::<bool>(),
    ) {
        let mut batch = CurveBatch::from_slices(&[&points[..]]).unwrap();
        if timed {
            let t = increments.iter().scan(0.0, |t, step| { *t += step; Some(*t) }).take(points.len()).collect();
            batch = batch.with_parameters(t).unwrap();
        }
        let batch = batch.closed(closed);
        for (method, fit_sampled) in methods(2) {
            for sampling in [Sampling::PerSpan(3), Sampling::Count(7)] {
                let (fit, samples) = fit_sampled(&batch, sampling);
                let status = fit.reports()[0].status;
                if matches!(status, CurveStatus::Invalid | CurveStatus::Degenerate) {
                    prop_assert_eq!(bits(samples.points(0)), bits(batch.points(0)), "{} {:?}", method, status);
                    if let Some(t) = batch.parameters(0) {
                        prop_assert_eq!(bits(samples.parameters(0).unwrap()), bits(t), "{} {:?}", method, status);
                    }
                    let curve = fit.curve(0);
                    prop_assert!(!curve.is_fitted());
                    let mut joints: Vec<f64> = curve.beziers(1e-3).iter().flat_map(|piece| [piece[0].x, piece[0].y]).collect();
                    if !closed && batch.count(0) > 1 {
                        let count = batch.count(0);
                        joints.extend(&batch.points(0)[2 * (count - 1)..]);
                    }
                    if batch.count(0) > 1 {
                        prop_assert_eq!(bits(&joints), bits(batch.points(0)), "{} Béziers", method);
                    }
                    let chains = fit.beziers(1e-3);
                    let controls = chains.count(0) + usize::from(chains.is_closed(0));
                    prop_assert!(chains.count(0) == 1 || controls % 3 == 1, "{} {} control points", method, controls);
                } else if status == CurveStatus::Converged {
                    let finite = samples.points(0).iter().all(|x| x.is_finite());
                    prop_assert!(finite, "{} {:?}", method, samples.points(0));
                }
            }
        }
    }
}

#[test]
fn closed_curves_have_three_samples_at_least_and_rings_four_positions() {
    let rings: [&[[f64; 2]]; 4] = [
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        &[[0.0, 0.0], [1.0, 0.0], [0.3, 1.0]],
        &[[0.0, 0.0], [1.0, 0.2]],
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0]],
    ];
    let batch = CurveBatch::from_slices(&rings).unwrap().closed(true);
    let samplings = [
        Sampling::Spacing(10.0),
        Sampling::Spacing(1.5),
        Sampling::Count(0),
        Sampling::Count(1),
        Sampling::Count(2),
        Sampling::Count(3),
        Sampling::PerSpan(0),
        Sampling::PerSpan(1),
        Sampling::PerSpan(2),
    ];
    for (method, fit_sampled) in methods(2) {
        for sampling in samplings {
            let (fit, samples) = fit_sampled(&batch, sampling);
            // A ring that cannot be fitted comes out as it came in, two points for two.
            for i in (0..batch.len()).filter(|&i| fit.curve(i).is_fitted()) {
                let mut points = samples.points(i).as_chunks::<2>().0.to_vec();
                let what = format!("{method} {sampling:?}, ring {i}: {points:?}");
                assert!(points.len() >= 3, "{what}");
                assert_eq!(fit.curve(i).sites(sampling).len(), points.len(), "{what}");
                points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
                points.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6);
                assert!(points.len() >= 3, "{what}");
            }
        }
    }
}

#[test]
fn every_chain_of_beziers_can_be_written_and_single_points_stay_points() {
    let curves: [&[[f64; 2]]; 4] = [&[[1.0, 2.0]], &[[1.0, 2.0]; 3], &[], &[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]];
    for closed in [false, true] {
        let batch = CurveBatch::from_slices(&curves).unwrap().closed(closed);
        for (method, fit_sampled) in methods(2) {
            let chains = fit_sampled(&batch, Sampling::PerSpan(1)).0.beziers(1e-3);
            assert_eq!(chains.count(2), 0, "{method}");
            // A point alone, or a chain that stays in it.
            let [single, repeated, curve] = [0, 1, 3].map(|i| chains.count(i) + usize::from(closed));
            assert!(chains.count(0) == 1 || single % 3 == 1, "{method}: {single}");
            assert!(chains.count(1) == 1 || repeated % 3 == 1, "{method}: {repeated}");
            assert!(curve > 1 && curve % 3 == 1, "{method}: {curve}");
            for extension in ["csv", "svg", "npz"] {
                let folder = tempfile::tempdir().unwrap();
                let options = faircurve::io::WriteOptions { beziers: true, ..Default::default() };
                let path = folder.path().join(format!("a.{extension}"));
                faircurve::io::write_with(path, &chains, &options).unwrap();
            }
        }
    }
}

#[test]
fn spacings_that_ask_for_too_much_are_refused_in_a_sentence() {
    let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&line[..], &line[..2]]).unwrap();
    let batch = batch.with_names(vec!["long".into(), "short".into()]).unwrap();
    let cpu = Device::cpu();
    for spacing in [5e-324, 1e-300, 1e-9, 1e-7] {
        let sampling = Sampling::Spacing(spacing);
        let fair = Fair { segments: faircurve::discrete::Segments::Spacing(spacing), ..Fair::default() };
        let errors = [
            Natural::default().fit_sampled(&batch, sampling, &cpu).err(),
            Smoothing::default().fit_sampled(&batch, sampling, &cpu).err(),
            Smooth::default().fit_sampled(&batch, sampling, &cpu).err(),
            Fair::default().fit_sampled(&batch, sampling, &cpu).err(),
            fair.fit(&batch, &cpu).err(),
        ];
        for error in errors {
            let text = error.unwrap().to_string();
            assert!(text.contains("of curve long") && text.contains("2.8284e0 apart"), "{text}");
            assert!(text.contains("give a spacing of"), "{text}");
        }
    }
    // What the sentence asks for is taken.
    let text = Sampling::Spacing(1e-9).check(&batch).unwrap_err().to_string();
    let least: f64 = text.split("give a spacing of ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(Sampling::Spacing(least).check(&batch).is_ok(), "{text}");
    for spacing in [0.0, -1.0, NAN, f64::INFINITY] {
        assert!(Sampling::Spacing(spacing).check(&batch).is_err());
    }
    let many = Smooth { starts: 1_000_000_000, ..Smooth::default() }.fit(&batch, &cpu).err().unwrap().to_string();
    assert!(many.contains("1000000000 starts") && many.contains("10000 are possible"), "{many}");
}

/// Nine good curves, and one that runs to 10¹² and ends in no number.
fn with_a_wild_one(folder: &std::path::Path, wild: bool) -> std::path::PathBuf {
    let mut text = String::from("curve,x,y\n");
    for i in 0..9 {
        for k in 0..6 {
            text += &format!("good{i},{k},{}\n", i as f64 * 2.0 + ((k * 7 + i * 3) % 5) as f64 * 0.3);
        }
    }
    if wild {
        text += "wild,0,0\nwild,1e12,1e12\nwild,NaN,0\n";
    }
    let path = folder.join(if wild { "wild.csv" } else { "tame.csv" });
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_curve_that_is_not_fitted_changes_no_tolerance_digit_or_extent_of_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let [tame, wild] = [false, true].map(|wild| with_a_wild_one(folder.path(), wild));
    let run = |input: &std::path::Path, name: &str, arguments: &[&str]| {
        let (out, picture) = (folder.path().join(name), folder.path().join(format!("{name}.picture.svg")));
        let mut command = cargo_bin_cmd!("faircurve");
        command
            .arg("fit")
            .arg(input)
            .arg("-o")
            .arg(&out)
            .args(["--device", "cpu", "--force", "--picture"])
            .arg(&picture);
        let _ = command.args(arguments).assert();
        [out, picture].map(|path| std::fs::read_to_string(path).unwrap())
    };
    for (method, arguments) in [("fair", &["--as", "bezier"][..]), ("scf", &["--as", "bezier", "--tolerance", "1e-5"])]
    {
        let arguments = [&["--method", method], arguments].concat();
        let [csv, other] = [&tame, &wild].map(|input| run(input, "out.csv", &arguments)[0].clone());
        // Beside a curve that is not usable all have a status.
        assert!(other.replace(",status\n", "\n").replace(",converged\n", "\n").starts_with(&csv), "{method}");
        let [a, b] = [&tame, &wild].map(|input| run(input, "out.svg", &arguments));
        let paths = |text: &str| -> Vec<String> {
            text.lines()
                .filter(|line| line.contains("id=\"good") || line.contains("viewBox"))
                .map(String::from)
                .collect()
        };
        assert_eq!(paths(&a[0]), paths(&b[0]), "{method}");
        let head = |text: &str| text.lines().next().unwrap().to_string();
        assert_eq!(head(&a[1]), head(&b[1]), "{method}");
        assert!(b[1].contains("not usable: 1 invalid; 1 far outside, not drawn"), "{method}");
    }
}

#[test]
fn a_curve_without_points_answers_with_what_is_no_number() {
    for dimension in [2, 3] {
        let batch = CurveBatch::from_ragged(dimension, vec![], vec![0, 0]).unwrap();
        let fit = Natural::default().fit(&batch, &Device::cpu()).unwrap();
        let curve = fit.curve(0);
        assert!(curve.point(0.5).is_nan() && (curve.length(), curve.max_curvature()) == (0.0, 0.0));
        assert!(curve.beziers(0.1).is_empty() && fit.polylines(Sampling::Count(8)).total_points() == 0);
    }
}
