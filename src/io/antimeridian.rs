//! Curves that were carried past ±180 come back, cut where they cross: RFC 7946, section 3.1.9.

use super::longitude::within_half_turn;
use crate::batch::CurveBatch;
use crate::sort;
use crate::words::words;

/// What becomes of longitudes beyond ±180 where a file is written.
///
/// It concerns curves that were carried past ±180 when they were read, and those that a fit moves
/// past it, of files whose longitudes were all within ±180.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Antimeridian {
    /// They stay as they are: a curve goes on past ±180.
    #[default]
    Keep,
    /// GeoJSON and TopoJSON: curves are cut at ±180, and lines and polygons become several. CSV and
    /// NPZ: whole turns are taken off. SVG: they stay.
    Cut,
}

words!(Antimeridian, "way at the antimeridian": [
    (Keep, "keep", "Curves run on past ±180"),
    (Cut, "cut", "Curves are cut there in GeoJSON, as RFC 7946 asks, and in TopoJSON; in CSV and NPZ they go on at the other side"),
]);

/// Half a turn of longitude, and a whole one.
const HALF_TURN: f64 = 180.0;
const TURN: f64 = 360.0;

/// Whether curve `i` is to be cut, or wrapped.
pub(super) fn concerns(batch: &CurveBatch, i: usize) -> bool {
    let origin = batch.origin();
    // A fit may bulge past ±180 where its points do not.
    let passes = || batch.points(i).iter().step_by(batch.dimension()).any(|&x| !within_half_turn(x));
    origin.within_half_turn && (origin.unwrapped.binary_search(&i).is_ok() || origin.geographic && passes())
}

/// A longitude without whole turns.
pub(super) fn wrapped(x: f64) -> f64 {
    if x.abs() <= HALF_TURN || !x.is_finite() { x } else { x - TURN * ((x - HALF_TURN) / TURN).ceil() }
}

/// Positions of a line or a ring. A ring does not repeat its first.
pub(super) type Path = Vec<Vec<f64>>;

/// The strip of a longitude: 0 from −180 to 180, 1 beyond.
fn strip(x: f64) -> f64 {
    ((x + HALF_TURN) / TURN).floor()
}

/// The point of a segment at a longitude. Both directions give the same.
fn at(a: &[f64], b: &[f64], x: f64) -> Vec<f64> {
    let (a, b) = if a[0] < b[0] { (a, b) } else { (b, a) };
    let u = (x - a[0]) / (b[0] - a[0]);
    let rest = a[1..].iter().zip(&b[1..]).map(|(a, b)| a + (b - a) * u);
    std::iter::once(x).chain(rest).collect()
}

/// The longitudes strictly between two where a line is to be cut, in order from the first.
fn cuts(from: f64, to: f64) -> Vec<f64> {
    let (low, high) = (from.min(to), from.max(to));
    let first = ((low - HALF_TURN) / TURN).floor() + 1.0;
    let mut all: Vec<f64> =
        (0..).map(|k| HALF_TURN + TURN * (first + f64::from(k))).take_while(|x| *x < high).collect();
    if to < from {
        all.reverse();
    }
    all
}

/// A line in parts, each within ±180.
pub(super) fn cut_line(line: &[Vec<f64>]) -> Vec<Path> {
    let mut parts: Vec<(f64, Path)> = Vec::new();
    for pair in line.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let inner = cuts(a[0], b[0]).into_iter().map(|x| at(a, b, x));
        let mut from = a.clone();
        for to in inner.chain([b.clone()]) {
            let strip = strip(0.5 * (from[0] + to[0]));
            match parts.last_mut() {
                Some((own, part)) if *own == strip => part.push(to.clone()),
                _ => parts.push((strip, vec![from, to.clone()])),
            }
            from = to;
        }
    }
    if parts.is_empty() {
        parts.extend(line.first().map(|point| (strip(point[0]), vec![point.clone()])));
    }
    parts.into_iter().map(|(strip, part)| moved(part, strip)).collect()
}

/// A path moved from its strip to within ±180.
fn moved(mut path: Path, strip: f64) -> Path {
    if strip != 0.0 {
        path.iter_mut().for_each(|point| point[0] -= TURN * strip);
    }
    path
}

/// A polygon, its shell first, as polygons that each lie within ±180.
pub(super) fn cut_polygon(rings: &[Path]) -> Vec<Vec<Path>> {
    let x = || rings.iter().flatten().map(|point| point[0]);
    let (low, high) = (x().fold(f64::INFINITY, f64::min), x().fold(f64::NEG_INFINITY, f64::max));
    let (mut rest, mut last) = (vec![rings.to_vec()], strip(0.5 * (low + high)));
    let mut all = Vec::new();
    let back = |polygon: Vec<Path>, strip: f64| polygon.into_iter().map(|ring| moved(ring, strip)).collect();
    for cut in cuts(low, high) {
        let own = ((cut - HALF_TURN) / TURN).round();
        let west = rest.iter().flat_map(|rings| side(rings, cut, Side::West));
        all.extend(west.map(|polygon| back(polygon, own)));
        rest = rest.iter().flat_map(|rings| side(rings, cut, Side::East)).collect();
        last = own + 1.0;
    }
    all.extend(rest.into_iter().map(|polygon| back(polygon, last)));
    all
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    West,
    East,
}

/// A part of a ring on one side of a line. Its first and last point lie on the line.
struct Chain {
    points: Path,
    walked: bool,
}

/// The polygons that are left of one on a side of a line of longitude.
fn side(rings: &[Path], cut: f64, side: Side) -> Vec<Vec<Path>> {
    let kept = |point: &[f64]| if side == Side::West { point[0] < cut } else { point[0] > cut };
    let (mut chains, mut shells, mut holes) = (Vec::new(), Vec::new(), Vec::new());
    for (k, ring) in rings.iter().enumerate() {
        let n = ring.len();
        let Some(start) = ring.iter().position(|point| !kept(point)) else {
            if k == 0 {
                shells.push(ring.clone())
            } else {
                holes.push(ring.clone())
            }
            continue;
        };
        let mut chain: Option<Path> = None;
        for k in start..start + n {
            let (a, b) = (&ring[k % n], &ring[(k + 1) % n]);
            match (kept(a), kept(b)) {
                (false, true) => chain = Some(vec![at(a, b, cut), b.clone()]),
                (true, true) => chain.iter_mut().for_each(|points| points.push(b.clone())),
                (true, false) => {
                    let mut points = chain.take().expect("a chain began where the ring came to this side");
                    points.push(at(a, b, cut));
                    chains.push(Chain { points, walked: false });
                }
                (false, false) => {}
            }
        }
    }
    shells.extend(joined(chains));
    let mut polygons: Vec<Vec<Path>> = shells.into_iter().map(|shell| vec![shell]).collect();
    for hole in holes {
        let inside = polygons.iter().position(|polygon| contains(&polygon[0], &hole[0]));
        if let Some(polygon) = polygons.get_mut(inside.unwrap_or(0)) {
            polygon.push(hole);
        }
    }
    polygons
}

/// Rings of chains that end on a line, joined along it: between its first and second end the line
/// is inside, between its third and fourth, and so on.
fn joined(mut chains: Vec<Chain>) -> Vec<Path> {
    // Ends 2k and 2k + 1 are the first and the last point of chain k.
    let latitude = |chains: &[Chain], end: usize| {
        let points = &chains[end / 2].points;
        points[if end.is_multiple_of(2) { 0 } else { points.len() - 1 }][1]
    };
    let order = sort::order(2 * chains.len(), &|a, b| latitude(&chains, a).total_cmp(&latitude(&chains, b)));
    let mut partner = vec![0; order.len()];
    for pair in order.chunks_exact(2) {
        (partner[pair[0]], partner[pair[1]]) = (pair[1], pair[0]);
    }
    let mut rings = Vec::new();
    for first in 0..chains.len() {
        let (mut ring, mut end) = (Path::new(), 2 * first);
        while !chains[end / 2].walked {
            let chain = &mut chains[end / 2];
            chain.walked = true;
            match end.is_multiple_of(2) {
                true => ring.extend(chain.points.iter().cloned()),
                false => ring.extend(chain.points.iter().rev().cloned()),
            }
            end = partner[end ^ 1];
        }
        if !ring.is_empty() {
            rings.push(ring);
        }
    }
    rings
}

/// Whether a point lies within a ring.
fn contains(ring: &Path, point: &[f64]) -> bool {
    let edges = (0..ring.len()).map(|k| (&ring[k], &ring[(k + 1) % ring.len()]));
    let crossed = edges.filter(|(a, b)| (a[1] > point[1]) != (b[1] > point[1])).filter(|(a, b)| {
        let x = a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        x > point[0]
    });
    crossed.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(points: &[[f64; 2]]) -> Path {
        points.iter().map(|point| point.to_vec()).collect()
    }

    fn area(ring: &Path) -> f64 {
        let n = ring.len();
        (0..n).map(|k| ring[k][0] * ring[(k + 1) % n][1] - ring[(k + 1) % n][0] * ring[k][1]).sum::<f64>() / 2.0
    }

    #[test]
    fn lines_are_cut_at_every_crossing_and_meet_there() {
        let line = path(&[[170.0, 0.0], [190.0, 10.0], [180.0, 20.0], [175.0, 20.0]]);
        let parts = cut_line(&line);
        let wanted = [
            path(&[[170.0, 0.0], [180.0, 5.0]]),
            path(&[[-180.0, 5.0], [-170.0, 10.0], [-180.0, 20.0]]),
            path(&[[180.0, 20.0], [175.0, 20.0]]),
        ];
        assert_eq!(parts, wanted);
        // All of it beyond, more than a turn, a point, nothing.
        assert_eq!(cut_line(&path(&[[190.0, 0.0], [200.0, 1.0]])), [path(&[[-170.0, 0.0], [-160.0, 1.0]])]);
        assert_eq!(cut_line(&path(&[[-190.0, 0.0], [550.0, 0.0]])).len(), 4);
        assert_eq!((cut_line(&path(&[[181.0, 3.0]])), cut_line(&[])), (vec![path(&[[-179.0, 3.0]])], vec![]));
        // The other way round the cuts are the same, to the bit.
        let (a, b) = ([179.3, -16.7], [180.9, -16.1]);
        assert_eq!(cut_line(&path(&[a, b]))[0][1], cut_line(&path(&[b, a]))[1][0]);
    }

    #[test]
    fn polygons_are_cut_with_their_holes_and_keep_their_area() {
        let comb = path(&[
            [170.0, 0.0],
            [190.0, 0.0],
            [190.0, 2.0],
            [175.0, 2.0],
            [175.0, 4.0],
            [190.0, 4.0],
            [190.0, 6.0],
            [170.0, 6.0],
        ]);
        let over_the_line = path(&[[178.0, 0.5], [178.0, 1.5], [182.0, 1.5], [182.0, 0.5]]);
        let west = path(&[[171.0, 1.0], [171.0, 5.0], [172.0, 5.0], [172.0, 1.0]]);
        let east = path(&[[186.0, 4.5], [186.0, 5.5], [188.0, 5.5], [188.0, 4.5]]);
        let total = area(&comb) + [&over_the_line, &west, &east].map(area).iter().sum::<f64>();
        for reversed in [false, true] {
            let mut rings = vec![comb.clone(), over_the_line.clone(), west.clone(), east.clone()];
            if reversed {
                rings.iter_mut().for_each(|ring| ring.reverse());
            }
            let polygons = cut_polygon(&rings);
            let mut holes: Vec<usize> = polygons.iter().map(|polygon| polygon.len() - 1).collect();
            holes.sort_unstable();
            // The western part with one hole, and two teeth, one of which has one.
            assert_eq!(holes, [0, 1, 1]);
            assert!(polygons.iter().flatten().flatten().all(|point| point[0].abs() <= 180.0));
            let areas: f64 = polygons
                .iter()
                .map(|polygon| area(&polygon[0]).abs() - polygon[1..].iter().map(|hole| area(hole).abs()).sum::<f64>())
                .sum();
            assert!((areas - total).abs() < 1e-9, "{areas} {total}");
        }
    }

    #[test]
    fn longitudes_come_back_by_whole_turns() {
        assert_eq!([180.0, -180.0, 181.0, -181.0, 541.0].map(wrapped), [180.0, -180.0, -179.0, 179.0, -179.0]);
        assert!(wrapped(f64::NAN).is_nan());
    }
}
