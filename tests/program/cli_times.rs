//! Tracks and their times, as users meet them: which times samples have, what is between two, and units of time and of the globe.

use std::fs;

use super::ran::{folder as with, run};
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

fn lines(folder: &TempDir, name: &str) -> Vec<String> {
    fs::read_to_string(folder.path().join(name)).unwrap().lines().map(String::from).collect()
}

/// Rows of a file in cells, without the head.
fn rows(folder: &TempDir, name: &str) -> Vec<Vec<String>> {
    lines(folder, name)[1..].iter().map(|line| line.split(',').map(String::from).collect()).collect()
}

/// A column of a file in numbers.
fn column(folder: &TempDir, name: &str, cell: usize) -> Vec<f64> {
    rows(folder, name).iter().map(|row| row[cell].parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn closed_curves_are_sampled_at_the_times_asked_for_alone() {
    let folder = with("curve,t,x,y\nball,0,0,0\nball,1,100,80\nball,2,200,0\nball,3,100,-80\nball,4,0,0\n");
    fs::write(folder.path().join("at.csv"), "t\n1\n2\n2.5\n").unwrap();
    for method in ["natural", "smoothing --smoothing 0", "fair", "scf", "natural --closed yes"] {
        let fit = format!("--device cpu --force --method {method}");
        run(&folder, &format!("fit in.csv -o out.csv --every 1 {fit}")).code(0);
        assert_eq!(column(&folder, "out.csv", 3), [0.0, 1.0, 2.0, 3.0, 4.0], "{method}");
        assert_eq!(column(&folder, "out.csv", 1), [0.0, 100.0, 200.0, 100.0, 0.0], "{method}");
        run(&folder, &format!("fit in.csv -o out.csv --at at.csv {fit}")).code(0);
        assert_eq!(column(&folder, "out.csv", 3), [1.0, 2.0, 2.5], "{method}");
    }
    run(&folder, "fit in.csv -o out.geojson --at at.csv --device cpu").code(0);
    assert_eq!(lines(&folder, "out.geojson")[1].matches("[").count(), 5);
    // Along the curve it is closed still.
    run(&folder, "fit in.csv -o out.csv --samples 1 --device cpu --force").code(0);
    assert_eq!(column(&folder, "out.csv", 4), [1.0; 5]);
}

#[test]
fn a_curve_has_the_offset_and_the_grid_of_its_own_times() {
    let own = |name: &str, zone: &str| -> String {
        let row = |k: usize| format!("{name},{k},{},2024-03-01T0{}:10:00{zone}\n", k * k, 2 * k);
        (0..3).map(row).collect()
    };
    let (a, b, c) = (own("a", "+05:30"), own("b", "Z"), own("c", "-03:00"));
    let alone = |rows: &str| -> Vec<Vec<String>> {
        let folder = with(&format!("curve,x,y,t\n{rows}"));
        run(&folder, "fit in.csv -o out.csv --every 1h --device cpu").code(0);
        self::rows(&folder, "out.csv")
    };
    let first = &alone(&b)[0];
    assert_eq!([&*first[0], &*first[1], &*first[3]], ["b", "0.4166666666666667", "2024-03-01T01:00:00Z"]);
    let each = [&a, &b, &c].map(|rows| alone(rows)).concat();
    assert_eq!(each.len(), 12);
    assert_eq!(alone(&format!("{a}{b}{c}")), each);
    // Rows that are mixed, and parts of a track that pauses.
    let mixed: String =
        (0..3).flat_map(|k| [&a, &b, &c].map(|rows| rows.lines().nth(k).unwrap().to_string() + "\n")).collect();
    assert_eq!(alone(&mixed), each);
    let folder =
        with(&format!("curve,x,y,t\n{a}a,9,9,2024-03-02T00:00:00+05:30\na,9,8,2024-03-02T01:00:00+05:30\n{b}"));
    run(&folder, "fit in.csv -o out.csv --gap 3h --every 1h --device cpu").code(0);
    let parts = rows(&folder, "out.csv");
    assert_eq!((&*parts[4][0], &*parts[4][3]), ("a.2", "2024-03-02T00:00:00+05:30"));
    assert_eq!((parts.len(), &parts[6..]), (10, &alone(&b)[..]));
}

#[test]
fn angles_are_carried_on_the_short_way_round() {
    let folder = with(
        "curve,x,y,t,COG,heading,drift,Course\n\
         a,0,0,0,350,-170,355,511\na,0,1,2,10,170,5,90\na,1,1,4,90,-170,95,90\na,1,2,6,270,100,0,91\n",
    );
    let carried = |columns: &str| -> Vec<Vec<f64>> {
        run(&folder, &format!("fit in.csv -o out.csv --every 1 --carry {columns} --device cpu --force")).code(0);
        let width = rows(&folder, "out.csv")[0].len();
        (4..width).map(|cell| column(&folder, "out.csv", cell)).collect()
    };
    let all = carried("all");
    assert_eq!(all[0], [350.0, 0.0, 10.0, 50.0, 90.0, 180.0, 270.0]);
    assert_eq!(all[1], [-170.0, -180.0, 170.0, -180.0, -170.0, 145.0, 100.0]);
    assert_eq!(all[2], [355.0, 180.0, 5.0, 50.0, 95.0, 47.5, 0.0]);
    // What stands for an angle that is not known is none, and is not mixed with one.
    assert_eq!(all[3], [511.0, 90.0, 90.0, 90.0, 90.0, 90.5, 91.0]);
    assert_eq!(
        carried("drift:angle,COG:linear"),
        [[350.0, 180.0, 10.0, 50.0, 90.0, 180.0, 270.0], [355.0, 0.0, 5.0, 50.0, 95.0, 47.5, 0.0]]
    );
    // Arrays, too.
    run(&folder, "fit in.csv -o in.npz --samples 1 --carry all --device cpu").code(0);
    run(&folder, "fit in.npz -o out.csv --every 1 --carry heading,drift:angle --device cpu --force").code(0);
    assert_eq!([column(&folder, "out.csv", 4)[1], column(&folder, "out.csv", 5)[1]], [0.0, -180.0]);
}

#[test]
fn a_last_time_given_twice_has_the_speed_of_arrival() {
    for (x, y) in [("lon", "lat"), ("x", "y")] {
        let folder = with(&format!("curve,{x},{y},t\na,0,0,0\na,1,0,1\na,2,0.5,2\na,2,1,2\n"));
        let unit = if x == "lon" { 111_195.0 } else { 1.0 };
        let globe: &[&str] = if x == "lon" { &["--surface wgs84", "--surface wgs84 --smoothing 1"] } else { &[] };
        for method in ["--method fair", "--method scf", "--smoothing 1", "--smoothing 0"].iter().chain(globe) {
            let said =
                contains("1 curve has several places at one time").and(contains("in.csv, line 5, curve a, point 3"));
            run(&folder, &format!("fit in.csv -o out.csv --every 1 --write speed --device cpu --force {method}"))
                .code(0)
                .stderr(said);
            let speeds = column(&folder, "out.csv", 4);
            assert!(
                speeds.len() == 3 && speeds.iter().all(|v| (0.9..1.7).contains(&(v / unit))),
                "{method}: {speeds:?}"
            );
            // On the way from one place to another at one time there is no speed.
            run(&folder, &format!("fit in.csv -o out.csv --samples 4 --write speed --device cpu --force {method}"))
                .code(0);
            let cells: Vec<String> = rows(&folder, "out.csv").into_iter().map(|row| row[4].clone()).collect();
            assert!(
                cells.iter().all(|cell| cell.is_empty() || cell.parse::<f64>().unwrap().is_finite()),
                "{method}: {cells:?}"
            );
            assert!((cells[8].parse::<f64>().unwrap() / unit - 1.3).abs() < 0.4, "{method}: {cells:?}");
        }
    }
    // Points that are given twice take no time, and the speed goes on.
    let folder = with("x,y,t\n0,0,0\n0,0,0\n1,0,1\n1,0,1\n2,0,2\n2,0,2\n");
    for method in ["natural", "fair", "scf"] {
        run(
            &folder,
            &format!("fit in.csv -o out.csv --samples 2 --write speed --device cpu --force --method {method}"),
        )
        .code(0);
        assert!(column(&folder, "out.csv", 4).iter().all(|v| (v - 1.0).abs() < 1e-9), "{method}");
    }
}

#[test]
fn geojson_has_times_and_columns_of_positions() {
    let features = |folder: &TempDir, options: &str| -> Vec<serde_json::Value> {
        run(folder, &format!("fit in.csv -o out.geojson --device cpu --force {options}")).code(0);
        let document: serde_json::Value = serde_json::from_str(&lines(folder, "out.geojson").join("\n")).unwrap();
        document["features"].as_array().unwrap().clone()
    };
    let folder = with(
        "curve,lon,lat,t,sog,COG,ship,note\na,0,0,2024-03-01T00:10:00+01:00,1,350,7,in\na,1,0,2024-03-01T02:10:00+01:00,2,10,7,\n\
         a,2,1,2024-03-01T04:10:00+01:00,,20,7,3\nb,0,5,2024-03-01T00:00:00Z,5,5,8,x\nb,0,6,2024-03-01T01:00:00Z,6,5,8,y\n",
    );
    let hours = features(&folder, "--every 1h --carry all");
    let expected = serde_json::json!({
        "curve": "a",
        "coordTimes": ["2024-03-01T01:00:00+01:00", "2024-03-01T02:00:00+01:00", "2024-03-01T03:00:00+01:00", "2024-03-01T04:00:00+01:00"],
        "sog": [1.0 + 50.0 / 120.0, 1.0 + 110.0 / 120.0, null, null],
        "COG": [350.0 + 20.0 * 50.0 / 120.0, 20.0 * 110.0 / 120.0 - 10.0, 10.0 + 10.0 * 50.0 / 120.0, 10.0 + 10.0 * 110.0 / 120.0],
        "ship": 7,
        "note": ["in", "", "", 3],
    });
    let [given, wanted] = [&hours[0]["properties"], &expected].map(|value| value.as_object().unwrap().clone());
    assert_eq!(given.keys().collect::<Vec<_>>(), wanted.keys().collect::<Vec<_>>());
    for (name, value) in wanted {
        let numbers = |value: &serde_json::Value| -> Option<Vec<f64>> {
            value.as_array()?.iter().map(|entry| if entry.is_null() { Some(-1.0) } else { entry.as_f64() }).collect()
        };
        match (numbers(&given[&name]), numbers(&value)) {
            (Some(a), Some(b)) => {
                assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12), "{name}: {a:?}")
            }
            _ => assert_eq!(given[&name], value, "{name}"),
        }
    }
    assert_eq!(
        hours[1]["properties"]["coordTimes"],
        serde_json::json!(["2024-03-01T00:00:00Z", "2024-03-01T01:00:00Z"])
    );
    // Where a line is cut its arrays are, too.
    let folder = with("lon,lat,t,v\n170,0,0,1\n176,0,1,2\n-176,0,3,4\n-170,0,4,5\n");
    let cut = features(&folder, "--samples 1 --carry v --method fair");
    assert_eq!(cut[0]["geometry"]["type"], "MultiLineString");
    let flat = |name: &str| {
        cut[0]["properties"][name]
            .as_array()
            .unwrap()
            .iter()
            .map(|part| part.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect())
            .collect::<Vec<Vec<f64>>>()
    };
    let (t, v) = (flat("t"), flat("v"));
    assert_eq!(t.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
    assert!(
        (t[0][2] - 2.0).abs() < 1e-9 && (v[1][0] - 3.0).abs() < 1e-9 && (t[1][2], v[1][2]) == (4.0, 5.0),
        "{t:?} {v:?}"
    );
    let kept = features(&folder, "--samples 1 --carry v --method fair --antimeridian keep");
    assert_eq!(kept[0]["properties"]["t"], serde_json::json!([0, 1, 3, 4]));
    // A closed curve comes back at a time of its own, and parameters that were not given are no times.
    let folder = with("x,y,t\n0,0,0\n1,0,1\n1,1,2\n0,0,5\n");
    assert_eq!(features(&folder, "--samples 1")[0]["properties"]["t"], serde_json::json!([0, 1, 2, 5]));
    fs::write(folder.path().join("in.csv"), "x,y\n0,0\n1,0\n1,1\n").unwrap();
    assert_eq!(features(&folder, "")[0]["properties"], serde_json::json!({"curve": "0"}));
}

#[test]
fn lambda_counts_hours_where_times_are_dates() {
    let rows = |time: &dyn Fn(u32) -> String| -> String {
        let row =
            |k: u32| format!("{},{},{}\n", 7.0 + 0.002 * f64::from(k), 54.0 + 0.001 * f64::from(k * k % 3), time(k));
        "lon,lat,t\n".to_string() + &(0..13).map(row).collect::<String>()
    };
    let folder = with(&rows(&|k| format!("2024-03-01T{:02}:{:02}:00Z", k / 12, k * 5 % 60)));
    fs::write(folder.path().join("hours.csv"), rows(&|k| (f64::from(k) / 12.0).to_string())).unwrap();
    let moved = |input: &str, options: &str| -> [f64; 2] {
        let fit = format!("fit {input} -o out.csv --report out.json --device cpu --force {options}");
        let said = contains("--smoothing 1 counts hours, since times are dates: 4.6656e10 in seconds");
        let outcome = run(&folder, &fit).code(0);
        if input == "in.csv" && options.starts_with("--smoothing 1") && !options.contains("chord") {
            outcome.stderr(said);
        } else {
            outcome.stderr(said.not());
        }
        let report: serde_json::Value = serde_json::from_str(&lines(&folder, "out.json").join("\n")).unwrap();
        ["max_deviation", "smoothing"].map(|what| report["curves"][0][what].as_f64().unwrap())
    };
    for options in ["--smoothing 1", "--smoothing 1 --surface wgs84", "--deviation 0.0005"] {
        let [dates, hours] = ["in.csv", "hours.csv"].map(|input| moved(input, options));
        assert!((0..2).all(|k| (dates[k] / hours[k] - 1.0).abs() < 1e-3), "{options}: {dates:?}, {hours:?}");
        assert!(hours[0] > 4e-4, "{options}: {hours:?}");
    }
    // Chords are no times.
    let chord = "--smoothing 1e-9 --parametrisation chord";
    assert_eq!(moved("in.csv", chord), moved("hours.csv", chord));
    run(&folder, "compare in.csv --smoothing 1 --device cpu").stderr(contains("counts hours"));
}

#[test]
fn distances_in_degrees_or_larger_than_curves_are_said() {
    let point = |k: u32| {
        format!(
            "<trkpt lat=\"{}\" lon=\"{}\"/>",
            47.0 + 0.01 * (0.33 * f64::from(k)).sin(),
            11.0 + 0.0005 * f64::from(k)
        )
    };
    let points: String = (0..40).map(point).collect();
    let folder = with("curve,x,y\nsmall,0,0\nsmall,1,1\nsmall,2,0\nlarge,0,5\nlarge,9,9\nlarge,20,5\n");
    fs::write(
        folder.path().join("run.gpx"),
        format!("<gpx><trk><name>run</name><trkseg>{points}</trkseg></trk></gpx>"),
    )
    .unwrap();
    for option in ["--deviation", "--tube", "--deviation 5 --method fair --pin"] {
        let (option, rest) = option.split_once(' ').unwrap_or((option, ""));
        let rest = if rest.is_empty() { "5".into() } else { format!("{rest} ends") };
        let sentence =
            contains(format!("{option} 5 is in degrees, as longitudes and latitudes are, up to 556 km on the ground"));
        let remedy =
            contains("run, the largest, measures 0.0279 degrees; for metres give --surface wgs84 --deviation 5");
        run(&folder, &format!("fit run.gpx -o out.csv {option} {rest} --device cpu"))
            .code(2)
            .stderr(sentence.and(remedy));
    }
    run(&folder, "fit run.gpx -o out.csv --deviation 5 --surface wgs84 --points 50 --device cpu")
        .code(0)
        .stderr(contains("degrees").not());
    let latitudes = column(&folder, "out.csv", 2);
    assert!(latitudes.iter().any(|y| (y - 47.0).abs() > 0.009), "{latitudes:?}");
    run(&folder, "fit run.gpx -o out.csv --deviation 0.0001 --device cpu --force").code(0).stderr(contains(
        "--deviation 0.0001 is in degrees, up to 11.1 m on the ground: with --surface wgs84 it is in metres",
    ));
    run(&folder, "fit run.gpx -o out.csv --deviation 2% --device cpu --force")
        .code(0)
        .stderr(contains("degrees").not());
    run(&folder, "fit run.gpx -o out.csv --spacing 0.01 --device cpu --force")
        .code(0)
        .stderr(contains("--spacing 0.01 is in degrees"));
    for option in ["--deviation", "--tube"] {
        let said = contains(format!("1 curve of 2 is smaller than {option} 3, small of size 2.24"));
        run(&folder, &format!("fit in.csv -o out.csv {option} 3 --device cpu --force")).code(0).stderr(said);
        run(&folder, &format!("fit in.csv -o out.csv {option} 1 --device cpu --force"))
            .code(0)
            .stderr(contains("smaller").not());
    }
    let said = contains("2 curves of 2 are smaller than --deviation 30, the largest of them large of size 20.4");
    run(&folder, "fit in.csv -o out.csv --deviation 30 --method fair --device cpu --force").stderr(said);
}
