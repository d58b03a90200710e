//! Reading: every segment of a track, and every route, is a curve.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use roxmltree::Node;

use super::{Document, ELEVATION, Edit, Value};
use crate::batch::{Clock, Column, CurveBatch, Origin, Values};
use crate::error::{Result, listed, quoted, shortened};
use crate::io::columns::Between;
use crate::io::source::Source;
use crate::io::{ReadOptions, close_as_marked, counted, grouped_names, longitude, xml};

pub(super) fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let text = source.text()?;
    let document = xml::parsed(source, &text, "GPX")?;
    let root = document.root_element();
    if root.tag_name().name() != "gpx" {
        let name = shortened(root.tag_name().name());
        return Err(source.error(None, format!("the document is <{name}>, and must be <gpx>: give a GPX file")));
    }
    let mut points = Points::new(source, &text);
    let (mut offsets, mut edits) = (vec![0], vec![]);
    // The name and the number of curves of every track.
    let mut tracks: Vec<(Option<String>, usize)> = vec![];
    let mut waypoints = 0;
    for node in root.children() {
        let (segment, point) = match node.tag_name().name() {
            "trk" => ("trkseg", "trkpt"),
            "rte" => ("rte", "rtept"),
            "wpt" => {
                waypoints += 1;
                continue;
            }
            _ => {
                let bounds = node.descendants().filter(|node| node.tag_name().name() == "bounds");
                edits.extend(bounds.map(|bounds| (bounds.range(), Edit::Nothing)));
                continue;
            }
        };
        let name = child(node, "name").and_then(|name| name.text()).map(|name| name.trim().to_string());
        let first = offsets.len() - 1;
        // A route is its own segment.
        for segment in node.descendants().filter(|node| node.tag_name().name() == segment) {
            let mut range: Option<Range<usize>> = None;
            for node in segment.children().filter(|node| node.tag_name().name() == point) {
                points.add(node, offsets.len() - 1)?;
                range = Some(range.map_or(node.range().start, |range| range.start)..node.range().end);
            }
            if let Some(range) = range {
                let name = qualified(&text[range.start..]);
                edits.push((range, Edit::Points(offsets.len() - 1, name.into())));
            }
            offsets.push(points.coords.len() / 2);
        }
        tracks.push((name, offsets.len() - 1 - first));
    }
    let curves = offsets.len() - 1;
    let groups = tracks.iter().enumerate().map(|(number, (name, count))| (number, name.as_ref(), *count));
    let names = grouped_names(&groups.collect::<Vec<_>>(), |track, k| format!("{track}.{}", k + 1));
    let mut notes = points.notes(waypoints);
    notes.extend(points.whole_times(&offsets, &names));
    let (columns, values) = points.columns()?;
    let Points { mut coords, times, clock, mut clocks, misplaced, .. } = points;
    clocks.resize(curves, None);
    let clock = clock.filter(|_| times.iter().any(|t| !t.is_nan()));
    // Where entities make elements, their places are others.
    let in_order = edits.windows(2).all(|pair| pair[0].0.end <= pair[1].0.start);
    let document = in_order.then(|| Document { text: text.clone(), edits, values, curves });
    let within_half_turn = coords.iter().step_by(2).all(|&x| longitude::within_half_turn(x));
    let (unwrapped, _) = longitude::unwrap(&mut coords, 2, &offsets);
    let origin = Origin {
        names: Some(names),
        clock,
        clocks: clock.and_then(|clock| clock.each_own(&clocks)),
        within_half_turn,
        unwrapped,
        geographic: true,
        notes,
        document: document.map(|document| Arc::new(document) as _),
        ..source.origin()
    };
    let batch = CurveBatch::from_file(2, coords, offsets, Arc::new(origin))?;
    let mut batch = batch.with_parameters(times)?.with_columns(columns)?;
    // The report names the first of a curve.
    for (point, what) in misplaced.iter().rev() {
        let i = batch.offsets().partition_point(|offset| offset <= point) - 1;
        batch.refuse(i, point - batch.offsets()[i], what);
    }
    close_as_marked(batch, options.closed, vec![])
}

/// Points as they are read. Missing values are NaN.
struct Points<'a> {
    source: &'a Source<'a>,
    text: &'a str,
    coords: Vec<f64>,
    times: Vec<f64>,
    /// How times are written, of all curves and of each as far as it has points.
    clock: Option<Clock>,
    clocks: Vec<Option<Clock>>,
    elevations: Vec<f64>,
    /// Other numbers of points, by the names of the elements around them.
    numbers: Vec<Numbers>,
    places: HashMap<String, usize>,
    /// Points whose longitude or latitude cannot be read, and why.
    misplaced: Vec<(usize, String)>,
    /// Elevations and times that cannot be read.
    unread: Vec<String>,
    /// The line of the last point, and the bytes before it.
    line: usize,
    counted: usize,
}

/// Numbers of points, with the points that have them.
struct Numbers {
    path: String,
    of: Vec<(usize, f64)>,
    is_whole: bool,
    /// Whether some are not numbers. Then the column is skipped.
    is_text: bool,
}

impl<'a> Points<'a> {
    fn new(source: &'a Source<'a>, text: &'a str) -> Self {
        Points {
            source,
            text,
            coords: vec![],
            times: vec![],
            clock: None,
            clocks: vec![],
            elevations: vec![],
            numbers: vec![],
            places: HashMap::new(),
            misplaced: vec![],
            unread: vec![],
            line: 1,
            counted: 0,
        }
    }

    fn add(&mut self, node: Node, curve: usize) -> Result<()> {
        self.clocks.resize(curve + 1, None);
        // The document would count lines from its start.
        let start = node.range().start;
        self.line += self.text[self.counted..start].bytes().filter(|&byte| byte == b'\n').count();
        self.counted = start;
        let line = self.line;
        let point = self.coords.len() / 2;
        let [x, y] = [("lon", 360.0), ("lat", 90.0)].map(|(name, most)| {
            let text = node.attribute(name).unwrap_or_default();
            let number = text.trim().parse::<f64>().ok().filter(|x| x.abs() <= most);
            if number.is_none() {
                let what = format!("its {name} is {} (line {line}): mend it, or remove the point", quoted(text));
                self.misplaced.push((point, what));
            }
            number.unwrap_or(f64::NAN)
        });
        let (mut elevation, mut time) = (f64::NAN, f64::NAN);
        for leaf in node.descendants().filter(|leaf| leaf.is_element() && *leaf != node) {
            let text = leaf.text().unwrap_or_default().trim();
            let number = || text.parse().ok().filter(|x: &f64| x.is_finite());
            let read = match (leaf.tag_name().name(), leaf.parent() == Some(node)) {
                (ELEVATION, true) => number().map(|number| elevation = number),
                ("time", true) => Clock::read(text).map(|(t, clock)| {
                    time = t;
                    for known in [&mut self.clock, &mut self.clocks[curve]] {
                        *known = Some(known.map_or(clock, |before| before.with(clock)));
                    }
                }),
                _ if leaf.children().any(|child| child.is_element()) => Some(()),
                _ => {
                    self.add_value(node, leaf, point, number(), text.parse::<i64>().is_ok())?;
                    Some(())
                }
            };
            if read.is_none() {
                self.unread.push(format!("{} {} in line {line}", leaf.tag_name().name(), quoted(text)));
            }
        }
        self.source.grow(&mut self.coords, 2)?;
        self.coords.extend([x, y]);
        self.source.push(&mut self.elevations, elevation)?;
        self.source.push(&mut self.times, time)
    }

    /// Adds what an element within a point holds.
    fn add_value(&mut self, point: Node, leaf: Node, k: usize, number: Option<f64>, is_whole: bool) -> Result<()> {
        let around = leaf.ancestors().take_while(|node| *node != point);
        let mut names: Vec<&str> = around.map(|node| qualified(&self.text[node.range().start..])).collect();
        names.reverse();
        let path = names.join("/");
        let place = match self.places.get(&path) {
            Some(&place) => place,
            None => {
                let numbers = Numbers { path: path.clone(), of: vec![], is_whole: true, is_text: false };
                self.source.take(std::mem::size_of::<Numbers>() + 2 * path.len())?;
                self.numbers.push(numbers);
                self.places.insert(path, self.numbers.len() - 1);
                self.numbers.len() - 1
            }
        };
        let numbers = &mut self.numbers[place];
        numbers.is_whole &= is_whole;
        match number {
            Some(number) => self.source.push(&mut numbers.of, (k, number)),
            None => {
                numbers.is_text = true;
                Ok(())
            }
        }
    }

    /// Notes of what is not read.
    fn notes(&self, waypoints: usize) -> Vec<String> {
        let mut notes = Vec::new();
        let texts: BTreeSet<&str> = self.numbers.iter().filter(|own| own.is_text).map(|own| local(&own.path)).collect();
        let waypoints = (waypoints > 0).then(|| counted(waypoints, "waypoint", "waypoints"));
        let texts = (!texts.is_empty()).then(|| format!("{} of points", listed(texts.iter().map(|text| quoted(text)))));
        let passed: Vec<String> = waypoints.into_iter().chain(texts).collect();
        if !passed.is_empty() {
            notes.push(format!(
                "{} passed over: tracks, routes and numbers of their points are read",
                passed.join(" and ")
            ));
        }
        if let Some(first) = self.unread.first() {
            let taken = counted(self.unread.len(), "value is", "values are");
            notes.push(format!("{taken} taken for missing, such as {first}"));
        }
        notes
    }

    /// Drops the times of curves that lack some. Returns a note of such curves.
    fn whole_times(&mut self, offsets: &[usize], names: &[String]) -> Option<String> {
        let mut partly = Vec::new();
        for i in 0..offsets.len() - 1 {
            let times = &mut self.times[offsets[i]..offsets[i + 1]];
            let lacking = times.iter().filter(|t| t.is_nan()).count();
            if lacking > 0 && lacking < times.len() {
                partly.push(i);
                times.fill(f64::NAN);
            }
        }
        let first = shortened(&names[*partly.first()?]);
        let have = counted(partly.len(), "curve has", "curves have");
        Some(format!("{have} points without a time, such as {first}: times of such curves are left out"))
    }

    /// Elevations and other numbers as columns, and their elements in the file.
    fn columns(&mut self) -> Result<(Vec<Column>, Vec<Value>)> {
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        if self.elevations.iter().any(|elevation| !elevation.is_nan()) {
            let numbers = std::mem::take(&mut self.elevations);
            columns.push(Column { name: ELEVATION.into(), values: Values::Numbers(numbers) });
        }
        for Numbers { path, of, is_whole, .. } in self.numbers.iter().filter(|numbers| !numbers.is_text) {
            let mut numbers = Vec::new();
            self.source.grow(&mut numbers, self.times.len())?;
            numbers.resize(self.times.len(), f64::NAN);
            of.iter().for_each(|&(point, number)| numbers[point] = number);
            let is_free = |name: &str| name != ELEVATION && columns.iter().all(|column: &Column| column.name != name);
            let name = if is_free(local(path)) { local(path) } else { path };
            values.push(Value {
                column: name.into(),
                path: path.split('/').map(String::from).collect(),
                is_whole: *is_whole,
            });
            columns.push(Column { name: name.into(), values: Between::by_name(local(path)).values(numbers) });
        }
        Ok((columns, values))
    }
}

/// The name of the element that a text begins with, with its prefix.
fn qualified(text: &str) -> &str {
    let name = text.strip_prefix('<').unwrap_or(text);
    name.split(|c: char| c.is_ascii_whitespace() || c == '/' || c == '>').next().unwrap_or_default()
}

/// The last name of a path, without its prefix.
fn local(path: &str) -> &str {
    path.rsplit(['/', ':']).next().unwrap_or(path)
}

fn child<'a, 't>(node: Node<'a, 't>, name: &str) -> Option<Node<'a, 't>> {
    node.children().find(|child| child.tag_name().name() == name)
}
