use super::super::synthetic::{Counted, Forbidden, Quadratic, Wells};
use super::super::total_cost;
use super::*;

/// Steps 2 to 5 word for word: every S_k and S_k^± anew in every iteration.
fn textbook(costs: &mut dyn SegmentCosts, start: &[f64], fixed: &[bool], step: f64) -> (Vec<f64>, usize) {
    let (dots, segments) = (costs.dots(), costs.segments());
    let mut steps = vec![0i64; dots];
    for iterations in 0.. {
        let slopes =
            |steps: &[i64]| -> Vec<f64> { start.iter().zip(steps).map(|(a, &s)| a + s as f64 * step).collect() };
        let mut combined = |k: usize, steps: &[i64]| {
            let all = requests_of(&slopes(steps), segments);
            let near = |request: &&Request| request.segment == k || (request.segment + 1) % dots == k;
            let mut near: Vec<Request> = all.iter().filter(near).copied().collect();
            if k == 0 {
                near.reverse(); // the one that arrives first, so that sums round alike
            }
            let mut found = vec![0.0; near.len()];
            costs.costs(&near, &mut found).unwrap();
            found.iter().sum::<f64>()
        };
        let mut best = (0.0, 0, 0);
        for k in (0..dots).filter(|&k| !fixed[k]) {
            let now = combined(k, &steps);
            for way in WAYS {
                let mut moved = steps.clone();
                moved[k] += way;
                let decrease = now - combined(k, &moved);
                if decrease > best.0 {
                    best = (decrease, k, way);
                }
            }
        }
        if best.0 == 0.0 {
            return (slopes(&steps), iterations);
        }
        steps[best.1] += best.2;
    }
    unreachable!("the loop ends by itself")
}

#[test]
fn keeping_costs_makes_the_same_moves_as_computing_all_anew() {
    for (dots, closed, fixed_every) in
        [(2, false, 9), (2, true, 9), (3, true, 9), (9, false, 4), (10, true, 3), (7, true, 99)]
    {
        let mut costs = Counted::new(Quadratic::random(dots, closed, 5));
        let fixed: Vec<bool> = (0..dots).map(|k| k % fixed_every == 1).collect();
        let start: Vec<f64> = (0..dots).map(|k| 1.5 + (k as f64).sin()).collect();
        let greedy = Greedy { step: 0.05, ..Greedy::default() };
        let outcome = greedy.search(&mut costs, &start, &fixed).unwrap();
        assert_eq!(outcome.segment_solves, costs.solves, "counted by the search and by the costs");
        let (slopes, iterations) = textbook(&mut costs.inner, &start, &fixed, 0.05);
        assert!(outcome.settled && iterations > 5);
        assert_eq!((outcome.slopes, outcome.iterations), (slopes, iterations), "{dots} dots, closed: {closed}");
    }
}

#[test]
fn an_iteration_takes_six_segment_solves_in_one_request() {
    let (dots, start) = (12, [0.3; 12]);
    let mut costs = Counted::new(Quadratic::random(dots, true, 1));
    let outcome = Greedy::default().search(&mut costs, &start, &[false; 12]).unwrap();
    assert!(outcome.iterations > 100);
    assert_eq!(outcome.segment_solves, 5 * dots + 6 * outcome.iterations);
    assert_eq!(outcome.textbook_solves, 5 * dots * (1 + outcome.iterations));
    assert_eq!((costs.solves, costs.requests), (outcome.segment_solves, 1 + outcome.iterations));
}

#[test]
fn the_end_admits_no_decreasing_move_and_fixed_slopes_stay() {
    for closed in [false, true] {
        let mut costs = Quadratic::random(20, closed, 2);
        let start: Vec<f64> = (0..20).map(|k| (3 * k) as f64).collect();
        let fixed: Vec<bool> = (0..20).map(|k| k == 0 || k == 7 || k == 8).collect();
        let outcome = Greedy { step: 0.02, ..Greedy::default() }.search(&mut costs, &start, &fixed).unwrap();
        let least = total_cost(&mut costs, &outcome.slopes).unwrap();
        assert!((least - outcome.cost).abs() <= 1e-13 * least);
        for k in 0..20 {
            if fixed[k] {
                assert_eq!(outcome.slopes[k], start[k]);
                continue;
            }
            for way in [-0.02, 0.02] {
                let mut moved = outcome.slopes.clone();
                moved[k] += way;
                // Rounding of sums of twenty costs; a step changes them by 1e-4.
                assert!(total_cost(&mut costs, &moved).unwrap() >= least * (1.0 - 1e-14), "dot {k} by {way}");
            }
        }
        assert!(outcome.history.windows(2).all(|pair| pair[1].cost < pair[0].cost * (1.0 + 1e-15)));
    }
}

#[test]
fn halving_steps_end_at_the_minimum_of_a_convex_cost() {
    for closed in [false, true] {
        let mut costs = Quadratic::random(15, closed, 3);
        let (minimum, bound) = costs.minimum();
        let coarse = Greedy { step: 0.04, ..Greedy::default() };
        let fine = Greedy { smallest_step: Some(1e-6), ..coarse.clone() };
        for (greedy, last_step) in [(coarse, 0.04), (fine, 0.04 / 32_768.0)] {
            let outcome = greedy.search(&mut costs, &[0.0; 15], &[false; 15]).unwrap();
            let error = minimum.iter().zip(&outcome.slopes).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // No move of one slope decreases: |g_k| ≤ H_kk Δα/2, and the error is H⁻¹g.
            assert!(outcome.settled && error <= bound * 0.5 * last_step, "{error:.1e} at steps of {last_step}");
        }
    }
}

#[test]
fn infinite_segments_are_left_and_never_entered() {
    let mut costs = Forbidden { quadratic: Quadratic::random(4, false, 4), largest_sum: 2.0 };
    // Both segments at dot 2 are forbidden, and its first step down frees only one of them.
    let (start, fixed) = ([0.0, 1.0, 1.005, 1.045], [false, true, false, true]);
    assert_eq!(total_cost(&mut costs, &start).unwrap(), f64::INFINITY);
    let outcome = Greedy::default().search(&mut costs, &start, &fixed).unwrap();
    assert!(outcome.settled && outcome.cost.is_finite());
    assert!(outcome.slopes.windows(2).all(|pair| pair[0] + pair[1] <= 2.0));
    // Where every slope is forbidden and far away, nothing can be done and the cost says so.
    let lost = Greedy::default().search(&mut costs, &[5.0; 4], &[false; 4]).unwrap();
    assert_eq!((lost.cost, lost.iterations, lost.slopes), (f64::INFINITY, 0, vec![5.0; 4]));
}

#[test]
fn of_two_minima_the_nearer_is_found() {
    let mut wells = Wells { dots: 6 };
    let near = Greedy::default().search(&mut wells, &[0.9; 6], &[false; 6]).unwrap();
    assert!(near.settled && near.slopes.iter().all(|slope| (slope - 1.0).abs() < 0.1), "{:?}", near.slopes);
}

#[test]
fn a_limit_ends_the_search_and_bad_steps_are_refused() {
    let mut costs = Quadratic::random(8, true, 6);
    let greedy = Greedy { max_iterations: 10, ..Greedy::default() };
    let outcome = greedy.search(&mut costs, &[2.0; 8], &[false; 8]).unwrap();
    assert_eq!((outcome.settled, outcome.iterations), (false, 10));
    let nan = Greedy { smallest_step: Some(f64::NAN), ..Greedy::default() };
    assert_eq!(
        nan.search(&mut costs, &[0.0; 8], &[false; 8]).unwrap_err().to_string(),
        "the greedy search's smallest step is NaN: give a positive angle in radians, such as 0.01"
    );
    let error = Greedy { step: 0.0, ..Greedy::default() }.search(&mut costs, &[0.0; 8], &[false; 8]).unwrap_err();
    assert_eq!(error.to_string(), "the greedy search's step is 0: give a positive angle in radians, such as 0.01");
}

#[test]
fn nothing_to_move_is_no_error() {
    for (dots, closed) in [(0, true), (1, false), (1, true)] {
        let mut costs = Quadratic::random(dots, closed, 7);
        let outcome = Greedy::default().search(&mut costs, &vec![0.5; dots], &vec![false; dots]).unwrap();
        assert_eq!((outcome.cost, outcome.settled, outcome.iterations), (0.0, true, 0));
    }
    let fixed = Greedy::default().search(&mut Quadratic::random(5, true, 7), &[1.0; 5], &[true; 5]).unwrap();
    assert_eq!((fixed.slopes, fixed.iterations, fixed.segment_solves), (vec![1.0; 5], 0, 5));
}
