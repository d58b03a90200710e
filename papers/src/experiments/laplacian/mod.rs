//! H. Weimer and J. Warren, *Variational subdivision for Laplacian splines*, 1997: its masks,
//! computed anew, and how near sparse rules come to the exact one.

mod distance;
mod pictures;

use crate::programmes::{Class, Energy, Programme};
use crate::unbounded::{Closed, UnboundedMask, unbounded_weight};
use faircurve::bezier::BigRational;
use faircurve::laplacian::{Grids, Reproduces, Rule, SparseRule, Subdivide, residual};
use faircurve::{Device, Result};

use super::{Experiment, Outcome, Record};
use distance::Distances;

const FILES: [&str; 5] =
    ["laplacian.txt", "laplacian.csv", "laplacian-basis.svg", "laplacian-surfaces.svg", "laplacian-plots.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "laplacian", files: &FILES, run };

/// Windows of the sparse rules.
const SUPPORTS: [usize; 5] = [3, 5, 7, 9, 11];

/// How near computed numbers must come to closed forms: some roundings.
const NEAR: f64 = 1e-13;

/// How near the optima of linear programmes must come to what is known of them, which has six
/// decimals.
const NEAR_OPTIMUM: f64 = 1e-6;

fn run() -> Result<Outcome> {
    let mut record = Record::new(HEAD, ["yes", "NO"]);
    record.exact_masks()?;
    record.decay();
    record.equations()?;
    record.programmes()?;
    let distances = Distances::measure()?;
    record.distances(&distances);
    record.end("it should be");
    let files = vec![
        record.table,
        distances.csv(),
        pictures::basis_functions()?,
        pictures::surfaces()?,
        pictures::plots(&distances)?,
    ];
    Ok(Outcome { files, agrees: record.agrees })
}

const HEAD: &str = "Weimer and Warren: Laplacian splines, E₂ₙ S = U Eₙ\n\n";

/// Subdivides one grid of heights.
fn subdivided(rule: Rule, rounds: u32, shape: [usize; 2], heights: Vec<f64>) -> Result<Grids> {
    let grids = Grids::uniform(1, shape, heights)?;
    Ok(Subdivide { rule, rounds }.fit(&grids, &Device::cpu())?.grids().clone())
}

/// "4 − 8/π"
fn formula(weight: &Closed) -> String {
    let sign = if weight.over_pi < BigRational::from_integer(0.into()) { '−' } else { '+' };
    let (over, below) = (weight.over_pi.numer().magnitude(), weight.over_pi.denom());
    let below = if below.to_string() == "1" { "π".into() } else { format!("{below}π") };
    format!("{} {sign} {over}/{below}", weight.rational).replace('-', "−")
}

/// A grid with a single 1.
fn peak(side: usize, [row, column]: [usize; 2]) -> Vec<f64> {
    let mut heights = vec![0.0; side * side];
    heights[row * side + column] = 1.0;
    heights
}

impl Record {
    /// Weights of a point in the new ones around it: in a corner of 9 × 9 points, as the book by
    /// the same authors prints them, and far from all borders.
    fn exact_masks(&mut self) -> Result<()> {
        self.line("Exact weights of a corner of 9 × 9 points in the new points next to it:");
        let corner = subdivided(Rule::Exact, 1, [9, 9], peak(9, [0, 0]))?;
        for row in 0..4 {
            let row: Vec<String> = (0..4).map(|column| format!("{:>8.4}", corner.point(0, row, column)[0])).collect();
            self.line(format_args!("    {}", row.join("")));
        }
        let printed = [1.4535, 0.4535, -0.1277, -0.0338];
        let as_printed = (0..4).all(|k| (corner.point(0, 0, k)[0] - printed[k]).abs() <= 5e-5);
        self.check("1.4535 .4535 −.1277 −.0338, as printed in Warren and Weimer's book, p. 192", as_printed);
        self.line("Exact weights far from all borders, in closed form:");
        for (x, y) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (3, 0)] {
            let weight = unbounded_weight(x, y);
            self.line(format_args!("    s({x}, {y}) = {:<16} = {:>9.6}", formula(&weight), weight.value()));
        }
        let near = |(x, y): (isize, isize), value: f64| (unbounded_weight(x, y).value() - value).abs() <= NEAR;
        let pi = std::f64::consts::PI;
        self.check(
            "4 − 8/π in the middle, 3 − 8/π beside it",
            near((0, 0), 4.0 - 8.0 / pi) && near((1, 0), 3.0 - 8.0 / pi),
        );
        self.line("");
        Ok(())
    }

    /// The report has weights decay exponentially.
    fn decay(&mut self) {
        let mask = UnboundedMask::of_radius(64);
        self.line("Their decay along a row and along a diagonal, against the fourth power of the distance:");
        self.line("    distance        s(x, 0)   s(x, 0) x⁴       s(x, x)   s(x, x) 4x⁴");
        for x in [4, 8, 16, 32, 64] {
            let (row, diagonal) = (mask.weight(x, 0), mask.weight(x, x));
            let power = (x as f64).powi(4);
            let products = [row * power, diagonal * 4.0 * power];
            self.line(format_args!(
                "    {x:>8}   {row:>12.4e}   {:>10.6}   {diagonal:>11.4e}   {:>11.6}",
                products[0], products[1]
            ));
        }
        let limit = 6.0 / std::f64::consts::PI;
        let last = [mask.weight(64, 0) * 64f64.powi(4), mask.weight(64, 64) * 4.0 * 64f64.powi(4)];
        let is_power = (last[0] + limit).abs() < 0.01 && (last[1] - limit).abs() < 0.01;
        self.check("like −(6/π) cos 4φ / |x|⁴, a power, not exponentially as the report has it", is_power);
        self.line("");
    }

    /// Six rounds on a random grid.
    fn equations(&mut self) -> Result<()> {
        let heights = distance::random_heights(0);
        let shape = [distance::SIDE; 2];
        let fine = subdivided(Rule::Exact, 6, shape, heights.clone())?;
        let largest = fine.values().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        let off = residual(1, shape, &heights, fine.grid(0), 6);
        let [rows, columns] = fine.shape(0);
        self.line(format_args!(
            "After six rounds, {rows} × {columns} points: largest |E p − U⁶E p₀| {off:.1e} of {largest:.2}"
        ));
        self.check("the equations hold to rounding", off <= NEAR * largest);
        self.line("");
        Ok(())
    }

    /// What the linear programmes found.
    fn programmes(&mut self) -> Result<()> {
        self.line("Sparse rules: the least ‖E₂ₙ S − U Eₙ‖∞, solved class after class for the complete grid");
        self.line("    support   unknowns          reproduces     interior     border     corner");
        for support in SUPPORTS {
            for (word, reproduces, _) in Reproduces::WORDS.iter().copied() {
                let programme = Programme::new(Energy::Dirichlet, support / 2, reproduces);
                let unknowns = Class::ALL.map(|class| programme.unknowns(class).len().to_string()).join(" + ");
                let [interior, border, corner] = SparseRule::of_support(support, reproduces)?.residual();
                self.line(format_args!(
                    "    {support:>7}   {unknowns:<15}   {word:<10}   {interior:>10.6} {border:>10.6} {corner:>10.6}"
                ));
            }
        }
        let known = [(3, 4.0), (5, 4.0 / 9.0), (7, 0.150447), (9, 0.031202)];
        let mut near = true;
        for (support, optimum) in known {
            let found = SparseRule::of_support(support, Reproduces::Constants)?.residual()[0];
            near &= (found - optimum).abs() <= NEAR_OPTIMUM;
        }
        self.check("interior optima 4, 4/9, 0.150447, 0.031202 of an independent solver", near);
        let curves = Programme::new(Energy::CurveBending, 2, Reproduces::Linear);
        let natural = curves.maximum(Class::Interior, &[0.75, 0.5, 0.125]);
        self.check(
            "asked about bending energies of curves, 1/8 3/4 1/8 and 1/2 1/2 leave no residual",
            natural <= NEAR,
        );
        let rule = SparseRule::of_support(5, Reproduces::Constants)?;
        self.line("The interior mask of support 5:");
        for i in 0..5 {
            let row: Vec<String> =
                (0..5).map(|j| format!("{:>9.5}", rule.weight([62 + i, 62 + j], [32, 32], [64, 64]))).collect();
            self.line(format_args!("    {}", row.join("")));
        }
        self.line("");
        Ok(())
    }

    fn distances(&mut self, distances: &Distances) {
        self.line(format_args!(
            "Distance of sparse from exact surfaces over {} random grids of {} × {} heights in ±1,",
            distance::GRIDS,
            distance::SIDE,
            distance::SIDE
        ));
        self.line("root of the mean square; away: the largest, a quarter of a square or more from the data");
        self.line("    reproduces   support  rounds: 1         2         3         4         5     away, 5 rounds");
        for (word, reproduces, _) in Reproduces::WORDS.iter().copied() {
            for support in SUPPORTS {
                let rows: Vec<_> =
                    (1..=distance::ROUNDS).map(|rounds| distances.of(reproduces, support, rounds)).collect();
                let means: Vec<String> = rows.iter().map(|row| format!("{:>9.5}", row.root_mean_square)).collect();
                let away = rows[rows.len() - 1].largest_away;
                self.line(format_args!("    {word:<10}   {support:>7}     {} {away:>12.5}", means.join(" ")));
            }
        }
        self.check(
            "the distance falls as the support grows, on every grid, after every number of rounds",
            distances.exceptions().is_empty(),
        );
        for exception in distances.exceptions() {
            self.line(format_args!("    but: {exception}"));
        }
        self.line("At the data themselves no distance has a limit: exact surfaces rise there by ln 2 / 2π of E p₀ every round (the Green's function of the");
        self.line("Laplacian has a pole), those of sparse rules by a little less each time. Rules that reproduce linear functions meet other conditions at");
        self.line(
            "borders than least energy (no slope across them), and stay away from it there whatever their support.",
        );
    }
}
