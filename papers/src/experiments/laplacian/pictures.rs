//! The pictures: basis functions, surfaces and their distances, decay.

use faircurve::Result;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule};
use faircurve::picture::{Net, Relief, ReliefSheet};
use glam::DVec2;

use super::distance::{self, Distances};
use super::{SUPPORTS, peak, subdivided};
use crate::picture::{Axis, Plot, Series, Sheet};
use crate::unbounded::UnboundedMask;

/// Points along the sides of the grids drawn, and rounds: 4² squares to a square of control points.
const SIDE: usize = 13;
const ROUNDS: u32 = 2;

/// Rounds of basis functions, whose poles are seen from near.
const BASIS_ROUNDS: u32 = 3;

fn sparse(support: usize) -> Result<Rule> {
    Ok(Rule::Sparse(SparseRule::of_support(support, Reproduces::Constants)?))
}

/// One control point raised: inside, at the border, in the corner; seven by seven control points
/// around it are drawn.
pub fn basis_functions() -> Result<String> {
    let (middle, last) = (SIDE / 2, SIDE - 1);
    let mut panels: Vec<(String, Grids)> = Vec::new();
    for (rule, name) in [(Rule::Exact, "exact"), (sparse(5)?, "support 5"), (sparse(11)?, "support 11")] {
        for (place, at, first) in [
            ("inside", [middle; 2], [middle - 3; 2]),
            ("at the border", [last, middle], [last - 6, middle - 3]),
            ("in the corner", [last; 2], [last - 6; 2]),
        ] {
            let surface = subdivided(rule.clone(), BASIS_ROUNDS, [SIDE; 2], peak(SIDE, at))?;
            panels.push((format!("{name}, {place}"), part(&surface, first.map(|k| k << BASIS_ROUNDS))?));
        }
    }
    let reliefs = panels.iter().map(|(title, surface)| relief(title, surface, None, Some([-0.4, 2.0])));
    Ok(ReliefSheet {
        columns: 3,
        title: Some("Basis functions of Laplacian splines".into()),
        caption: format!("one of {SIDE} × {SIDE} control points is 1, all others are 0, three rounds"),
        reliefs: reliefs.collect(),
        ..ReliefSheet::default()
    }
    .draw())
}

/// What lies over seven by seven control points.
fn part(surface: &Grids, [row, column]: [usize; 2]) -> Result<Grids> {
    let side = (6 << BASIS_ROUNDS) + 1;
    let heights = (0..side * side).map(|k| surface.point(0, row + k / side, column + k % side)[0]);
    Grids::uniform(1, [side; 2], heights.collect())
}

/// A random grid: exact, and what sparse rules make of it.
pub fn surfaces() -> Result<String> {
    let heights = distance::random_heights(0);
    let shape = [distance::SIDE; 2];
    let mut panels = vec![("exact".into(), subdivided(Rule::Exact, ROUNDS, shape, heights.clone())?)];
    for support in SUPPORTS {
        panels.push((format!("support {support}"), subdivided(sparse(support)?, ROUNDS, shape, heights.clone())?));
    }
    let net = Net { shape, values: &heights };
    let reliefs = panels.iter().map(|(title, surface)| relief(title, surface, Some(net), Some([-2.0, 2.0])));
    Ok(ReliefSheet {
        columns: 3,
        title: Some("Laplacian splines of random heights, exact and sparse".into()),
        caption: "two rounds".into(),
        reliefs: reliefs.collect(),
        ..ReliefSheet::default()
    }
    .draw())
}

fn relief<'a>(title: &str, surface: &'a Grids, net: Option<Net<'a>>, range: Option<[f64; 2]>) -> Relief<'a> {
    Relief { title: title.into(), dimension: 1, shape: surface.shape(0), values: surface.grid(0), net, range }
}

/// Distance against support, and the decay of the exact weights.
pub fn plots(distances: &Distances) -> Result<String> {
    let against = |reproduces: Reproduces| {
        let series = (1..=distance::ROUNDS).map(|rounds| Series {
            name: format!("{rounds} round{}", if rounds == 1 { "" } else { "s" }),
            points: SUPPORTS
                .iter()
                .map(|&support| DVec2::new(support as f64, distances.of(reproduces, support, rounds).root_mean_square))
                .collect(),
        });
        Plot {
            title: format!("Distance, {} reproduced", what(reproduces)),
            x: Axis::linear("support"),
            y: Axis::log("root of the mean square"),
            series: series.collect(),
        }
    };
    let mask = UnboundedMask::of_radius(64);
    let decay = |name: &str, y: fn(isize) -> isize| Series {
        name: name.into(),
        points: (1..=64).map(|x| DVec2::new((x as f64).hypot(y(x) as f64), mask.weight(x, y(x)).abs())).collect(),
    };
    let power = Series {
        name: "6/π |x|⁻⁴".into(),
        points: (1..=90).map(|x| DVec2::new(f64::from(x), 6.0 / std::f64::consts::PI / f64::from(x).powi(4))).collect(),
    };
    let decays = Plot {
        title: "Exact weights fall like a power of the distance".into(),
        x: Axis::log("distance |x|"),
        y: Axis::log("|weight|"),
        series: vec![decay("along a row", |_| 0), decay("along a diagonal", |x| x), power],
    };
    Ok(Sheet {
        title: Some("Laplacian splines: sparse rules against the exact one".into()),
        caption: format!("{} random grids of {} × {} heights in ±1", distance::GRIDS, distance::SIDE, distance::SIDE),
        width: 1200.0,
        columns: 3,
        panels: Vec::new(),
        plots: vec![against(Reproduces::Constants), against(Reproduces::Linear), decays],
    }
    .draw())
}

fn what(reproduces: Reproduces) -> &'static str {
    match reproduces {
        Reproduces::Constants => "constants",
        Reproduces::Linear => "linear functions",
    }
}
