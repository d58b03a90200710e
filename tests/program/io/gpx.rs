//! Tracks of receivers.

use faircurve::io::{self, Closed, Format, ReadOptions, WriteOptions};
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
    let heart: Vec<_> = batch.columns()[1..].iter().map(|column| (&*column.name, &column.values)).collect();
    let [("hr", Values::Numbers(heart))] = &heart[..] else { panic!("{heart:?}") };
    assert!(heart[0] == 90.0 && heart[1..].iter().all(|x| x.is_nan()));
    assert_eq!(batch.notes(), ["1 waypoint passed over: tracks, routes and numbers of their points are read"]);
}

#[test]
fn files_come_back_with_all_else_and_within_half_a_turn() {
    let batch = parsed(WALK).unwrap();
    let text = written(&batch);
    assert_eq!((text.matches("<trk>").count(), text.matches("<trkseg>").count()), (1, 2), "{text}");
    for part in [
        "creator=\"a watch\"",
        "<metadata><name>all</name></metadata>\n<wpt lat=\"1\" lon=\"2\"/>",
        "<rte><name>Way</name><rtept lat=\"1\" lon=\"2\"><time>",
        "<name>Up &amp; down</name>",
        "<trkpt lat=\"46.5\" lon=\"179.9\"><ele>800.5</ele><time>2024-03-01T06:00:00.0Z</time><extensions><hr>90</hr></extensions></trkpt>",
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
fn a_point_without_a_time_takes_times_from_its_curve_alone() {
    for (without, untimed) in [("07:00:00Z", [false, true, false]), ("06:10:00.5Z", [true, false, false])] {
        for time in [String::new(), "<time/>".into(), "<time>null</time>".into()] {
            let batch = parsed(&WALK.replacen(&format!("<time>2024-03-01T{without}</time>"), &time, 1)).unwrap();
            assert_eq!([0, 1, 2].map(|i| batch.parameters(i).is_none()), untimed, "{without} {time}");
            let notes = batch.notes().join("\n");
            assert!(notes.contains("1 curve has points without a time, such as Up & down."), "{notes}");
            assert_eq!(
                notes.contains("1 value is taken for missing, such as time \"null\" in line "),
                time.contains("null")
            );
            // None is made up, whatever is made of the curves, and the others keep theirs.
            let fit = faircurve::spline::Natural::default().fit(&batch, &faircurve::Device::cpu()).unwrap();
            let samples = fit.polylines(faircurve::Sampling::PerSpan(2));
            let text = written(&samples);
            let points = |i: usize| if untimed[i] { 0 } else { samples.count(i) };
            assert_eq!(text.matches("<time>2024-03-01T0").count(), (0..3).map(points).sum::<usize>(), "{text}");
            assert_eq!(text.matches("<time>").count(), text.matches("<time>2024").count());
            let options = WriteOptions { format: Some(Format::Csv), ..WriteOptions::default() };
            let mut table = Vec::new();
            io::write_to(&mut table, &samples, &options).unwrap();
            let options = ReadOptions { format: Some(Format::Csv), ..ReadOptions::default() };
            let back = io::read_from(&table[..], &options).unwrap();
            for (i, is_untimed) in untimed.into_iter().enumerate() {
                assert_eq!((back.parameters(i).is_none(), back.problem(i)), (is_untimed, None), "{without}");
            }
        }
    }
    let none = WALK.replace("<time>", "<when>").replace("</time>", "</when>");
    let batch = parsed(&none).unwrap();
    assert!((0..3).all(|i| batch.parameters(i).is_none()) && !batch.has_dates());
    assert!(batch.notes()[0].contains("\"when\" of points passed over"), "{:?}", batch.notes());
}

#[test]
fn a_curve_without_times_is_fitted_as_it_is_alone() {
    let route = "<rte><rtept lat=\"1\" lon=\"2\"/><rtept lat=\"1.5\" lon=\"2\"/><rtept lat=\"1.5\" lon=\"2.1\"/></rte>";
    let alone = parsed(&format!("<gpx>{route}</gpx>")).unwrap();
    let beside = parsed(&WALK.replace("</gpx>", &format!("{route}</gpx>"))).unwrap();
    for smooths in [false, true] {
        let points = |batch: &CurveBatch, i: usize| {
            let (cpu, sampling) = (faircurve::Device::cpu(), faircurve::Sampling::PerSpan(3));
            let fit = match smooths {
                false => faircurve::spline::Natural::default().fit(batch, &cpu),
                true => faircurve::spline::Smoothing::default().fit(batch, &cpu),
            };
            fit.unwrap().polylines(sampling).points(i).to_vec()
        };
        assert_eq!(points(&alone, 0), points(&beside, 3), "{smooths}");
    }
}

#[test]
fn a_point_without_a_place_is_its_curve_s_trouble_alone() {
    for lat in ["", "north", "47,1", "NaN", "1e9"] {
        let text = WALK.replacen("lat=\"46.7\"", &format!("lat=\"{lat}\""), 1);
        let batch = parsed(&text).unwrap();
        assert_eq!([0, 2].map(|i| batch.problem(i)), [None, None]);
        let message = &batch.problem(1).unwrap().message;
        let wanted =
            format!("input, curve Up & down.2, point 0: its lat is {lat:?} (line 7): mend it, or remove the point");
        assert_eq!(*message, wanted);
        assert!(batch.is_geographic() && batch.parameters(0).is_some());
        // Its points stay as they were.
        assert!(
            written(&batch).contains(&format!("<trkpt lat=\"{lat}\" lon=\"-179.8\"><time>2024-03-01T07:00:00Z</time>"))
        );
    }
    let high = parsed(&WALK.replacen("<ele>900<", "<ele>high<", 1)).unwrap();
    let Values::Numbers(elevations) = &high.columns()[0].values else { panic!() };
    assert!(elevations[1].is_nan() && high.problem(0).is_none());
    assert!(high.notes()[1].contains("such as ele \"high\" in line 6"), "{:?}", high.notes());
    let cut = parsed(&WALK.replacen("</gpx>", "", 1)).unwrap_err();
    assert!(cut.contains("this is no XML, or the file was cut off"), "{cut}");
    assert!(parsed("<svg/>").unwrap_err().contains("the document is <svg>, and must be <gpx>: give a GPX file"));
    assert!(parsed("<gpx/>").unwrap().notes()[0].contains("no curve was found: there is no track and no route"));
}

#[test]
fn a_closed_track_is_back_at_its_start_later() {
    let options = ReadOptions { format: Some(Format::Gpx), closed: Closed::Yes, ..ReadOptions::default() };
    let batch = io::read_from(WALK.as_bytes(), &options).unwrap();
    let text = written(&batch);
    let times: Vec<&str> = text.split("<time>").skip(1).map(|rest| rest.split('<').next().unwrap()).collect();
    assert_eq!(times[..2], ["2024-03-01T06:00:00.0Z", "2024-03-01T06:10:00.5Z"]);
    assert!(times[2] > times[1], "{times:?}");
}

#[test]
fn numbers_of_points_go_along_within_the_elements_around_them() {
    let point = |k: u8, within: &str| {
        format!("\n  <g:trkpt lat=\"1\" lon=\"{k}\"><g:time>2024-01-01T00:00:0{k}Z</g:time>{within}</g:trkpt>")
    };
    let heart = |beats: u8, degrees: &str| {
        format!(
            "<g:extensions><t:x><t:hr>{beats}</t:hr><t:temp>{degrees}</t:temp></t:x><power>{beats}</power></g:extensions>"
        )
    };
    let text = format!(
        "<g:gpx xmlns:g=\"urn:g\" xmlns:t=\"urn:t\"><g:metadata><g:bounds minlat=\"1\"/></g:metadata><g:trk><g:trkseg>{}{}{}\n</g:trkseg></g:trk></g:gpx>",
        point(0, &heart(100, "1.5")),
        point(2, &heart(105, "2.5")),
        point(4, "<g:sym>Flag</g:sym>")
    );
    let batch = parsed(&text).unwrap();
    let names: Vec<&str> = batch.columns().iter().map(|column| &*column.name).collect();
    assert_eq!(names, ["hr", "temp", "power"]);
    assert_eq!(batch.notes(), ["\"sym\" of points passed over: tracks, routes and numbers of their points are read"]);
    let fit = faircurve::spline::Natural::default().fit(&batch, &faircurve::Device::cpu()).unwrap();
    let samples = faircurve::tracks::sample(&batch, &fit, &faircurve::tracks::At::Every(1.0), &[]).unwrap();
    let text = written(&samples);
    // Beats have no fractions, and bounds would no longer be true.
    let wanted = "\n  <g:trkpt lat=\"1\" lon=\"1\"><g:time>2024-01-01T00:00:01Z</g:time><g:extensions><t:x><t:hr>103</t:hr>\
                  <t:temp>2</t:temp></t:x><power>103</power></g:extensions></g:trkpt>\n  <g:trkpt";
    assert!(text.contains(wanted) && text.contains("<g:metadata></g:metadata>"), "{text}");
    assert_eq!(text.matches("<g:trkpt ").count(), 5);
    assert_eq!(Format::Gpx.left_out(&samples), [""; 0]);
}

#[test]
fn xml_is_decoded_as_it_declares_itself() {
    let text = |encoding: &str| {
        WALK.replace("<?xml version=\"1.0\"?>", &format!("<?xml version='1.0' encoding = '{encoding}'?>"))
            .replace("Way", "Zürich")
    };
    let latin = |encoding: &str| text(encoding).chars().map(|c| c as u8).collect::<Vec<u8>>();
    let units = |encoding: &str, mark: &str, encode: fn(u16) -> [u8; 2]| {
        format!("{mark}{}", text(encoding)).encode_utf16().flat_map(encode).collect::<Vec<u8>>()
    };
    let files = [
        latin("ISO-8859-1"),
        latin("windows-1252"),
        text("utf-8").into_bytes(),
        format!("\u{feff}{}", text("UTF-8")).into_bytes(),
        text("utf-16").into_bytes(),
        units("UTF-16", "\u{feff}", u16::to_le_bytes),
        units("UTF-16", "\u{feff}", u16::to_be_bytes),
        units("ISO-8859-1", "", u16::to_le_bytes),
        units("UTF-16BE", "", u16::to_be_bytes),
    ];
    let read = |bytes: &[u8]| {
        let options = ReadOptions { format: Some(Format::Gpx), ..ReadOptions::default() };
        io::read_from(bytes, &options).map_err(|error| error.to_string())
    };
    for (k, bytes) in files.iter().enumerate() {
        let batch = read(bytes).unwrap();
        assert_eq!(batch.name(2), "Zürich", "file {k}");
        let written = written(&batch);
        assert!(
            written.contains("encoding = 'UTF-8'") && written.contains("<name>Zürich</name>"),
            "file {k}: {written}"
        );
    }
    let euro = [&b"<?xml version='1.0' encoding='windows-1252'?><gpx><rte><name>\x80</name></rte></gpx>"[..]].concat();
    assert_eq!(read(&euro).unwrap().name(0), "€");
    let error = read(&latin("Shift_JIS")).unwrap_err();
    assert!(
        error.starts_with("input, line 1: its encoding is \"Shift_JIS\", and UTF-8, UTF-16, ISO-8859-1"),
        "{error}"
    );
    let error = read(&latin("UTF-8")).unwrap_err();
    assert!(error.contains("line 9: byte") && error.contains("is not UTF-8 text: save the file as UTF-8"), "{error}");
    let odd = &files[5][..files[5].len() - 1];
    let error = read(odd).unwrap_err();
    assert!(error.contains("the text begins as UTF-16, and is damaged or cut off"), "{error}");
}

#[test]
fn courses_are_angles_and_every_track_has_its_own_offset() {
    let point = |k: u8, course: u16, zone: &str| {
        let time = format!("<time>2024-03-01T0{k}:00:00{zone}</time>");
        format!("<trkpt lat=\"1\" lon=\"{k}\">{time}<extensions><course>{course}</course></extensions></trkpt>")
    };
    let track = |zone: &str| {
        let points = [point(1, 350, zone), point(2, 10, zone), point(3, 20, zone)];
        format!("<trk><trkseg>{}</trkseg></trk>", points.concat())
    };
    let batch = parsed(&format!("<gpx>{}{}</gpx>", track("Z"), track("+05:30"))).unwrap();
    let fit = faircurve::spline::Natural::default().fit(&batch, &faircurve::Device::cpu()).unwrap();
    let half_hours = faircurve::tracks::At::Every(1800.0);
    let text = written(&faircurve::tracks::sample(&batch, &fit, &half_hours, &[]).unwrap());
    for zone in ["Z", "+05:30"] {
        let middle = format!("<time>2024-03-01T01:30:00{zone}</time><extensions><course>0</course></extensions>");
        assert!(text.contains(&middle), "{middle} in {text}");
    }
}
