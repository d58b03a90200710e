//! Arguments of the program.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use arbitrary::Unstructured;

/// Files that runs read: every format, and one that is not there.
const FILES: [(&str, &str); 6] = [
    (
        "curves.csv",
        "curve,x,y,t,weight\na,0,0,0,1\na,1,2,1,1\na,3,1,2,2\nb,0,5,0,1\nb,2,6,3,1\nb,3,4,4,1\nb,0,5,9,1\np,1,1,0,1\n",
    ),
    ("spatial.csv", "curve,x,y,z,tx,ty,tz\na,0,0,0,,,\na,1,2,1,1,0,0\na,3,1,2,,,\n"),
    ("controls.csv", "curve,x,y,known\na,0,0,1\na,,,0\na,,,0\na,3,1,1\n"),
    ("grid.csv", "0,1,2\n1,3,1\n2,0,0\n"),
    (
        "borders.geojson",
        r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"n":1},"geometry":{"type":"Polygon","coordinates":[[[0,0],[2,0],[2,1],[0,1],[0,0]]]}},{"type":"Feature","properties":null,"geometry":{"type":"LineString","coordinates":[[5,5],[6,7],[8,6]]}}]}"#,
    ),
    (
        "drawing.svg",
        r#"<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0C1 1 2 1 3 0S5 -1 6 0"/><polygon points="0,0 2,0 1,2"/></svg>"#,
    ),
];

/// Options that take a value, with values that may make sense.
const OPTIONS: [(&str, &[&str]); 37] = [
    ("--method", &["natural", "smoothing", "fair", "scf", "geodesic"]),
    (
        "--surface",
        &["sphere", "wgs84", "sphere:3", "ellipsoid:3,2,1", "torus:2,1", "cone:90", "ball", "grid:in.csv,2,-3"],
    ),
    ("--radius", &["1", "0", "1e300"]),
    ("--off-surface", &["1e9", "0", "-1"]),
    ("--parametrisation", &["auto", "chord", "centripetal", "uniform", "given"]),
    ("--samples", &["1", "2", "16", "100000000000"]),
    ("--spacing", &["0.1", "1", "10", "1e-9", "1e-300", "5e-324"]),
    ("--smoothing", &["0", "0.1", "1e300"]),
    ("--deviation", &["0.01", "0.5", "100", "1e-300"]),
    ("--tube", &["0.01", "0.5", "100", "1e-300"]),
    ("--pin", &["ends", "none"]),
    ("--max-curvature", &["0.5", "1e-3", "1e300", "-1"]),
    ("--min-radius", &["0.5", "1e3", "0"]),
    ("--corners", &["60deg", "0", "180"]),
    (
        "--energy",
        &[
            "bending=1",
            "bending=1,length=0.1",
            "variation=1,length=1",
            "torsion=1",
            "bending=1,attachment=2",
            "geodesic_bending=1,length=2",
        ],
    ),
    ("--exponent", &["2", "1", "1.5", "40", "1e300"]),
    ("--solver", &["newton", "cg", "descent"]),
    ("--tension", &["0", "1", "3", "50", "-1", "1e9"]),
    ("--starts", &["1", "3", "4294967295"]),
    ("--max-iterations", &["0", "5"]),
    ("--tolerance", &["1e-3", "1e-300", "1e300"]),
    ("--as", &["polyline", "bezier"]),
    ("--columns", &["weight=", "x=y,y=x", "t="]),
    ("--closed", &["auto", "yes", "no"]),
    ("--from", &["csv", "geojson", "svg", "npz"]),
    ("--to", &["csv", "geojson", "svg", "npz", "obj"]),
    ("--comb", &["1", "1e9"]),
    ("--known", &["file", "joints", "ends"]),
    ("--degree", &["1", "3", "30", "31"]),
    ("--joints", &["free", "c1", "c2", "g1"]),
    ("--lengths", &["chords", "equal"]),
    ("--tangents", &["derivatives", "directions"]),
    ("--elevate", &["1", "29"]),
    ("--reduce", &["1", "2"]),
    ("--rounds", &["1", "4", "30"]),
    ("--rule", &["exact", "sparse"]),
    ("--support", &["3", "5", "4"]),
];

const FLAGS: [&str; 7] = ["--force", "-q", "-v", "--strict", "--linear", "--help", "--no-crossing"];

const OUTPUTS: [&str; 6] = ["out.csv", "out.geojson", "out.svg", "out.npz", "out.obj", "out.csv.gz"];

/// Arguments of a run, the program's name among them; the files that it may read stand in `folder`,
/// and only there it may write. Always on the CPU: to open a GPU takes longer than the run. `None`
/// where the bytes are used up.
pub fn arguments(data: &[u8], folder: &Path) -> Option<Vec<OsString>> {
    for (name, text) in FILES {
        let path = folder.join(name);
        if !path.exists() {
            fs::write(path, text).ok()?;
        }
    }
    let mut bytes = Unstructured::new(data);
    let command = *bytes.choose(&["fit", "fit", "fit", "bezier", "grid", "compare"]).ok()?;
    let input = bytes.choose(&FILES).ok()?.0;
    let mut arguments: Vec<String> = [command, input, "--device", "cpu"].map(String::from).to_vec();
    arguments.insert(0, "faircurve".into());
    if command != "compare" {
        arguments.extend(["-o".into(), bytes.choose(&OUTPUTS).ok()?.to_string(), "--force".into()]);
        if bytes.ratio(1, 4).ok()? {
            arguments.extend(["--picture", "picture.svg"].map(String::from));
        }
    }
    if bytes.ratio(1, 4).ok()? {
        arguments.extend(["--report", "report.json"].map(String::from));
    }
    for _ in 0..bytes.int_in_range(0..=6).ok()? {
        if bytes.ratio(1, 5).ok()? {
            arguments.push(bytes.choose(&FLAGS).ok()?.to_string());
            continue;
        }
        let (option, values) = bytes.choose(&OPTIONS).ok()?;
        let value = match bytes.ratio(3, 4).ok()? {
            true => bytes.choose(values).ok()?.to_string(),
            false => bytes.arbitrary::<&str>().ok()?.chars().filter(|c| *c != '\0').collect(),
        };
        arguments.push(format!("{option}={value}"));
    }
    Some(arguments.into_iter().map(OsString::from).collect())
}
