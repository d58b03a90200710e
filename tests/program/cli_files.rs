//! What is read from files, and what becomes of it: nothing is lost, changed or made up without a word.

use std::fs;

use super::ran::run;
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().unwrap();
    files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    folder
}

#[test]
fn files_without_curves_become_files_without_curves() {
    let folder = folder(&[
        ("a.geojson", "{\"type\":\"FeatureCollection\",\"features\":[]}"),
        ("a.csv", "curve,x,y\n"),
        ("a.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"><text>a</text></svg>"),
        ("a.gpx", "<gpx><wpt lat=\"1\" lon=\"2\"/></gpx>"),
    ]);
    let end: Vec<u8> = [f32::INFINITY; 3].iter().flat_map(|x| x.to_le_bytes()).collect();
    let tck = [b"mrtrix tracks\nfile: . 29\nEND\n".as_slice(), &end].concat();
    fs::write(folder.path().join("a.tck"), tck).unwrap();
    for name in ["a.geojson", "a.csv", "a.svg", "a.gpx", "a.tck"] {
        let out = format!("out.{}", &name[2..]);
        for command in ["fit", "fit --method fair --every 1", "fit --gap 1 --as polyline", "fit --report r.html"] {
            run(&folder, &format!("{command} {name} -o {out} --device cpu --force"))
                .code(0)
                .stderr(contains("0 curves, 0 points").and(contains("no curve was found: ")));
        }
        let [given, written] = [name, &out].map(|name| fs::read(folder.path().join(name)).unwrap());
        match &name[2..] {
            "csv" => assert_eq!(written, b"curve,x,y,t\n"),
            "tck" => assert!(written.ends_with(&end)),
            _ => assert_eq!(written, given, "{name}"),
        }
        let refused = format!("fit {name} -o strict.{} --device cpu --strict", &name[2..]);
        run(&folder, &refused).code(2).stderr(contains(format!("{name} has no curve, which --strict refuses")));
        assert!(!folder.path().join(format!("strict.{}", &name[2..])).exists());
    }
    run(&folder, "bezier a.svg -o out.svg --simplify --tolerance 0.1 --force").code(0);
    run(&folder, "bezier a.svg -o strict.svg --strict").code(2);
}

#[test]
fn what_is_no_track_stays_unless_tracks_are_divided() {
    let point = |k: u8| format!("<trkpt lat=\"1\" lon=\"{k}\"><time>2024-01-01T0{k}:00:00Z</time></trkpt>");
    let track = format!("<trk><name>a</name><type>b</type><trkseg>{}{}{}</trkseg></trk>", point(1), point(2), point(8));
    let folder = folder(&[("in.gpx", &format!("<gpx><metadata><name>Day</name></metadata>{track}</gpx>"))]);
    for (gap, stays) in [("7h", true), ("2h", false)] {
        let ran = run(&folder, &format!("fit in.gpx -o out.gpx --gap {gap} --samples 1 --device cpu --force")).code(0);
        let text = fs::read_to_string(folder.path().join("out.gpx")).unwrap();
        assert_eq!(text.contains("<name>Day</name>") && text.contains("<type>b</type>"), stays, "{text}");
        assert_eq!(text.matches("<time>2024-01-01T0").count(), 3, "{text}");
        let word = contains("what is no track is left out: out.gpx has no place for it");
        if stays {
            ran.stderr(word.not())
        } else {
            ran.stderr(word)
        };
    }
}

const SPEEDS: &str = "curve,x,y,t,speed,ship\na,0,0,1,5,X\na,1,2,2,6,X\na,3,3,3,7,X\n";

#[test]
fn what_an_output_has_no_place_for_is_named() {
    let folder = folder(&[("in.csv", SPEEDS)]);
    let left_out = |arguments: &str, line: Option<&str>| {
        let ran = run(&folder, &format!("fit in.csv --carry all --device cpu --force {arguments}")).code(0);
        match line {
            Some(line) => ran.stderr(contains(format!("faircurve: {line}\n"))),
            None => ran.stderr(contains("left out").not()),
        };
    };
    left_out("-o a.csv", None);
    left_out("-o a.npz", None);
    // Lines of GeoJSON have the times and columns of their positions, and topologies what is one for a line.
    left_out("-o a.geojson", None);
    left_out("-o a.geojson --every 1", None);
    left_out("-o a.topojson", Some("speed and times are left out: a.topojson has no place for them"));
    left_out("-o a.svg", Some("speed, ship and times are left out: a.svg has no place for them"));
    left_out("-o a.npy", Some("speed, ship and times are left out: a.npy has no place for them"));
    left_out("-o a.gpx", Some("speed and ship are left out: a.gpx has no place for them"));
    fs::write(folder.path().join("in.csv"), "curve,x,y,z,fa\na,0,0,1,5\na,1,2,2,6\na,3,3,3,7\n").unwrap();
    left_out("-o a.trk", None);
    left_out("-o a.tck", Some("fa is left out: a.tck has no place for it"));
    // Columns of TRK come without being asked for.
    run(&folder, "fit a.trk -o b.tck --device cpu")
        .code(0)
        .stderr(contains("fa is left out: b.tck has no place for it"));
}

#[test]
fn curves_without_times_keep_their_points_where_times_are_asked() {
    let folder = folder(&[("in.csv", "curve,x,y,t\na,0,0,0\na,1,2,2\na,3,3,4\nb,0,0,\nb,1,1,\nb,3,0,\n")]);
    run(&folder, "fit in.csv -o out.csv --every 1 --device cpu --write speed")
        .code(0)
        .stderr(contains("1 curve has no times, such as b: points stay as they are"));
    let text = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert_eq!(text.lines().filter(|line| line.starts_with("a,")).count(), 5, "{text}");
    assert!(text.ends_with("b,0,0,,\nb,1,1,,\nb,3,0,,\n"), "{text}");
}
