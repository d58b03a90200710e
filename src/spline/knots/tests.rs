use super::*;

fn knots(batch: &CurveBatch, parametrisation: Parametrisation) -> Knots {
    Knots::new(batch, parametrisation, Coincident::Refuse).unwrap()
}

#[test]
fn each_parametrisation_follows_its_rule() {
    let points = [[0.0, 0.0], [3.0, 4.0], [3.0, 8.0], [3.0, 8.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[..3]]).unwrap();
    let chord = knots(&batch, Parametrisation::ChordLength);
    assert_eq!((chord.t(0), chord.t(1)), (&[0.0, 5.0, 9.0][..], &[0.0, 5.0, 9.0][..]));
    assert_eq!(chord.repeats, BTreeMap::from([(0, vec![0, 1, 2, 2])]));
    assert_eq!(chord.values(1), &points.as_flattened()[..6]);
    let roots = [0.0, 5_f64.sqrt(), 5_f64.sqrt() + 2.0];
    for rule in [Parametrisation::Centripetal, Parametrisation::Auto] {
        assert_eq!(knots(&batch, rule).t(1), roots.map(|t| 9.0 * (t / roots[2])));
    }
    assert_eq!(knots(&batch, Parametrisation::Uniform).t(0), &[0.0, 1.0, 2.0, 3.0]);
    let batch = batch.with_parameters(vec![1.0, 2.0, 5.0, 5.0, -1.0, 0.5, 9.0]).unwrap();
    let given = knots(&batch, Parametrisation::Auto);
    assert_eq!((given.t(0), given.t(1)), (&[1.0, 2.0, 5.0][..], &[-1.0, 0.5, 9.0][..]));
}

#[test]
fn a_closed_curve_repeats_its_first_knot_one_period_later() {
    let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 2.0], [0.0, 0.0], [0.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&square[..]]).unwrap().closed(true);
    let chord = knots(&batch, Parametrisation::ChordLength);
    assert_eq!(chord.t(0), &[0.0, 2.0, 4.0, 6.0, 8.0]);
    assert_eq!(chord.values(0)[8..], [0.0, 0.0]);
    // Six data points are left; the last is where the curve closes.
    assert_eq!(chord.repeats[&0], [0, 1, 2, 3, 3, 4, 4]);
    let bare = CurveBatch::from_slices(&[&square[..4]]).unwrap().with_parameters(vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    assert_eq!(knots(&bare.clone().closed(true), Parametrisation::Auto).t(0), &[0.0, 1.0, 2.0, 3.0, 4.0]);
    let stated = bare.with_closing_spans(vec![0.25]).unwrap().closed(true);
    assert_eq!(knots(&stated, Parametrisation::Auto).t(0)[4], 3.25);
}

#[test]
fn different_points_at_one_parameter_are_refused_or_averaged() {
    let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [2.0, 0.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[..2]]).unwrap();
    let batch = batch.with_parameters(vec![0.0, 1.5, 1.5, 2.0, 0.0, 1.0]).unwrap();
    let refused = knots(&batch, Parametrisation::Given);
    assert_eq!(refused.unfitted[&0].status, CurveStatus::Degenerate);
    assert_eq!(
        refused.unfitted[&0].message,
        "curve 0, point 2: a different point stands at the same parameter 1.5: \
         remove one of them, or use `spline::Smoothing`, which averages them"
    );
    assert_eq!((refused.offsets.as_slice(), refused.t(1)), (&[0, 0, 2][..], &[0.0, 1.0][..]));
    assert_eq!(refused.values(1), &[0.0, 0.0, 1.0, 0.0]);
    let batch = batch.with_weights(vec![1.0, 1.0, 2.0, 1.0, 5.0, 6.0]).unwrap();
    let averaged = Knots::new(&batch, Parametrisation::Given, Coincident::Average).unwrap();
    assert_eq!(averaged.t(0), &[0.0, 1.5, 2.0]);
    assert_eq!(averaged.values(0), &[0.0, 0.0, 1.0, 2.0, 2.0, 0.0]);
    assert_eq!(averaged.weights.unwrap(), [1.0, 3.0, 1.0, 5.0, 6.0]);
}

#[test]
fn a_closed_curve_whose_ends_coincide_averages_them_at_both_entries() {
    let points = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 2.0]];
    let batch = CurveBatch::from_slices(&[&points[..]]).unwrap().with_parameters(vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let batch = batch.with_closing_spans(vec![0.0]).unwrap().closed(true);
    let averaged = Knots::new(&batch, Parametrisation::Given, Coincident::Average).unwrap();
    assert_eq!(averaged.t(0), &[0.0, 1.0, 2.0, 3.0]);
    assert_eq!(averaged.values(0), &[0.0, 1.0, 4.0, 0.0, 4.0, 4.0, 0.0, 1.0]);
    assert_eq!(averaged.weights.as_deref(), Some(&[2.0, 1.0, 1.0, 2.0][..]));
    assert_eq!(knots(&batch, Parametrisation::Given).unfitted[&0].status, CurveStatus::Degenerate);
}

#[test]
fn curves_with_too_little_own_no_knot_and_say_why() {
    let (one, same) = ([[1.0, 1.0]], [[1.0, 1.0]; 3]);
    let far = [[-1.7e308, 0.0], [1.7e308, 0.0]];
    let batch = CurveBatch::from_slices(&[&one[..], &same[..], &[], &far[..]]).unwrap();
    let none = knots(&batch, Parametrisation::Auto);
    let says = |i: usize| (none.unfitted[&i].status, none.unfitted[&i].message.as_str());
    assert_eq!(none.offsets, [0; 5]);
    assert_eq!(says(0).0, CurveStatus::Degenerate);
    assert!(says(0).1.contains("has this point only"), "{}", says(0).1);
    assert!(says(1).1.contains("one and the same"), "{}", says(1).1);
    assert!(says(2).1.contains("has no point"), "{}", says(2).1);
    assert_eq!(says(3).0, CurveStatus::Invalid);
    assert!(says(3).1.contains("divide the numbers by a common factor"), "{}", says(3).1);
    let error = Knots::new(&batch, Parametrisation::Given, Coincident::Refuse).unwrap_err().to_string();
    assert!(error.contains("add a column t, or choose chord length"), "{error}");
    let closed = knots(&batch.closed(true), Parametrisation::Auto);
    assert_eq!((closed.unfitted.len(), closed.t.len()), (4, 0));
}

#[test]
fn chords_neither_overflow_nor_underflow() {
    for scale in [1e-300, 1e-150, 1.0, 1e150, 1e300] {
        let points = [[0.0, 0.0, 0.0], [2.0 * scale, 3.0 * scale, 6.0 * scale]];
        let t = knots(&CurveBatch::from_slices(&[&points[..]]).unwrap(), Parametrisation::ChordLength).t;
        assert!((t[1] / scale - 7.0).abs() < 1e-14, "{scale}: {}", t[1]);
    }
}

#[test]
fn open_curves_with_a_knot_a_point_share_the_arrays_of_their_batch() {
    let points = [[0.0, 0.0], [3.0, 4.0], [3.0, 8.0]];
    let batch = CurveBatch::from_slices(&[&points[..], &points[1..]]).unwrap();
    let shares = |batch: &CurveBatch, knots: &Knots| {
        let given = batch.shared_parameters().is_some_and(|t| Arc::ptr_eq(t, &knots.t));
        [Arc::ptr_eq(batch.shared_coords(), &knots.values), given]
    };
    assert_eq!(shares(&batch, &knots(&batch, Parametrisation::Auto)), [true, false]);
    let timed = batch.clone().with_parameters(vec![0.0, 1.0, 3.0, 0.0, 2.0]).unwrap();
    assert_eq!(shares(&timed, &knots(&timed, Parametrisation::Auto)), [true, true]);
    assert_eq!(shares(&timed, &knots(&timed, Parametrisation::Uniform)), [true, false]);
    // What has other knots than points has arrays of its own.
    let closed = timed.clone().closed(true);
    assert_eq!(shares(&closed, &knots(&closed, Parametrisation::Auto)), [false, false]);
    let repeated = timed.with_parameters(vec![0.0, 1.0, 3.0, 2.0, 2.0]).unwrap();
    assert_eq!(shares(&repeated, &knots(&repeated, Parametrisation::Auto)), [false, false]);
}
