//! SVG text: path data in few bytes, and escaping.

use std::fmt::Write;

use glam::DVec2;

/// The length up to which consecutive pieces are merged, in steps of the rounding.
///
/// It is 0.8 pixels at two decimal places, and at most 1.6 with one.
const MERGE: f64 = 80.0;

/// How close a cubic's control points are to its chord if it is written as a line, in steps of the
/// rounding.
const STRAIGHT: f64 = 4.0;

/// Writes path data with coordinates rounded to `decimals` places of a pixel.
///
/// Steps are differences of rounded positions, so rounding does not add up along a curve.
pub struct Pen {
    text: String,
    at: [i64; 2],
    unit: f64,
    merge: f64,
    straight: f64,
    decimals: usize,
    command: u8,
    waiting: Option<[DVec2; 4]>,
}

impl Pen {
    /// No path yet.
    pub fn new(decimals: usize) -> Self {
        let unit = 10f64.powi(decimals as i32);
        let (merge, straight) = ((MERGE / unit).min(1.6), (STRAIGHT / unit).min(0.12));
        Pen { text: String::new(), at: [0; 2], unit, merge, straight, decimals, command: 0, waiting: None }
    }

    fn round(&self, p: DVec2) -> [i64; 2] {
        // A coordinate beyond i64 saturates. NaN (which callers keep out) would become 0.
        [(p.x * self.unit).round() as i64, (p.y * self.unit).round() as i64]
    }

    fn number(&mut self, value: i64) {
        if value >= 0 && self.text.ends_with(|last: char| last.is_ascii_digit()) {
            self.text.push(' ');
        }
        if value < 0 {
            self.text.push('-');
        }
        let (value, unit) = (value.unsigned_abs(), self.unit as u64);
        let (whole, fraction) = (value / unit, value % unit);
        if whole > 0 || fraction == 0 {
            write!(self.text, "{whole}").expect("a String takes all");
        }
        if fraction > 0 {
            let digits = format!("{fraction:0width$}", width = self.decimals);
            write!(self.text, ".{}", digits.trim_end_matches('0')).expect("a String takes all");
        }
    }

    fn emit(&mut self, command: u8, points: &[DVec2]) {
        if command != self.command {
            self.text.push(command as char);
            self.command = command;
        }
        let from = if command == b'M' { [0; 2] } else { self.at };
        for &p in points {
            self.at = self.round(p);
            self.number(self.at[0] - from[0]);
            self.number(self.at[1] - from[1]);
        }
    }

    /// Starts a new piece of path.
    pub fn move_to(&mut self, p: DVec2) {
        self.flush();
        self.emit(b'M', &[p]);
        self.command = b'm';
    }

    /// A straight line. Steps that round to nothing are left out.
    pub fn line_to(&mut self, p: DVec2) {
        if self.round(p) != self.at {
            self.emit(b'l', &[p]);
        }
    }

    /// A line of no length. Round caps make it a dot.
    pub fn dot(&mut self, p: DVec2) {
        self.move_to(p);
        self.text.push_str("h0");
        self.command = b'h';
    }

    /// A cubic that starts where the last one ended.
    ///
    /// Pieces of less than a pixel are joined into one with the same ends and end directions. This
    /// is exactly the same curve if they were parts of one cubic.
    pub fn cubic(&mut self, next: [DVec2; 4]) {
        let Some(last) = self.waiting.take() else {
            self.waiting = Some(next);
            return;
        };
        let (a, b) = (control_length(&last), control_length(&next));
        if a + b >= self.merge {
            self.write_cubic(&last);
            self.waiting = Some(next);
        } else {
            let first = if a > 0.0 { last[0] + (last[1] - last[0]) * ((a + b) / a) } else { last[0] };
            let second = if b > 0.0 { next[3] - (next[3] - next[2]) * ((a + b) / b) } else { next[3] };
            self.waiting = Some([last[0], first, second, next[3]]);
        }
    }

    fn flush(&mut self) {
        if let Some(last) = self.waiting.take() {
            self.write_cubic(&last);
            // A curve of less than a pixel is still a dot.
            if self.command == b'm' {
                self.text.push_str("h0");
                self.command = b'h';
            }
        }
    }

    fn write_cubic(&mut self, piece: &[DVec2; 4]) {
        let chord = piece[3] - piece[0];
        let near = |p: DVec2| {
            let from_start = p - piece[0];
            let along = from_start.dot(chord);
            // |cross| is the distance times the chord's length.
            from_start.perp_dot(chord).powi(2) <= self.straight * self.straight * chord.length_squared()
                && (0.0..=chord.length_squared()).contains(&along)
        };
        if near(piece[1]) && near(piece[2]) {
            self.line_to(piece[3]);
        } else {
            self.emit(b'c', &piece[1..]);
        }
    }

    /// Closes the piece of path.
    pub fn close(&mut self) {
        self.flush();
        self.text.push('z');
        self.command = b'z';
    }

    /// The path data.
    pub fn finish(mut self) -> String {
        self.flush();
        self.text
    }
}

fn control_length(piece: &[DVec2; 4]) -> f64 {
    piece.windows(2).map(|pair| (pair[1] - pair[0]).length()).sum()
}

/// Text fit for XML content and attributes. Characters that XML cannot hold become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' => out.push(c),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn numbers_take_few_bytes_and_rounding_does_not_add_up() {
        let mut pen = Pen::new(1);
        pen.move_to(v(10.0, -0.5));
        (1..=9).for_each(|k| pen.line_to(v(10.0 + 0.34 * f64::from(k), 0.04)));
        // Nine steps of 0.34 end at 13.06, not at nine rounded steps of 0.3.
        assert_eq!(pen.finish(), "M10-.5l.3 .5 .4 0 .3 0 .4 0 .3 0 .3 0 .4 0 .3 0 .4 0");
    }

    #[test]
    fn a_straight_cubic_becomes_a_line_and_a_bent_one_stays() {
        let mut pen = Pen::new(2);
        pen.move_to(v(0.0, 0.0));
        pen.cubic([v(0.0, 0.0), v(3.0, 0.0), v(6.0, 0.01), v(9.0, 0.0)]);
        pen.cubic([v(9.0, 0.0), v(12.0, 0.0), v(12.0, 3.0), v(9.0, 3.25)]);
        pen.close();
        assert_eq!(pen.finish(), "M0 0l9 0c3 0 3 3 0 3.25z");
    }

    #[test]
    fn pieces_below_a_pixel_are_merged_back_into_the_cubic_they_were_parts_of() {
        let whole = [v(0.0, 0.0), v(0.3, 0.0), v(0.6, 0.2), v(0.7, 0.3)];
        let lerp = |t: f64| -> DVec2 {
            let [a, b, c] = [0, 1, 2].map(|i| whole[i].lerp(whole[i + 1], t));
            a.lerp(b, t).lerp(b.lerp(c, t), t)
        };
        let mut pen = Pen::new(2);
        pen.move_to(whole[0]);
        for k in 0..1000 {
            let (a, b) = (lerp(f64::from(k) / 1000.0), lerp(f64::from(k + 1) / 1000.0));
            pen.cubic([a, a.lerp(b, 1.0 / 3.0), a.lerp(b, 2.0 / 3.0), b]);
        }
        let text = pen.finish();
        assert!(text.starts_with("M0 0") && text.len() < 40, "{text}");
    }

    #[test]
    fn a_curve_smaller_than_a_pixel_is_still_a_dot() {
        let mut pen = Pen::new(1);
        pen.move_to(v(1.0, 1.0));
        pen.cubic([v(1.0, 1.0), v(1.001, 1.0), v(1.002, 1.0), v(1.003, 1.0)]);
        assert_eq!(pen.finish(), "M1 1h0");
    }

    #[test]
    fn names_cannot_break_the_xml() {
        assert_eq!(escape("<b>&\"\u{1}é"), "&lt;b&gt;&amp;&quot;\u{fffd}é");
    }
}
