//! Cutting curves into pieces.
//!
//! Pieces are fitted as curves of their own. Their messages still name the points of the whole
//! curve.

use std::sync::Arc;

use super::CurveBatch;
use crate::batch::Origin;
use crate::constraint::gather_rows;

/// Consecutive points of a curve, past the end of a closed one if need be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// The curve that the piece is cut from.
    pub curve: usize,
    /// The piece's first point in that curve.
    pub first: usize,
    /// Number of the piece's points.
    ///
    /// A closed curve that is cut open at one point has that point first and last. It then has one
    /// point more than the curve.
    pub count: usize,
    /// Whether the piece is all of a closed curve, still closed.
    pub closed: bool,
}

/// What pieces were cut from, for the places in messages.
#[derive(Clone, Debug)]
pub(crate) struct Cut {
    whole: Arc<Origin>,
    pieces: Vec<Piece>,
    /// For every piece the number of points of its curve.
    counts: Vec<usize>,
}

impl Cut {
    /// The origin, curve and point that correspond to point `k` of piece `i`.
    pub fn given(&self, i: usize, k: usize) -> (&Origin, usize, usize) {
        let piece = self.pieces[i];
        (&self.whole, piece.curve, (piece.first + k) % self.counts[i].max(1))
    }
}

impl CurveBatch {
    /// The pieces as a batch, with their weights and constraints, and the problems of their curves.
    ///
    /// The batch has no parameters.
    pub(crate) fn cut(&self, pieces: Vec<Piece>) -> CurveBatch {
        // Taken apart by name, so that a new column cannot be forgotten.
        let CurveBatch {
            dimension,
            coords,
            offsets,
            closed: _,
            parameters: _,
            closing_spans: _,
            weights,
            constraints,
            problems,
            origin,
        } = self;
        let mut ends = vec![0];
        pieces.iter().for_each(|piece| ends.push(ends[ends.len() - 1] + piece.count));
        let points: Vec<usize> = pieces
            .iter()
            .flat_map(|piece| {
                let (start, count) = (offsets[piece.curve], self.count(piece.curve).max(1));
                (0..piece.count).map(move |k| start + (piece.first + k) % count)
            })
            .collect();
        let problem = |(to, piece): (usize, &Piece)| Some((to, problems.get(&piece.curve)?.clone()));
        let names = pieces.iter().map(|piece| self.name(piece.curve).into_owned()).collect();
        CurveBatch {
            dimension: *dimension,
            coords: points.iter().flat_map(|&k| &coords[k * dimension..(k + 1) * dimension]).copied().collect(),
            offsets: ends,
            closed: pieces.iter().map(|piece| piece.closed).collect(),
            parameters: None,
            closing_spans: None,
            weights: gather_rows(weights, 1, &points),
            constraints: constraints.gather(*dimension, &points),
            problems: pieces.iter().enumerate().filter_map(problem).collect(),
            origin: Arc::new(Origin {
                names: Some(names),
                cut: Some(Cut {
                    whole: origin.clone(),
                    counts: pieces.iter().map(|piece| self.count(piece.curve)).collect(),
                    pieces,
                }),
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
