//! [`Cells`]: a division of space into boxes, each with the balls that reach into it.

use glam::DVec3;

use super::tree::Sides;

/// The most balls of an undivided cell.
const TOGETHER: usize = 8;

/// The most cuts above a cell.
const MOST_CUTS: usize = 64;

/// The numbers of a node in a table, and of the box around all.
const NODE: usize = 4;
const SIDES: usize = 6;

/// Where a node is no cut.
const NO_AXIS: f64 = 3.0;

#[derive(Clone, Copy, Debug)]
enum Node {
    /// Two halves along an axis. That below the cut is the next node.
    Cut { axis: usize, at: f64, above: u32 },
    /// Some of the items, and the largest radius of them.
    Cell { first: u32, count: u32, reach: f64 },
}

/// A tree of cuts in the middle of boxes, until they are no longer than the mean radius of the
/// balls that reach into them.
#[derive(Clone, Debug)]
pub struct Cells {
    sides: Sides,
    nodes: Vec<Node>,
    items: Vec<u32>,
    /// The most nodes above a cell, plus its items.
    turns: usize,
}

impl Cells {
    /// The cells of numbered balls of these middles and radii. A ball of radius 0 is in none.
    pub fn new(balls: &[(DVec3, f64)]) -> Self {
        let ends = balls.iter().flat_map(|(middle, reach)| [*middle - *reach, *middle + *reach]);
        let sides = Sides::around(&ends.collect::<Vec<_>>());
        let mut cells = Cells { sides, nodes: vec![], items: vec![], turns: 0 };
        cells.divide(balls, sides, &(0..balls.len() as u32).collect::<Vec<_>>(), 0);
        cells
    }

    fn divide(&mut self, balls: &[(DVec3, f64)], sides: Sides, within: &[u32], cuts: usize) {
        let reaches = || within.iter().map(|&k| balls[k as usize].1);
        let mean = reaches().sum::<f64>() / within.len() as f64;
        let long = sides.high - sides.low;
        let axis = long.max_position();
        if within.len() <= TOGETHER || long[axis] <= mean || cuts == MOST_CUTS {
            let (first, count) = (self.items.len() as u32, within.len() as u32);
            self.items.extend(within);
            self.nodes.push(Node::Cell { first, count, reach: reaches().fold(0.0, f64::max) });
            self.turns = self.turns.max(cuts + within.len());
            return;
        }
        let (own, at) = (self.nodes.len(), 0.5 * sides.low[axis] + 0.5 * sides.high[axis]);
        let (mut below, mut above) = (sides, sides);
        (below.high[axis], above.low[axis]) = (at, at);
        let reaching = |half: Sides| -> Vec<u32> {
            let reaches = |&&k: &&u32| half.distance(balls[k as usize].0) < balls[k as usize].1;
            within.iter().filter(reaches).copied().collect()
        };
        self.nodes.push(Node::Cut { axis, at, above: 0 });
        self.divide(balls, below, &reaching(below), cuts + 1);
        self.nodes[own] = Node::Cut { axis, at, above: self.nodes.len() as u32 };
        self.divide(balls, above, &reaching(above), cuts + 1);
    }

    /// The largest radius of the balls that reach into the cell of a point, and their numbers.
    /// Empty out of reach of all.
    pub fn at(&self, x: DVec3) -> (f64, &[u32]) {
        if !self.sides.holds(x) {
            return (0.0, &[]);
        }
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Cut { axis, at, above } => node = if x[axis] < at { node + 1 } else { above as usize },
                Node::Cell { first, count, reach } => return (reach, &self.items[first as usize..][..count as usize]),
            }
        }
    }

    /// The most loop iterations of a search for a cell and through its items.
    pub fn turns(&self) -> usize {
        self.turns
    }

    /// The box, the nodes and the items as a table for kernels, which refers to nodes and items by
    /// index. The items' numbers follow behind it, `width` each.
    pub fn table(&self, width: usize) -> Vec<f64> {
        let of_node = |node: usize| (SIDES + NODE * node) as f64;
        let lists = SIDES + NODE * self.nodes.len();
        let items = lists + self.items.len();
        let mut table = [self.sides.low.to_array(), self.sides.high.to_array()].concat();
        for node in &self.nodes {
            table.extend(match *node {
                Node::Cut { axis, at, above } => [axis as f64, at, of_node(above as usize), 0.0],
                Node::Cell { first, count, reach } => {
                    [NO_AXIS, reach, (lists + first as usize) as f64, f64::from(count)]
                }
            });
        }
        table.extend(self.items.iter().map(|&k| (items + width * k as usize) as f64));
        table
    }
}
