//! Times and columns of the positions of a line: one array each, with an entry per position in the
//! same order. If the line is cut, there is one array per part.

use std::io;

use super::cut::Cut;
use super::lists::{has_places, list, nested};
use crate::batch::{Column, CurveBatch, Values};
use crate::io::text::Text;

/// The properties that a feature has by itself: its curve's name, and times as dates or as numbers.
pub(super) const CURVE: &str = "curve";
pub(super) const DATES: &str = "coordTimes";
pub(super) const TIMES: &str = "t";

/// The positions of a curve, each by its point, or a number between two.
pub(super) struct Along<'a> {
    batch: &'a CurveBatch,
    i: usize,
    lines: Vec<Vec<f64>>,
}

impl<'a> Along<'a> {
    /// The positions of curve `i`, cut or whole, if it has any.
    pub fn of(batch: &'a CurveBatch, i: usize, cut: Option<&Cut>) -> Option<Self> {
        let lines: Vec<Vec<f64>> = match cut {
            Some(Cut::Lines(lines)) => {
                let place = |position: &Vec<f64>| position.last().copied().unwrap_or_default();
                lines.iter().map(|line| line.iter().map(place).collect()).collect()
            }
            _ => vec![(0..batch.count(i) + usize::from(batch.is_closed(i))).map(|k| k as f64).collect()],
        };
        (batch.count(i) > 0 && has_places(batch, i)).then_some(Along { batch, i, lines })
    }

    /// The times, if they were given.
    pub fn write_times(&self, text: &mut Text) -> io::Result<()> {
        let origin = self.batch.origin();
        let Some(t) = self.batch.parameters(self.i).filter(|_| origin.timed) else { return Ok(()) };
        let mut times = Values::Numbers(vec![]);
        let knots = Values::Numbers(self.batch.times_with_end(self.i));
        self.places().for_each(|(k, u)| times.push_between(&knots, [k, (k + 1).min(knots.len() - 1)], u));
        let Values::Numbers(times) = times else { return Ok(()) };
        match origin.clock(self.i).map(|clock| clock.for_all(t.iter().copied())) {
            Some(clock) => self.write(text, DATES, |text, k| text.push(format!("\"{}\"", clock.write(times[k])))),
            None => self.write(text, TIMES, |text, k| text.number_or_null(times[k])),
        }
    }

    /// A column of the batch, as a property of this name.
    pub fn write_column(&self, text: &mut Text, name: &str, column: &Column) -> io::Result<()> {
        let (first, count) = (self.batch.offsets()[self.i], self.batch.count(self.i));
        let mut values = column.values.gather(&[]);
        self.places().for_each(|(k, u)| {
            values.push_between(&column.values, [k, k + 1].map(|k| first + k % count), u);
        });
        self.write(text, name, |text, k| match &values {
            Values::Texts(texts) => text.push(of_text(&texts[k]).to_string()),
            values => text.number_or_null(values.numbers().map_or(f64::NAN, |numbers| numbers[k])),
        })
    }

    /// The point of every position, and the part of the way from there to the next.
    fn places(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.lines.iter().flatten().map(|place| (place.floor() as usize, place.fract()))
    }

    fn write(
        &self,
        text: &mut Text,
        name: &str,
        mut entry: impl FnMut(&mut Text, usize) -> io::Result<()>,
    ) -> io::Result<()> {
        text.push(format!(",{}:", serde_json::to_string(name)?))?;
        let mut first = 0;
        nested(text, self.lines.len(), |text, line| {
            let count = self.lines[line].len();
            list(text, count, |text, k| entry(text, first + k))?;
            first += count;
            Ok(())
        })
    }
}

/// A text as JSON. A number stays one, unless it would be written in another way.
pub(super) fn of_text(text: &str) -> serde_json::Value {
    let number = text.parse::<serde_json::Number>().ok().filter(|number| number.to_string() == text);
    number.map_or_else(|| text.into(), serde_json::Value::Number)
}
