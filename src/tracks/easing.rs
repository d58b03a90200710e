//! [`Easing`]: how a span is passed in time.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use crate::error::{Error, Result, quoted};

/// How a span is passed in time: the part of the span as a function of the part of its time.
///
/// A word of CSS ([Easing Functions Level 2](https://www.w3.org/TR/css-easing-2/)): `linear`, `ease`,
/// `ease-in`, `ease-out`, `ease-in-out`, `cubic-bezier(x1,y1,x2,y2)` with numbers from 0 to 1, or
/// `hold`, which waits at the point before and jumps at the end. A blank is `linear`. Blanks may stand
/// in place of commas.
///
/// ```
/// let ease: faircurve::tracks::Easing = "ease-in-out".parse()?;
/// assert_eq!((ease.at(0.0), ease.at(0.5), ease.at(1.0)), (0.0, 0.5, 1.0));
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Easing {
    /// Waits at the point before.
    Hold,
    /// The graph is a cubic Bézier from (0, 0) by (x1, y1) and (x2, y2) to (1, 1), all from 0 to 1.
    CubicBezier([f64; 4]),
}

/// The words for cubics.
const WORDS: [(&str, [f64; 4]); 5] = [
    ("linear", [0.0, 0.0, 1.0, 1.0]),
    ("ease", [0.25, 0.1, 0.25, 1.0]),
    ("ease-in", [0.42, 0.0, 1.0, 1.0]),
    ("ease-out", [0.0, 0.0, 0.58, 1.0]),
    ("ease-in-out", [0.42, 0.0, 0.58, 1.0]),
];

const HOLD: &str = "hold";

/// Halvings until the parameter of a Bézier is exact.
const HALVINGS: usize = 60;

impl Easing {
    /// The part of the span that is passed after the part `u` of its time, both from 0 to 1.
    pub fn at(&self, u: f64) -> f64 {
        self.with_rate(u)[0]
    }

    /// The part of the span at the part `u` of its time, and its derivative.
    pub(super) fn with_rate(&self, u: f64) -> [f64; 2] {
        let Easing::CubicBezier([x1, y1, x2, y2]) = *self else {
            return [if u < 1.0 { 0.0 } else { 1.0 }, 0.0];
        };
        if [x1, x2] == [y1, y2] {
            return [u, 1.0];
        }
        // From the other end derivatives are as exact as here.
        if u > 0.5 {
            let [rest, rate] = Easing::CubicBezier([x2, y2, x1, y1].map(|x| 1.0 - x)).with_rate(1.0 - u);
            return [1.0 - rest, rate];
        }
        let (x, y) = (Cubic::new(x1, x2), Cubic::new(y1, y2));
        let [mut low, mut high] = [0.0, 1.0];
        if u <= 0.0 {
            high = 0.0;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if x.derivatives(middle)[0] < u {
                low = middle;
            } else {
                high = middle;
            }
        }
        let s = 0.5 * (low + high);
        let (x, y) = (x.derivatives(s), y.derivatives(s));
        // Where both stand still, the next derivative decides.
        let rate = (1..4).find(|&k| x[k] != 0.0 || y[k] != 0.0).map_or(1.0, |k| y[k] / x[k]);
        [y[0], rate]
    }
}

/// A polynomial as + bs² + cs³ from 0 to 1.
struct Cubic([f64; 3]);

impl Cubic {
    fn new(first: f64, second: f64) -> Self {
        Cubic([3.0 * first, 3.0 * (second - 2.0 * first), 1.0 + 3.0 * (first - second)])
    }

    /// The value and three derivatives.
    fn derivatives(&self, s: f64) -> [f64; 4] {
        let [a, b, c] = self.0;
        [s * (a + s * (b + s * c)), a + s * (2.0 * b + 3.0 * s * c), 2.0 * b + 6.0 * s * c, 6.0 * c]
    }
}

impl FromStr for Easing {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let word = text.trim().to_ascii_lowercase();
        if word == HOLD {
            return Ok(Easing::Hold);
        }
        let word = if word.is_empty() { WORDS[0].0 } else { &word };
        let known = WORDS.iter().find(|(known, _)| *known == word).map(|(_, cubic)| *cubic);
        let written = || {
            let inner = word.strip_prefix("cubic-bezier(")?.strip_suffix(')')?;
            let numbers = inner.split([',', ' ']).filter(|x| !x.is_empty());
            let numbers: Vec<f64> = numbers.map(|x| x.parse().ok()).collect::<Option<_>>()?;
            <[f64; 4]>::try_from(numbers).ok().filter(|all| all.iter().all(|x| (0.0..=1.0).contains(x)))
        };
        known.or_else(written).map(Easing::CubicBezier).ok_or_else(|| {
            let words: Vec<&str> = WORDS.iter().map(|(word, _)| *word).collect();
            Error::argument(format!(
                "{} is no easing: give {}, {HOLD}, or cubic-bezier(x1 y1 x2 y2) with numbers from 0 to 1",
                quoted(text),
                words.join(", ")
            ))
        })
    }
}

impl Display for Easing {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Easing::Hold => f.pad(HOLD),
            Easing::CubicBezier(own) => match WORDS.iter().find(|(_, cubic)| cubic == own) {
                Some((word, _)) => f.pad(word),
                None => write!(f, "cubic-bezier({},{},{},{})", own[0], own[1], own[2], own[3]),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By bisection in decimals of 50 digits.
    const REFERENCE: [(&str, f64, f64); 15] = [
        ("ease", 0.1, 0.09479630571604325),
        ("ease", 0.3, 0.5133151609733584),
        ("ease", 0.75, 0.9604589783489741),
        ("ease-in", 0.1, 0.017026609651562944),
        ("ease-in", 0.3, 0.12957676084535255),
        ("ease-in", 0.75, 0.6218618691748902),
        ("ease-out", 0.1, 0.1605721542375335),
        ("ease-out", 0.3, 0.44518596747133715),
        ("ease-out", 0.75, 0.9065353492811752),
        ("ease-in-out", 0.1, 0.0197224535483112),
        ("ease-in-out", 0.3, 0.18739590670531256),
        ("ease-in-out", 0.75, 0.8708380689526802),
        ("cubic-bezier(0.1,0.7,0.9,0.3)", 0.1, 0.26601966575847896),
        ("cubic-bezier(0.1,0.7,0.9,0.3)", 0.3, 0.42401026114528895),
        ("cubic-bezier(0.1,0.7,0.9,0.3)", 0.75, 0.6023832715752988),
    ];

    #[test]
    fn easings_are_the_curves_of_css() {
        let of = |word: &str| word.parse::<Easing>().unwrap();
        for (word, u, expected) in REFERENCE {
            assert!((of(word).at(u) - expected).abs() < 1e-14, "{word} at {u}: {}", of(word).at(u));
        }
        for word in ["linear", "ease", "ease-in", "ease-out", "ease-in-out", "hold", "cubic-bezier(0,1,1,0)"] {
            let easing = of(word);
            assert_eq!((easing.at(0.0), easing.at(1.0), easing.to_string()), (0.0, 1.0, word.to_string()));
            let mut before = 0.0;
            for k in 1..100 {
                let u = f64::from(k) / 100.0;
                let [at, rate] = easing.with_rate(u);
                let near = [u - 1e-6, u + 1e-6].map(|u| easing.at(u));
                assert!(at >= before && (rate - (near[1] - near[0]) / 2e-6).abs() < 1e-3 * rate.max(1.0), "{word} {u}");
                before = at;
            }
        }
        // The slopes at the ends are those of the control polygon.
        for (word, u, rate) in [("ease", 0.0, 0.1 / 0.25), ("ease-out", 0.0, 1.0 / 0.58), ("ease-in", 1.0, 1.0 / 0.58)]
        {
            assert!((of(word).with_rate(u)[1] - rate).abs() < 1e-15, "{word} {:?}", of(word).with_rate(u));
        }
        assert_eq!(of("cubic-bezier(0.25 0.1  0.25 1)"), of("ease"));
        for wrong in ["eas", "cubic-bezier(0,0,1)", "cubic-bezier(0,-0.5,1,1)", "steps(4)"] {
            assert!(wrong.parse::<Easing>().unwrap_err().to_string().contains("cubic-bezier(x1 y1 x2 y2)"), "{wrong}");
        }
    }
}
