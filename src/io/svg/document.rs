//! [`Drawing`]: the document that a drawing was read from, so that it can be written again with other
//! paths and all else as it was.

use std::ops::Range;

use kurbo::Affine;
use roxmltree::{Attribute, Node};

/// A drawing's text, and where its paths stand.
#[derive(Debug, Default)]
pub(super) struct Drawing {
    pub text: String,
    pub elements: Vec<Element>,
    /// What changes in the text, in order of the places.
    pub edits: Vec<(Range<usize>, Edit)>,
    /// Number of curves of all elements.
    pub curves: usize,
}

/// An element that draws curves.
#[derive(Debug)]
pub(super) struct Element {
    /// From the element's coordinates to those of the drawing.
    pub affine: Affine,
    /// Its curves.
    pub curves: Range<usize>,
}

/// What takes the place of a part of the text.
#[derive(Debug)]
pub(super) enum Edit {
    /// Another text.
    Text(&'static str),
    /// The path data of an element, by its number.
    Data(usize),
    /// The attribute `d` with the path data of an element.
    Attribute(usize),
}

/// Attributes that give other elements than paths their shape.
const GEOMETRY: [&str; 14] =
    ["points", "x", "y", "x1", "y1", "x2", "y2", "width", "height", "r", "cx", "cy", "rx", "ry"];

impl Drawing {
    /// Notes that an element draws curves. `None` where its text cannot be found, as in an entity.
    pub fn add(&mut self, text: &str, node: Node, affine: Affine, curves: Range<usize>) -> Option<()> {
        let number = self.elements.len();
        self.elements.push(Element { affine, curves });
        if node.tag_name().name() == "path" {
            let data = quoted(text, &node.attribute_node("d")?)?;
            self.edits.push((data, Edit::Data(number)));
            return Some(());
        }
        // Another element becomes a path: its name changes, at its end too, and `d` takes the place of its attributes.
        let range = node.range();
        let whole = text.get(range.clone())?;
        let name = whole.strip_prefix('<')?.split(|c: char| c.is_ascii_whitespace() || c == '/' || c == '>').next()?;
        let local = node.tag_name().name();
        let prefix = name.len().checked_sub(local.len()).filter(|&prefix| &name[prefix..] == local)?;
        let start = range.start + 1 + prefix;
        self.edits.push((start..start + local.len(), Edit::Text("path")));
        let mut end = start + local.len();
        self.edits.push((end..end, Edit::Attribute(number)));
        for attribute in node.attributes().filter(|attribute| is_geometry(attribute)) {
            let value = quoted(text, &attribute)?;
            let from = attribute.range_qname().start;
            let blanks = text[end..from].chars().rev().take_while(char::is_ascii_whitespace).count();
            self.edits.push((from - blanks..value.end + 1, Edit::Text("")));
            end = value.end + 1;
        }
        if !whole.ends_with("/>") {
            let at = whole.rfind("</")? + 2 + prefix;
            let at = range.start + at..range.start + at + local.len();
            (text.get(at.clone())? == local).then(|| self.edits.push((at, Edit::Text("path"))))?;
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
