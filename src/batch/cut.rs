//! Curves made of other curves' points: pieces, and joined pieces.
//!
//! Their messages name the original points.

use std::iter;
use std::ops::Range;
use std::sync::Arc;

use super::{CurveBatch, Cut, Origin};
use crate::constraint::{Constraints, gather_rows, rows_of};
use crate::ragged;
use crate::sort;

/// Consecutive points of a curve. They may pass the end of a closed one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// The original curve.
    pub curve: usize,
    /// The piece's first point in that curve.
    pub first: usize,
    /// Number of the piece's points.
    ///
    /// A closed curve that is cut at one point has that point first and last.
    pub count: usize,
    /// Whether the piece is a whole closed curve.
    pub closed: bool,
}

/// Curves made of other curves' points.
pub(crate) struct Traced {
    pub coords: Vec<f64>,
    pub offsets: Vec<usize>,
    pub closed: Vec<bool>,
    pub constraints: Constraints,
    /// The original curve at the start of every curve.
    pub curves: Vec<u32>,
    /// The original curve and point of every point.
    pub points: Vec<(u32, u32)>,
}

impl CurveBatch {
    /// Curves of this batch's points. A curve has the name of the original curve at its start, and
    /// the first problem of this and of its points' curves.
    pub(crate) fn traced(&self, traced: Traced) -> CurveBatch {
        let Traced { coords, offsets, closed, constraints, curves: firsts, points } = traced;
        let of =
            |i: usize| iter::once(firsts[i]).chain(points[offsets[i]..offsets[i + 1]].iter().map(|&(curve, _)| curve));
        let problem = |i: usize| Some((i, of(i).find_map(|curve| self.problem(curve as usize))?.clone()));
        let curves = 0..closed.len();
        let problems = sort::map(curves.filter_map(problem));
        let origin = Arc::new(Origin {
            names: Some(firsts.iter().map(|&curve| self.name(curve as usize).into_owned()).collect()),
            cut: Some(Cut { whole: self.origin.clone(), offsets: offsets.clone(), curves: firsts, points }),
            geographic: self.origin.geographic,
            ..Origin::default()
        });
        let bare = CurveBatch::bare(self.dimension, coords, offsets, closed, origin);
        CurveBatch { problems, constraints, ..bare }
    }

    /// Divides curves into consecutive ranges of their points.
    ///
    /// The parts of a divided curve have its name and a number.
    pub(crate) fn parted(&self, parts: &[(usize, Range<usize>)]) -> CurveBatch {
        let offsets = ragged::offsets(parts.iter().map(|(_, range)| range.len()));
        let is_whole = |(i, range): &(usize, Range<usize>)| range.len() == self.count(*i);
        let mut number = 0;
        let names = parts.iter().enumerate().map(|(k, part)| {
            number = if k > 0 && parts[k - 1].0 == part.0 { number + 1 } else { 1 };
            let name = self.name(part.0);
            if is_whole(part) { name.into_owned() } else { format!("{name}.{number}") }
        });
        let lines =
            |lines: &Vec<Option<u64>>| parts.iter().map(|(i, range)| Some(lines[*i]? + range.start as u64)).collect();
        let whole = &self.origin;
        let origin = Origin {
            file: whole.file.clone(),
            first_lines: whole.first_lines.as_ref().map(lines),
            geographic: whole.geographic,
            timed: whole.timed,
            notes: whole.notes.clone(),
            document: whole.document.clone(),
            clock: whole.clock,
            clocks: whole.clocks.as_ref().map(|clocks| parts.iter().map(|(i, _)| clocks[*i]).collect()),
            within_half_turn: whole.within_half_turn,
            unwrapped: (0..parts.len()).filter(|&k| whole.unwrapped.contains(&parts[k].0)).collect(),
            untimed: (0..parts.len()).filter(|&k| whole.untimed.contains(&parts[k].0)).collect(),
            names: Some(names.collect()),
            ..Origin::default()
        };
        let problem = |(k, part): (usize, &(usize, Range<usize>))| Some((k, self.problems.get(&part.0)?.clone()));
        CurveBatch {
            offsets,
            closed: parts.iter().map(|(i, _)| self.closed[*i]).collect(),
            closing_spans: self.closing_spans.as_ref().map(|spans| parts.iter().map(|(i, _)| spans[*i]).collect()),
            problems: sort::map(parts.iter().enumerate().filter_map(problem)),
            origin: Arc::new(origin),
            ..self.clone()
        }
    }

    /// The pieces as a batch, with weights, constraints and problems, but without parameters and
    /// columns.
    pub(crate) fn cut(&self, pieces: Vec<Piece>) -> CurveBatch {
        // Destructured by name, so that a new column cannot be forgotten.
        let CurveBatch {
            dimension,
            coords,
            offsets,
            closed: _,
            parameters: _,
            closing_spans: _,
            weights,
            constraints,
            columns: _,
            problems,
            origin,
        } = self;
        let mut ends = vec![0];
        for piece in &pieces {
            ends.push(ends[ends.len() - 1] + piece.count);
        }
        let points: Vec<usize> = pieces
            .iter()
            .flat_map(|piece| {
                let (start, count) = (offsets[piece.curve], self.count(piece.curve).max(1));
                (0..piece.count).map(move |k| start + (piece.first + k) % count)
            })
            .collect();
        let given = |piece: &Piece| {
            let (first, all) = (piece.first, self.count(piece.curve).max(1));
            let curve = piece.curve as u32;
            (0..piece.count).map(move |k| (curve, ((first + k) % all) as u32))
        };
        let problem = |(to, piece): (usize, &Piece)| Some((to, problems.get(&piece.curve)?.clone()));
        let names = pieces.iter().map(|piece| self.name(piece.curve).into_owned()).collect();
        CurveBatch {
            dimension: *dimension,
            coords: Arc::new(rows_of(coords, *dimension, &points).into()),
            offsets: ends.clone(),
            closed: pieces.iter().map(|piece| piece.closed).collect(),
            parameters: None,
            closing_spans: None,
            weights: gather_rows(weights, 1, &points),
            constraints: constraints.gather(*dimension, &points),
            columns: Vec::new(),
            problems: sort::map(pieces.iter().enumerate().filter_map(problem)),
            origin: Arc::new(Origin {
                names: Some(names),
                cut: Some(Cut {
                    whole: origin.clone(),
                    curves: pieces.iter().map(|piece| piece.curve as u32).collect(),
                    points: pieces.iter().flat_map(given).collect(),
                    offsets: ends.clone(),
                }),
                geographic: origin.geographic,
                ..Origin::default()
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Constraints;

    #[test]
    fn sentences_about_pieces_name_the_points_of_the_whole() {
        let ring = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let batch = CurveBatch::from_slices(&[&ring[..], &ring[..]]).unwrap().closed(true);
        let batch = batch.with_names(vec!["a".into(), "b".into()]).unwrap();
        let pieces = vec![
            Piece { curve: 1, first: 3, count: 3, closed: false },
            Piece { curve: 1, first: 1, count: 3, closed: false },
            Piece { curve: 0, first: 0, count: 4, closed: true },
        ];
        let batch = batch.with_weights((0..8).map(|k| 1.0 + f64::from(k)).collect()).unwrap();
        let constraints = Constraints {
            exponents: Some((0..8).map(f64::from).collect()),
            known: Some((0..8).map(|k| k % 3 == 0).collect()),
            ..Constraints::default()
        };
        let cut = batch.with_constraints(constraints).unwrap().cut(pieces);
        let columns = cut.constraints();
        assert_eq!(columns.exponents.as_ref().unwrap()[..6], [7.0, 4.0, 5.0, 5.0, 6.0, 7.0]);
        assert_eq!(columns.known.as_ref().unwrap()[..6], [false, false, false, false, true, false]);
        assert_eq!(cut.points(0), [0.0, 2.0, 0.0, 0.0, 2.0, 0.0]);
        assert_eq!((cut.weights(0), cut.weights(1)), (Some(&[8.0, 5.0, 6.0][..]), Some(&[6.0, 7.0, 8.0][..])));
        assert_eq!(cut.sentence(0, 2, "so"), "curve b, point 1: so");
        assert_eq!(cut.sentence(1, 2, "so"), "curve b, point 3: so");
        assert_eq!(cut.sentence(2, 0, "so"), "curve a, point 0: so");
        assert_eq!([0, 1, 2].map(|i| cut.is_closed(i)), [false, false, true]);
    }
}
