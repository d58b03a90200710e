//! D. Eberly, *A relationship between minimum bending energy and degree elevation for Bézier
//! curves*, 2010: its examples, computed exactly.

mod pictures;

use std::fmt::Write;

use faircurve::bezier::{
    BigRational, Completion, Eigenstructure, Energy, Matrix, Pattern, energy_matrix, energy_matrix_by_beta,
};
use faircurve::{Error, Result};

use super::{Experiment, Outcome, Record};

const FILES: [&str; 3] = ["bezier.txt", "bezier.csv", "bezier.svg"];

pub const EXPERIMENT: Experiment = Experiment { name: "bezier", files: &FILES, run };

/// Highest degree of the tables.
const MOST: usize = 30;

/// How near eigenvalues and eigenvectors must come to the paper's: some roundings.
const NEAR: f64 = 1e-13;

fn run() -> Result<Outcome> {
    let mut record = Record::new(HEAD, ["as in the paper", "NOT as in the paper"]);
    record.matrices();
    record.cubic_eigenstructure()?;
    record.completions()?;
    let csv = record.degrees()?;
    record.end("the paper says");
    Ok(Outcome { files: vec![record.table, csv, pictures::sheet()?], agrees: record.agrees })
}

const HEAD: &str = "Eberly: Bézier curves of least bending energy E = ∫|X″|² dt = Σ Pᵀ M P over the coordinates\n\n";

impl Record {
    /// Sections 3 and 5.
    fn matrices(&mut self) {
        self.line("M of the cubic, section 3 (there divided by 6):");
        let matrix = energy_matrix(3, 2);
        let paper = [[2, -3, 0, 1], [-3, 6, -3, 0], [0, -3, 6, -3], [1, 0, -3, 2]];
        for i in 0..4 {
            let row: Vec<String> = (0..4).map(|j| format!("{:>4}", matrix.at(i, j).to_string())).collect();
            self.line(format_args!("    {}", row.join(" ")));
        }
        let six = |i: usize, j: usize| BigRational::from_integer((6 * paper[i][j]).into());
        self.check("6 times the matrix printed", matrix == Matrix::from_fn(4, 4, six));
        let agree = (2..=12).all(|d| energy_matrix(d, 2) == energy_matrix_by_beta(d, 2));
        self.check("the closed form and the recursion for the Beta function of section 5, degrees 2 to 12", agree);
        self.line("");
    }

    fn cubic_eigenstructure(&mut self) -> Result<()> {
        let cubic = Eigenstructure::new(3, &Energy::bending())?;
        self.line("Eigenvalues and eigenvectors of M/6, section 3:");
        for (value, vector) in cubic.values.iter().zip(&cubic.vectors) {
            let vector: Vec<String> = vector.iter().map(|x| format!("{x:>9.6}")).collect();
            self.line(format_args!("    {:>9.6}   ({})", value / 6.0, vector.join(", ")));
        }
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= NEAR * (1.0 + b.abs()));
        self.check("eigenvalues 10, 6, 0, 0", near(&cubic.values, &[60.0, 36.0, 0.0, 0.0]));
        let bent = [[1.0, -3.0, 3.0, -1.0].map(|x| x / 20f64.sqrt()), [0.5, -0.5, -0.5, 0.5]];
        self.check(
            "V₀ = (1, −3, 3, −1)/√20 and V₁ = (1, −1, −1, 1)/2",
            near(&cubic.vectors[0], &bent[0]) && near(&cubic.vectors[1], &bent[1]),
        );
        let straight =
            [[1.0, 0.0, -1.0, -2.0].map(|x| x / 6f64.sqrt()), [4.0, 3.0, 2.0, 1.0].map(|x| x / 30f64.sqrt())];
        let inside = |v: &[f64; 4]| {
            let along = |vector: &Vec<f64>| vector.iter().zip(v).map(|(a, b)| a * b).sum::<f64>().powi(2);
            (cubic.vectors[2..].iter().map(along).sum::<f64>() - 1.0).abs() <= NEAR
        };
        self.check("V₂ = (1, 0, −1, −2)/√6 and V₃ = (4, 3, 2, 1)/√30 span the rest", straight.iter().all(inside));
        self.line("");
        Ok(())
    }

    /// Sections 3 and 4, and what the paper's title says.
    fn completions(&mut self) -> Result<()> {
        self.line("Unknown control points of least bending energy:");
        for (degree, known, what, wanted) in CASES {
            let completion = completion(*degree, known)?;
            let weights = completion.weights();
            let unknown: Vec<usize> = completion.pattern().unknown().collect();
            for (row, i) in unknown.iter().enumerate() {
                let terms = known.iter().enumerate().map(|(j, k)| (weights.at(row, j), k));
                let terms: Vec<String> = terms
                    .filter(|(weight, _)| **weight != zero())
                    .map(|(weight, k)| format!("{weight} P{k}"))
                    .collect();
                self.line(format_args!("    d = {degree}: P{i} = {}", terms.join(" + ").replace("+ -", "− ")));
            }
            let entry = |i: usize, j: usize| {
                let (p, q) = wanted[i * known.len() + j];
                BigRational::new(p.into(), q.into())
            };
            self.check(what, weights == Matrix::from_fn(unknown.len(), known.len(), entry));
        }
        self.line("");
        Ok(())
    }

    /// Elevated lines and cubics at every degree, exactly; and what f64 would make of the equations.
    fn degrees(&mut self) -> Result<String> {
        let mut csv = String::from("degree,largest_eigenvalue,smallest_eigenvalue,condition\n");
        let (mut lines, mut cubics, mut condition) = (true, true, 1.0);
        for degree in 2..=MOST {
            let line = completion(degree, &[0, degree])?.weights();
            lines &= line == Matrix::from_fn(degree - 1, 2, |i, j| fraction([degree - i - 1, i + 1][j], degree));
            if degree > 3 {
                cubics &= is_elevated_cubic(degree)?;
            }
            let structure = Eigenstructure::new(degree, &Energy::bending())?;
            let (largest, smallest) = (structure.values[0], structure.values[degree - 2]);
            condition = largest / smallest;
            let _ = writeln!(csv, "{degree},{largest},{smallest},{condition}");
        }
        self.line(format_args!("Degrees 2 to {MOST}, in exact rationals:"));
        self.check("known ends make the elevated line", lines);
        self.check("two known points at each end make an elevated cubic", cubics);
        self.line(format_args!(
            "    eigenvalues of M at degree {MOST} are {condition:.1e} apart: f64 could not solve such equations"
        ));
        Ok(csv)
    }
}

/// Degree, known points, the paper's words, and the weights of the known points in every unknown
/// one.
type Case = (usize, &'static [usize], &'static str, &'static [(i64, i64)]);

const CASES: &[Case] = &[
    (2, &[0, 2], "P₁ = (P₀ + P₂)/2", &[(1, 2), (1, 2)]),
    (3, &[0, 3], "P₁ = (2 P₀ + P₃)/3, P₂ = (P₀ + 2 P₃)/3, the elevated line", &[(2, 3), (1, 3), (1, 3), (2, 3)]),
    (3, &[0, 1, 3], "P₂ = (P₁ + P₃)/2", &[(0, 1), (1, 2), (1, 2)]),
    (5, &[0, 1, 4, 5], "the elevated cubic", &[(-3, 10), (1, 1), (1, 2), (-1, 5), (-1, 5), (1, 2), (1, 1), (-3, 10)]),
];

fn zero() -> BigRational {
    BigRational::from_integer(0.into())
}

fn fraction(p: usize, q: usize) -> BigRational {
    BigRational::new(p.into(), q.into())
}

fn completion(degree: usize, known: &[usize]) -> Result<Completion> {
    let flags: Vec<bool> = (0..=degree).map(|i| known.contains(&i)).collect();
    Completion::new(Pattern::new(&flags), &Energy::bending())
        .ok_or_else(|| Error::argument(format!("degree {degree} with {known:?} known contradicts itself")))
}

/// Whether fourth differences vanish: control points of an elevated cubic are cubic in their number.
fn is_elevated_cubic(degree: usize) -> Result<bool> {
    let all = completion(degree, &[0, 1, degree - 1, degree])?.all();
    let fourth = |i: usize, j: usize| {
        let terms = [1, -4, 6, -4, 1].into_iter().enumerate();
        terms.map(|(k, weight)| all.at(i + k, j) * BigRational::from_integer(weight.into())).sum::<BigRational>()
    };
    Ok((0..=degree - 4).all(|i| (0..4).all(|j| fourth(i, j) == zero())))
}
