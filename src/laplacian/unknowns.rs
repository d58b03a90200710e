//! The entries of sparse masks and their numbering.
//!
//! The linear programme of the papers' crate finds these entries, and the tables hold them. The names are for that crate and
//! promise nothing.

/// The three classes of rows of E₂ₙS − UEₙ.
///
/// A class determines its masks, given the masks of the previous classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Rows with interior masks only.
    Interior,
    /// Rows with a border mask and no corner mask.
    Border,
    /// Rows with a corner mask.
    Corner,
}

impl Class {
    /// All three, in the order of solution.
    pub const ALL: [Class; 3] = [Class::Interior, Class::Border, Class::Corner];
}

/// An entry of a mask: the weight of a coarse point in a fine one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// For fine points `far` and `near` away along the two axes, near ≤ far, from coarse points far
    /// from all borders.
    Interior {
        /// The greater distance, in fine steps.
        far: usize,
        /// The smaller distance. 0 for curves.
        near: usize,
    },
    /// For coarse points `row` away from a border.
    Border {
        /// The coarse point's distance from the border, in coarse steps.
        row: usize,
        /// The fine point's distance from the border, in fine steps.
        from_border: usize,
        /// The fine point's distance from the coarse one along the border, in fine steps.
        along: usize,
    },
    /// For coarse points near two borders. The entry with both axes exchanged is the same.
    Corner {
        /// The coarse point's distances from the two borders, in coarse steps.
        rows: [usize; 2],
        /// The fine point's distances from the two borders, in fine steps.
        from_borders: [usize; 2],
    },
}

/// The numbering of unknowns: interior, border, corner.
///
/// A *line* is a pair of distances from a border: of a coarse point (row) and of a fine point in
/// its window. Lines are numbered row by row. A border entry is a line and a distance along the
/// border. A corner entry is two lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknowns {
    /// 1 for curves, 2 for grids.
    pub dimension: usize,
    /// The distance that masks reach, in fine steps.
    pub radius: usize,
    /// Rows of coarse points with border masks.
    pub own_rows: usize,
}

/// The number of a pair among all pairs whose second entry is at most the first.
fn triangular([first, second]: [usize; 2]) -> usize {
    let (large, small) = (first.max(second), first.min(second));
    large * (large + 1) / 2 + small
}

impl Unknowns {
    /// The unknowns of masks of this radius.
    pub fn new(dimension: usize, radius: usize, own_rows: usize) -> Self {
        Unknowns { dimension, radius, own_rows }
    }

    /// The default number of rows of coarse points with border masks, radius / 2 + 1: all rows
    /// whose window of fine points meets the border.
    pub fn usual_own_rows(radius: usize) -> usize {
        radius / 2 + 1
    }

    /// Number of unknowns of a class and the previous ones.
    pub fn count_to(&self, class: Class) -> usize {
        let along = if self.dimension == 1 { 1 } else { self.radius + 1 };
        let lines = self.first_line(self.own_rows);
        let interior = if self.dimension == 1 { self.radius + 1 } else { triangular([self.radius + 1, 0]) };
        match (class, self.dimension) {
            (Class::Interior, _) => interior,
            (Class::Border, _) | (Class::Corner, 1) => interior + lines * along,
            (Class::Corner, _) => interior + lines * along + triangular([lines, 0]),
        }
    }

    /// Number of lines of the rows before this.
    fn first_line(&self, row: usize) -> usize {
        (0..row).map(|k| 2 * k + self.radius + 1 - self.nearest(k)).sum()
    }

    /// The fine distance from the border at which the window of a row begins.
    fn nearest(&self, row: usize) -> usize {
        (2 * row).saturating_sub(self.radius)
    }

    fn line(&self, row: usize, from_border: usize) -> usize {
        self.first_line(row) + from_border - self.nearest(row)
    }

    fn number(&self, unknown: Unknown) -> usize {
        match unknown {
            Unknown::Interior { far, .. } if self.dimension == 1 => far,
            Unknown::Interior { far, near } => triangular([far, near]),
            Unknown::Border { row, from_border, along } => {
                let width = if self.dimension == 1 { 1 } else { self.radius + 1 };
                self.count_to(Class::Interior) + self.line(row, from_border) * width + along
            }
            Unknown::Corner { rows, from_borders } => {
                let lines = [0, 1].map(|axis| self.line(rows[axis], from_borders[axis]));
                self.count_to(Class::Border) + triangular(lines)
            }
        }
    }

    /// The number of the entry of S for a fine and a coarse point. `None` if the entry is 0.
    ///
    /// Along an axis with a border, points are counted from it.
    pub fn entry(&self, fine: [isize; 2], coarse: [isize; 2], borders: [bool; 2]) -> Option<usize> {
        let distances = [0, 1].map(|axis| fine[axis].abs_diff(2 * coarse[axis]));
        if distances.iter().any(|&distance| distance > self.radius) {
            return None;
        }
        let near = |axis: usize| {
            let row = usize::try_from(coarse[axis]).ok().filter(|&row| borders[axis] && row < self.own_rows)?;
            Some((row, usize::try_from(fine[axis]).ok()?))
        };
        let unknown = match [near(0), near(1)] {
            [None, None] => {
                let [first, second] = distances;
                Unknown::Interior { far: first.max(second), near: first.min(second) }
            }
            [Some((row, from_border)), None] => Unknown::Border { row, from_border, along: distances[1] },
            [None, Some((row, from_border))] => Unknown::Border { row, from_border, along: distances[0] },
            [Some(first), Some(second)] => {
                Unknown::Corner { rows: [first.0, second.0], from_borders: [first.1, second.1] }
            }
        };
        Some(self.number(unknown))
    }

    /// The unknowns of a class, in the order of their numbers.
    pub fn of_class(&self, class: Class) -> Vec<Unknown> {
        let lines: Vec<(usize, usize)> = (0..self.own_rows)
            .flat_map(|row| (self.nearest(row)..=2 * row + self.radius).map(move |from_border| (row, from_border)))
            .collect();
        let flat = self.dimension == 1;
        match class {
            Class::Interior => {
                let far = 0..=self.radius;
                far.flat_map(|far| (0..=if flat { 0 } else { far }).map(move |near| Unknown::Interior { far, near }))
                    .collect()
            }
            Class::Border => {
                let width = if flat { 0 } else { self.radius };
                let on_line = |&(row, from_border): &(usize, usize)| {
                    (0..=width).map(move |along| Unknown::Border { row, from_border, along })
                };
                lines.iter().flat_map(on_line).collect()
            }
            Class::Corner if flat => Vec::new(),
            Class::Corner => {
                let pairs = (0..lines.len()).flat_map(|first| (0..=first).map(move |second| (first, second)));
                pairs
                    .map(|(first, second)| {
                        let [first, second] = [lines[first], lines[second]];
                        Unknown::Corner { rows: [first.0, second.0], from_borders: [first.1, second.1] }
                    })
                    .collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unknown_has_its_place_in_the_order_of_numbers() {
        for (dimension, radius, own_rows) in
            [(1, 2, 2), (1, 1, 1), (2, 1, 1), (2, 2, 1), (2, 4, 3), (2, 5, 3), (2, 2, 4)]
        {
            let unknowns = Unknowns::new(dimension, radius, own_rows);
            let all: Vec<Unknown> = Class::ALL.into_iter().flat_map(|class| unknowns.of_class(class)).collect();
            assert_eq!(all.len(), unknowns.count_to(Class::Corner));
            for (number, &unknown) in all.iter().enumerate() {
                assert_eq!(unknowns.number(unknown), number, "{unknown:?}");
            }
        }
    }

    #[test]
    fn windows_end_where_they_should() {
        let unknowns = Unknowns::new(2, 2, 2);
        let entry = |fine, coarse| unknowns.entry(fine, coarse, [true, false]);
        assert_eq!(entry([3, 0], [0, 0]), None);
        assert_eq!(entry([4, 3], [1, 0]), None);
        assert!(entry([4, -2], [1, 0]).is_some());
        // Beyond the rows of their own masks, and without a border, all is interior.
        assert_eq!(entry([5, 1], [2, 0]), unknowns.entry([1, 1], [0, 0], [false, false]));
        assert_eq!(entry([5, 1], [2, 0]), Some(unknowns.number(Unknown::Interior { far: 1, near: 1 })));
    }
}
