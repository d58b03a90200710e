//! [`ExponentSearch`]: finds the exponent of a shape, the ν whose curve through some of its points
//! comes closest to it.

use super::Smooth;
use crate::batch::CurveBatch;
use crate::constraint::Constraints;
use crate::curve::Sampling;
use crate::device::Device;
use crate::error::{Error, Result};
use crate::sort;

/// The samples per span at which a curve is compared with the shape.
///
/// Their chords are within 1/2,000 of a half circle's size of the curve.
const SAMPLES: usize = 32;

/// The number of exponents in the first round, in equal ratios.
const CANDIDATES: usize = 24;

/// The number of refinement rounds around the best exponent.
///
/// Each round tries the same number of exponents, between the neighbours of the best one.
const ROUNDS: usize = 3;

/// The choice of dots among the points of a shape.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum DotsOf {
    /// This number of dots, at equal arc lengths.
    ///
    /// They include the first point and, for open shapes, the last.
    Count(usize),
    /// The points with these indices, in increasing order.
    Points(Vec<usize>),
}

/// The deviation of an exponent's curve from a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// ν
    pub exponent: f64,
    /// The root mean square of the distances of the shape's points from the curve, in units of the
    /// input.
    ///
    /// Infinite if there is no curve.
    pub rms: f64,
    /// The largest of the distances.
    pub largest: f64,
}

/// The exponent of a shape or of one of its pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeExponent {
    /// The best exponent, by its root mean square.
    pub best: Deviation,
    /// All exponents tried, in increasing order.
    pub profile: Vec<Deviation>,
    /// The indices of the shape's points that are dots.
    pub dots: Vec<usize>,
}

/// Finds the ν whose curve through some dots of a given shape deviates least from it.
///
/// Alon and Bergmann propose this to characterise handwriting.
///
/// ```
/// use faircurve::scf::exponent::{DotsOf, ExponentSearch};
/// use faircurve::Device;
///
/// // A circle: the larger ν, the nearer.
/// let circle: Vec<[f64; 2]> = (0..120).map(|k| (k as f64 * std::f64::consts::TAU / 120.0).sin_cos().into()).collect();
/// let search = ExponentSearch { dots: DotsOf::Count(4), ..ExponentSearch::default() };
/// let found = search.whole(&circle, true, &Device::cpu())?;
/// assert!(found.best.exponent > 50.0 && found.best.rms < 1e-2);
/// # Ok::<(), faircurve::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ExponentSearch {
    /// The points that the curve passes through.
    ///
    /// By default 10 at equal arc lengths.
    pub dots: DotsOf,
    /// The smallest and the largest ν tried.
    ///
    /// By default 1.1 and 60.
    pub range: [f64; 2],
}

impl Default for ExponentSearch {
    fn default() -> Self {
        ExponentSearch { dots: DotsOf::Count(10), range: [1.1, 60.0] }
    }
}

impl ExponentSearch {
    /// The exponent of a whole shape.
    ///
    /// The shape is a dense list of points, closed or open.
    ///
    /// # Errors
    /// - Fewer than two dots, or fewer than three for closed shapes.
    /// - Indices of dots that are out of range or do not increase.
    /// - A range of exponents that does not increase or is not above 1.
    /// - Points that are not finite.
    pub fn whole(&self, shape: &[[f64; 2]], closed: bool, device: &Device) -> Result<ShapeExponent> {
        let dots = self.choose(shape, closed)?;
        let [least, most] = self.range;
        if !(least > 1.0 && least < most && most.is_finite()) {
            return Err(Error::argument(format!(
                "exponents from {least} to {most} were asked for; they must increase, and be above 1, such as 1.1 to 60"
            )));
        }
        let mut profile: Vec<Deviation> = Vec::new();
        let mut range = [least, most];
        for _ in 0..=ROUNDS {
            // The last one is exactly the end of the range.
            let step = |k: usize| match k + 1 == CANDIDATES {
                true => range[1],
                false => range[0] * (range[1] / range[0]).powf(k as f64 / (CANDIDATES - 1) as f64),
            };
            let candidates: Vec<f64> = (0..CANDIDATES).map(step).collect();
            profile.extend(deviations(shape, closed, &dots, &candidates, device)?);
            sort::by(&mut profile, |a, b| a.exponent.total_cmp(&b.exponent));
            profile.dedup_by(|a, b| a.exponent == b.exponent);
            let best = best_of(&profile);
            range = [profile[best.saturating_sub(1)].exponent, profile[(best + 1).min(profile.len() - 1)].exponent];
        }
        Ok(ShapeExponent { best: profile[best_of(&profile)], profile, dots })
    }

    /// The exponents of a shape's pieces, as a profile along the shape.
    ///
    /// Each piece has this many chords between dots and is fitted separately. The rest at the end
    /// of an open shape is also a piece.
    ///
    /// # Errors
    /// The errors of [`whole`](Self::whole), and 0 chords per piece.
    pub fn by_piece(
        &self,
        shape: &[[f64; 2]],
        closed: bool,
        chords: usize,
        device: &Device,
    ) -> Result<Vec<ShapeExponent>> {
        if chords == 0 {
            return Err(Error::argument("pieces of 0 chords were asked for: at least 1 is needed, such as 3"));
        }
        let mut dots = self.choose(shape, closed)?;
        if closed {
            dots.push(dots[0] + shape.len());
        }
        let mut pieces = Vec::new();
        for first in (0..dots.len() - 1).step_by(chords) {
            let own = &dots[first..(first + chords + 1).min(dots.len())];
            let points: Vec<[f64; 2]> = (own[0]..=own[own.len() - 1]).map(|k| shape[k % shape.len()]).collect();
            let search =
                ExponentSearch { dots: DotsOf::Points(own.iter().map(|dot| dot - own[0]).collect()), ..self.clone() };
            let found = search.whole(&points, false, device)?;
            let dots = own.iter().map(|dot| dot % shape.len()).collect();
            pieces.push(ShapeExponent { dots, ..found });
        }
        Ok(pieces)
    }

    /// The indices of the dots.
    fn choose(&self, shape: &[[f64; 2]], closed: bool) -> Result<Vec<usize>> {
        let refuse = |why: String| Err(Error::argument(why));
        let least = if closed { 3 } else { 2 };
        if let Some(k) = shape.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return refuse(format!("point {k} of the shape is {:?}; coordinates must be finite numbers", shape[k]));
        }
        let dots = match &self.dots {
            DotsOf::Points(dots) => dots.clone(),
            DotsOf::Count(count) => spread(shape, closed, *count),
        };
        if dots.len() < least {
            return refuse(format!("{} dots were asked for; a shape like this needs at least {least}", dots.len()));
        }
        if let Some(pair) = dots.windows(2).find(|pair| pair[0] >= pair[1]) {
            return refuse(format!(
                "dot {} follows dot {}: dots must be different points, in order; ask for fewer",
                pair[1], pair[0]
            ));
        }
        match dots.iter().find(|&&dot| dot >= shape.len()) {
            Some(dot) => refuse(format!("dot {dot} is no point of a shape of {} points", shape.len())),
            None => Ok(dots),
        }
    }
}

fn best_of(profile: &[Deviation]) -> usize {
    let by_rms = |a: &(usize, &Deviation), b: &(usize, &Deviation)| a.1.rms.total_cmp(&b.1.rms);
    profile.iter().enumerate().min_by(by_rms).map_or(0, |(k, _)| k)
}

/// The indices of the points nearest to equal arc lengths.
fn spread(shape: &[[f64; 2]], closed: bool, count: usize) -> Vec<usize> {
    let n = shape.len();
    let mut lengths = vec![0.0];
    for k in 0..if closed { n } else { n.saturating_sub(1) } {
        let ([x, y], [u, v]) = (shape[k], shape[(k + 1) % n]);
        lengths.push(lengths[k] + (u - x).hypot(v - y));
    }
    let total = lengths[lengths.len() - 1];
    let parts = if closed { count } else { count.saturating_sub(1) }.max(1);
    let nearest = |part: usize| {
        let at = total * part as f64 / parts as f64;
        let next = lengths.partition_point(|&length| length < at).min(lengths.len() - 1);
        if next > 0 && at - lengths[next - 1] < lengths[next] - at { next - 1 } else { next }
    };
    (0..count).map(nearest).collect()
}

/// The deviations of the curves of several exponents, fitted in one batch.
fn deviations(
    shape: &[[f64; 2]],
    closed: bool,
    dots: &[usize],
    exponents: &[f64],
    device: &Device,
) -> Result<Vec<Deviation>> {
    let points: Vec<[f64; 2]> = dots.iter().map(|&dot| shape[dot]).collect();
    let coords = exponents.iter().flat_map(|_| points.iter().flatten().copied()).collect();
    let offsets = (0..=exponents.len()).map(|k| k * points.len()).collect();
    let of_span = exponents.iter().flat_map(|&exponent| std::iter::repeat_n(exponent, points.len())).collect();
    let constraints = Constraints { exponents: Some(of_span), ..Constraints::default() };
    let batch = CurveBatch::from_ragged(2, coords, offsets)?.closed(closed).with_constraints(constraints)?;
    let (fit, samples) = Smooth::default().fit_sampled(&batch, Sampling::PerSpan(SAMPLES), device)?;
    let deviation = |(k, &exponent): (usize, &f64)| {
        if !fit.reports()[k].status.is_usable() {
            return Deviation { exponent, rms: f64::INFINITY, largest: f64::INFINITY };
        }
        let curve = samples.points(k).as_chunks::<2>().0;
        let (rms, largest) = distances(shape, closed, dots, curve);
        Deviation { exponent, rms, largest }
    };
    Ok(exponents.iter().enumerate().map(deviation).collect())
}

/// The root mean square and the largest distance of the shape's points from the curve, span by
/// span.
fn distances(shape: &[[f64; 2]], closed: bool, dots: &[usize], curve: &[[f64; 2]]) -> (f64, f64) {
    let (mut sum, mut count, mut largest) = (0.0, 0usize, 0.0f64);
    for span in 0..if closed { dots.len() } else { dots.len() - 1 } {
        let last = if span + 1 < dots.len() { dots[span + 1] } else { dots[0] + shape.len() };
        let samples = |k: usize| curve[(span * SAMPLES + k) % curve.len()];
        for k in dots[span]..last {
            let point = shape[k % shape.len()];
            let square =
                (0..SAMPLES).map(|j| square_from(point, samples(j), samples(j + 1))).fold(f64::INFINITY, f64::min);
            sum += square;
            count += 1;
            largest = largest.max(square.sqrt());
        }
    }
    ((sum / count.max(1) as f64).sqrt(), largest)
}

/// The squared distance of a point from the segment from a to b.
fn square_from([x, y]: [f64; 2], [ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let square = dx * dx + dy * dy;
    let t = if square > 0.0 { (((x - ax) * dx + (y - ay) * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    let (u, v) = (x - ax - t * dx, y - ay - t * dy);
    u * u + v * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::CurveStatus;

    /// A densely sampled closed curve of the given exponent through uneven dots, and the indices of
    /// its dots.
    fn shape(exponent: f64) -> (Vec<[f64; 2]>, Vec<usize>) {
        let dots = [[0.0, 0.0], [2.0, -0.3], [3.1, 0.7], [2.4, 1.9], [0.9, 1.6], [-0.4, 1.1]];
        let batch = CurveBatch::from_slices(&[&dots[..]]).unwrap().closed(true);
        let smooth = Smooth { exponent, ..Smooth::default() };
        let (fit, samples) = smooth.fit_sampled(&batch, Sampling::PerSpan(SAMPLES), &Device::cpu()).unwrap();
        assert_eq!(fit.reports()[0].status, CurveStatus::Converged);
        (samples.points(0).as_chunks::<2>().0.to_vec(), (0..dots.len()).map(|k| k * SAMPLES).collect())
    }

    #[test]
    fn the_exponent_that_drew_a_shape_is_found_again() {
        for exponent in [1.7, 2.0, 3.5, 12.0] {
            let (shape, dots) = shape(exponent);
            let search = ExponentSearch { dots: DotsOf::Points(dots.clone()), ..ExponentSearch::default() };
            let found = search.whole(&shape, true, &Device::cpu()).unwrap();
            assert!((found.best.exponent / exponent - 1.0).abs() < 1e-3, "{exponent}: {:?}", found.best);
            assert!(found.best.rms < 1e-5 && found.best.largest < 1e-4, "{:?}", found.best);
            assert!(found.profile.windows(2).all(|pair| pair[0].exponent < pair[1].exponent));
            assert_eq!(found.dots, dots);
        }
    }

    #[test]
    fn pieces_cover_the_shape_and_each_has_an_exponent_of_its_own() {
        let (shape, dots) = shape(4.0);
        let search = ExponentSearch { dots: DotsOf::Points(dots), ..ExponentSearch::default() };
        let pieces = search.by_piece(&shape, true, 4, &Device::cpu()).unwrap();
        assert_eq!(
            pieces.iter().map(|piece| piece.dots.clone()).collect::<Vec<_>>(),
            [vec![0, 32, 64, 96, 128], vec![128, 160, 0]]
        );
        assert!(pieces.iter().all(|piece| piece.best.rms.is_finite() && piece.best.rms > 0.0));
    }

    #[test]
    fn dots_lie_at_equal_arc_lengths() {
        let line: Vec<[f64; 2]> = (0..=100).map(|k| [k as f64, 0.0]).collect();
        assert_eq!(spread(&line, false, 5), [0, 25, 50, 75, 100]);
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(spread(&square, true, 4), [0, 1, 2, 3]);
    }

    #[test]
    fn what_is_no_shape_is_refused_with_a_sentence() {
        let search = ExponentSearch { dots: DotsOf::Count(2), ..ExponentSearch::default() };
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let refused = |search: &ExponentSearch, shape: &[[f64; 2]]| {
            search.whole(shape, true, &Device::cpu()).unwrap_err().to_string()
        };
        assert!(refused(&search, &square).contains("2 dots were asked for; a shape like this needs at least 3"));
        let search = ExponentSearch { dots: DotsOf::Count(9), ..search };
        assert!(refused(&search, &square).contains("dots must be different points, in order; ask for fewer"));
        let search = ExponentSearch { dots: DotsOf::Points(vec![0, 1, 7]), ..search };
        assert!(refused(&search, &square).contains("dot 7 is no point of a shape of 4 points"));
        let search = ExponentSearch { dots: DotsOf::Count(3), range: [0.5, 2.0] };
        assert!(refused(&search, &square).contains("exponents from 0.5 to 2 were asked for"));
        assert!(
            refused(&ExponentSearch::default(), &[[0.0, f64::NAN]; 4]).contains("point 0 of the shape is [0.0, NaN]")
        );
    }
}
