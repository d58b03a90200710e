//! Coordinates, straight from the text into flat vectors.

use std::fmt;
use std::ops::Range;

use crate::io::memory::{Full, Room};
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, SeqAccess, Visitor};

/// Flat coordinates of lines, as they are read.
pub(super) struct Lines<'a> {
    room: &'a Room,
    /// Why there is no room for more.
    pub full: Option<Full>,
    pub xy: Vec<f64>,
    z: Vec<f64>,
    pub offsets: Vec<usize>,
    /// Numbers of lines in each innermost list of lines of the current geometry.
    pub counts: Vec<usize>,
    /// The first position of each line that lacks a number, by its place among all positions.
    pub lacking: Vec<usize>,
    /// Whether some position has an altitude.
    has_z: bool,
}

impl<'a> Lines<'a> {
    pub fn new(room: &'a Room) -> Self {
        Lines {
            room,
            full: None,
            xy: Vec::new(),
            z: Vec::new(),
            offsets: vec![0],
            counts: Vec::new(),
            lacking: Vec::new(),
            has_z: false,
        }
    }

    /// Adds a position that lacks a number.
    fn lack<E: serde::de::Error>(&mut self, xy: [f64; 2]) -> std::result::Result<(), E> {
        self.grow()?;
        let point = self.xy.len() / 2;
        if self.lacking.last().is_none_or(|&last| last < self.offsets[self.offsets.len() - 1]) {
            self.lacking.push(point);
        }
        self.xy.extend(xy);
        Ok(())
    }

    /// Makes room for a position and a line.
    fn grow<E: serde::de::Error>(&mut self) -> std::result::Result<(), E> {
        let room = self.room;
        let lower = (self.xy.len() / 2 + 1).saturating_sub(self.z.len());
        let z = if self.has_z { room.grow(&mut self.z, lower) } else { Ok(()) };
        let grown = z
            .and_then(|()| room.grow(&mut self.xy, 2))
            .and_then(|()| room.grow(&mut self.offsets, 1))
            .and_then(|()| room.grow(&mut self.counts, 1));
        grown.map_err(|full| {
            self.full = Some(full);
            E::custom(full)
        })
    }

    /// The entries of `xy` that line `i` owns.
    pub fn range(&self, i: usize) -> Range<usize> {
        2 * self.offsets[i]..2 * self.offsets[i + 1]
    }

    /// The line of a position, counted among all, and its number there.
    pub fn locate(&self, point: usize) -> (usize, usize) {
        let i = self.offsets.partition_point(|&offset| offset <= point) - 1;
        (i, point - self.offsets[i])
    }

    /// The dimension, the coordinates, and the lines none of whose positions has an altitude, which
    /// become 0. Other altitudes that are missing are NaN.
    pub fn interleave(&mut self, drop_z: bool) -> (usize, Vec<f64>, Vec<usize>) {
        let xy = std::mem::take(&mut self.xy);
        if drop_z || !self.has_z {
            return (2, xy, vec![]);
        }
        self.z.resize(xy.len() / 2, f64::NAN);
        let mut flat = Vec::new();
        for i in 0..self.offsets.len() - 1 {
            let z = &mut self.z[self.offsets[i]..self.offsets[i + 1]];
            if !z.is_empty() && z.iter().all(|z| z.is_nan()) {
                z.fill(0.0);
                flat.push(i);
            }
        }
        let coords = xy.chunks_exact(2).zip(&self.z).flat_map(|(xy, z)| [xy[0], xy[1], *z]).collect();
        (3, coords, flat)
    }
}

/// Lists of lines. `depth` 1 is one line, a list of positions.
pub(super) struct List<'l, 'a> {
    pub depth: usize,
    pub lines: &'l mut Lines<'a>,
}

impl<'de> DeserializeSeed<'de> for List<'_, '_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> std::result::Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for List<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(["a position", "a list of positions", "a list of lines", "a list of polygons"][self.depth])
    }

    /// A list that is null has no entries.
    fn visit_unit<E: serde::de::Error>(self) -> std::result::Result<(), E> {
        let List { depth, lines } = self;
        lines.grow()?;
        match depth {
            1 => lines.offsets.push(lines.xy.len() / 2),
            2 => lines.counts.push(0),
            _ => {}
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> std::result::Result<(), A::Error> {
        let List { depth, lines } = self;
        if depth == 1 {
            while list.next_element_seed(Position(lines))?.is_some() {}
            lines.grow()?;
            lines.offsets.push(lines.xy.len() / 2);
            return Ok(());
        }
        let mut count = 0;
        while list.next_element_seed(List { depth: depth - 1, lines })?.is_some() {
            count += 1;
        }
        if depth == 2 {
            lines.grow()?;
            lines.counts.push(count);
        }
        Ok(())
    }
}

/// A position: two numbers, and perhaps an altitude.
///
/// Further numbers are skipped, as RFC 7946 allows.
///
/// A position that is null, or lacks a number, makes its line invalid.
struct Position<'l, 'a>(&'l mut Lines<'a>);

impl<'de> DeserializeSeed<'de> for Position<'_, '_> {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> std::result::Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Position<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a position of two or three numbers")
    }

    fn visit_unit<E>(self) -> std::result::Result<(), E>
    where
        E: serde::de::Error,
    {
        self.0.lack([f64::NAN; 2])
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> std::result::Result<(), A::Error> {
        let Position(lines) = self;
        // Null, or nothing.
        let [x, y] = [list.next_element::<Option<f64>>()?.flatten(), list.next_element::<Option<f64>>()?.flatten()];
        let (Some(x), Some(y)) = (x, y) else {
            while list.next_element::<IgnoredAny>()?.is_some() {}
            return lines.lack([x, y].map(|x| x.unwrap_or(f64::NAN)));
        };
        lines.grow()?;
        match list.next_element::<Option<f64>>()? {
            Some(Some(z)) => {
                // Positions that lack a number have no altitude.
                lines.z.resize(lines.xy.len() / 2, f64::NAN);
                lines.xy.extend([x, y]);
                lines.z.push(z);
                lines.has_z = true;
            }
            Some(None) => lines.lack([x, y])?,
            None => {
                lines.xy.extend([x, y]);
                return Ok(());
            }
        }
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(())
    }
}
