//! Reading: each subpath of `<path>`, and each `<polyline>`, `<polygon>`, `<line>`, `<rect>`,
//! `<circle>` and `<ellipse>`, is a curve.
//!
//! - The vertices are the data points. Of curved segments (C, S, Q, T, A) only points on the curve
//!   are taken: the end of the segment, and for an arc also the ends of its quarter turns.
//! - On demand there are points between, as many as the curve asks for, or the data points are the
//!   control points of the subpath as a chain of cubics instead.
//! - y is turned over, so that it points up.
//! - `transform` attributes are applied. `viewBox` and styles are not. Lengths may have units, 96
//!   to an inch.
//! - An element that cannot be read is a curve without points, whose problem says why.
//! - What is only defined (`defs`, `symbol`, `clipPath`, `mask`, `marker`, `pattern`) is passed
//!   over, and so are texts, images and what `use` repeats. So is what a transform without an
//!   inverse hides.
//! - The document is kept, to be written again with other paths.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

use kurbo::{Affine, PathEl, Rect};
use roxmltree::Node;

use super::chain::{self, MOST_STEPS, Vertices};
use super::document::{Drawing, Element};
use super::length::{self, Viewport};
use super::path::{self, Segment};
use super::{shape, transform};
use crate::batch::CurveBatch;
use crate::batch::Origin;
use crate::error::{Result, listed, quoted, shortened};
use crate::io::source::Source;
use crate::io::{Flatness, ReadOptions, Selection, close, grouped_names, part, xml};
use crate::sort;
use crate::status::CurveStatus;

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
        paths_only: options.paths_only,
        selection: options.selected.as_ref(),
        drawing: Drawing::default(),
        passed_over: BTreeMap::new(),
        exact: BTreeMap::new(),
        hidden: Vec::new(),
        in_entity: Vec::new(),
        problems: Vec::new(),
        coords: Vec::new(),
        offsets: vec![0],
        closed: Vec::new(),
        ids: Vec::new(),
    };
    curves.walk(root)?;
    let names = curves.names();
    let mut drawing = curves.drawing;
    sort::by(&mut drawing.edits, |a, b| a.0.start.cmp(&b.0.start));
    drawing.curves = curves.closed.len();
    drawing.text = text.clone();
    let counted = |elements: &BTreeMap<&str, usize>, what: &str| {
        let each = elements.iter().map(|(name, count)| format!("{count} <{name}>"));
        (!elements.is_empty()).then(|| format!("{} {what}", listed(each)))
    };
    let passed_over = counted(&curves.passed_over, "passed over: only elements with a shape are read");
    let exact = counted(&curves.exact, "left as they are, since their shapes are exact");
    let left = |labels: Vec<String>, why: &str| {
        (!labels.is_empty()).then(|| format!("{why}, and left as it is: {}", listed(labels)))
    };
    let hidden = left(curves.hidden, "hidden by a transform without an inverse");
    let in_entity = left(curves.in_entity, "drawn by an entity");
    let origin = Origin {
        names: Some(names),
        document: Some(Arc::new(drawing)),
        notes: [passed_over, exact, hidden, in_entity].into_iter().flatten().collect(),
        metres: Some(length::unit(root)),
        ..source.origin()
    };
    let mut batch = CurveBatch::from_file(2, curves.coords, curves.offsets, Arc::new(origin))?;
    for (i, problem) in curves.problems {
        batch.refuse_as(i, CurveStatus::Invalid, problem);
    }
    close(batch, options.closed, &curves.closed, &[])
}

/// Whether an element, or a group around it, is selected.
fn is_selected(node: Node, selection: &Selection) -> bool {
    let has = |value: &str| match selection.key.as_str() {
        "class" => value.split_whitespace().any(|class| selection.has(class)),
        _ => selection.has(value),
    };
    node.ancestors().any(|node| node.attribute(selection.key.as_str()).is_some_and(has))
}

struct Curves<'a> {
    source: &'a Source<'a>,
    text: &'a str,
    /// Whether the data points are control points rather than vertices.
    controls: bool,
    /// How near chords between vertices are to the path.
    flatness: Option<Flatness>,
    /// Whether exact shapes stay as they are.
    paths_only: bool,
    selection: Option<&'a Selection>,
    /// The document, and where its paths are found in its text.
    drawing: Drawing,
    /// Elements that are seen in the drawing and have no curves here.
    passed_over: BTreeMap<&'static str, usize>,
    /// Exact shapes that stay as they are.
    exact: BTreeMap<&'static str, usize>,
    /// Names of the elements that a transform hides.
    hidden: Vec<String>,
    /// Names of the elements whose text is not found in the document.
    in_entity: Vec<String>,
    /// The curves that stand for an element that cannot be read, and why it cannot.
    problems: Vec<(usize, String)>,
    coords: Vec<f64>,
    offsets: Vec<usize>,
    closed: Vec<bool>,
    /// Each element's `id`, and the number of its first curve.
    ids: Vec<(Option<String>, usize)>,
}

impl Curves<'_> {
    /// Visits the elements in document order, without recursion: drawings may nest to any depth.
    fn walk(&mut self, root: Node) -> Result<()> {
        let mut waiting = vec![(root, Ok(Affine::IDENTITY), Viewport::default())];
        while let Some((node, outer, viewport)) = waiting.pop() {
            let name = node.tag_name().name();
            if ["defs", "symbol", "clipPath", "mask", "marker", "pattern"].contains(&name) {
                continue;
            }
            let affine = outer.and_then(|outer| match node.attribute("transform").map(transform::parse) {
                Some(Ok(inner)) => Ok(outer * inner),
                Some(Err(what)) => Err(Rc::from(self.sentence(node, &what))),
                None => Ok(outer),
            });
            let viewport = if name == "svg" { Viewport::of(node, viewport) } else { viewport };
            if self.selection.is_some_and(|selection| !is_selected(node, selection)) {
                // It stays a part of the document.
            } else if let Some(name) = one_of(&shape::EXACT, name).filter(|_| self.paths_only) {
                *self.exact.entry(name).or_default() += 1;
            } else if name == "path" || shape::SHAPES.contains(&name) {
                self.element(node, &affine, viewport)?;
            } else if let Some(name) = one_of(&["text", "image", "use"], name) {
                *self.passed_over.entry(name).or_default() += 1;
            }
            let children = node.children().rev().filter(Node::is_element);
            waiting.extend(children.map(|child| (child, affine.clone(), viewport)));
        }
        Ok(())
    }

    /// Reads an element that draws a path, at its place, if its place is known.
    fn element(&mut self, node: Node, place: &Result<Affine, Rc<str>>, viewport: Viewport) -> Result<()> {
        let is_path = node.tag_name().name() == "path";
        let data = node.attribute(if is_path { "d" } else { "points" }).unwrap_or_default();
        let most_bytes = path::most_bytes(data);
        self.source.take(most_bytes)?;
        let path = if is_path { path::parse(data) } else { shape::path(node, viewport) };
        match (path, place) {
            (Ok(path), _) if path.is_empty() => {}
            (Ok(path), Ok(affine)) => match transform::inverse(*affine) {
                Some(inverse) => self.path(node, &path, *affine, inverse)?,
                None => self.source.push(&mut self.hidden, label(node))?,
            },
            (Ok(_), Err(sentence)) => self.refuse(node, sentence.to_string())?,
            (Err(what), _) => self.refuse(node, self.sentence(node, &what))?,
        }
        self.source.room.give_back(most_bytes);
        Ok(())
    }

    fn path(&mut self, node: Node, path: &[Segment], affine: Affine, inverse: Affine) -> Result<()> {
        let size = size(path, affine);
        if !size.is_finite() {
            let what = "its coordinates are too large for f64: scale it down";
            return self.refuse(node, self.sentence(node, what));
        }
        let first = self.closed.len();
        self.ids.push((node.attribute("id").map(str::to_string), first));
        let within = match self.flatness {
            Some(Flatness::Within(distance)) => distance,
            Some(Flatness::OfSize(part)) => part * size,
            None => f64::INFINITY,
        };
        let mut vertices: Vertices = Vec::new();
        for segment in path {
            match segment {
                Segment::Arc(arc) if !self.controls => {
                    let points = arc.points(within / path::largest_scale(affine), MOST_STEPS);
                    self.source.grow(&mut vertices, points.len())?;
                    vertices.extend(points.map(|point| affine * point));
                }
                _ => segment
                    .elements(affine, within)
                    .try_for_each(|element| self.draw(&mut vertices, element, within))?,
            }
        }
        self.end(&mut vertices, false)?;
        let element = Element { affine, inverse, curves: first..self.closed.len() };
        match self.drawing.add(self.text, node, element) {
            true => Ok(()),
            false => self.source.push(&mut self.in_entity, label(node)),
        }
    }

    /// Adds the points of an element, and ends the curve where the element does.
    fn draw(&mut self, vertices: &mut Vertices, element: PathEl, within: f64) -> Result<()> {
        if matches!(element, PathEl::MoveTo(_)) {
            self.end(vertices, false)?;
        }
        if self.controls {
            self.source.grow(vertices, 3)?;
            chain::add_cubic(vertices, element);
        } else if let Some((cubic, steps)) = chain::steps(vertices, element, within) {
            self.source.grow(vertices, steps)?;
            chain::add_sampled(vertices, cubic, steps);
        } else {
            chain::add_vertex(vertices, element);
        }
        if element == PathEl::ClosePath {
            self.end(vertices, true)?;
        }
        Ok(())
    }

    /// Adds a curve without points for an element that cannot be read.
    fn refuse(&mut self, node: Node, sentence: String) -> Result<()> {
        self.source.take(sentence.len())?;
        self.ids.push((node.attribute("id").map(str::to_string), self.closed.len()));
        self.problems.push((self.closed.len(), sentence));
        self.offsets.push(self.coords.len() / 2);
        self.closed.push(false);
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

    /// Names of the curves: the ids of their elements if those are unique, else the elements'
    /// numbers.
    fn names(&self) -> Vec<String> {
        let ends = self.ids.iter().skip(1).map(|(_, first)| *first).chain([self.closed.len()]);
        let elements = self.ids.iter().zip(ends).filter(|((_, first), end)| end > first).enumerate();
        let groups = elements.map(|(number, ((id, first), end))| (number, id.as_ref(), end - first));
        grouped_names(&groups.collect::<Vec<_>>(), part)
    }

    /// What is wrong with an element, with its place.
    fn sentence(&self, node: Node, what: &str) -> String {
        debug_assert!(node.range().end <= self.text.len());
        let line = u64::from(node.document().text_pos_at(node.range().start).row);
        self.source.error(line, format!("{}: {what}", label(node))).to_string()
    }
}

/// The name as the list has it.
fn one_of(names: &[&'static str], name: &str) -> Option<&'static str> {
    names.iter().copied().find(|own| *own == name)
}

/// An element for a sentence: `<path> "leaf"`.
fn label(node: Node) -> String {
    let id = node.attribute("id").map(|id| format!(" {}", quoted(id))).unwrap_or_default();
    format!("<{}>{id}", shortened(node.tag_name().name()))
}

/// The larger side of the box around a path's control points, which is not finite if one of them is
/// not.
fn size(path: &[Segment], affine: Affine) -> f64 {
    let mut bounds: Option<Rect> = None;
    for element in path.iter().flat_map(|segment| segment.elements(affine, f64::INFINITY)) {
        let points = match element {
            PathEl::MoveTo(a) | PathEl::LineTo(a) => [a; 3],
            PathEl::QuadTo(a, b) => [a, b, b],
            PathEl::CurveTo(a, b, c) => [a, b, c],
            PathEl::ClosePath => continue,
        };
        for point in points {
            if !point.is_finite() {
                return f64::NAN;
            }
            let before = bounds.unwrap_or(Rect::from_points(point, point));
            bounds = Some(before.union_pt(point));
        }
    }
    bounds.map_or(0.0, |bounds| bounds.width().max(bounds.height()))
}
