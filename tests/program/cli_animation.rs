//! Keyframes: easings, frames, and markers that move.

use std::fs;

use super::ran::{refused, run};
use serde_json::Value;
use tempfile::TempDir;

const CARRY: &str = "--carry scale:smooth,rotation:angle:smooth,opacity:smooth --device cpu";

fn data(name: &str) -> String {
    format!("{}/examples/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// The frames of a curve in a file.
fn frames(folder: &TempDir, name: &str, curve: usize) -> Vec<Value> {
    let document: Value = serde_json::from_str(&read(folder, name)).unwrap();
    document[curve]["frames"].as_array().unwrap().clone()
}

fn number(frame: &Value, name: &str) -> f64 {
    frame[name].as_f64().unwrap()
}

#[test]
fn keys_are_eased_and_held_with_all_that_belongs_to_them() {
    let folder = TempDir::new().unwrap();
    let keys = data("keys.csv");
    let fit = format!("fit {keys} --every 0.1 --write speed {CARRY}");
    run(&folder, &format!("{fit} -o plain.json --to frames")).code(0);
    run(&folder, &format!("{fit} -o eased.json --to frames --ease ease")).code(0);
    let (plain, eased) = (frames(&folder, "plain.json", 0), frames(&folder, "eased.json", 0));
    assert_eq!((plain.len(), eased.len()), (51, 51));
    assert!(eased[0].get("ease").is_none() && number(&eased[0], "scale") == 1.0, "{}", eased[0]);
    // Keys stay where they are.
    for k in [0, 10, 20, 30, 40, 50] {
        for name in ["t", "x", "y", "scale", "rotation", "opacity"] {
            assert!((number(&plain[k], name) - number(&eased[k], name)).abs() < 1e-12, "{name} of {}", eased[k]);
        }
    }
    // From 0 to 1 it slows down, from 2 to 3 it waits, and from 4 to 5 it does as without easing.
    assert!(number(&eased[5], "x") > number(&plain[5], "x") && number(&eased[10], "speed") < 1e-12);
    for held in &eased[20..30] {
        assert_eq!(["x", "y", "speed"].map(|name| number(held, name)), [4.0, 0.0, 0.0], "{held}");
    }
    for k in 40..=50 {
        let differ = ["x", "y", "scale"].map(|name| (number(&eased[k], name) - number(&plain[k], name)).abs());
        assert!(differ.iter().all(|x| *x < 1e-12), "{}", eased[k]);
    }
    // The speed is that of the motion.
    run(&folder, &format!("fit {keys} -o fine.json --to frames --every 0.001 --ease ease --write speed {CARRY}"))
        .code(0);
    let fine = frames(&folder, "fine.json", 0);
    for k in [200, 500, 700, 1300, 1800, 3400, 3900, 4500] {
        let moved = ["x", "y"].map(|name| number(&fine[k + 1], name) - number(&fine[k - 1], name));
        let (speed, mean) = (number(&fine[k], "speed"), moved[0].hypot(moved[1]) / 0.002);
        assert!((speed - mean).abs() < 1e-3 * speed, "{speed} {mean} at {k}");
    }
}

/// The numbers of an attribute of the first element that begins so after a place.
fn numbers(element: &str, attribute: &str) -> Vec<Vec<f64>> {
    let values = element.split_once(&format!(" {attribute}=\"")).unwrap().1.split('"').next().unwrap();
    values.split(';').map(|value| value.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

#[test]
fn markers_are_where_the_frames_are() {
    let folder = TempDir::new().unwrap();
    let fit = format!("fit {} --every 0.25 --ease ease {CARRY}", data("keys.csv"));
    run(&folder, &format!("{fit} -o dance.svg --to motion")).code(0);
    run(&folder, &format!("{fit} -o dance.frames")).code(0);
    let text = read(&folder, "dance.svg");
    let markers: Vec<&str> = text.split("<use ").skip(1).collect();
    assert_eq!(markers.len(), 2);
    for (i, marker) in markers.into_iter().enumerate() {
        let elements: Vec<&str> = marker.split("<animate").skip(1).collect();
        assert_eq!(elements.len(), 4, "{marker}");
        let times: Vec<Vec<Vec<f64>>> = elements.iter().map(|element| numbers(element, "keyTimes")).collect();
        let values: Vec<Vec<Vec<f64>>> = elements.iter().map(|element| numbers(element, "values")).collect();
        let keys: Vec<f64> = times[0].iter().map(|time| time[0]).collect();
        assert!(keys[0] == 0.0 && keys[keys.len() - 1] == 1.0 && keys.is_sorted(), "{keys:?}");
        assert!(times.iter().all(|own| *own == times[0]) && values.iter().all(|own| own.len() == keys.len()));
        for frame in frames(&folder, "dance.frames", i) {
            // 5 s are a period.
            let k = keys.iter().rposition(|key| (key * 5.0 - number(&frame, "t")).abs() < 1e-5).unwrap();
            let [x, y] = [values[0][k][0], 0.0 - values[0][k][1]];
            assert!(x == number(&frame, "x") && y == number(&frame, "y"), "{frame}");
            assert!(values[1][k][0] == number(&frame, "opacity") && values[3][k][0] == number(&frame, "scale"));
            let turned = (number(&frame, "rotation") + values[2][k][0]).rem_euclid(360.0);
            assert!(turned.min(360.0 - turned) < 1e-9, "{frame}");
        }
    }
    // A drawing with its paths.
    run(&folder, "fit dance.svg -o again.csv --samples 1 --device cpu").code(0);
    assert!(read(&folder, "again.csv").lines().count() > 40);
}

#[test]
fn easings_that_cannot_be_are_refused_in_a_sentence() {
    let folder = TempDir::new().unwrap();
    let keys = data("keys.csv");
    let refuse = |options: &str, sentence: &str| refused(&folder, &format!("fit {options}"), sentence);
    refuse(&format!("{keys} -o a.csv --ease ease"), "--ease is of times between points: add --every DT or --at FILE");
    refuse(&format!("{keys} -o a.csv --ease easy --every 1"), "there is no column \"easy\" to carry");
    fs::write(folder.path().join("bad.csv"), "curve,x,y,t,ease\na,0,0,0,linear\na,1,1,1,bounce\n").unwrap();
    let sentence = "bad.csv, line 3, curve a, point 1: \"bounce\" is no easing: give linear, ease, ease-in";
    refuse("bad.csv -o a.csv --ease ease --every 1", sentence);
    fs::write(folder.path().join("bad.frames"), "[]").unwrap();
    refuse("bad.frames -o a.csv", "frames are written and not read");
}
