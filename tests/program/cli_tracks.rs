//! `faircurve fit` on tracks in time, as their users meet it: positions of ships as a receiver writes them.

use std::fs;

use super::ran::{self, run};
use faircurve::io;
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

/// Two ships, out of order; the second pauses for a day, and crosses the antimeridian.
const SHIPS: &str = "MMSI,Time,LON,LAT,SOG,Status,Name
219000001,2024-03-01T00:50:00Z,10.6,55.1,12,moored,\"Anna, the\"
007123456,2024-03-01T00:10:00Z,179.6,-17.0,9,under way,Bob
219000001,2024-03-01T00:10:00Z,10.0,55.0,10,under way,\"Anna, the\"
219000001,2024-03-01T02:10:00Z,11.0,55.4,14,moored,\"Anna, the\"
007123456,2024-03-01T02:20:00Z,-179.8,-16.4,8,under way,Bob
007123456,2024-03-01T01:10:00Z,179.9,-16.8,8,under way,Bob
007123456,2024-03-02T02:20:00Z,-179.0,-16.0,8,moored,Bob
007123456,2024-03-02T04:20:00Z,-178.6,-15.0,8,moored,Bob
";

const ROLES: &str = "--columns curve=MMSI,t=Time,x=LON,y=LAT --device cpu";

fn ships() -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("ais.csv"), SHIPS).unwrap();
    folder
}

fn lines(folder: &TempDir, name: &str) -> Vec<String> {
    fs::read_to_string(folder.path().join(name)).unwrap().lines().map(String::from).collect()
}

#[test]
fn dirty_tracks_are_cleaned_and_what_is_dropped_is_said() {
    let folder = TempDir::new().unwrap();
    let minute = |k: u32| format!("2024-03-01T{:02}:{:02}:00Z", 12 + k / 60, k % 60);
    let mut rows = String::from("curve,lon,lat,t,ship\n");
    for k in 0..90_u32 {
        // It is moored for half an hour, and leaps once.
        let at = f64::from(if k < 40 { k } else { k.max(70) - 30 });
        let (lon, lat) = if k == 12 { (100.0, -3.0) } else { (-179.98 + 0.004 * at, 10.0) };
        rows += &format!("a,{},{lat},{},x{k}\n", if lon < -180.0 { lon + 360.0 } else { lon }, minute(k));
        if k == 20 {
            rows += &format!("a,{lon},{lat},{},twice\na,{lon},{lat},,blank\n", minute(k));
        }
    }
    fs::write(folder.path().join("in.csv"), rows).unwrap();
    let clean = "track in.csv --within 50m --max-speed 40kn --stops 100m,20min --device cpu";
    run(&folder, &format!("{clean} -o out.csv --every 10min --dropped dropped.csv"))
        .code(0)
        .stderr(contains("1 point is dropped, without a time or a place: in.csv, line 24, curve a, point 22"))
        .stderr(contains("1 point is dropped, too far to be reached in time: in.csv, line 14"))
        .stderr(contains("1 point is dropped, of a time that another point has: in.csv, line 23"))
        .stderr(contains("1 stop is held at one place"));
    let dropped = lines(&folder, "dropped.csv");
    assert_eq!(dropped[0], "curve,x,y,t,ship,why");
    for (word, count) in [("too fast", 1), ("blank", 1), ("duplicate", dropped.len() - 3)] {
        assert_eq!(dropped.iter().filter(|line| line.ends_with(&format!(",{word}"))).count(), count, "{dropped:?}");
    }
    // Nobody is dropped twice, and the rest is fitted.
    assert_eq!(lines(&folder, "out.csv").len(), 1 + 9);
    let refuse =
        |options: &str, sentence: &str| ran::refused(&folder, &format!("track in.csv -o no.csv {options}"), sentence);
    refuse("--within 50m --stops 100m", "give a radius and a time, such as 200m,10min");
    refuse("--within 50m --duplicates error", "its time is that of the point before");
    refuse("--within 50m --max-speed 40kn --dropped no.csv", "--output and --dropped both write no.csv");
    ran::refused(
        &folder,
        "fit in.csv -o no.csv --carry all --dropped d.csv",
        "add --max-speed, --duplicates, --robust or --stops",
    );
}

#[test]
fn two_ships_of_one_name_become_two_tracks() {
    let folder = TempDir::new().unwrap();
    // They take turns, minute by minute, and the second one leaps to a third place at every fifth turn.
    let mut rows = String::from("mmsi,lon,lat,time\n");
    for k in 0..120_u32 {
        let along = 0.002 * f64::from(k);
        let (lon, lat) = match k % 10 {
            own if own % 2 == 0 => (5.0 + along, 54.0),
            7 => (90.0, 0.0),
            _ => (-70.0, 41.0 + along),
        };
        rows += &format!("244,{lon},{lat},2024-03-01T{:02}:{:02}:00Z\n", 12 + k / 60, k % 60);
    }
    fs::write(folder.path().join("in.csv"), rows).unwrap();
    let track =
        "track in.csv -o out.csv --columns curve=mmsi,x=lon,y=lat,t=time --within 50m --max-speed 40kn --device cpu";
    run(&folder, &format!("{track} --every 10min --dropped d.csv"))
        .code(0)
        .stderr(contains("1 more track of several things of one name, too far apart for one: such as 244.2"))
        .stderr(contains("12 points are dropped, too far to be reached in time"));
    let out = lines(&folder, "out.csv");
    for (name, lon) in [("244.1,", 5.0), ("244.2,", -70.0)] {
        let own: Vec<&String> = out.iter().filter(|line| line.starts_with(name)).collect();
        let longitude = |line: &String| line.split(',').nth(1).unwrap().parse::<f64>().unwrap();
        assert!(own.len() >= 11 && own.iter().all(|line| (longitude(line) - lon).abs() < 0.3), "{out:?}");
    }
    assert_eq!(lines(&folder, "d.csv").len(), 1 + 12);
}

/// A run of 400 s on a circle, in GPX, with noise of a metre in both directions and 0.5 m in height.
fn run_with_noise(folder: &TempDir) {
    let (mut text, mut state) = (String::from("<gpx version=\"1.1\"><trk><trkseg>\n"), 1_u32);
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 23) - 1.0
    };
    for k in 0..400 {
        let angle = f64::from(k) / 100.0;
        let [lon, lat, ele] =
            [300.0 * angle.cos() + noise(), 300.0 * angle.sin() + noise(), 20.0 * angle.sin() + noise()];
        let ele = if k == 30 { String::new() } else { format!("<ele>{:.1}</ele>", 0.5 * ele + 100.0) };
        let (lon, lat) = (lon / 111_319.5, lat / 110_574.0 + if k == 200 { 1e-3 } else { 0.0 });
        text += &format!(
            "<trkpt lat=\"{lat:.7}\" lon=\"{lon:.7}\">{ele}<time>2026-05-01T06:{:02}:{:02}Z</time></trkpt>\n",
            k / 60,
            k % 60
        );
    }
    std::fs::write(folder.path().join("run.gpx"), text + "</trkseg></trk></gpx>").unwrap();
}

#[test]
fn runs_have_the_length_climb_and_pace_of_the_truth() {
    let folder = TempDir::new().unwrap();
    run_with_noise(&folder);
    let numbers = |name: &str| -> Vec<Vec<f64>> {
        let rows = lines(&folder, name).into_iter().skip(1);
        rows.map(|row| row.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect()).collect()
    };
    let columns = "--write arclength,speed,acceleration,turn_rate,gap --every 1s --device cpu";
    for heights in ["", "--within-height 0.8m"] {
        run(&folder, &format!("track run.gpx -o out.csv --force --robust {columns} {heights}")).code(0).stderr(
            contains("1 point is dropped, 5 times as far as noise from where the points before and after lead"),
        );
        assert_eq!(lines(&folder, "out.csv")[0], "curve,x,y,t,ele,arclength,speed,acceleration,turn_rate,gap");
        let rows = numbers("out.csv");
        let length = rows.last().unwrap()[5];
        assert!((length / (3.99 * 300.0) - 1.0).abs() < 0.01, "{length}");
        let mean = |column: usize| rows.iter().map(|row| row[column]).sum::<f64>() / rows.len() as f64;
        assert!((mean(6) / 3.0 - 1.0).abs() < 0.01 && mean(7).abs() < 0.01, "{} {}", mean(6), mean(7));
        // To the left, 3.99 radians in 399 s, less at the ends, which do not bend. Between 199 s and 201 s there
        // is no point.
        assert!((mean(8) + 0.01f64.to_degrees()).abs() < 0.03, "{}", mean(8));
        assert_eq!(rows.iter().filter(|row| row[9] != 0.0).map(|row| row[9]).collect::<Vec<_>>(), [2.0]);
        // 10 m up and 18 m down, but for what the noise leaves.
        let heights: Vec<f64> = rows.iter().map(|row| row[4]).filter(|x| x.is_finite()).collect();
        let climb: f64 = heights.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).sum();
        assert!((climb - 10.0).abs() < 1.0, "{climb}");
    }
    run(&folder, "track run.gpx -o km.csv --write speed --units km/h --every 1s --device cpu").code(0);
    run(&folder, "track run.gpx -o ms.csv --write speed --every 1s --device cpu").code(0);
    let [km, ms] = ["km.csv", "ms.csv"].map(|name| numbers(name)[50][5]);
    assert!((km / ms - 3.6).abs() < 1e-12, "{km} {ms}");
    // What GPX has a place for comes back, a point a second.
    run(&folder, "track run.gpx -o out.gpx --every 1s --device cpu").code(0);
    assert_eq!(std::fs::read_to_string(folder.path().join("out.gpx")).unwrap().matches("<time>").count(), 400);
}

#[test]
fn raw_positions_become_hourly_ones_with_all_that_belongs_to_them() {
    let folder = ships();
    run(
        &folder,
        &format!("fit ais.csv -o hours.csv {ROLES} --sort t --gap 6h --every 1h --carry all --write speed,heading"),
    )
    .code(0)
    .stderr(contains("3 curves, 8 points"));
    let lines = lines(&folder, "hours.csv");
    assert_eq!(lines[0], "curve,x,y,t,SOG,Status,Name,speed,heading");
    let starts: Vec<String> = lines[1..]
        .iter()
        .map(|line| line.split(',').take(1).chain(line.split(',').skip(3).take(3)).collect::<Vec<_>>().join(" "))
        .collect();
    // Linear in time: 10 + 2 · 50/40 min, 12 + 2 · 10/80 min. Texts are those of the nearest point.
    assert_eq!(
        starts,
        [
            "219000001 2024-03-01T01:00:00Z 12.25 moored",
            "219000001 2024-03-01T02:00:00Z 13.75 moored",
            "007123456.1 2024-03-01T01:00:00Z 8.166666666666666 under way",
            "007123456.1 2024-03-01T02:00:00Z 8 under way",
            "007123456.2 2024-03-02T03:00:00Z 8 moored",
            "007123456.2 2024-03-02T04:00:00Z 8 moored",
        ]
    );
    assert!(lines[1].contains(",\"Anna, the\",") && lines[3].contains(",Bob,"));
    // Longitudes come back to ±180.
    let longitude = |line: &String| line.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    assert!(longitude(&lines[3]) > 179.8 && longitude(&lines[4]) < -179.8, "{lines:?}");
    // The last track is a straight line of 0.4 and 1 degrees in two hours.
    let [speed, heading] = [7, 8].map(|k| lines[6].split(',').nth(k).unwrap().parse::<f64>().unwrap());
    let east = 0.4 * (-15.5_f64).to_radians().cos();
    let metres = east.hypot(1.0).to_radians() * 6_371_008.771_4;
    assert!((speed / (metres / 7200.0) - 1.0).abs() < 1e-3, "{speed} {metres}");
    let course = (0.4 * (-15.1666_f64).to_radians().cos()).atan2(1.0).to_degrees();
    assert!((heading - course).abs() < 1e-3, "{heading} {course}");
}

#[test]
fn what_is_written_is_read_again_with_its_times() {
    let folder = ships();
    run(&folder, &format!("fit ais.csv -o a.tsv {ROLES} --sort t --samples 1 --carry Name,SOG:nearest")).code(0);
    let lines = lines(&folder, "a.tsv");
    assert_eq!(lines[0], "curve\tx\ty\tt\tSOG\tName");
    assert_eq!(lines[1], "219000001\t10\t55\t2024-03-01T00:10:00Z\t10\tAnna, the");
    let again = io::read_with(
        folder.path().join("a.tsv"),
        &io::ReadOptions { carried: "all".parse().unwrap(), ..Default::default() },
    )
    .unwrap();
    assert!(again.has_dates());
    assert_eq!(again.parameters(0).unwrap(), [600.0, 3000.0, 7800.0].map(|t| t + 1_709_251_200.0));
}

#[test]
fn every_method_gives_the_times_between_those_given() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("in.csv"), "x,y,t\n0,0,3\n2,1,5\n3,0,5.5\n5,2,11\n").unwrap();
    for method in ["natural", "smoothing --smoothing 0.1", "fair --energy bending=1,length=1", "scf"] {
        run(&folder, &format!("fit in.csv -o out.csv --force --device cpu --method {method} --samples 2")).code(0);
        let t: Vec<f64> = lines(&folder, "out.csv")[1..]
            .iter()
            .map(|line| line.rsplit(',').next().unwrap().parse().unwrap())
            .collect();
        assert_eq!(t, [3.0, 4.0, 5.0, 5.25, 5.5, 8.25, 11.0], "{method}");
        // Whole numbers within the times; never outside.
        run(&folder, &format!("fit in.csv -o out.csv --force --device cpu --method {method} --every 4")).code(0);
        let t: Vec<String> =
            lines(&folder, "out.csv")[1..].iter().map(|line| line.rsplit(',').next().unwrap().into()).collect();
        assert_eq!(t, ["4", "8"], "{method}");
    }
}

#[test]
fn samples_at_given_times_and_in_given_numbers() {
    let folder = ships();
    fs::write(
        folder.path().join("at.csv"),
        "curve,t\n219000001,2024-03-01T01:30:00Z\n007123456,2024-03-01 02:00\n219000001,2030-01-01\n",
    )
    .unwrap();
    run(&folder, &format!("fit ais.csv -o at.out.csv {ROLES} --sort t --gap 6h --at at.csv")).code(0);
    let at = lines(&folder, "at.out.csv");
    assert_eq!((at.len(), &at[1][..10], &at[2][..12]), (3, "219000001,", "007123456.1,"));
    // In a plane, where equal lengths of the curve are equal lengths.
    fs::write(folder.path().join("plane.csv"), SHIPS.replace("LON,LAT", "E,N")).unwrap();
    let roles = ROLES.replace("x=LON,y=LAT", "x=E,y=N");
    run(
        &folder,
        &format!("fit plane.csv -o seven.csv {roles} --sort t --points 7 --write arclength,curvature,tangent"),
    )
    .code(0);
    let seven = lines(&folder, "seven.csv");
    assert_eq!(seven[0], "curve,x,y,t,arclength,curvature,tangent_x,tangent_y");
    let lengths: Vec<f64> = seven[1..8].iter().map(|line| line.split(',').nth(4).unwrap().parse().unwrap()).collect();
    assert!(
        seven.len() == 15 && (1..7).all(|k| (lengths[k] - k as f64 * lengths[6] / 6.0).abs() < 1e-8),
        "{lengths:?}"
    );
    fs::write(folder.path().join("times"), "t\n1\nnoon\n").unwrap();
    run(&folder, &format!("fit ais.csv -o no.csv {ROLES} --sort t --at times"))
        .code(2)
        .stderr(contains("times, line 3: column t holds \"noon\""));
}

#[test]
fn options_of_tracks_are_refused_where_they_mean_nothing() {
    let folder = ships();
    fs::write(folder.path().join("plain.csv"), "x,y\n0,0\n1,1\n2,0\n").unwrap();
    for (arguments, sentence) in [
        ("plain.csv -o o.csv --every 1", "needs times, and the points have none"),
        ("plain.csv -o o.csv --gap 1", "no times to see gaps in"),
        ("plain.csv -o o.csv --write speed", "the speed needs times"),
        ("plain.csv -o o.csv --points 1", "--points is 1; a curve has two ends: give 2 or more"),
        ("plain.csv -o o.svg --write heading", "--write makes columns, and SVG has none: write CSV, NPZ, TRK"),
        ("plain.csv -o o.csv --as bezier --points 5", "--as bezier writes the curves themselves: leave --points out"),
        ("plain.csv -o o.csv --carry speed", "there is no column \"speed\" to carry: the columns are \"x\", \"y\""),
        ("ais.csv -o o.csv --columns x=LON,y=LAT,t=SOG --every 1h", "the times of the curves are numbers and no dates"),
        (
            "ais.csv -o o.csv --columns x=LON,y=LAT,t=Time --sort t --every 1mo",
            "months and years differ in length: give days",
        ),
        (
            "ais.csv -o o.csv --columns x=LON,y=LAT,t=Time --sort t --every soon",
            "it must be a number or a time such as 90s",
        ),
        ("ais.csv -o o.csv --columns x=LON,y=LAT,t=Time --sort t --gap 0", "a length of time must be positive"),
        ("ais.csv -o o.csv --columns x=LON,y=LAT,t=Name", "which is neither a number nor a date such as"),
        (
            "ais.csv -o o.csv --columns x=LON,y=LAT,t=Time --sort t --every 1e-9",
            "of all are possible: give 0.0051 s or more",
        ),
    ] {
        run(&folder, &format!("fit {arguments} --device cpu")).code(2).stderr(contains(sentence));
    }
    run(&folder, "fit ais.csv -o o.csv --device cpu").code(2).stderr(contains("--columns").and(contains("--carry")));
    // Times that go back name the way out, in words of dates.
    run(&folder, &format!("fit ais.csv -o o.csv {ROLES}"))
        .code(1)
        .stderr(contains("decreases from 2024-03-01T00:50:00Z to 2024-03-01T00:10:00Z: sort the points (--sort t)"));
}

#[test]
fn curves_are_cut_at_the_antimeridian_and_their_geometries_say_so() {
    let folder = ships();
    let map = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","properties":{"n":1},"geometry":{"coordinates":[[170,0],[178,2],[-178,4],[-170,3]],"type":"LineString"}},
        {"type":"Feature","properties":{"n":2},"geometry":{"type":"Polygon","coordinates":[[[176,10],[-176,10],[-175,15],[177,15],[176,10]]]}},
        {"type":"Feature","properties":{"n":3},"geometry":{"type":"LineString","coordinates":[[0,0],[1,1],[2,0]]}}]}"#;
    fs::write(folder.path().join("map.geojson"), map).unwrap();
    let kinds = |name: &str| -> Vec<String> {
        let document: serde_json::Value = serde_json::from_str(&lines(&folder, name).join("\n")).unwrap();
        let geometry = |k: usize| document["features"][k]["geometry"].clone();
        let all: Vec<_> = (0..3).map(geometry).collect();
        if name == "cut.geojson" {
            let flat = |value: &serde_json::Value| serde_json::to_string(value).unwrap();
            let numbers = flat(&serde_json::json!(all));
            let positions: Vec<f64> = numbers.split(['[', ',', ']']).filter_map(|text| text.parse().ok()).collect();
            assert!(
                positions.iter().all(|x| x.abs() <= 180.0) && numbers.contains("[180,") && numbers.contains("[-180,"),
                "{numbers}"
            );
        }
        all.iter().map(|geometry| geometry["type"].as_str().unwrap().to_string()).collect()
    };
    run(&folder, "fit map.geojson -o cut.geojson --device cpu --samples 4").code(0);
    assert_eq!(kinds("cut.geojson"), ["MultiLineString", "MultiPolygon", "LineString"]);
    run(&folder, "fit map.geojson -o keep.geojson --device cpu --samples 4 --antimeridian keep").code(0);
    assert_eq!(kinds("keep.geojson"), ["LineString", "Polygon", "LineString"]);
    // A ship's constant columns are its properties.
    run(&folder, &format!("fit ais.csv -o ships.geojson {ROLES} --sort t --carry all")).code(0);
    let ships = lines(&folder, "ships.geojson").join("\n");
    for (curve, name, kind) in [("219000001", "Anna, the", "LineString"), ("007123456", "Bob", "MultiLineString")] {
        let begin = format!(r#""properties":{{"curve":"{curve}","#);
        let end = format!(r#","Name":"{name}"}},"geometry":{{"type":"{kind}""#);
        assert!(ships.contains(&begin) && ships.contains(&end), "{ships}");
    }
}

#[test]
fn lengths_and_speeds_of_longitudes_and_latitudes_are_metres_on_the_earth() {
    let folder = ships();
    // A quarter of the equator, of a meridian, and of the parallel of 60°, in 1,000 s each; across
    // ±180° too.
    let quarter = std::f64::consts::FRAC_PI_2 * 6_371_008.771_4;
    let rows = "curve,t,lon,lat\n\
        equator,0,0,0\nequator,500,45,0\nequator,1000,90,0\n\
        meridian,0,5,0\nmeridian,500,5,45\nmeridian,1000,5,90\n\
        parallel,0,150,60\nparallel,500,-165,60\nparallel,1000,-120,60\n";
    fs::write(folder.path().join("quarters.csv"), rows).unwrap();
    fs::write(folder.path().join("plane.csv"), rows.replace("lon,lat", "x,y")).unwrap();
    // The last length and speed of each curve.
    let ends = |input: &str| -> Vec<(f64, f64)> {
        run(&folder, &format!("fit {input} -o o.csv --every 100 --write arclength,speed --device cpu --force")).code(0);
        let written = lines(&folder, "o.csv");
        assert_eq!(written[0].split(',').skip(4).collect::<Vec<_>>(), ["arclength", "speed"]);
        let row = |line: &String| -> (f64, f64) {
            let fields: Vec<&str> = line.split(',').collect();
            (fields[4].parse().unwrap(), fields[5].parse().unwrap())
        };
        written[1..].chunks(11).map(|curve| row(&curve[10])).collect()
    };
    let lengths = [quarter, quarter, quarter / 2.0];
    for ((length, speed), expected) in ends("quarters.csv").into_iter().zip(lengths) {
        // The splines are straight, but for the rounding of their points.
        assert!((length / expected - 1.0).abs() < 1e-9, "{length} instead of {expected}");
        assert!((speed / (expected / 1000.0) - 1.0).abs() < 1e-9, "{speed}");
    }
    assert_eq!(ends("plane.csv")[0], (90.0, 0.09));
}
