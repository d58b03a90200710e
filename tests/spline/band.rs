//! Curves within a distance of their whole polygon: sampled densely, they are, and the polygon is
//! within it of them; areas and straight lines stay.

use faircurve::io;
use faircurve::spline::{Band, Corners, Smoothing, SmoothingTarget};
use faircurve::{CurveBatch, CurveStatus, Deviation, Device, Sampling};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

type Point = [f64; 3];

fn points(batch: &CurveBatch, i: usize) -> Vec<Point> {
    let d = batch.dimension();
    let mut all: Vec<Point> = batch
        .points(i)
        .chunks_exact(d)
        .map(|point| std::array::from_fn(|c| point.get(c).copied().unwrap_or(0.0)))
        .collect();
    if batch.is_closed(i) {
        all.push(all[0]);
    }
    all
}

fn distance(a: Point, b: Point) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// The distance of a point from a polyline.
fn from_polyline(point: Point, line: &[Point]) -> f64 {
    let from_edge = |pair: &[Point]| {
        let (a, b) = (pair[0], pair[1]);
        let square = distance(a, b).powi(2);
        let along = (0..3).map(|c| (point[c] - a[c]) * (b[c] - a[c])).sum::<f64>();
        let u = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
        distance(point, std::array::from_fn(|c| a[c] + u * (b[c] - a[c])))
    };
    line.windows(2).map(from_edge).fold(f64::INFINITY, f64::min)
}

/// A polyline with seven points more on every edge.
fn dense(line: &[Point]) -> Vec<Point> {
    let of_edge = |pair: &[Point]| {
        let (a, b) = (pair[0], pair[1]);
        (0..8).map(move |k| std::array::from_fn(|c| a[c] + f64::from(k) / 8.0 * (b[c] - a[c]))).collect::<Vec<_>>()
    };
    line.windows(2).flat_map(of_edge).chain(line.last().copied()).collect()
}

fn area(line: &[Point]) -> f64 {
    0.5 * (0..line.len())
        .map(|k| (line[k], line[(k + 1) % line.len()]))
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum::<f64>()
}

/// Asserts that curves are within the distance of their polygons, both ways. Returns the samples.
fn check(band: &Band, batch: &CurveBatch, asked: f64) -> CurveBatch {
    let fit = band.fit(batch, &Device::cpu()).unwrap();
    let samples = fit.polylines(Sampling::PerSpan(24));
    // All pairs of points and edges of the longest ones take too long.
    for i in (0..batch.len()).filter(|&i| batch.count(i) < 100) {
        let report = &fit.reports()[i];
        if !report.status.is_usable() {
            continue;
        }
        assert_eq!(report.status, CurveStatus::Converged, "{report:?}");
        let (line, curve) = (points(batch, i), points(&samples, i));
        let far = |points: &[Point], line: &[Point]| points.iter().map(|p| from_polyline(*p, line)).fold(0.0, f64::max);
        let both = far(&curve, &line).max(far(&dense(&line), &curve));
        // Between samples the curve may be a little farther than the chord.
        assert!(both <= 1.02 * report.max_deviation + 1e-12, "curve {i}: {both} of {}", report.max_deviation);
        assert!(report.max_deviation <= asked * (1.0 + 1e-12), "curve {i}: {report:?}");
    }
    samples
}

fn lines(name: &str) -> CurveBatch {
    io::read(format!("{}/examples/data/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

#[test]
fn borders_are_within_the_distance_of_their_polygons_both_ways() {
    let batch = lines("countries-110m.geojson");
    for asked in [0.02, 0.2, 1.0] {
        let fit = Band::within(asked).fit(&batch, &Device::cpu()).unwrap();
        let usable = fit.usable();
        println!("{asked}: {usable} of {}", batch.len());
        assert_eq!(fit.reports().iter().filter(|report| report.status == CurveStatus::NotConverged).count(), 0);
        check(&Band::within(asked), &batch, asked);
    }
}

#[test]
fn closed_curves_and_sections_between_pins_keep_their_area() {
    let batch = lines("countries-110m.geojson");
    let samples = check(&Band::within(0.2), &batch, 0.2);
    let mut seen = 0;
    for i in (0..batch.len()).filter(|&i| batch.is_closed(i)) {
        let [before, after] = [&batch, &samples].map(|batch| area(&points(batch, i)));
        // Chords of 24 samples a span are within 1e-3 of the area of their curve.
        assert!((after / before - 1.0).abs() < 1.5e-3, "curve {i}: {before} became {after}");
        seen += 1;
    }
    assert!(seen > 80, "{seen} closed curves");
    // A third point in the middle is pinned: both halves keep what they enclose with their chords.
    let wave: Vec<[f64; 2]> =
        (0..=40).map(|k| f64::from(k) * 0.25).map(|x| [x, 0.4 * x.sin() + 0.1 * (7.0 * x).sin()]).collect();
    let pinned = (0..41).map(|k| k == 20).collect();
    let constraints = faircurve::Constraints { pinned: Some(pinned), ..Default::default() };
    let batch = CurveBatch::from_slices(&[&wave[..]]).unwrap().with_constraints(constraints).unwrap();
    let samples = check(&Band::within(0.1), &batch, 0.1);
    let (before, after) = (points(&batch, 0), points(&samples, 0));
    for (from, to) in [(0, 20), (20, 40)] {
        let [own, found] = [area(&before[from..=to]), area(&after[24 * from..=24 * to])];
        assert!((own - found).abs() < 1e-3, "{own}, {found}");
    }
    assert_eq!(after[24 * 20], before[20]);
}

#[test]
fn long_lines_stay_straight_and_corners_are_rounded_near_them() {
    // A rectangle, whose long sides have vertices on them too.
    let sides = [[0.0, 0.0], [20.0, 0.0], [31.0, 0.001], [60.0, 0.0], [60.0, 20.0], [0.0, 20.0]];
    let batch = CurveBatch::from_slices(&[&sides[..]]).unwrap().closed(true);
    for asked in [0.5, 1.0] {
        let samples = check(&Band::within(asked), &batch, asked);
        let away = |[x, y, _]: Point| x.min(60.0 - x).abs().min(y.min(20.0 - y).abs());
        for point in points(&samples, 0) {
            let [x, y, _] = point;
            let from_corner = [[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 20.0, 0.0], [0.0, 20.0, 0.0]]
                .map(|corner| distance(point, corner))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            if from_corner > 8.0 * asked {
                assert!(away(point) < 0.03 * asked, "{x}, {y} at {asked}");
            }
        }
    }
}

#[test]
fn noise_becomes_about_as_smooth_as_any_curve_within_its_discs() {
    let mut rng = StdRng::seed_from_u64(7);
    let ring: Vec<[f64; 2]> = (0..200)
        .map(|k| std::f64::consts::TAU * f64::from(k) / 200.0)
        .map(|turn| [10.0 * turn.cos() + rng.random_range(-0.3..0.3), 10.0 * turn.sin() + rng.random_range(-0.3..0.3)])
        .collect();
    let batch = CurveBatch::from_slices(&[&ring[..]]).unwrap().closed(true);
    let mut band = Band::within(0.6);
    band.keep_area = false;
    let found = band.fit(&batch, &Device::cpu()).unwrap().reports()[0].energy;
    let least = |distance: f64| {
        let smoothing = Smoothing { target: SmoothingTarget::Tube(Deviation::Units(distance)), ..Smoothing::default() };
        smoothing.fit(&batch, &Device::cpu()).unwrap().reports()[0].energy
    };
    let [less, more] = [least(0.6), least(0.57)];
    println!("{found}: {less} within 0.6, {more} within 0.57");
    assert!(found >= less * (1.0 - 1e-6) && found <= 1.1 * more, "{found}: {less}, {more}");
}

#[test]
fn nasty_points_have_a_status_and_leave_their_neighbours_alone() {
    let spike = [[0.0, 0.0], [1.0, 0.0], [1.0, 50.0], [1.0, 0.0], [2.0, 0.0]];
    let repeated = [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [3.0, 0.0], [3.0, 0.0]];
    let pair = [[0.0, 0.0], [1e-9, 3e-9]];
    let nan = [[0.0, 0.0], [f64::NAN, 1.0], [2.0, 2.0]];
    let single = [[4.0, 4.0]];
    let far = [[1e12, 1e12], [1e12 + 1.0, 1e12 + 2.0], [1e12 + 3.0, 1e12]];
    let all: [&[[f64; 2]]; 6] = [&spike, &repeated, &pair, &nan, &single, &far];
    let batch = CurveBatch::from_slices(&all).unwrap();
    let fit = Band::within(0.25).fit(&batch, &Device::cpu()).unwrap();
    let statuses: Vec<CurveStatus> = fit.reports().iter().map(|report| report.status).collect();
    use CurveStatus::{Converged, Degenerate, Invalid};
    assert_eq!(statuses, [Converged, Converged, Converged, Invalid, Degenerate, Converged], "{:?}", fit.reports());
    check(&Band::within(0.25), &batch, 0.25);
    let samples = fit.polylines(Sampling::PerSpan(8));
    for (i, own) in all.iter().enumerate() {
        let alone = Band::within(0.25).fit(&CurveBatch::from_slices(&[own]).unwrap(), &Device::cpu()).unwrap();
        let alone = alone.polylines(Sampling::PerSpan(8));
        let bits = |points: &[f64]| points.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(alone.points(0)), bits(samples.points(i)), "curve {i}");
    }
    // A spike goes there and back: its tip is kept to the distance.
    let tip = points(&samples, 0).into_iter().map(|[_, y, _]| y).fold(0.0, f64::max);
    assert!(tip > 49.7, "{tip}");
}

#[test]
fn curves_in_space_are_within_the_distance_too() {
    let helix: Vec<[f64; 3]> = (0..60)
        .map(|k| f64::from(k) * 0.3)
        .map(|a| [3.0 * a.cos(), 3.0 * a.sin(), 0.5 * a + 0.2 * (9.0 * a).sin()])
        .collect();
    let batch = CurveBatch::from_slices(&[&helix[..], &helix[..9]]).unwrap();
    check(&Band::within(0.4), &batch, 0.4);
    let closed = CurveBatch::from_slices(&[&helix[..40]]).unwrap().closed(true);
    check(&Band::within(0.2), &closed, 0.2);
}

#[test]
fn a_length_on_the_ground_is_one_at_every_latitude() {
    let batch = lines("world-110m.topojson");
    let band = Band::within(Deviation::Metres(20_000.0));
    let fit = band.fit(&batch, &Device::cpu()).unwrap();
    let samples = fit.polylines(Sampling::PerSpan(12));
    let mut farthest = [0.0_f64; 2];
    for i in (0..batch.len()).filter(|&i| batch.count(i) < 60 && fit.reports()[i].status == CurveStatus::Converged) {
        let line = points(&batch, i);
        for point in points(&samples, i) {
            // Metres around this point, the fewest of a degree.
            let [x, y] = [110_574.0 * point[1].to_radians().cos(), 110_574.0];
            let here = |p: &Point| [x * p[0], y * p[1], 0.0];
            let away = from_polyline(here(&point), &line.iter().map(here).collect::<Vec<_>>());
            let is_north = usize::from(point[1].abs() > 55.0);
            farthest[is_north] = farthest[is_north].max(away);
        }
    }
    println!("{farthest:?} m");
    assert!(farthest.iter().all(|far| *far <= 20_000.0 && *far > 14_000.0), "{farthest:?}");
    let said = fit.reports().iter().map(|report| report.max_deviation).fold(0.0, f64::max);
    assert!(said > 14_000.0 && said <= 20_000.0 * (1.0 + 1e-12), "{said}");
    // Points that nobody says are longitudes and latitudes have no metres.
    let planar = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]][..]]).unwrap();
    let error = band.fit(&planar, &Device::cpu()).unwrap_err().to_string();
    assert!(error.contains("20km is a length in metres"), "{error}");
}

/// A closed polygon with points at a spacing along its sides, each with noise of up to `noise`.
fn noisy(corners: &[[f64; 2]], spacing: f64, noise: f64, rng: &mut StdRng) -> Vec<[f64; 2]> {
    let mut all = vec![];
    for (k, [x, y]) in corners.iter().enumerate() {
        let [to_x, to_y] = corners[(k + 1) % corners.len()];
        let steps = ((to_x - x).hypot(to_y - y) / spacing).ceil();
        for j in 0..steps as usize {
            let (u, angle) = (j as f64 / steps, rng.random_range(0.0..std::f64::consts::TAU));
            let r = noise * rng.random_range(0.0..1.0_f64).sqrt();
            all.push([x + u * (to_x - x) + r * angle.cos(), y + u * (to_y - y) + r * angle.sin()]);
        }
    }
    all
}

/// The points at which a closed curve turns at once.
fn corners_of(batch: &CurveBatch, corners: Corners) -> Vec<[f64; 2]> {
    let mut band = Band::within(1.0);
    band.corners = corners;
    let fit = band.fit(batch, &Device::cpu()).unwrap();
    assert!(fit.reports()[0].max_deviation <= 1.0);
    let curve = fit.curve(0);
    let spans = curve.spans();
    let turns = (0..spans).filter_map(|k| {
        let [before, here] = [curve.jet((k + spans - 1) % spans, 1.0), curve.jet(k, 0.0)];
        let angle = before.first.normalize().dot(here.first.normalize());
        (angle < 0.3_f64.cos()).then_some([here.point.x, here.point.y])
    });
    turns.collect()
}

#[test]
fn corners_stay_sharp_in_noise_and_round_shapes_have_none() {
    let star = |k: u32| {
        let (angle, r) = (f64::from(k) * 0.2 * std::f64::consts::PI, if k.is_multiple_of(2) { 60.0 } else { 25.0 });
        [r * angle.cos(), r * angle.sin()]
    };
    let shapes = [
        vec![[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
        vec![[0.0, 0.0], [50.0, 0.0], [50.0, 20.0], [20.0, 20.0], [20.0, 60.0], [0.0, 60.0]],
        (0..10).map(star).collect(),
    ];
    for seed in 0..10 {
        let rng = &mut StdRng::seed_from_u64(seed);
        for noise in [0.0, 0.25, 0.5] {
            for (k, shape) in shapes.iter().enumerate() {
                let points = noisy(shape, 0.7, noise, rng);
                let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
                let found = corners_of(&batch, Corners::Auto);
                assert_eq!(found.len(), shape.len(), "shape {k}, noise {noise}, seed {seed}: {found:?}");
                let far = |corner: &[f64; 2]| {
                    let distances = found.iter().map(|own| (own[0] - corner[0]).hypot(own[1] - corner[1]));
                    distances.fold(f64::INFINITY, f64::min)
                };
                let farthest = shape.iter().map(far).fold(0.0, f64::max);
                assert!(farthest <= 2.0, "shape {k}, noise {noise}, seed {seed}: {farthest}");
            }
            for radius in [6.0_f64, 10.0, 30.0, 100.0] {
                let round: Vec<[f64; 2]> = (0..(9.0 * radius) as usize)
                    .map(|k| k as f64 / (9.0 * radius).floor() * std::f64::consts::TAU)
                    .map(|a| [radius * a.cos(), 0.8 * radius * a.sin()])
                    .collect();
                let points = noisy(&round, 0.7, noise, rng);
                let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().closed(true);
                let found = corners_of(&batch, Corners::Auto);
                assert!(found.is_empty(), "radius {radius}, noise {noise}, seed {seed}: {found:?}");
            }
        }
    }
    // Surveyed corners need straight lines, which noise does not have.
    let house = CurveBatch::from_slices(&[&shapes[0][..]]).unwrap().closed(true);
    assert_eq!(corners_of(&house, Corners::Straight).len(), 4);
    let rough = noisy(&shapes[0], 0.7, 0.5, &mut StdRng::seed_from_u64(1));
    let rough = CurveBatch::from_slices(&[&rough[..]]).unwrap().closed(true);
    assert!(corners_of(&rough, Corners::Straight).is_empty());
    assert_eq!(corners_of(&house, Corners::Above(1.0)).len(), 4);
    assert!(corners_of(&house, Corners::Rounded).is_empty());
}

#[test]
fn loops_that_are_smaller_than_the_distance_keep_their_shape() {
    // A border that goes round and comes back to its junction, as islands on a spit do.
    let ring = [[0.0, 0.0], [1.0, -1.0], [2.0, 0.0], [1.5, 2.0], [0.5, 2.0], [0.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&ring[..]]).unwrap();
    for distance in [0.3, 3.0, 100.0] {
        let fit = Band::within(distance).fit(&batch, &Device::cpu()).unwrap();
        let report = &fit.reports()[0];
        assert!(report.status.is_usable() && report.max_deviation < 0.5, "{distance}: {report:?}");
        assert!(fit.polylines(Sampling::PerSpan(16)).coords().iter().all(|x| x.is_finite()));
    }
}
