//! Words: how options of the library are read and listed here, and what this program calls what the
//! library's sentences name.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use faircurve::io::Format;

/// Reads one of the library's words; help lists them with their meanings.
pub fn one_of<T>(words: &'static [(&'static str, T, &'static str)]) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync,
{
    let listed = words.iter().map(|(word, _, meaning)| PossibleValue::new(*word).help(*meaning));
    PossibleValuesParser::new(listed).map(|given| {
        let (_, value, _) = words.iter().find(|(word, ..)| *word == given).expect("one of those that are listed");
        *value
    })
}

/// Reads the word of a format, or another extension of its files; help lists them with what they
/// hold.
pub fn format() -> impl TypedValueParser<Value = Format> {
    let listed = Format::ALL.iter().map(|format| {
        let mut extensions = format.extensions();
        let word = extensions.next().unwrap_or_default();
        PossibleValue::new(word).aliases(extensions).help(format.holds()[0].replace('`', ""))
    });
    PossibleValuesParser::new(listed).map(|given| given.parse().expect("one of those that are listed"))
}

/// What sentences of the library name, and the options here that stand for it.
const OPTIONS: [(&str, &str); 15] = [
    ("`Device::cpu`", "--device cpu"),
    ("`Precision::F32`", "--precision f32"),
    ("`gpu::adapters`", "`faircurve doctor`"),
    ("`discrete::Fair`", "--method fair"),
    ("`Smooth::tension`", "--tension"),
    ("`spline::Natural`", "--method natural"),
    ("`spline::Smoothing`", "--method smoothing"),
    ("`ReadOptions::columns`", "--columns"),
    ("`ReadOptions::format`", "--from"),
    ("`ReadOptions::sorted`", "--sort t"),
    ("`ReadOptions::carried`", "--carry"),
    ("`format`", "--from"),
    ("`WriteOptions::format`", "--to"),
    ("`GridWrite::format`", "--to"),
    ("`overwrite`", "--force"),
];

/// A sentence of the library for users of the program: with options in place of the library's
/// names.
pub fn with_options(sentence: impl ToString) -> String {
    let replace = |sentence: String, (name, option): (&str, &str)| match sentence.contains(name) {
        true => sentence.replace(name, option),
        false => sentence,
    };
    OPTIONS.into_iter().fold(sentence.to_string(), replace)
}
