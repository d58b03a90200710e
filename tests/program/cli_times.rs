//! Tracks and their times, as users meet them: which times samples have, what is between two, and units of time and of the globe.

use std::fs;

use super::ran::{folder as with, run};
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

fn lines(folder: &TempDir, name: &str) -> Vec<String> {
    fs::read_to_string(folder.path().join(name)).unwrap().lines().map(String::from).collect()
}

/// Rows of a file in cells, without the head.
fn rows(folder: &TempDir, name: &str) -> Vec<Vec<String>> {
    lines(folder, name)[1..].iter().map(|line| line.split(',').map(String::from).collect()).collect()
}

/// A column of a file in numbers.
fn column(folder: &TempDir, name: &str, cell: usize) -> Vec<f64> {
    rows(folder, name).iter().map(|row| row[cell].parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn a_curve_has_the_offset_and_the_grid_of_its_own_times() {
    let own = |name: &str, zone: &str| -> String {
        let row = |k: usize| format!("{name},{k},{},2024-03-01T0{}:10:00{zone}\n", k * k, 2 * k);
        (0..3).map(row).collect()
    };
    let (a, b, c) = (own("a", "+05:30"), own("b", "Z"), own("c", "-03:00"));
    let alone = |rows: &str| -> Vec<Vec<String>> {
        let folder = with(&format!("curve,x,y,t\n{rows}"));
        run(&folder, "fit in.csv -o out.csv --every 1h --device cpu").code(0);
        self::rows(&folder, "out.csv")
    };
    let first = &alone(&b)[0];
    assert_eq!([&*first[0], &*first[1], &*first[3]], ["b", "0.4166666666666667", "2024-03-01T01:00:00Z"]);
    let each = [&a, &b, &c].map(|rows| alone(rows)).concat();
    assert_eq!(each.len(), 12);
    assert_eq!(alone(&format!("{a}{b}{c}")), each);
    // Rows that are mixed, and parts of a track that pauses.
    let mixed: String =
        (0..3).flat_map(|k| [&a, &b, &c].map(|rows| rows.lines().nth(k).unwrap().to_string() + "\n")).collect();
    assert_eq!(alone(&mixed), each);
    let folder =
        with(&format!("curve,x,y,t\n{a}a,9,9,2024-03-02T00:00:00+05:30\na,9,8,2024-03-02T01:00:00+05:30\n{b}"));
    run(&folder, "fit in.csv -o out.csv --gap 3h --every 1h --device cpu").code(0);
    let parts = rows(&folder, "out.csv");
    assert_eq!((&*parts[4][0], &*parts[4][3]), ("a.2", "2024-03-02T00:00:00+05:30"));
    assert_eq!((parts.len(), &parts[6..]), (10, &alone(&b)[..]));
}
