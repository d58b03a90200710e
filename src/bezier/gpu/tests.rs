//! What the kernel makes of a matrix and data, against its twin; host structs, constants, divisions
//! of the products.

use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

use super::polygons::ROUNDINGS;
use super::*;
use crate::bezier::pattern::{Completion, Pattern};
use crate::bezier::{Energy, MOST_DEGREE};
use crate::gpu::plan::Limits;
use crate::gpu::reflect::assert_layout;
use crate::gpu::source;
use crate::gpu::testing::{gpu, precisions};

fn seeded(seed: u64) -> StdRng {
    println!("seed {seed}");
    StdRng::seed_from_u64(seed)
}

/// The whole completion of a pattern.
fn completion(degree: usize, is_known: impl Fn(usize) -> bool) -> Operator<f64> {
    let known: Vec<bool> = (0..=degree).map(is_known).collect();
    Operator::from_exact(&Completion::new(Pattern::new(&known), &Energy::bending()).unwrap().weights())
}

/// All patterns of degrees 3 to 10 with two known points at least, or so many of a degree, drawn;
/// and some of the highest.
fn completions(random: &mut StdRng, most: u32) -> Vec<Operator<f64>> {
    let mut found = Vec::new();
    for degree in 3..=10 {
        let all = 1_u32 << (degree + 1);
        let drawn: Vec<u32> =
            if all <= most { (0..all).collect() } else { (0..most).map(|_| random.random_range(0..all)).collect() };
        let enough = drawn.into_iter().filter(|bits| (2..=degree).contains(&(bits.count_ones() as usize)));
        found.extend(enough.map(|bits| completion(degree, |i| bits >> i & 1 == 1)));
    }
    found.extend([2, 3, 7].map(|step| completion(MOST_DEGREE, |i| i.is_multiple_of(step))));
    found.push(completion(MOST_DEGREE, |i| i < 4));
    found.push(completion(MOST_DEGREE, |i| [0, MOST_DEGREE].contains(&i)));
    found
}

/// Curves of random data, which differ in size, for every operator in turn.
fn data<const D: usize>(operators: &[Operator<f64>], curves: usize, random: &mut StdRng) -> Vec<Vec<[f64; D]>> {
    let curve = |i: usize| {
        let scale = 10_f64.powi((i % 9) as i32 - 4);
        let columns = operators[i % operators.len()].columns();
        (0..columns).map(|_| [0; D].map(|_| scale * random.random_range(-1.0..1.0))).collect()
    };
    (0..curves).map(curve).collect()
}

/// What comes back of a curve: points, energy, magnitude.
type Back<const D: usize> = (Vec<[f64; D]>, f64, Option<f64>);

fn apply_all<const D: usize>(
    gpu: &Gpu,
    precision: Precision,
    operators: &[Operator<f64>],
    points: impl Fn(&Operator<f64>) -> usize,
    data: &[Vec<[f64; D]>],
) -> Vec<Back<D>> {
    let products = Products {
        gpu,
        precision,
        dimension: D,
        operators: operators.iter().map(|operator| Some(Product { operator, points: points(operator) })).collect(),
        numbers: (0..data.len()).map(|i| (i % operators.len()) as u32).collect(),
    };
    let mut back = Vec::new();
    let gather = |i: usize, own: &mut Vec<f64>| {
        own.clear();
        own.extend_from_slice(data[i].as_flattened());
        true
    };
    products
        .run(&gather, &mut |chunk, found| {
            for i in chunk.clone() {
                let own = found.of(i).expect("all were sent");
                let rows = points(&operators[i % operators.len()]);
                back.push(((0..rows).map(|row| own.point(row)).collect(), own.energy(), own.magnitude()));
            }
        })
        .unwrap();
    back
}

/// The largest difference of coordinates.
fn apart<const D: usize>(a: &[[f64; D]], b: &[[f64; D]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.as_flattened().iter().zip(b.as_flattened()).fold(0.0, |most, (a, b)| {
        assert!(a.is_finite() && b.is_finite());
        most.max((a - b).abs())
    })
}

fn applied<const D: usize>(operator: &Operator<f64>, data: &[[f64; D]]) -> Vec<[f64; D]> {
    let mut rows = vec![[0.0; D]; operator.rows()];
    operator.apply(data, |row, point| rows[row] = point);
    rows
}

#[test]
fn sums_are_within_the_roundings_that_their_magnitudes_allow() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1100);
    let operators = completions(&mut random, 60);
    let data = data::<3>(&operators, 60_000, &mut random);
    for precision in precisions(&gpu) {
        let back = apply_all(&gpu, precision, &operators, Operator::rows, &data);
        let mut worst = 0.0_f64;
        for (i, (found, energy, magnitude)) in back.iter().enumerate() {
            let operator = &operators[i % operators.len()];
            let wanted = applied(operator, &data[i]);
            let sizes = Operator::<f64>::from_fn(operator.rows(), operator.columns(), |i, j| operator.at(i, j).abs());
            let absolute: Vec<[f64; 3]> = data[i].iter().map(|point| point.map(f64::abs)).collect();
            let own = applied(&sizes, &absolute).into_flattened().into_iter().fold(0.0, f64::max);
            let difference = apart(found, &wanted);
            assert_eq!(*energy, 0.0);
            match magnitude {
                Some(magnitude) => {
                    assert!((magnitude - own).abs() <= 8.0 * f64::from(f32::EPSILON) * own, "{magnitude} for {own}");
                    worst = worst.max(difference / (0.5 * f64::from(f32::EPSILON) * own));
                }
                // The same operations in the same order.
                None => assert!(difference <= 2.0 * f64::EPSILON * own, "{found:?} for {wanted:?}"),
            }
        }
        println!("{precision:?}: {worst:.2} halves of ε of the magnitude, of {ROUNDINGS}");
        assert!(worst <= ROUNDINGS, "{worst}");
    }
}

#[test]
fn in_single_precision_the_kernel_is_its_twin() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1101);
    let operators = completions(&mut random, 20);
    let data = data::<2>(&operators, 4000, &mut random);
    // The first half of the rows are points.
    let back = apply_all(&gpu, Precision::F32, &operators, |operator| operator.rows() / 2, &data);
    for (i, (found, energy, _)) in back.iter().enumerate() {
        let of = &operators[i % operators.len()];
        let twin = Operator::<f32>::from_fn(of.rows(), of.columns(), |i, j| of.at(i, j));
        let size = power_of_two(data[i].as_flattened());
        let own: Vec<[f32; 2]> = data[i].iter().map(|point| point.map(|x| (x / size) as f32)).collect();
        let (mut points, mut square, mut largest) = (Vec::new(), 0.0_f32, 0.0_f32);
        twin.apply(&own, |row, point| match row < of.rows() / 2 {
            true => points.push(point.map(|x| f64::from(x) * size)),
            false => {
                square += point.iter().map(|x| x * x).sum::<f32>();
                largest = point.iter().fold(largest, |largest, x| largest.max(x.abs()));
            }
        });
        let sizes =
            (0..of.rows()).map(|i| (0..of.columns()).map(|j| of.at(i, j).abs()).sum::<f64>()).fold(1.0, f64::max);
        // A driver may contract a product and a sum, which leaves out a rounding a column.
        let contracted = f64::from(f32::EPSILON) * of.columns() as f64 * sizes;
        assert!(apart(found, &points) <= contracted * size, "curve {i}: {found:?} for {points:?}");
        let square = f64::from(square);
        let of_energy = contracted * 4.0 * of.rows() as f64 * (f64::from(largest) + contracted);
        assert!((energy / size / size - square).abs() <= of_energy, "curve {i}: {energy} for {square}");
    }
}

#[test]
fn a_curve_has_the_same_bits_whatever_its_chunk_and_neighbours() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1102);
    let operators = completions(&mut random, 10);
    let data = data::<4>(&operators, 1000, &mut random);
    let points = |operator: &Operator<f64>| operator.rows() - operator.rows() / 3;
    for precision in precisions(&gpu) {
        let together = apply_all(&gpu, precision, &operators, points, &data);
        let limits = Limits { chunk_bytes: 20_000, ..*gpu.limits() };
        let small = Gpu::open(0).unwrap().with_limits(limits);
        assert_eq!(apply_all(&small, precision, &operators, points, &data), together, "{precision:?}");
        let alone = apply_all(&gpu, precision, &operators[..1], points, &data[..1]);
        assert_eq!(alone[0], together[0], "{precision:?}");
    }
}

#[test]
fn matrices_of_many_rows_are_divided_among_threads_and_very_wide_ones_left_out() {
    let Some(gpu) = gpu() else { return };
    let mut random = seeded(1103);
    let mut matrix = |rows: usize, columns: usize| {
        let entries: Vec<f64> = (0..rows * columns).map(|_| random.random_range(-1.0..1.0)).collect();
        Operator::<f64>::from_fn(rows, columns, |i, j| entries[i * columns + j])
    };
    // Four threads, the last with few rows; and one thread that takes four rows at once.
    let operators = [matrix(23_000, 30), matrix(11, LOOP_TURNS - 1), matrix(3, 2)];
    let wide = matrix(1, LOOP_TURNS);
    let at_once = operators.each_ref().map(|operator| Product { operator, points: 0 }.rows_at_once());
    assert_eq!(at_once, [7740, 4, 80_000]);
    let data = data::<1>(&operators, 9, &mut random);
    for precision in precisions(&gpu) {
        let back = apply_all(&gpu, precision, &operators, Operator::rows, &data);
        let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f32::EPSILON.into() };
        for (i, (found, _, magnitude)) in back.iter().enumerate() {
            let operator = &operators[i % 3];
            let size = data[i].iter().map(|[x]| x.abs()).sum::<f64>();
            assert!(apart(found, &applied(operator, &data[i])) <= 200.0 * epsilon * size, "curve {i}");
            let of_row = |row: usize| data[i].iter().enumerate().map(|(j, [x])| (x * operator.at(row, j)).abs()).sum();
            let own = (0..operator.rows()).map(of_row).fold(0.0, f64::max);
            assert!(magnitude.is_none_or(|found| (found - own).abs() <= 1e-3 * own), "{magnitude:?} for {own}");
        }
    }
    assert!(!Product { operator: &wide, points: 1 }.is_for_kernel());
}

#[test]
fn curves_without_finite_data_are_not_sent() {
    let Some(gpu) = gpu() else { return };
    let operator = completion(3, |i| i != 2);
    let product = Product { operator: &operator, points: operator.rows() };
    let numbers = vec![0, 0, NONE, 0, 0];
    let products =
        Products { gpu: &gpu, precision: Precision::F32, dimension: 1, operators: vec![Some(product)], numbers };
    let gather = |i: usize, own: &mut Vec<f64>| {
        own.clear();
        own.extend([1.0, 2.0, [f64::NAN, 3.0, 0.0, f64::INFINITY, 4.0][i]]);
        i != 1
    };
    let mut back = Vec::new();
    products
        .run(&gather, &mut |chunk, found| {
            back.extend(chunk.clone().map(|i| found.of(i).map(|own| own.point(0))));
        })
        .unwrap();
    assert_eq!(back, [None, None, None, None, Some([3.0])]);
}

#[test]
fn host_structs_and_constants_are_the_kernels() {
    for precision in [Precision::F32, Precision::F64] {
        for key in bezier_kernels(precision) {
            assert_layout!(key, ApplyParams { groups });
            assert_layout!(key, ApplyGroup { matrix, rows, columns, points, start, out, curves, padding });
        }
    }
    let text = source::file("bezier/operator.wgsl").unwrap();
    assert!(text.contains(&format!("//:unroll k 0..{BLOCK}\n")) && text.contains(&format!("vec{BLOCK}<real>")));
}
