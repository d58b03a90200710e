//! Minimisations end as they say.

use faircurve::Sampling;
use faircurve::discrete::{attachment, length, tension};
use faircurve::spline::{Natural, Parametrisation};

use super::*;

/// A loop that crosses itself.
fn ring(count: usize) -> Vec<[f64; 2]> {
    let at = |k: usize| {
        let t = k as f64 / (count - 1) as f64;
        [t + 0.8 * (std::f64::consts::TAU * t).sin(), 1.3 * (std::f64::consts::PI * t).sin()]
    };
    let mut vertices: Vec<[f64; 2]> = (0..count).map(at).collect();
    vertices[count - 1] = [1.0, 0.0];
    vertices
}

#[test]
fn one_sobolev_step_of_length_1_gives_the_segment_in_f32_too() {
    // Section 4's curve.
    let points = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
    let by_chords = Natural { parametrisation: Parametrisation::ChordLength, ..Natural::default() };
    let fit = by_chords.fit(&CurveBatch::from_slices(&[&points[..]]).unwrap(), &Device::cpu()).unwrap();
    let polylines = fit.polylines(Sampling::Spacing(fit.curve(0).length() / 199.5));
    let vertices = polylines.points(0).as_chunks::<2>().0.to_vec();
    assert_eq!(vertices.len(), 201);
    // Edges and tangents in f32, of the curve in f64.
    let narrow: Vec<[f32; 2]> = vertices.windows(2).map(|p| [0, 1].map(|c| (p[1][c] - p[0][c]) as f32)).collect();
    let lengths: Vec<f32> = narrow.iter().map(|[x, y]| (x * x + y * y).sqrt()).collect();
    let tangent = |j: usize| narrow[j].map(|x| x / lengths[j]);
    let turn = |row: usize| [0, 1].map(|c| tangent(row - 1)[c] - tangent(row)[c]);
    let ends = [[0.0f32; 2]];
    let gradient: Vec<[f32; 2]> = ends.into_iter().chain((1..200).map(turn)).chain(ends).collect();
    let z = sobolev_gradient(&lengths, &gradient);
    let found: Vec<[f64; 2]> =
        vertices.iter().zip(&z).map(|(x, z)| [x[0] - f64::from(z[0]), x[1] - f64::from(z[1])]).collect();
    let edges: Vec<f64> = vertices.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect();
    let (total, mut along, mut worst) = (edges.iter().sum::<f64>(), 0.0, 0.0f64);
    for (k, vertex) in found.iter().enumerate() {
        worst = worst.max((vertex[0] - along / total).hypot(vertex[1]));
        along += edges.get(k).copied().unwrap_or(0.0);
    }
    println!("f32: {worst:e}");
    assert!(worst < 5e-5, "{worst:e}");
    assert!(worst > 1e-9, "{worst:e}: that is f64");
}

#[test]
fn what_cannot_be_minimised_is_refused_with_value_and_remedy() {
    let vertices = ring(5);
    let refusal = |minimisation: Minimisation, vertices: &[[f64; 2]]| {
        minimisation.run(vertices, |_| panic!("nothing to show")).unwrap_err().to_string()
    };
    let new = || Minimisation::new(length());
    let constant = |step| Minimiser::Gradient {
        product: InnerProduct::Ordinary,
        step: Step::Constant(step),
        direction: Direction::Steepest,
    };
    assert_eq!(refusal(new(), &vertices[..2]), "2 vertices; with both ends held, three at least are needed");
    assert_eq!(
        refusal(Minimisation { tolerance: -1.0, ..new() }, &vertices),
        "tolerance is -1; it must be finite and not negative, such as 1e-8"
    );
    assert_eq!(
        refusal(Minimisation { method: constant(0.0), ..new() }, &vertices),
        "the constant step is 0; it must be finite and positive, such as 1"
    );
    assert_eq!(
        refusal(Minimisation::new(tension() + attachment()), &vertices),
        "attachment without data points: give them as targets"
    );
    assert_eq!(
        refusal(new(), &[[0.0, 0.0], [1.0, f64::NAN], [2.0, 0.0]]),
        "vertex 1 is [1.0, NaN]; coordinates must be finite"
    );
    assert_eq!(
        refusal(new(), &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]),
        "vertices 1 and 2 are both [1.0, 0.0]; neighbours must differ"
    );
    let error = new().run(&[[0.0; 4], [1.0; 4], [2.0; 4]], |_| {}).unwrap_err();
    assert_eq!(error.to_string(), "vertices have 4 coordinates; curves are 2-D or 3-D");
}

#[test]
fn a_step_out_of_the_numbers_ends_as_broken_with_the_last_curve_that_had_an_energy() {
    let method = Minimiser::Gradient {
        product: InnerProduct::Ordinary,
        step: Step::Constant(1e300),
        direction: Direction::Steepest,
    };
    let vertices = ring(9);
    let found = Minimisation { method, ..Minimisation::new(tension()) }.run(&vertices, |_| {}).unwrap();
    assert_eq!((found.ending, found.iterations), (Ending::Broken, 0));
    assert_eq!(found.vertices, vertices);
}
