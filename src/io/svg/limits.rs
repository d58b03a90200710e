//! Limits that roxmltree lacks, checked before it reads: text that entities make, attributes of an
//! element.

use std::collections::HashSet;

/// The most bytes that entities may make.
///
/// Drawing programs use them for the names of a few namespaces.
pub(super) const GROWTH_BYTES: usize = 16 << 20;

/// The most references in entities that roxmltree follows for one reference in the document.
const REFERENCES: usize = 255;

/// An upper bound of the bytes that references to entities make: the longest entity, for every
/// reference.
pub(super) fn growth(text: &str) -> usize {
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
pub(super) const ATTRIBUTES: usize = 10_000;

/// An upper bound of the attributes that an element has.
pub(super) fn attributes(text: &str) -> usize {
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
/// roxmltree compares and copies all of them for every element that has one of its own.
pub(super) const NAMESPACES: usize = 64;

/// An upper bound of the names of namespaces.
pub(super) fn namespaces(text: &str) -> usize {
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
