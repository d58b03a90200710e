//! Shader composition: one source for both precisions, from the files of `shaders/` and a few text
//! directives.
//!
//! WGSL has no includes, no generics and no unrolling, and kernels need all three. The directives
//! are lines:
//!
//! * `//:include PATH [NAME=VALUE …]`: the file `shaders/PATH`, with further definitions inside it.
//! * `//:once include PATH`: the file, unless `once` has included it already.
//! * `//:if NAME` … `//:else` … `//:end`: by whether NAME is defined. `//:if A == B`: by whether
//!   both are one text.
//! * `//:unroll i A..B` … `//:end`: the lines once for each i from A up to B, without B. If A > B
//!   they run downwards, with B.
//! * `//:each LIST` … `//:end`: the lines once for each k = 0, 1 … with a definition `LIST.k.NAME`,
//!   which is `$NAME` there.
//! * `$NAME`: the definition of NAME, anywhere. `$(i+1)`: what follows an unrolled i.

use std::collections::{BTreeMap, BTreeSet};

use crate::precision::Precision;
use crate::sort;

include!(concat!(env!("OUT_DIR"), "/shader_files.rs"));

/// Definitions by name.
pub type Definitions = BTreeMap<String, String>;

/// Makes definitions from pairs.
pub fn definitions<const N: usize>(pairs: [(&str, &dyn ToString); N]) -> Definitions {
    sort::map(pairs.map(|(name, value)| (name.to_string(), value.to_string())))
}

/// The text of a shader file by its path below `shaders/`.
pub fn file(path: &str) -> Option<&'static str> {
    SHADER_FILES.iter().find(|(name, _)| *name == path).map(|(_, text)| *text)
}

/// The paths of all shader files.
pub fn files() -> impl Iterator<Item = &'static str> {
    SHADER_FILES.iter().map(|(name, _)| *name)
}

/// Composes a kernel from the file at `path`. `real` is f32 or f64, and F64 is defined for f64.
///
/// # Panics
/// On a directive that is malformed or names an unknown file. That is a fault of the shader, which
/// the tests that compose all kernels find.
pub fn compose(path: &str, precision: Precision, definitions: &Definitions) -> String {
    let real = if precision == Precision::F64 { "f64" } else { "f32" };
    let text = format!("// Composed from shaders/{path}.\nalias real = {real};\n");
    let mut composed = Composed { text, once: BTreeSet::new() };
    composed.include(path, &with(definitions, (real == "f64").then(|| ("F64".into(), "1".into()))));
    composed.text
}

/// A text while it is composed.
struct Composed {
    text: String,
    /// The files that are included already.
    once: BTreeSet<String>,
}

impl Composed {
    fn include(&mut self, path: &str, definitions: &Definitions) {
        self.once.insert(path.to_string());
        let source = file(path).unwrap_or_else(|| panic!("no shader file {path}"));
        self.expand(&source.lines().collect::<Vec<_>>(), definitions);
    }

    fn expand(&mut self, lines: &[&str], definitions: &Definitions) {
        let mut at = 0;
        while at < lines.len() {
            let line = lines[at];
            at += 1;
            let Some(directive) = line.trim_start().strip_prefix("//:") else {
                self.text.push_str(&substitute(line, definitions));
                self.text.push('\n');
                continue;
            };
            let directive = substitute(directive, definitions);
            let words: Vec<&str> = directive.split_whitespace().collect();
            if let ["include", path, ref extra @ ..] = words[..] {
                let pair = |pair: &&str| {
                    let pair = pair.split_once('=').unwrap_or_else(|| panic!("include takes NAME=VALUE: {line}"));
                    (pair.0.to_string(), pair.1.to_string())
                };
                self.include(path, &with(definitions, extra.iter().map(pair)));
                continue;
            }
            if let ["once", "include", path] = words[..] {
                if !self.once.contains(path) {
                    self.include(path, definitions);
                }
                continue;
            }
            let (body, otherwise, next) = block(lines, at);
            at = next;
            match words[..] {
                ["if", name] => {
                    self.expand(if definitions.contains_key(name) { body } else { otherwise }, definitions);
                }
                ["if", a, "==", b] => self.expand(if a == b { body } else { otherwise }, definitions),
                ["unroll", name, range] => {
                    for i in unrolled(range) {
                        let own = [(name.to_string(), i.to_string()), (format!("({name}+1)"), (i + 1).to_string())];
                        self.expand(body, &with(definitions, own));
                    }
                }
                ["each", list] => {
                    for own in (0..).map(|k| listed(definitions, list, k)).take_while(|own| !own.is_empty()) {
                        self.expand(body, &with(definitions, own));
                    }
                }
                _ => panic!("unknown shader directive: {line}"),
            }
        }
    }
}

/// Definitions with some more.
fn with(definitions: &Definitions, more: impl IntoIterator<Item = (String, String)>) -> Definitions {
    let mut all = definitions.clone();
    all.extend(more);
    all
}

/// The definitions of an entry of a list.
fn listed(definitions: &Definitions, list: &str, k: usize) -> Definitions {
    let prefix = format!("{list}.{k}.");
    let own = definitions.range(prefix.clone()..).map_while(|(name, value)| Some((name.strip_prefix(&prefix)?, value)));
    sort::map(own.map(|(name, value)| (name.to_string(), value.clone())))
}

/// The lines of a block up to its `else` and up to its `end`, and the line after it.
fn block<'a, 'b>(lines: &'a [&'b str], start: usize) -> (&'a [&'b str], &'a [&'b str], usize) {
    let mut depth = 0;
    let mut middle = None;
    for (at, line) in lines.iter().enumerate().skip(start) {
        let Some(directive) = line.trim_start().strip_prefix("//:") else { continue };
        match directive.split_whitespace().next() {
            Some("if" | "unroll" | "each") => depth += 1,
            Some("else") if depth == 0 => middle = Some(at),
            Some("end") if depth == 0 => {
                let body = &lines[start..middle.unwrap_or(at)];
                return (body, middle.map_or(&[], |middle| &lines[middle + 1..at]), at + 1);
            }
            Some("end") => depth -= 1,
            _ => {}
        }
    }
    panic!("shader block without end: {}", lines[start - 1]);
}

fn unrolled(range: &str) -> Vec<i64> {
    let bounds = range.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let (from, to): (i64, i64) = bounds.unwrap_or_else(|| panic!("unroll takes A..B, not {range}"));
    if from <= to { (from..to).collect() } else { (to..from).rev().collect() }
}

/// Replaces every `$NAME`.
///
/// The longest defined name wins, so `$iu` is the unrolled `$i` with WGSL's suffix u.
fn substitute(line: &str, definitions: &Definitions) -> String {
    let mut out = String::with_capacity(line.len());
    let mut rest = line;
    while let Some(at) = rest.find('$') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        let found =
            definitions.iter().filter(|(name, _)| rest.starts_with(name.as_str())).max_by_key(|(name, _)| name.len());
        let (name, value) = found.unwrap_or_else(|| panic!("undefined ${rest} in shader line: {line}"));
        out.push_str(value);
        rest = &rest[name.len()..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn expanded(source: &str, definitions: &Definitions) -> String {
        let mut composed = Composed { text: String::new(), once: BTreeSet::new() };
        composed.expand(&source.lines().collect::<Vec<_>>(), definitions);
        composed.text
    }

    #[test]
    fn blocks_nest_and_names_are_replaced() {
        let source = "//:unroll i 0..$N\na$iu\n//:if ODD\nodd\n//:else\neven\n//:end\n//:end\n";
        assert_eq!(expanded(source, &definitions([("N", &2)])), "a0u\neven\na1u\neven\n");
        assert_eq!(expanded(source, &definitions([("N", &1), ("ODD", &1)])), "a0u\nodd\n");
    }

    #[test]
    fn unrolling_downwards_excludes_the_start_and_includes_the_end() {
        assert_eq!(expanded("//:unroll i 4..1\n$i\n//:end", &definitions([])), "3\n2\n1\n");
        assert_eq!(expanded("//:unroll i 1..1\n$i\n//:end", &definitions([])), "");
    }

    #[test]
    fn lists_repeat_their_lines_with_definitions_of_their_own() {
        let terms = [("TERM.0.NAME", "a"), ("TERM.1.NAME", "b"), ("TERM.1.MORE", "1"), ("TERM.10.NAME", "far")];
        let terms = terms.map(|(name, value)| (name.to_string(), value.to_string())).into();
        let source = "//:each TERM\n$NAME_value\n//:if MORE\nmore\n//:end\n//:end\n//:each OTHER\nnothing\n//:end";
        assert_eq!(expanded(source, &terms), "a_value\nb_value\nmore\n");
    }

    #[test]
    fn unrolled_numbers_have_successors_and_are_compared() {
        let source = "//:unroll j 0..2\n//:unroll k $(j+1)..3\n$j$k\n//:if $k == $(j+1)\nnext\n//:end\n//:end\n//:end";
        assert_eq!(expanded(source, &definitions([])), "01\nnext\n02\n12\nnext\n");
    }

    #[test]
    fn a_file_stands_once_however_often_it_is_wanted() {
        let wanted = "//:once include linalg/power.wgsl\n";
        assert_eq!(expanded(&wanted.repeat(2), &definitions([])), expanded(wanted, &definitions([])));
    }
}
