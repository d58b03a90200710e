//! XML, read by roxmltree, with limits that it lacks: text that entities make, attributes of an
//! element.

use std::collections::HashSet;

use roxmltree::{Document, ParsingOptions};

use super::source::Source;
use crate::error::{Result, shortened};

/// Memory that an element or an attribute takes in roxmltree's tree, which grows by doubling.
const NODE_BYTES: usize = 192;

/// The most bytes that entities may make.
///
/// Drawing programs use them for the names of a few namespaces.
const GROWTH_BYTES: usize = 16 << 20;

/// The most references in entities that roxmltree follows for one reference in the document.
const REFERENCES: usize = 255;

/// The document of a text. `what` is wanted: `SVG`.
///
/// # Errors
/// What is no XML, or claims more than it holds.
pub(super) fn parsed<'t>(source: &Source, text: &'t str, what: &str) -> Result<Document<'t>> {
    let a_file = format!("{} {what} file", if what.starts_with('S') { "an" } else { "a" });
    // Many drawing programs write a document type. roxmltree limits how entities nest, but not how
    // much text they make.
    let grown_bytes = growth(text);
    if grown_bytes > GROWTH_BYTES {
        return Err(source.error(
            None,
            format!(
                "its entities may make {} MiB of text, and {} MiB are the most: write the file without them",
                grown_bytes >> 20,
                GROWTH_BYTES >> 20
            ),
        ));
    }
    if attributes(text) > ATTRIBUTES {
        let most = ATTRIBUTES;
        return Err(source.error(None, format!("an element has more than {most} attributes: give {a_file}")));
    }
    if namespaces(text) > NAMESPACES {
        let most = NAMESPACES;
        return Err(source.error(None, format!("there are more than {most} names of namespaces: give {a_file}")));
    }
    let count = |wanted: u8| text.bytes().filter(|&c| c == wanted).count();
    // Elements, and text between them. Those in entities begin with a tag of four bytes or more.
    let nodes = 2 * count(b'<') + grown_bytes / 2;
    source.take(NODE_BYTES * (nodes + count(b'=') + grown_bytes / 4) + grown_bytes)?;
    let nodes_limit = u32::try_from(nodes + 16).unwrap_or(u32::MAX);
    let allow = ParsingOptions { allow_dtd: true, nodes_limit, ..ParsingOptions::default() };
    Document::parse_with_options(text, allow).map_err(|error| {
        let what = error.to_string();
        let what = shortened(what.rsplit_once(" at ").map_or(what.as_str(), |(what, _)| what));
        // At the end of the document roxmltree has no place to report and says 1:1.
        let line = Some(u64::from(error.pos().row)).filter(|_| (error.pos().row, error.pos().col) != (1, 1));
        source.error(line, format!("{what}: this is no XML, or the file was cut off"))
    })
}

/// An upper bound of the bytes that references to entities make: the longest entity, for every
/// reference.
fn growth(text: &str) -> usize {
    let declarations = text.split("<!ENTITY").skip(1).map(value);
    let (longest, nested) = declarations.fold((0, false), |(longest, nested), value| {
        // A reference to a character is no entity.
        let refers = value.match_indices('&').any(|(at, _)| !value[at + 1..].starts_with('#'));
        (longest.max(value.len()), nested || refers)
    });
    let references = if longest > 0 { text.bytes().filter(|&c| c == b'&').count() } else { 0 };
    references.saturating_mul(longest).saturating_mul(if nested { REFERENCES } else { 1 })
}

/// The text of a declaration, which is in quotation marks.
fn value(declaration: &str) -> &str {
    let Some((before, _)) = declaration.split_once(['"', '\'']) else { return declaration };
    let (mark, rest) = declaration[before.len()..].split_at(1);
    rest.split_once(mark).map_or(rest, |(value, _)| value)
}

/// The most attributes of an element. roxmltree compares each of them with all others.
const ATTRIBUTES: usize = 10_000;

/// An upper bound of the attributes that an element has.
fn attributes(text: &str) -> usize {
    let (mut most, mut count) = (0, 0);
    // Whether the place is inside a tag, and which quotation mark is open there.
    let (mut inside, mut mark) = (false, None);
    let bytes = text.as_bytes();
    for (at, &c) in bytes.iter().enumerate() {
        match (inside, mark) {
            (false, _) => {
                inside = c == b'<' && !matches!(bytes.get(at + 1), Some(b'!' | b'?'));
                count = 0;
            }
            (true, Some(open)) => mark = mark.filter(|_| c != open),
            (true, None) => match c {
                b'"' | b'\'' => mark = Some(c),
                b'>' => inside = false,
                b'=' => {
                    count += 1;
                    most = most.max(count);
                }
                _ => {}
            },
        }
    }
    most
}

/// The most names of namespaces.
///
/// roxmltree compares and copies all of them for every element that declares one.
const NAMESPACES: usize = 64;

/// An upper bound of the names of namespaces.
fn namespaces(text: &str) -> usize {
    let end = |c: char| c == '=' || c.is_ascii_whitespace();
    let names = text.split("xmlns:").skip(1).map(|rest| rest.split(end).next().unwrap_or_default());
    names.collect::<HashSet<_>>().len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_counted_from_above() {
        let svg = |entities: &str, body: &str| growth(&format!("<!DOCTYPE svg [{entities}]><svg>{body}</svg>"));
        assert_eq!(svg("", "&amp;&lt;"), 0);
        assert_eq!(svg("<!ENTITY a '12\"45'><!ENTITY b \"1\">", "&a;&b;&a;"), 15);
        assert_eq!(svg("<!ENTITY a '12345'><!ENTITY b '&a;&a;'>", "&b;"), 3 * 6 * 255);
        assert_eq!(svg("<!ENTITY a '&#65;'>", "&a;"), 2 * 5);
    }

    #[test]
    fn namespaces_are_counted_by_name() {
        assert_eq!(namespaces("<svg xmlns='a' xmlns:b='1' xmlns:c ='2'><p xmlns:b='3'/></svg>"), 2);
    }

    #[test]
    fn attributes_are_counted_by_element() {
        let text = "<?xml a='' b='' c=''?><!-- <d e='' f='' g='' --><svg a='>' b=\"'=\"><p c=''/> d='' e='' f=''</svg>";
        assert_eq!(attributes(text), 3, "the comment's element counts");
        assert_eq!(attributes("<svg a='>' b=\"'=\"><p c=''/> d='' e='' f=''</svg>"), 2);
    }
}
