//! Triangle meshes: OBJ (Wavefront, Object Files, version 3.0), the lines `v` and `f`.
//!
//! (Errors of `tobj` name neither line nor value.)

use std::io::{self, Read};
use std::path::Path;

use super::extension_of;
use super::source::{Source, read_line};
use crate::error::{Error, Result, quoted};
use crate::surface::Mesh;

/// Reads a mesh from an OBJ file, or from standard input for `-`.
///
/// Of a vertex, `v x y z` are read. A face `f` has vertex numbers from 1 on, or from −1 back from
/// the last vertex before it. What follows a slash is skipped. Faces of more than three vertices
/// are cut into triangles that share the first. Other lines are skipped.
///
/// ```
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("square.obj");
/// std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
/// let mesh = faircurve::io::read_mesh(&path)?;
/// # use faircurve::surface::Surface;
/// assert_eq!(mesh.name(), "the mesh of 4 vertices and 2 triangles");
/// # Ok::<(), faircurve::Error>(())
/// ```
///
/// # Errors
/// A file that cannot be read or is not OBJ. A coordinate that is not a number, a face of fewer
/// than three vertices or of a missing one, each with its line. The errors of [`Mesh::new`].
pub fn read_mesh(path: impl AsRef<Path>) -> Result<Mesh> {
    let path = path.as_ref();
    let is_obj = extension_of(path).is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    if !is_obj && path != Path::new("-") {
        return Err(Error::Argument(format!(
            "the mesh {} is no OBJ file: give one that ends in .obj or .obj.gz",
            path.display()
        )));
    }
    mesh_of(&mut Source::open(path)?)
}

/// Reads a mesh from the bytes of an OBJ file.
///
/// # Errors
/// As [`read_mesh`].
pub fn read_mesh_from(reader: impl Read) -> Result<Mesh> {
    mesh_of(&mut Source::of_reader(reader)?)
}

fn mesh_of(source: &mut Source) -> Result<Mesh> {
    let mut reader = std::mem::replace(&mut source.reader, Box::new(io::empty()));
    let mut raw = Raw { source, vertices: vec![], triangles: vec![], lines: vec![] };
    let (mut bytes, mut line) = (Vec::new(), 0);
    loop {
        bytes.clear();
        if read_line(&mut reader, &raw.source.room, &mut bytes, u64::MAX).map_err(|error| raw.source.failed(error))?
            == 0
        {
            break;
        }
        line += 1;
        // Words are ASCII. Names and comments may be in any encoding.
        let text = String::from_utf8_lossy(&bytes);
        let mut words = text.split('#').next().unwrap_or_default().split_ascii_whitespace();
        match words.next() {
            Some("v") => raw.vertex(line, words)?,
            Some("f") => raw.face(line, words)?,
            _ => {}
        }
    }
    raw.mesh()
}

/// What has been read.
struct Raw<'s, 'a> {
    source: &'s Source<'a>,
    vertices: Vec<[f64; 3]>,
    /// Vertices counted from 0.
    triangles: Vec<[usize; 3]>,
    /// The line of each triangle.
    lines: Vec<u64>,
}

impl Raw<'_, '_> {
    fn vertex<'w>(&mut self, line: u64, mut words: impl Iterator<Item = &'w str>) -> Result<()> {
        let mut place = [0.0; 3];
        for (x, axis) in place.iter_mut().zip(["x", "y", "z"]) {
            let Some(word) = words.next() else {
                return Err(self.source.error(line, format!("the vertex has no {axis}: write v x y z")));
            };
            *x = match word.parse() {
                Ok(x) if f64::is_finite(x) => x,
                _ => {
                    let found = quoted(word);
                    return Err(self
                        .source
                        .error(line, format!("{axis} of the vertex is {found}: give a finite number")));
                }
            };
        }
        self.source.push(&mut self.vertices, place)
    }

    fn face<'w>(&mut self, line: u64, words: impl Iterator<Item = &'w str>) -> Result<()> {
        let (mut corners, mut count) = ([0; 3], 0);
        for word in words {
            let own = self.number(line, word)?;
            count += 1;
            if count <= 3 {
                corners[count - 1] = own;
            } else {
                corners = [corners[0], corners[2], own];
            }
            if count >= 3 {
                self.source.push(&mut self.triangles, corners)?;
                self.source.push(&mut self.lines, line)?;
            }
        }
        match count {
            3.. => Ok(()),
            _ => Err(self.source.error(line, format!("the face has {count} vertices: give three or more"))),
        }
    }

    /// The vertex of a word such as 7, 7/2, 7//3 or −1, counted from 0.
    fn number(&self, line: u64, word: &str) -> Result<usize> {
        let first = word.split('/').next().unwrap_or_default();
        let wrong =
            |why: &str| Err(self.source.error(line, format!("the face has the vertex {}: {why}", quoted(word))));
        match first.parse::<i64>() {
            Ok(0) => wrong("count from 1"),
            Ok(number) if number > 0 => Ok(number as usize - 1),
            Ok(number) => match self.vertices.len().checked_sub(number.unsigned_abs() as usize) {
                Some(own) => Ok(own),
                None => wrong(&format!("{} vertices stand before it", self.vertices.len())),
            },
            Err(_) => wrong("give a whole number"),
        }
    }

    fn mesh(self) -> Result<Mesh> {
        let count = self.vertices.len();
        if self.triangles.is_empty() {
            return Err(self.source.error(None, format!("no face was found among {count} vertices: write f 1 2 3")));
        }
        for (triangle, &line) in self.triangles.iter().zip(&self.lines) {
            if let Some(beyond) = triangle.iter().find(|&&own| own >= count) {
                return Err(self.source.error(
                    line,
                    format!("the face has the vertex {}, and the file has {count} vertices: give them all", beyond + 1),
                ));
            }
        }
        // What a mesh keeps of a vertex and of its two triangles.
        self.source.take(count.saturating_mul(MESH_BYTES))?;
        Mesh::new(&self.vertices, &self.triangles).map_err(|error| match error {
            Error::Argument(why) => self.source.error(None, why),
            error => error,
        })
    }
}

/// Bytes of a mesh per vertex while it is made: its patch, boxes and sides.
const MESH_BYTES: usize = 1400;
