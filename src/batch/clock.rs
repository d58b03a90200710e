//! [`Clock`]: the format of dates such as `2024-03-01T06:00:00Z`.

use jiff::civil::{DateTime, Time};
use jiff::fmt::temporal::{Pieces, PiecesOffset};
use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp};

/// The ISO 8601 format of a file's times. Numbers are seconds since 1970, UTC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    /// `T`, a space, or none for days without times.
    separator: Option<char>,
    /// Whether seconds are written, and with how many decimals.
    seconds: bool,
    decimals: usize,
    zone: Zone,
}

/// The time zone after the time of day.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Zone {
    /// None: UTC or local time.
    Unsaid,
    Z,
    Offset(Offset),
}

/// The most decimals of seconds: f64 seconds since 1970 have no more.
const MOST_DECIMALS: usize = 6;

const MICROSECONDS: f64 = 1e6;

impl Clock {
    /// Parses a time and its format.
    pub fn read(text: &str) -> Option<(f64, Self)> {
        let pieces = Pieces::parse(text).ok()?;
        let (zone, offset) = match pieces.offset() {
            None => (Zone::Unsaid, Offset::UTC),
            Some(PiecesOffset::Zulu) => (Zone::Z, Offset::UTC),
            Some(PiecesOffset::Numeric(numeric)) => (Zone::Offset(numeric.offset()), numeric.offset()),
            Some(_) => return None,
        };
        let time = pieces.time();
        let stamp = offset.to_timestamp(pieces.date().to_datetime(time.unwrap_or(Time::midnight()))).ok()?;
        let separator = text.chars().nth(10).filter(|letter| *letter == ' ').or(Some('T')).filter(|_| time.is_some());
        let clock_time = text.split(['T', 't', ' ']).nth(1).unwrap_or_default();
        let fraction = clock_time.split(['.', ',']).nth(1).unwrap_or_default();
        let decimals = fraction.bytes().take_while(u8::is_ascii_digit).count().min(MOST_DECIMALS);
        let digits = clock_time.bytes().take_while(|c| c.is_ascii_digit() || *c == b':').filter(u8::is_ascii_digit);
        let clock = Clock { separator, seconds: digits.count() > 4, decimals, zone };
        let seconds = stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9;
        Some((seconds, clock))
    }

    /// The clocks of curves with different offsets from UTC. Curves without a clock get this one.
    pub fn each_own(self, clocks: &[Option<Clock>]) -> Option<Vec<Clock>> {
        let all: Vec<Clock> = clocks.iter().map(|own| own.unwrap_or(self)).collect();
        all.windows(2).any(|pair| pair[0].zone != pair[1].zone).then_some(all)
    }

    /// The clock with the fields of both, in this one's zone.
    pub fn with(self, other: Clock) -> Self {
        Clock {
            separator: self.separator.or(other.separator),
            seconds: self.seconds || other.seconds,
            decimals: self.decimals.max(other.decimals),
            zone: self.zone,
        }
    }

    /// The clock with the fields that these times need.
    pub fn for_all(self, times: impl Iterator<Item = f64>) -> Self {
        let mut clock = self;
        for date in times.filter_map(|t| self.date(t)) {
            let time = date.time();
            if clock.separator.is_none() && time != Time::midnight() {
                clock.separator = Some('T');
            }
            if time.second() != 0 || time.subsec_nanosecond() != 0 {
                clock.seconds = true;
            }
            let micros = time.subsec_nanosecond() / 1000;
            while clock.decimals < MOST_DECIMALS && micros % 10_i32.pow((MOST_DECIMALS - clock.decimals) as u32) != 0 {
                clock.decimals += 1;
            }
        }
        clock
    }

    /// The date and the time of day in the clock's zone.
    fn date(&self, t: f64) -> Option<DateTime> {
        let offset = match self.zone {
            Zone::Offset(offset) => offset,
            Zone::Unsaid | Zone::Z => Offset::UTC,
        };
        let micros = (t * MICROSECONDS).round();
        let stamp = Timestamp::from_duration(SignedDuration::from_micros(micros as i64)).ok();
        stamp.filter(|_| micros.is_finite()).map(|stamp| offset.to_datetime(stamp))
    }

    /// A time as text, empty if it is out of range.
    pub fn write(&self, t: f64) -> String {
        let Some(date) = self.date(t) else { return String::new() };
        let mut text = date.strftime("%Y-%m-%d").to_string();
        let Some(separator) = self.separator else { return text };
        text.push(separator);
        text += &date.strftime(if self.seconds || self.decimals > 0 { "%H:%M:%S" } else { "%H:%M" }).to_string();
        if self.decimals > 0 {
            let fraction = format!("{:06}", date.subsec_nanosecond() / 1000);
            text += &format!(".{}", &fraction[..self.decimals]);
        }
        match self.zone {
            Zone::Unsaid => {}
            Zone::Z => text.push('Z'),
            Zone::Offset(offset) => {
                let minutes = offset.seconds() / 60;
                let sign = if minutes < 0 { '-' } else { '+' };
                text += &format!("{sign}{:02}:{:02}", minutes.abs() / 60, minutes.abs() % 60);
            }
        }
        text
    }

    /// The zone's offset from UTC in seconds.
    pub fn offset(&self) -> f64 {
        match self.zone {
            Zone::Offset(offset) => offset.seconds().into(),
            Zone::Unsaid | Zone::Z => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_as_they_came() {
        for text in [
            "2024-03-01T06:00:00Z",
            "2024-03-01 06:00:00",
            "2024-03-01",
            "1969-12-31T23:59",
            "2024-02-29T23:59:59.250+05:30",
            "2024-07-01T00:00:00.000001-04:00",
            "0001-01-01T00:00:00Z",
        ] {
            let (t, clock) = Clock::read(text).unwrap();
            assert_eq!(clock.write(t), text);
            assert_eq!(clock.for_all([t].into_iter()), clock);
        }
        assert_eq!(Clock::read("1970-01-02T00:00:01.5+01:00").unwrap().0, 82801.5);
        assert_eq!(Clock::read("20240301T060000Z").unwrap().0, Clock::read("2024-03-01T06:00Z").unwrap().0);
        assert!(
            ["", "noon", "2024", "1.5", "2024-13-01", "06:00", "2024-02-30T00:00"]
                .iter()
                .all(|t| Clock::read(t).is_none())
        );
    }

    #[test]
    fn a_clock_has_the_digits_that_its_times_need() {
        let (t, clock) = Clock::read("2024-03-01").unwrap();
        let of = |times: &[f64]| clock.for_all(times.iter().map(|dt| t + dt));
        assert_eq!(of(&[0.0, 86_400.0]).write(t), "2024-03-01");
        assert_eq!(of(&[0.0, 3600.0]).write(t), "2024-03-01T00:00");
        assert_eq!(of(&[0.0, 3.25]).write(t), "2024-03-01T00:00:00.00");
        assert_eq!(of(&[1.0 / 3.0]).write(t + 1.0 / 3.0), "2024-03-01T00:00:00.333333");
        assert_eq!([f64::NAN, f64::INFINITY, 1e300].map(|t| clock.write(t)), ["", "", ""]);
    }
}
