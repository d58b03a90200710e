//! [`Drawing`]: the document that a drawing was read from, so that it can be written again with
//! other paths and all else as it was.

use std::ops::Range;

use kurbo::Affine;
use roxmltree::{Attribute, Node};

/// A drawing's text, and where its paths stand.
#[derive(Debug, Default)]
pub(super) struct Drawing {
    pub text: String,
    pub elements: Vec<Element>,
    /// What changes in the text, in order of the places, and the element that it belongs to.
    pub edits: Vec<(Range<usize>, usize, Edit)>,
    /// Number of curves of all elements.
    pub curves: usize,
}

/// An element that draws curves.
#[derive(Debug)]
pub(super) struct Element {
    /// From the element's coordinates to the drawing's, and back.
    pub affine: Affine,
    pub inverse: Affine,
    /// Its curves.
    pub curves: Range<usize>,
}

/// What takes the place of a part of the text.
#[derive(Debug)]
pub(super) enum Edit {
    /// Another text.
    Text(&'static str),
    /// The path data of the element.
    Data,
    /// The attribute `d` with the path data of the element.
    Attribute,
}

/// Attributes that give other elements than paths their shape.
const GEOMETRY: [&str; 14] =
    ["points", "x", "y", "x1", "y1", "x2", "y2", "width", "height", "r", "cx", "cy", "rx", "ry"];

impl Drawing {
    /// Notes that an element draws curves, unless its text is not in its place in the document;
    /// whether it is.
    pub fn add(&mut self, text: &str, node: Node, element: Element) -> bool {
        let before = self.edits.len();
        let is_found = self.edit(text, node).is_some();
        match is_found {
            true => self.elements.push(element),
            false => self.edits.truncate(before),
        }
        is_found
    }

    /// Adds what changes in the text of the next element.
    fn edit(&mut self, text: &str, node: Node) -> Option<()> {
        // An entity stands before the root, and may draw many elements.
        if node.range().start < node.document().root_element().range().start {
            return None;
        }
        let number = self.elements.len();
        if node.tag_name().name() == "path" {
            let data = quoted(text, &node.attribute_node("d")?)?;
            self.edits.push((data, number, Edit::Data));
            return Some(());
        }
        // Another element becomes a path: its name changes, at its end too, and `d` takes the place
        // of its attributes.
        let range = node.range();
        let whole = text.get(range.clone())?;
        let name = whole.strip_prefix('<')?.split(|c: char| c.is_ascii_whitespace() || c == '/' || c == '>').next()?;
        let local = node.tag_name().name();
        let prefix = name.len().checked_sub(local.len()).filter(|&prefix| &name[prefix..] == local)?;
        let start = range.start + 1 + prefix;
        self.edits.push((start..start + local.len(), number, Edit::Text("path")));
        let mut end = start + local.len();
        self.edits.push((end..end, number, Edit::Attribute));
        for attribute in node.attributes().filter(|attribute| is_geometry(attribute)) {
            let value = quoted(text, &attribute)?;
            let from = attribute.range_qname().start;
            let blanks = text[end..from].chars().rev().take_while(char::is_ascii_whitespace).count();
            self.edits.push((from - blanks..value.end + 1, number, Edit::Text("")));
            end = value.end + 1;
        }
        if !whole.ends_with("/>") {
            let at = whole.rfind("</")? + 2 + prefix;
            let at = range.start + at..range.start + at + local.len();
            (text.get(at.clone())? == local).then(|| self.edits.push((at, number, Edit::Text("path"))))?;
        }
        Some(())
    }
}

fn is_geometry(attribute: &Attribute) -> bool {
    attribute.namespace().is_none() && GEOMETRY.contains(&attribute.name())
}

/// The place of an attribute's value, between quotation marks.
fn quoted(text: &str, attribute: &Attribute) -> Option<Range<usize>> {
    let range = attribute.range_value();
    let mark = text.get(range.start.checked_sub(1)?..range.start)?;
    let stands = ["\"", "'"].contains(&mark) && text.get(range.end..range.end + 1) == Some(mark);
    stands.then_some(range)
}
