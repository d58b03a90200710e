//! Tracks of receivers.

use faircurve::io::{self, Format, ReadOptions, WriteOptions};
use faircurve::{CurveBatch, Values};

const WALK: &str = r#"<?xml version="1.0"?>
<gpx version="1.1" creator="a watch" xmlns="http://www.topografix.com/GPX/1/1"><metadata><name>all</name></metadata>
<wpt lat="1" lon="2"/>
<trk><name>Up &amp; down</name><trkseg>
<trkpt lat="46.5" lon="179.9"><ele>800.5</ele><time>2024-03-01T06:00:00Z</time><extensions><hr>90</hr></extensions></trkpt>
<trkpt lat="46.6" lon="-179.9"><ele>900</ele><time>2024-03-01T06:10:00.5Z</time></trkpt>
</trkseg><trkseg><trkpt lat="46.7" lon="-179.8"><time>2024-03-01T07:00:00Z</time></trkpt>
<trkpt lat="46.8" lon="-179.7"><ele>1000</ele><time>2024-03-01T08:00:00Z</time></trkpt></trkseg></trk>
<rte><name>Way</name><rtept lat="1" lon="2"><time>2024-03-01T06:00:00Z</time></rtept></rte></gpx>
"#;

fn parsed(text: &str) -> Result<CurveBatch, String> {
    let options = ReadOptions { format: Some(Format::Gpx), ..ReadOptions::default() };
    io::read_from(text.as_bytes(), &options).map_err(|error| error.to_string())
}

fn written(batch: &CurveBatch) -> String {
    let mut bytes = Vec::new();
    io::write_to(&mut bytes, batch, &WriteOptions { format: Some(Format::Gpx), ..WriteOptions::default() }).unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn segments_and_routes_are_curves_with_times_and_elevations() {
    let batch = parsed(WALK).unwrap();
    let names: Vec<_> = (0..batch.len()).map(|i| batch.name(i).into_owned()).collect();
    assert_eq!(names, ["Up & down.1", "Up & down.2", "Way"]);
    assert_eq!(batch.points(0), [179.9, 46.5, 180.1, 46.6], "on past 180");
    let t = batch.parameters(0).unwrap();
    assert_eq!(t[1] - t[0], 600.5);
    let Values::Numbers(elevations) = &batch.columns()[0].values else { panic!() };
    assert_eq!(elevations[..2], [800.5, 900.0]);
    assert!(elevations[2].is_nan() && batch.has_dates() && batch.is_geographic());
}

#[test]
fn tracks_come_back_with_their_segments_and_within_half_a_turn() {
    let batch = parsed(WALK).unwrap();
    let text = written(&batch);
    assert_eq!((text.matches("<trk>").count(), text.matches("<trkseg>").count()), (2, 3), "{text}");
    for part in [
        "<name>Up &amp; down</name>",
        "<trkpt lat=\"46.5\" lon=\"179.9\"><ele>800.5</ele><time>2024-03-01T06:00:00.0Z</time></trkpt>",
        "<time>2024-03-01T06:10:00.5Z</time>",
        "<trkpt lat=\"46.7\" lon=\"-179.8\"><time>",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let back = parsed(&text).unwrap();
    assert_eq!(back.parameters(0), batch.parameters(0));
    assert_eq!((back.offsets(), back.name(2)), (batch.offsets(), batch.name(2)));
    let far = back.coords().iter().zip(batch.coords()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(far < 1e-12, "{far}");
}

#[test]
fn points_without_times_leave_times_out_and_damage_is_a_sentence() {
    let untimed = WALK.replacen("<time>2024-03-01T07:00:00Z</time>", "", 1);
    let batch = parsed(&untimed).unwrap();
    assert!(batch.parameters(0).is_none());
    assert_eq!(batch.notes(), ["1 of 5 points have no time, and times are left out"]);
    for (from, to, sentence) in [
        ("lat=\"46.6\"", "lat=\"north\"", "input, line 6: <trkpt>: its lat is \"north\": mend it"),
        ("<ele>900<", "<ele>high<", "line 6: <trkpt>: its ele is \"high\""),
        ("06:10:00.5Z", "later", "line 6: <trkpt>: its time is"),
        ("</gpx>", "", "this is no XML, or the file was cut off"),
    ] {
        let found = parsed(&WALK.replacen(from, to, 1)).map(|batch| batch.len()).unwrap_err();
        assert!(found.contains(sentence), "{found}, not {sentence}");
    }
    assert!(parsed("<svg/>").unwrap_err().contains("the document is <svg>, and must be <gpx>: give a GPX file"));
    assert!(parsed("<gpx/>").unwrap_err().contains("no curve was found: there is no track and no route"));
}
