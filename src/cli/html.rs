//! The report as a page: totals, how often which value, and the worst curves with their pictures.
//! It needs nothing outside its file.

use std::io::{self, Write};

use serde_json::Value;

use super::thousands;

/// The number of the worst curves that are shown.
const WORST: usize = 20;

/// The number of bars of a histogram.
const BARS: usize = 24;

/// Fields of the lines that have a histogram, and what they are.
const HISTOGRAMS: [(&str, &str); 3] = [
    ("max_deviation", "largest distance from a data point, in units of the input"),
    ("max_curvature", "largest curvature, in 1/units of the input"),
    ("iterations", "iterations"),
];

/// Fields of the lines in the table of the worst.
const COLUMNS: [&str; 6] = ["points_in", "length", "max_curvature", "max_deviation", "iterations", "energy"];

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.5rem}table{border-collapse:collapse}td,th{padding:.2rem .8rem .2rem 0;\
text-align:left;font-variant-numeric:tabular-nums}th{font-weight:600;border-bottom:1px solid #999}.row{display:flex;flex-wrap:wrap;gap:2rem}\
figure{margin:0 0 1.5rem;max-width:34rem}figcaption{font-size:.9rem;overflow-wrap:anywhere}figure svg{max-width:100%;height:auto;border:1px solid #ddd}\
.bad{color:#b34700}";

/// A run, as a page shows it.
pub struct Page<'a> {
    pub title: String,
    /// What is counted: `curve` or `grid`.
    pub what: &'static str,
    /// What concerns the whole run.
    pub head: Value,
    pub totals: &'a Value,
    /// One a curve.
    pub lines: Vec<Value>,
}

impl Page<'_> {
    /// Writes the page. `picture` draws a curve, if it can be drawn.
    pub fn write(&self, out: &mut dyn Write, picture: impl Fn(usize) -> Option<String>) -> io::Result<()> {
        let Page { title, what, head, totals, lines } = self;
        let title = escaped(title);
        writeln!(out, "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>")?;
        writeln!(out, "<style>{STYLE}</style></head>\n<body><h1>{title}</h1>")?;
        let usable = thousands(totals["usable"].as_u64().unwrap_or(0) as usize);
        writeln!(out, "<p>{usable} of {} {what}s are usable.</p>\n<table>", thousands(lines.len()))?;
        for (name, value) in head.as_object().into_iter().flatten() {
            writeln!(out, "<tr><td>{}<td>{}", escaped(name), escaped(&said(value)))?;
        }
        for (name, seconds) in totals["seconds"].as_object().into_iter().flatten() {
            writeln!(out, "<tr><td>{} <td>{:.3} s", escaped(name), seconds.as_f64().unwrap_or(0.0))?;
        }
        writeln!(out, "</table>\n<h2>How they ended</h2>\n<table><tr><th>status<th>{what}s")?;
        for (status, count) in counted(lines) {
            writeln!(out, "<tr><td>{}<td>{}", escaped(&status), thousands(count))?;
        }
        writeln!(out, "</table>")?;
        let bars_of =
            |field: &str| histogram(&lines.iter().filter_map(|line| line[field].as_f64()).collect::<Vec<_>>());
        let bars: Vec<_> = HISTOGRAMS.iter().filter_map(|(field, meaning)| Some((bars_of(field)?, meaning))).collect();
        if !bars.is_empty() {
            writeln!(out, "<h2>How often which value</h2>\n<div class=\"row\">")?;
            for (bars, meaning) in bars {
                writeln!(out, "<figure>{bars}<figcaption>{meaning}</figcaption></figure>")?;
            }
            writeln!(out, "</div>")?;
        }
        writeln!(
            out,
            "<h2>The worst</h2>\n<p>Not usable first, then by deviation and curvature.</p>\n<div class=\"row\">"
        )?;
        for i in worst(lines) {
            self.figure(out, i, picture(i))?;
        }
        writeln!(out, "</div></body></html>")
    }

    fn figure(&self, out: &mut dyn Write, i: usize, picture: Option<String>) -> io::Result<()> {
        let line = &self.lines[i];
        let name = line[self.what].as_str().map_or_else(|| i.to_string(), str::to_string);
        let status = line["status"].as_str().unwrap_or_default();
        let class = if is_usable(line) { "" } else { " class=\"bad\"" };
        writeln!(out, "<figure>{}", picture.unwrap_or_default())?;
        write!(out, "<figcaption><b>{} {}</b>: <span{class}>{}</span>", self.what, escaped(&name), escaped(status))?;
        for field in COLUMNS.iter().filter(|field| !line[**field].is_null()) {
            write!(out, ", {} {}", field.replace('_', " "), said(&line[*field]))?;
        }
        if let Some(message) = line["message"].as_str() {
            write!(out, "<br>{}", escaped(message))?;
        }
        writeln!(out, "</figcaption></figure>")
    }
}

fn is_usable(line: &Value) -> bool {
    matches!(line["status"].as_str(), Some("converged" | "not_unique"))
}

/// A value as text, numbers with six digits.
fn said(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(number) => match number.as_f64() {
            Some(x) if x.fract() == 0.0 && x.abs() < 1e15 => format!("{x}"),
            Some(x) if (1e-3..1e6).contains(&x.abs()) => {
                format!("{x:.6}").trim_end_matches('0').trim_end_matches('.').into()
            }
            Some(x) => format!("{x:.3e}"),
            None => number.to_string(),
        },
        Value::Object(fields) => {
            fields.values().map(said).filter(|text| !text.is_empty()).collect::<Vec<_>>().join(", ")
        }
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

/// How often every status is found, the most frequent first.
fn counted(lines: &[Value]) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for status in lines.iter().filter_map(|line| line["status"].as_str()) {
        match counts.iter_mut().find(|(own, _)| own == status) {
            Some((_, count)) => *count += 1,
            None => counts.push((status.to_string(), 1)),
        }
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    counts
}

/// The worst curves: unusable ones first, then by deviation, then by curvature.
fn worst(lines: &[Value]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..lines.len()).collect();
    let number = |i: usize, field: &str| lines[i][field].as_f64().unwrap_or(0.0);
    order.sort_unstable_by(|&a, &b| {
        let [usable_a, usable_b] = [a, b].map(|i| is_usable(&lines[i]));
        let by = |field: &str| number(b, field).total_cmp(&number(a, field));
        usable_a.cmp(&usable_b).then(by("max_deviation")).then(by("max_curvature")).then(a.cmp(&b))
    });
    order.truncate(WORST);
    order
}

/// Bars for values, logarithmic where they range over more than three decades. `None` if all are
/// one.
///
/// The first and the last bar take what is beyond the outermost hundredths, too.
fn histogram(values: &[f64]) -> Option<String> {
    const WIDTH: f64 = 480.0;
    const HEIGHT: f64 = 160.0;
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (least, most) = (sorted.first()?, sorted.last()?);
    let at = |part: f64| sorted[(part * (sorted.len() - 1) as f64).round() as usize];
    let (mut low, high) = if at(0.01) < at(0.99) { (at(0.01), at(0.99)) } else { (*least, *most) };
    let positive = sorted.iter().copied().find(|x| *x > 0.0).unwrap_or(1.0);
    let logarithmic = low >= 0.0 && high > 1e3 * low.max(positive);
    if logarithmic {
        low = low.max(positive);
    }
    if !(low < high && high.is_finite()) {
        return None;
    }
    let place = |x: f64| match logarithmic {
        true => (x.max(low) / low).ln() / (high / low).ln(),
        false => (x - low) / (high - low),
    };
    let mut counts = [0usize; BARS];
    values.iter().for_each(|&x| counts[((place(x).max(0.0) * BARS as f64) as usize).min(BARS - 1)] += 1);
    let tallest = counts.iter().copied().max().unwrap_or(1).max(1);
    let step = WIDTH / BARS as f64;
    let bar = |(k, &count): (usize, &usize)| {
        let height = count as f64 / tallest as f64 * HEIGHT;
        let (x, y, width, count) = (k as f64 * step, 20.0 + HEIGHT - height, step - 2.0, thousands(count));
        format!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"><title>{count}</title></rect>"
        )
    };
    let bars: String = counts.iter().enumerate().map(bar).collect();
    let number = |x: f64| said(&serde_json::json!(x));
    let from = number(low) + if *least < low { " and less" } else { "" };
    let to = number(high) + if *most > high { " and more" } else { "" };
    let scale = if logarithmic { "logarithmic" } else { "" };
    let (tallest, middle) = (thousands(tallest), 0.5 * WIDTH);
    Some(format!(
        "<svg viewBox=\"0 0 {WIDTH} 210\" width=\"{WIDTH}\" height=\"210\" font-family=\"sans-serif\" font-size=\"13\"><g \
         fill=\"#0072B2\">{bars}</g><text x=\"0\" y=\"14\">{tallest}</text><text x=\"0\" y=\"200\">{from}</text><text x=\"{middle}\" \
         y=\"200\" text-anchor=\"middle\">{scale}</text><text x=\"{WIDTH}\" y=\"200\" text-anchor=\"end\">{to}</text></svg>"
    ))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn histograms_count_every_value_once() {
        let total = |values: &[f64]| -> usize {
            let bars = histogram(values).unwrap();
            let counts = bars.split("<title>").skip(1).map(|part| part.split('<').next().unwrap());
            counts.map(|count| count.parse::<usize>().unwrap()).sum()
        };
        assert_eq!(total(&[0.0, 1.0, 2.0, 2.0, 3.0]), 5);
        assert_eq!(total(&[0.0, 1e-20, 1.0, 1e4, 1e6]), 5);
        assert!(histogram(&[0.0, 1e-20, 1e6]).unwrap().contains("logarithmic"));
        let outlier =
            histogram(&(0..500).map(|k| if k == 0 { 1e15 } else { f64::from(k) }).collect::<Vec<_>>()).unwrap();
        assert!(outlier.contains(" and more") && !outlier.contains("logarithmic"), "{outlier}");
        assert!(histogram(&[2.0, 2.0]).is_none() && histogram(&[]).is_none());
    }

    #[test]
    fn the_worst_are_those_that_are_not_usable_then_the_farthest() {
        let line = |status: &str, deviation: f64| json!({"status": status, "max_deviation": deviation});
        let lines = [line("converged", 1.0), line("converged", 3.0), line("invalid", 0.0), line("not_unique", 2.0)];
        assert_eq!(worst(&lines), [2, 1, 3, 0]);
    }
}
