//! The page around the curves: head, grid, title, legend and caption.

use std::borrow::Cow;
use std::io::{self, Write};

use super::layout::Frame;
use super::svg::escape;

const TEXT: &str = "#444444";
/// The colour of grid lines.
pub const GRID: &str = "#ECECEC";
const FONT: f64 = 12.0;

/// The approximate width of a letter, in font sizes. Exact widths would need the reader's fonts.
const LETTER: f64 = 0.56;

/// Pixels from line to line of text.
pub const LINE: f64 = 20.0;
/// Pixels at both sides of the page.
pub const SIDE: f64 = 24.0;

/// One entry of the legend: a line, maybe with a dot on it, and its meaning.
pub(super) struct Entry {
    pub colour: Cow<'static, str>,
    pub width: f64,
    pub dashed: bool,
    pub dot: Option<(&'static str, f64)>,
    pub text: String,
}

pub(super) struct Page<'a> {
    pub frame: &'a Frame,
    pub width: f64,
    pub title: Option<&'a str>,
}

impl Page<'_> {
    /// Writes the head, the title, the legend and the caption.
    pub fn open(&self, out: &mut dyn Write, legend: &[Entry], caption: &str) -> io::Result<()> {
        let bottom = self.frame.plot[3];
        let (mut x, mut y) = (SIDE, bottom + LINE);
        let mut foot = Vec::new();
        for entry in legend {
            let wide = 36.0 + text_width(&entry.text);
            if x > SIDE && x + wide > self.width - SIDE {
                (x, y) = (SIDE, y + LINE);
            }
            let dashes = if entry.dashed { r#" stroke-dasharray="5 4""# } else { "" };
            writeln!(
                foot,
                r#"<path d="M{x:.1} {:.1}h28" stroke="{}" stroke-width="{:.2}"{dashes}/>"#,
                y - 4.0,
                entry.colour,
                entry.width
            )?;
            if let Some((colour, radius)) = entry.dot {
                let (x, y) = (x + 14.0, y - 4.0);
                writeln!(foot, r#"<path d="M{x:.1} {y:.1}h0" stroke="{colour}" stroke-width="{:.2}"/>"#, 2.0 * radius)?;
            }
            writeln!(foot, r#"<text x="{:.1}" y="{y:.1}">{}</text>"#, x + 36.0, escape(&entry.text))?;
            x += wide + 24.0;
        }
        for line in wrap(caption, self.width - 2.0 * SIDE) {
            y += if legend.is_empty() && y == bottom + LINE { 0.0 } else { LINE };
            writeln!(foot, r#"<text x="{SIDE}" y="{y:.1}">{}</text>"#, escape(&line))?;
        }
        let (width, height) = (self.width.ceil(), (y + 12.0).ceil());
        writeln!(
            out,
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="system-ui, 'Helvetica Neue', Arial, sans-serif" font-size="{FONT}" fill="none" stroke-linecap="round" stroke-linejoin="round">"#
        )?;
        writeln!(out, "<title>{}</title>", escape(self.title.unwrap_or(caption)))?;
        writeln!(
            out,
            "<style>path{{vector-effect:non-scaling-stroke}}text{{fill:{TEXT};stroke:none}}.g{{fill:#999;stroke:#fff;stroke-width:3;paint-order:stroke}}</style>"
        )?;
        writeln!(out, r##"<rect width="{width}" height="{height}" fill="#FFFFFF"/>"##)?;
        if let Some(title) = self.title {
            writeln!(out, r#"<text x="{SIDE}" y="30" font-size="18">{}</text>"#, escape(title))?;
        }
        out.write_all(&foot)
    }

    /// Very light lines at round values, and the values at the left and lower edge.
    pub fn grid(&self, out: &mut dyn Write) -> io::Result<()> {
        let [left, top, right, bottom] = self.frame.plot;
        let step = self.frame.grid_step(90.0);
        writeln!(out, r#"<g stroke="{GRID}" stroke-width="1" font-size="10">"#)?;
        let at = |x: f64, y: f64| self.frame.map(glam::DVec2::new(x, y));
        let (x_lines, y_lines) = (self.frame.grid(0, step), self.frame.grid(1, step));
        let y0 = y_lines.first().copied().unwrap_or(0.0);
        let x0 = x_lines.first().copied().unwrap_or(0.0);
        for value in x_lines {
            let x = at(value, y0).x;
            writeln!(out, r#"<path d="M{x:.1} {top:.1}V{bottom:.1}"/>"#)?;
            let text = number(value, step);
            // A number that is cut at the edge would read as another number.
            if x + 3.0 + text_width(&text) <= right {
                writeln!(out, r#"<text x="{:.1}" y="{:.1}" class="g">{text}</text>"#, x + 3.0, bottom - 4.0)?;
            }
        }
        for value in y_lines {
            let y = at(x0, value).y;
            writeln!(out, r#"<path d="M{left:.1} {y:.1}H{right:.1}"/>"#)?;
            if y < bottom - 16.0 {
                writeln!(
                    out,
                    r#"<text x="{:.1}" y="{:.1}" class="g">{}</text>"#,
                    left + 3.0,
                    y - 3.0,
                    number(value, step)
                )?;
            }
        }
        writeln!(out, "</g>")
    }

    pub fn close(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "</svg>")
    }
}

/// The width of a text in pixels, approximately.
pub fn text_width(text: &str) -> f64 {
    text.chars().count() as f64 * LETTER * FONT
}

/// Lines of whole words no wider than `width`.
pub(super) fn wrap(text: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if text_width(line) + text_width(word) < width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

/// A grid value with as many decimals as its step has.
pub fn number(value: f64, step: f64) -> String {
    let value = if value.abs() < 1e-9 * step { 0.0 } else { value };
    if value.abs() >= 1e7 || (step < 1e-4) {
        return format!("{value:.2e}");
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// A number of three significant digits.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    if !(-3..=8).contains(&digits) { format!("{value:.2e}") } else { format!("{value:.*}", digits.max(0) as usize) }
}

/// 12345 as "12,345".
pub fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_round() {
        assert_eq!([number(-30.0, 30.0), number(0.30000000000000004, 0.1), number(1e-17, 0.5)], ["-30", "0.3", "0.0"]);
        assert_eq!(
            [short(0.012345), short(12.345), short(1234.5), short(1.2e-12)],
            ["0.0123", "12.3", "1234", "1.20e-12"]
        );
        assert_eq!([thousands(7), thousands(1234), thousands(1234567)], ["7", "1,234", "1,234,567"]);
    }

    #[test]
    fn a_caption_is_broken_between_words() {
        assert_eq!(wrap("one two three", 60.0), ["one two", "three"]);
    }
}
