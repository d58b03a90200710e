//! Reading: each subpath of `<path>`, and each `<polyline>`, `<polygon>`, `<line>`, `<rect>`, `<circle>`
//! and `<ellipse>`, is a curve.
//!
//! - The vertices are the data points. Of curved segments (C, S, Q, T, A) only points on the curve
//!   are taken: the end of the segment, and for an arc also where kurbo divides it into Béziers.
//! - On demand there are points between, as many as the curve asks for, or the data points are the
//!   control points of the subpath as a chain of cubics instead.
//! - y is turned over, so that it points up.
//! - `transform` attributes are applied. `viewBox`, units and styles are not.
//! - What is only defined (`defs`, `symbol`, `clipPath`, `mask`, `marker`, `pattern`) is passed
//!   over, and so are texts, images and what `use` repeats.
//! - The document is kept, to be written again with other paths.

use std::any::Any;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use kurbo::{Affine, BezPath, PathEl};
use roxmltree::Node;

use super::chain::{self, Vertices};
use super::document::Drawing;
use super::{path, shape, transform};
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::error::{Error, Result, listed, quoted, shortened};
use crate::io::source::Source;
use crate::io::{Flatness, ReadOptions, close, xml};
use crate::sort;

/// Reads a drawing.
pub(in crate::io) fn read(source: &mut Source, options: &ReadOptions) -> Result<CurveBatch> {
    let text = source.text()?;
    let document = xml::parsed(source, &text, "SVG")?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        let name = shortened(root.tag_name().name());
        return Err(source.error(None, format!("the document is <{name}>, and must be <svg>: give an SVG file")));
    }
    let mut curves = Curves {
        source,
        text: &text,
        controls: options.controls,
        flatness: options.flatness,
        drawing: Some(Drawing::default()),
        passed_over: BTreeMap::new(),
        coords: Vec::new(),
        offsets: vec![0],
        closed: Vec::new(),
        ids: Vec::new(),
    };
    curves.walk(root)?;
    let names = curves.names();
    let drawing = curves.drawing.take().map(|mut drawing| {
        sort::by(&mut drawing.edits, |a, b| a.0.start.cmp(&b.0.start));
        drawing.curves = curves.closed.len();
        drawing.text = text.clone();
        Arc::new(drawing) as Arc<dyn Any + Send + Sync>
    });
    let passed_over: Vec<String> = curves.passed_over.iter().map(|(name, count)| format!("{count} {name}")).collect();
    let note = (!passed_over.is_empty())
        .then(|| format!("{} passed over: only what has a shape of its own is read", listed(passed_over)));
    let origin = Origin {
        file: Some(source.path.display().to_string()),
        names: Some(names),
        document: drawing,
        notes: note.into_iter().collect(),
        ..Origin::default()
    };
    let batch = CurveBatch::from_file(2, curves.coords, curves.offsets, Arc::new(origin))?;
    close(batch, options.closed, &curves.closed, &[])
}

struct Curves<'a> {
    source: &'a Source<'a>,
    text: &'a str,
    /// Whether the data points are control points rather than vertices.
    controls: bool,
    /// How near chords between vertices are to the path.
    flatness: Option<Flatness>,
    /// The document, as far as its paths are found in its text.
    drawing: Option<Drawing>,
    /// Elements that are seen in the drawing and have no curves here.
    passed_over: BTreeMap<&'static str, usize>,
    coords: Vec<f64>,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    /// Each element's `id`, and the number of its first curve.
    ids: Vec<(Option<String>, usize)>,
}

impl Curves<'_> {
    /// Visits the elements in document order, without recursion: drawings may nest to any depth.
    fn walk(&mut self, root: Node) -> Result<()> {
        let mut waiting = vec![(root, Affine::IDENTITY)];
        while let Some((node, outer)) = waiting.pop() {
            let name = node.tag_name().name();
            if ["defs", "symbol", "clipPath", "mask", "marker", "pattern"].contains(&name) {
                continue;
            }
            let affine = match node.attribute("transform") {
                Some(text) => {
                    outer * transform::parse(text).map_err(|what| self.wrong(node, &format!("transform: {what}")))?
                }
                None => outer,
            };
            if name == "path" {
                let data = node.attribute("d").unwrap_or_default();
                let most_bytes = path::most_bytes(data);
                self.source.take(most_bytes)?;
                self.path(node, path::parse(data), affine)?;
                self.source.room.give_back(most_bytes);
            } else if shape::SHAPES.contains(&name) {
                let most_bytes = path::most_bytes(node.attribute("points").unwrap_or_default());
                self.source.take(most_bytes)?;
                match shape::path(node) {
                    Ok(None) => *self.passed_over.entry("shape with lengths such as 100%").or_default() += 1,
                    Ok(Some(path)) => self.path(node, Ok(path), affine)?,
                    Err(what) => return Err(self.wrong(node, &what)),
                }
                self.source.room.give_back(most_bytes);
            } else if let Some(name) =
                ["<text>", "<image>", "<use>"].into_iter().find(|other| other[1..other.len() - 1] == *name)
            {
                *self.passed_over.entry(name).or_default() += 1;
            }
            waiting.extend(node.children().rev().filter(Node::is_element).map(|child| (child, affine)));
        }
        Ok(())
    }

    fn path(&mut self, node: Node, path: Result<BezPath, String>, affine: Affine) -> Result<()> {
        let path = path.map_err(|what| self.wrong(node, &what))?;
        let first = self.closed.len();
        self.ids.push((node.attribute("id").map(str::to_string), first));
        let within = self.flatness.map(|flatness| match flatness {
            Flatness::Within(distance) => distance,
            Flatness::OfSize(part) => {
                let bounds = affine.transform_rect_bbox(path.control_box());
                part * bounds.width().max(bounds.height())
            }
        });
        let mut vertices: Vertices = Vec::new();
        for &element in path.elements() {
            if matches!(element, PathEl::MoveTo(_)) {
                self.end(&mut vertices, false)?;
            }
            let placed = if affine == Affine::IDENTITY { element } else { affine * element };
            match within.and_then(|within| chain::steps(&vertices, placed, within)) {
                _ if self.controls => chain::add_cubic(&mut vertices, placed),
                Some((cubic, steps)) => {
                    self.source.grow(&mut vertices, steps)?;
                    chain::add_sampled(&mut vertices, cubic, steps);
                }
                None => chain::add_vertex(&mut vertices, placed),
            }
            if element == PathEl::ClosePath {
                // A chain without a piece is a point.
                let closed = vertices.len() > 1 || !self.controls;
                self.end(&mut vertices, closed)?;
            }
        }
        self.end(&mut vertices, false)?;
        let curves = first..self.closed.len();
        if let Some(drawing) = self.drawing.as_mut().filter(|_| !curves.is_empty())
            && drawing.add(self.text, node, affine, curves).is_none()
        {
            self.drawing = None;
        }
        Ok(())
    }

    fn end(&mut self, vertices: &mut Vertices, closed: bool) -> Result<()> {
        if !vertices.is_empty() {
            self.source.grow(&mut self.coords, 2 * vertices.len())?;
            // Not −y, which makes −0 of 0.
            self.coords.extend(vertices.drain(..).flat_map(|point| [point.x, 0.0 - point.y]));
            self.offsets.push(self.coords.len() / 2);
            self.closed.push(closed);
        }
        Ok(())
    }

    /// Names of the curves: ids if every element has one of its own, else the elements' numbers.
    ///
    /// If a path has several subpaths, `/part` is added.
    fn names(&self) -> Vec<String> {
        let ends = self.ids.iter().skip(1).map(|(_, first)| *first).chain([self.closed.len()]);
        let elements: Vec<_> = self.ids.iter().zip(ends).filter(|((_, first), end)| end > first).collect();
        let mut seen = HashSet::new();
        let named = elements.iter().all(|((id, _), _)| id.as_ref().is_some_and(|id| seen.insert(id)));
        let mut names = Vec::with_capacity(self.closed.len());
        for (number, ((id, first), end)) in elements.into_iter().enumerate() {
            let name = id.clone().filter(|_| named).unwrap_or_else(|| number.to_string());
            match end - first {
                1 => names.push(name),
                parts => names.extend((0..parts).map(|part| format!("{name}/{part}"))),
            }
        }
        names
    }

    fn wrong(&self, node: Node, what: &str) -> Error {
        let line = u64::from(node.document().text_pos_at(node.range().start).row);
        let id = node.attribute("id").map(|id| format!(" {}", quoted(id))).unwrap_or_default();
        debug_assert!(node.range().end <= self.text.len());
        self.source.error(line, format!("<{}>{id}: {what}", shortened(node.tag_name().name())))
    }
}
