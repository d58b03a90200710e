//! Text output through one small buffer. Numbers are the shortest decimals that read back to the
//! same bits.

use std::io::{self, Write};

/// How much is gathered before it goes to the file.
const BUFFER_BYTES: usize = 1 << 16;

/// A buffered writer of text and numbers.
///
/// [`finish`](Self::finish) must be called. What is left in the buffer is not written on drop.
pub(crate) struct Text<'w> {
    out: &'w mut dyn Write,
    buffer: Vec<u8>,
    digits: zmij::Buffer,
    /// Ten to the number of decimals that coordinates are rounded to.
    rounding: Option<f64>,
}

impl<'w> Text<'w> {
    pub(crate) fn new(out: &'w mut dyn Write) -> Self {
        Text { out, buffer: Vec::with_capacity(BUFFER_BYTES + 4096), digits: zmij::Buffer::new(), rounding: None }
    }

    /// Rounds the coordinates of points to this many decimals, or leaves them as they are.
    pub(crate) fn with_decimals(mut self, decimals: Option<u8>) -> Self {
        self.rounding = decimals.map(|decimals| 10_f64.powi(decimals.into()));
        self
    }

    /// Appends text.
    pub(crate) fn push(&mut self, text: impl AsRef<[u8]>) -> io::Result<()> {
        self.buffer.extend_from_slice(text.as_ref());
        if self.buffer.len() >= BUFFER_BYTES { self.flush() } else { Ok(()) }
    }

    /// Appends a number: the shortest decimal that reads back to the same bits.
    ///
    /// It has at most 17 significant digits. `NaN`, `inf` and `-inf` are for formats that have no
    /// other way to say it.
    pub(crate) fn number(&mut self, x: f64) -> io::Result<()> {
        let digits = self.digits.format(x);
        self.buffer.extend_from_slice(digits.strip_suffix(".0").unwrap_or(digits).as_bytes());
        if self.buffer.len() >= BUFFER_BYTES { self.flush() } else { Ok(()) }
    }

    /// Appends a number, or null: JSON has no NaN.
    pub(crate) fn number_or_null(&mut self, x: f64) -> io::Result<()> {
        if x.is_finite() { self.number(x) } else { self.push("null") }
    }

    /// Appends the coordinates of one point with a separator between them.
    pub(crate) fn point(&mut self, point: &[f64], separator: &str) -> io::Result<()> {
        for (axis, &x) in point.iter().enumerate() {
            if axis > 0 {
                self.push(separator)?;
            }
            self.number(self.rounded(x))?;
        }
        Ok(())
    }

    fn rounded(&self, x: f64) -> f64 {
        // 0 and −0 are written alike; numbers too large to have such decimals stay.
        let round = |by: f64| Some((x * by).round() / by + 0.0).filter(|rounded| rounded.is_finite());
        self.rounding.and_then(round).unwrap_or(x)
    }

    /// Writes out what the buffer still holds.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        self.out.flush()
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.write_all(&self.buffer)?;
        self.buffer.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(x: f64) -> String {
        let mut out = Vec::new();
        let mut text = Text::new(&mut out);
        text.number(x).unwrap();
        text.finish().unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn numbers_are_short_and_read_back_to_the_same_bits() {
        let shortest = [
            (0.1, "0.1"),
            (-0.0, "-0"),
            (5.0, "5"),
            (1e23, "1e+23"),
            (0.1 + 0.2, "0.30000000000000004"),
            (-180.0, "-180"),
        ];
        for (x, expected) in shortest {
            assert_eq!(written(x), expected);
            assert_eq!(expected.parse::<f64>().unwrap().to_bits(), x.to_bits());
        }
        for x in [f64::MIN_POSITIVE, 5e-324, f64::MAX, 2.0f64.powi(53) + 2.0, 9007199254740993.0, std::f64::consts::PI]
        {
            assert_eq!(written(x).parse::<f64>().unwrap().to_bits(), x.to_bits(), "{}", written(x));
            assert_eq!(serde_json::from_str::<f64>(&written(x)).unwrap().to_bits(), x.to_bits(), "{}", written(x));
        }
        assert_eq!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(written), ["NaN", "inf", "-inf"]);
    }

    #[test]
    fn a_full_disk_is_an_error_however_late_it_comes() {
        struct Room(usize);
        impl Write for Room {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                if self.0 == 0 {
                    return Err(io::ErrorKind::StorageFull.into());
                }
                let taken = bytes.len().min(self.0);
                self.0 -= taken;
                Ok(taken)
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        for room in [0, 1, 70_000, 199_999] {
            let mut out = Room(room);
            let mut text = Text::new(&mut out);
            let error = (0..100_000).try_for_each(|_| text.push("ab")).and_then(|()| text.finish()).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::StorageFull, "room for {room} bytes");
        }
        let mut out = Room(200_000);
        let mut text = Text::new(&mut out);
        (0..100_000).try_for_each(|_| text.push("ab")).and_then(|()| text.finish()).unwrap();
    }
}
