//! GPX, GPS Exchange, as receivers write tracks (topografix.com/GPX/1/1).

use std::collections::HashSet;
use std::io::{self, Write};
use std::sync::Arc;

use roxmltree::Node;

use super::formats::Entry;
use super::source::Source;
use super::text::Text;
use super::{ReadOptions, WriteOptions, antimeridian, close_as_marked, is_finite, longitude, xml};
use crate::batch::{Clock, Column, CurveBatch, Origin, Values};
use crate::error::{Error, Result, quoted, shortened};

pub(super) const ENTRY: Entry = Entry {
    word: "gpx",
    extensions: &[],
    title: "GPX",
    reads: "tracks and routes with times and elevations",
    writes: "tracks, a segment a curve",
    lacks: "there is no track and no route with points",
    dimensions: 2..=2,
    beziers: false,
    columns: false,
    statuses: false,
    fills: |batch| tracks(batch).is_some(),
    read,
    write: |out, batch, options, _| write(out, batch, options),
    write_file: None,
    check: |_| Ok(()),
};

/// The column of elevations.
const ELEVATION: &str = "ele";

/// The tracks that were read.
struct Tracks {
    /// The number of the track of every curve.
    of: Vec<usize>,
    names: Vec<Option<String>>,
}

fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let text = source.text()?;
    let document = xml::parsed(source, &text, "GPX")?;
    let root = document.root_element();
    if root.tag_name().name() != "gpx" {
        let name = shortened(root.tag_name().name());
        return Err(source.error(None, format!("the document is <{name}>, and must be <gpx>: give a GPX file")));
    }
    let mut points = Points { source, coords: vec![], times: vec![], clock: None, elevations: vec![] };
    let (mut offsets, mut tracks) = (vec![0], Tracks { of: vec![], names: vec![] });
    for node in root.children() {
        let (segment, point) = match node.tag_name().name() {
            "trk" => ("trkseg", "trkpt"),
            "rte" => ("rte", "rtept"),
            _ => continue,
        };
        tracks.names.push(child(node, "name").and_then(|name| name.text()).map(|name| name.trim().to_string()));
        // A route is its own segment.
        for segment in node.descendants().filter(|node| node.tag_name().name() == segment) {
            segment.children().filter(|node| node.tag_name().name() == point).try_for_each(|node| points.add(node))?;
            offsets.push(points.coords.len() / 2);
            tracks.of.push(tracks.names.len() - 1);
        }
    }
    let names = tracks.curves();
    let Points { mut coords, times, clock, elevations, .. } = points;
    let mut origin = Origin {
        file: Some(source.path.display().to_string()),
        names: Some(names),
        clock,
        within_half_turn: coords.iter().step_by(2).all(|&x| longitude::within_half_turn(x)),
        geographic: longitude::is_geographic(&coords, 2),
        document: Some(Arc::new(tracks)),
        ..Origin::default()
    };
    for i in 0..offsets.len() - 1 {
        let points = &mut coords[2 * offsets[i]..2 * offsets[i + 1]];
        if longitude::is_geographic(points, 2)
            && let Some(turns) = longitude::turns(points, 2)
        {
            longitude::apply(points, 2, &turns);
            origin.unwrapped.push(i);
        }
    }
    let untimed = times.iter().filter(|t| t.is_nan()).count();
    if untimed > 0 && untimed < times.len() {
        origin.notes.push(format!("{untimed} of {} points have no time, and times are left out", times.len()));
    }
    let mut batch = CurveBatch::from_file(2, coords, offsets, Arc::new(origin))?;
    if untimed == 0 {
        batch = batch.with_parameters(times)?;
    }
    if elevations.iter().any(|elevation| !elevation.is_nan()) {
        batch = batch.with_columns(vec![Column { name: ELEVATION.into(), values: Values::Numbers(elevations) }])?;
    }
    let open = vec![false; batch.len()];
    close_as_marked(batch, options.closed, open)
}

impl Tracks {
    /// Names of the curves: those of the tracks, with the number of the segment where there are several.
    /// Where tracks share a name, or have none, their numbers.
    fn curves(&self) -> Vec<String> {
        let mut seen = HashSet::new();
        let named = self.names.iter().all(|name| name.as_ref().is_some_and(|name| seen.insert(name)));
        let mut parts = vec![0; self.names.len()];
        let several: Vec<bool> =
            (0..parts.len()).map(|track| self.of.iter().filter(|of| **of == track).count() > 1).collect();
        let name = |&track: &usize| {
            parts[track] += 1;
            let name = self.names[track].clone().filter(|_| named).unwrap_or_else(|| track.to_string());
            if several[track] { format!("{name}.{}", parts[track]) } else { name }
        };
        self.of.iter().map(name).collect()
    }
}

/// Points as they are read. What they lack is NaN.
struct Points<'a> {
    source: &'a Source<'a>,
    coords: Vec<f64>,
    times: Vec<f64>,
    clock: Option<Clock>,
    elevations: Vec<f64>,
}

impl Points<'_> {
    fn add(&mut self, node: Node) -> Result<()> {
        let line = u64::from(node.document().text_pos_at(node.range().start).row);
        let wrong = |what: &str, found: &str| -> Error {
            let (element, found) = (node.tag_name().name(), quoted(found));
            self.source.error(line, format!("<{element}>: its {what} is {found}: mend it"))
        };
        let [x, y] = ["lon", "lat"].map(|name| {
            let text = node.attribute(name).unwrap_or_default();
            text.trim().parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| wrong(name, text))
        });
        let (x, y) = (x?, y?);
        let text = |name: &str| child(node, name).and_then(|node| node.text()).map(str::trim);
        let elevation = text(ELEVATION).map(|text| text.parse().map_err(|_| wrong(ELEVATION, text))).transpose()?;
        let time = text("time").map(|text| Clock::read(text).ok_or_else(|| wrong("time", text))).transpose()?;
        self.source.grow(&mut self.coords, 2)?;
        self.coords.extend([x, y]);
        self.source.push(&mut self.elevations, elevation.unwrap_or(f64::NAN))?;
        self.source.push(&mut self.times, time.map_or(f64::NAN, |(t, _)| t))?;
        if let Some((_, clock)) = time {
            self.clock = Some(self.clock.map_or(clock, |before| before.with(clock)));
        }
        Ok(())
    }
}

fn child<'a, 't>(node: Node<'a, 't>, name: &str) -> Option<Node<'a, 't>> {
    node.children().find(|child| child.tag_name().name() == name)
}

/// The tracks that were read, if the batch has the same curves still.
fn tracks(batch: &CurveBatch) -> Option<&Tracks> {
    let tracks: &Tracks = batch.origin().document.as_ref()?.downcast_ref()?;
    (tracks.of.len() == batch.len()).then_some(tracks)
}

/// Writes a track for every one that was read, or for every curve.
fn write(out: &mut dyn Write, batch: &CurveBatch, options: &WriteOptions) -> io::Result<()> {
    let mut text = Text::new(out).with_decimals(options.decimals);
    text.push("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n")?;
    text.push("<gpx version=\"1.1\" creator=\"faircurve\" xmlns=\"http://www.topografix.com/GPX/1/1\">\n")?;
    let tracks = tracks(batch);
    let track = |i: usize| tracks.map_or(i, |tracks| tracks.of[i]);
    for i in 0..batch.len() {
        if i == 0 || track(i) != track(i - 1) {
            let name = match tracks {
                Some(tracks) => tracks.names[track(i)].clone(),
                None => Some(batch.name(i).into_owned()),
            };
            text.push("<trk>\n")?;
            if let Some(name) = name {
                text.push(format!("<name>{}</name>\n", escaped(&name)))?;
            }
        }
        segment(&mut text, batch, i)?;
        if i + 1 == batch.len() || track(i) != track(i + 1) {
            text.push("</trk>\n")?;
        }
    }
    text.push("</gpx>\n")?;
    text.finish()
}

fn segment(text: &mut Text, batch: &CurveBatch, i: usize) -> io::Result<()> {
    let elevations = batch.columns().iter().find_map(|column| match &column.values {
        Values::Numbers(numbers) if column.name == ELEVATION => Some(numbers),
        _ => None,
    });
    let times = batch.parameters(i).zip(batch.origin().clock(i));
    let count = if is_finite(batch, i) { batch.count(i) } else { 0 };
    text.push("<trkseg>\n")?;
    for k in (0..count).chain((batch.is_closed(i) && count > 0).then_some(0)) {
        let point = &batch.points(i)[2 * k..2 * k + 2];
        text.push("<trkpt lat=\"")?;
        text.point(&point[1..], "")?;
        text.push("\" lon=\"")?;
        text.point(&[antimeridian::wrapped(point[0])], "")?;
        text.push("\">")?;
        if let Some(elevation) = elevations.map(|numbers| numbers[batch.offsets()[i] + k]).filter(|x| x.is_finite()) {
            text.push("<ele>")?;
            text.number(elevation)?;
            text.push("</ele>")?;
        }
        if let Some((t, clock)) = times {
            text.push(format!("<time>{}</time>", clock.for_all(std::iter::once(t[k])).write(t[k])))?;
        }
        text.push("</trkpt>\n")?;
    }
    text.push("</trkseg>\n")
}

fn escaped(name: &str) -> String {
    let name = name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
