//! Shader composition: the files of `shaders/`, a few text directives, and one source for both precisions.
//!
//! WGSL has no includes, no generics and no unrolling, and kernels need all three. The directives are lines:
//!
//! * `//:include PATH [NAME=VALUE …]` — the file `shaders/PATH`, with further definitions inside it;
//! * `//:if NAME` … `//:else` … `//:end` — by whether NAME is defined;
//! * `//:unroll i A..B` … `//:end` — the lines once for each i from A up to, without, B (downwards, B included, if A > B);
//! * `$NAME` — the definition of NAME, anywhere.

use std::collections::BTreeMap;

use crate::precision::Precision;

include!(concat!(env!("OUT_DIR"), "/shader_files.rs"));

/// Definitions by name.
pub type Definitions = BTreeMap<String, String>;

/// Makes definitions from pairs.
pub fn definitions<const N: usize>(pairs: [(&str, &dyn ToString); N]) -> Definitions {
    pairs.into_iter().map(|(name, value)| (name.to_string(), value.to_string())).collect()
}

/// The text of a shader file by its path below `shaders/`.
pub fn file(path: &str) -> Option<&'static str> {
    SHADER_FILES.iter().find(|(name, _)| *name == path).map(|(_, text)| *text)
}

/// The paths of all shader files.
pub fn files() -> impl Iterator<Item = &'static str> {
    SHADER_FILES.iter().map(|(name, _)| *name)
}

/// Composes a kernel from the file at `path`; `real` is f32 or f64.
///
/// # Panics
/// On a directive that is malformed or names an unknown file: a fault of the shader, found by the tests that compose all.
pub fn compose(path: &str, precision: Precision, definitions: &Definitions) -> String {
    let real = if precision == Precision::F64 { "f64" } else { "f32" };
    let mut text = format!("// Composed from shaders/{path}.\nalias real = {real};\n");
    expand(file(path).unwrap_or_else(|| panic!("no shader file {path}")), definitions, &mut text);
    text
}

fn expand(source: &str, definitions: &Definitions, out: &mut String) {
    let lines: Vec<&str> = source.lines().collect();
    expand_lines(&lines, definitions, out);
}

fn expand_lines(lines: &[&str], definitions: &Definitions, out: &mut String) {
    let mut at = 0;
    while at < lines.len() {
        let line = lines[at];
        at += 1;
        let Some(directive) = line.trim_start().strip_prefix("//:") else {
            out.push_str(&substitute(line, definitions));
            out.push('\n');
            continue;
        };
        let directive = substitute(directive, definitions);
        let words: Vec<&str> = directive.split_whitespace().collect();
        match words[..] {
            ["include", path, ref extra @ ..] => {
                let mut inner = definitions.clone();
                inner.extend(extra.iter().map(|pair| {
                    let (name, value) =
                        pair.split_once('=').unwrap_or_else(|| panic!("include takes NAME=VALUE: {line}"));
                    (name.to_string(), value.to_string())
                }));
                expand(file(path).unwrap_or_else(|| panic!("no shader file {path}")), &inner, out);
            }
            ["if", name] => {
                let (body, otherwise, next) = block(lines, at);
                expand_lines(if definitions.contains_key(name) { body } else { otherwise }, definitions, out);
                at = next;
            }
            ["unroll", name, range] => {
                let (body, _, next) = block(lines, at);
                for value in unrolled(range) {
                    let mut inner = definitions.clone();
                    inner.insert(name.to_string(), value.to_string());
                    expand_lines(body, &inner, out);
                }
                at = next;
            }
            _ => panic!("unknown shader directive: {line}"),
        }
    }
}

/// The lines of a block up to its `else` and up to its `end`, and the line after it.
fn block<'a, 'b>(lines: &'a [&'b str], start: usize) -> (&'a [&'b str], &'a [&'b str], usize) {
    let mut depth = 0;
    let mut middle = None;
    for (at, line) in lines.iter().enumerate().skip(start) {
        let Some(directive) = line.trim_start().strip_prefix("//:") else { continue };
        match directive.split_whitespace().next() {
            Some("if" | "unroll") => depth += 1,
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

/// Replaces every `$NAME`. The longest defined name wins, so that `$iu` is the unrolled `$i` with WGSL's suffix u.
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
        let mut out = String::new();
        expand(source, definitions, &mut out);
        out
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
}
