//! Solves the linear programmes of the sparse Laplacian rules, and chooses among their solutions.

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{NonnegativeConeT, ZeroConeT};
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus};
use faircurve::laplacian::Reproduces;
use faircurve_papers::programmes::{Class, Energy, Programme, StandardForm, Unknown};
use faircurve_papers::unbounded::UnboundedMask;
use nalgebra::{DMatrix, DVector};

/// By how much a maximum may exceed the least so that a nearer rule can be chosen, relative to it.
pub const SLACK: f64 = 1e-8;

/// Minimises Σ weight (x − target)² / 2 + Σ cost x subject to the conditions of `form`.
fn minimised(form: &StandardForm, cost: &[f64], weights: &[f64], targets: &[f64]) -> Vec<f64> {
    let variables = form.objective.len();
    let conditions = || form.equalities.iter().chain(&form.inequalities);
    let (mut rows, mut columns, mut entries) = (Vec::new(), Vec::new(), Vec::new());
    for (row, (terms, _)) in conditions().enumerate() {
        for &(column, entry) in terms {
            rows.push(row);
            columns.push(column);
            entries.push(entry);
        }
    }
    let right: Vec<f64> = conditions().map(|&(_, value)| value).collect();
    let left = CscMatrix::new_from_triplets(right.len(), variables, rows, columns, entries);
    let own: Vec<usize> = (0..weights.len()).collect();
    let quadratic = CscMatrix::new_from_triplets(variables, variables, own.clone(), own, weights.to_vec());
    let mut linear = cost.to_vec();
    for (x, (weight, target)) in linear.iter_mut().zip(weights.iter().zip(targets)) {
        *x -= weight * target;
    }
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-12)
        .tol_gap_rel(1e-12)
        .tol_feas(1e-12)
        .build()
        .unwrap();
    let cones = [ZeroConeT(form.equalities.len()), NonnegativeConeT(form.inequalities.len())];
    let mut solver = DefaultSolver::new(&quadratic, &linear, &left, &right, &cones, settings).unwrap();
    solver.solve();
    let status = solver.solution.status;
    assert!(matches!(status, SolverStatus::Solved | SolverStatus::AlmostSolved), "{status:?}");
    solver.solution.x.clone()
}

/// The least maximum of a class, the masks of the classes before being known, and masks that have
/// it.
pub fn optimum(programme: &Programme, class: Class, known: &[f64]) -> (f64, Vec<f64>) {
    let form = programme.standard_form(class, known);
    let mut solution = minimised(&form, &form.objective, &[], &[]);
    let least = solution[form.objective.len() - 1];
    solution.truncate(form.unknowns);
    (least, solution)
}

/// Of all masks of a class that leave ‖E₂ₙS − UEₙ‖∞ the least there is, those nearest to the exact
/// rule in least squares. No row exceeds the least maximum of the class, which is returned too, or
/// `before`, that of the classes before, where it is larger.
pub fn nearest(
    programme: &Programme,
    class: Class,
    known: &[f64],
    before: f64,
    exact: &UnboundedMask,
) -> (Vec<f64>, f64) {
    let mut form = programme.standard_form(class, known);
    let (least, _) = optimum(programme, class, known);
    let maximum = form.objective.len() - 1;
    form.inequalities.push((vec![(maximum, 1.0)], least.max(before) * (1.0 + SLACK)));
    let (weights, targets) = weights_and_targets(programme, class, exact);
    let mut entries = minimised(&form, &vec![0.0; maximum + 1], &weights, &targets);
    entries.truncate(form.unknowns);
    (projected(&form, entries), least)
}

/// How often each unknown of a class counts, and what it is in the exact rule.
pub fn weights_and_targets(programme: &Programme, class: Class, exact: &UnboundedMask) -> (Vec<f64>, Vec<f64>) {
    programme.unknowns(class).into_iter().map(|unknown| (multiplicity(unknown), target(unknown, exact))).unzip()
}

/// As far as the masks of a programme and their images reach.
pub fn exact_mask(programme: &Programme) -> UnboundedMask {
    UnboundedMask::of_radius(4 * programme.radius() + 2)
}

/// The nearest entries that satisfy the equalities to rounding.
fn projected(form: &StandardForm, entries: Vec<f64>) -> Vec<f64> {
    let mut left = DMatrix::zeros(form.equalities.len(), entries.len());
    for (row, (terms, _)) in form.equalities.iter().enumerate() {
        for &(column, entry) in terms {
            left[(row, column)] = entry;
        }
    }
    let inverse = left.clone().pseudo_inverse(1e-9).unwrap();
    let right = DVector::from_iterator(form.equalities.len(), form.equalities.iter().map(|&(_, value)| value));
    let mut entries = DVector::from_vec(entries);
    // The first time takes away what the solver left, the second what rounding did.
    for _ in 0..2 {
        entries -= &inverse * (&left * &entries - &right);
    }
    entries.as_slice().to_vec()
}

/// How many entries of masks are this unknown.
fn multiplicity(unknown: Unknown) -> f64 {
    match unknown {
        Unknown::Interior { far: 0, .. } => 1.0,
        Unknown::Interior { far, near } if near == 0 || near == far => 4.0,
        Unknown::Interior { .. } => 8.0,
        Unknown::Border { along, .. } => {
            if along == 0 {
                1.0
            } else {
                2.0
            }
        }
        Unknown::Corner { rows, from_borders } => {
            if rows[0] == rows[1] && from_borders[0] == from_borders[1] {
                1.0
            } else {
                2.0
            }
        }
    }
}

/// The entry of the exact rule: of the unbounded plane, of the half plane (two images), of the
/// quarter (four).
fn target(unknown: Unknown, exact: &UnboundedMask) -> f64 {
    let images = |row: usize, fine: usize| -> Vec<isize> {
        let (row, fine) = (2 * row as isize, fine as isize);
        if row == 0 { vec![fine] } else { vec![fine - row, fine + row] }
    };
    match unknown {
        Unknown::Interior { far, near } => exact.weight(far as isize, near as isize),
        Unknown::Border { row, from_border, along } => {
            images(row, from_border).into_iter().map(|i| exact.weight(i, along as isize)).sum()
        }
        Unknown::Corner { rows, from_borders } => {
            let [first, second] = [0, 1].map(|axis| images(rows[axis], from_borders[axis]));
            first.iter().flat_map(|&i| second.iter().map(move |&j| exact.weight(i, j))).sum()
        }
    }
}

/// Solves the three classes one after the other: all unknowns.
pub fn solved(programme: &Programme) -> Vec<f64> {
    let exact = exact_mask(programme);
    let mut before = 0.0f64;
    Class::ALL.into_iter().fold(Vec::new(), |mut entries, class| {
        let (own, least) = nearest(programme, class, &entries, before, &exact);
        entries.extend(own);
        before = before.max(least);
        entries
    })
}

/// The programme of a rule.
pub fn programme(support: usize, reproduces: Reproduces) -> Programme {
    Programme::new(Energy::Dirichlet, support / 2, reproduces)
}
