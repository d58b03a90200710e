//! Triangle meshes from OBJ files.

use std::io::Write;

use faircurve::Result;
use faircurve::io::{read_mesh, read_mesh_from};
use faircurve::surface::{Mesh, Surface};

fn read(text: &str) -> Result<Mesh> {
    read_mesh_from(text.as_bytes())
}

/// A square of 3 × 3 vertices.
const GRID: &str = "# A comment, f 1 2\no näme\nv 0 0 0 1\nv 1 0 0\nv 2 0 0 0.1 0.2 0.3\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 0 2 0\nv 1 2 0\r\nv 2e0 2 0\nvn 0 0 1\nvt 0 0\n";

#[test]
fn faces_of_every_form_are_read() {
    let faces =
        "s off\nf 1/1/1 2/1/1 5/1/1 4/1/1 # square\nf 2//1 3//1 6//1 5//1\nf 4 5 8 7\nf -5 -4 -1\nf -5/1 -1/1 -2/1\n";
    let mesh = read(&format!("{GRID}{faces}")).unwrap();
    assert_eq!(mesh.name(), "the mesh of 9 vertices and 8 triangles");
    let at = |x, y| glam::DVec3::new(x, y, 0.0);
    assert_eq!(mesh.undefined(at(0.3, 0.2)), None);
    assert!(mesh.undefined(at(2.4, 0.2)).is_some());
    // Faces may come before their vertices.
    assert!(read(&format!("f 1 2 5\n{GRID}")).is_ok());
}

#[test]
fn what_is_wrong_in_a_file_has_its_line() {
    for (text, what) in [
        ("v 0 0\n", "input, line 1: the vertex has no z: write v x y z"),
        ("v 0 0 0\nv 0 0,5 0\n", "input, line 2: y of the vertex is \"0,5\": give a finite number"),
        ("v 0 nan 0\n", "y of the vertex is \"nan\""),
        ("f 1 2\n", "input, line 1: the face has 2 vertices: give three or more"),
        ("f 1 2 0\n", "input, line 1: the face has the vertex \"0\": count from 1"),
        ("v 0 0 0\nf -1 -2 1\n", "input, line 2: the face has the vertex \"-2\": 1 vertices stand before it"),
        ("f 1 /2 3\n", "the face has the vertex \"/2\": give a whole number"),
        ("\nv 0 0 0\nf 1 2 3\n", "input, line 3: the face has the vertex 2, and the file has 1 vertices"),
        ("v 0 0 0\n", "input: no face was found among 1 vertices: write f 1 2 3"),
        ("", "input: no face was found among 0 vertices"),
        ("v 0 0 0\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", "input: all 1 triangles of the mesh have two vertices at one place"),
    ] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
    let error = read_mesh("bunny.ply").unwrap_err().to_string();
    assert_eq!(error, "the mesh bunny.ply is no OBJ file: give one that ends in .obj or .obj.gz");
    assert!(read_mesh("no such.obj").unwrap_err().to_string().contains("cannot read no such.obj"));
}

#[test]
fn packed_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.obj.gz");
    let mut out = flate2::write::GzEncoder::new(std::fs::File::create(&path).unwrap(), Default::default());
    out.write_all(format!("{GRID}f 1 2 5\nf 1 5 4\n").as_bytes()).unwrap();
    out.finish().unwrap();
    assert_eq!(read_mesh(&path).unwrap().name(), "the mesh of 4 vertices and 2 triangles");
}
