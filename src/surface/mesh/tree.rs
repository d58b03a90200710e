//! [`Tree`]: a bounding-volume hierarchy for closest points.

use glam::DVec3;

/// The most boxes of a leaf.
const TOGETHER: usize = 4;

/// A box with sides along the axes.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    pub low: DVec3,
    pub high: DVec3,
}

impl Sides {
    const EMPTY: Self = Sides { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The box around points.
    pub fn around(points: &[DVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |all, &x| Sides { low: all.low.min(x), high: all.high.max(x) })
    }

    fn with(self, other: Self) -> Self {
        Sides { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn middle(&self) -> DVec3 {
        0.5 * self.low + 0.5 * self.high
    }

    pub fn holds(&self, x: DVec3) -> bool {
        x.cmpge(self.low).all() && x.cmple(self.high).all()
    }

    /// The distance of a point from it. 0 inside.
    pub fn distance(&self, x: DVec3) -> f64 {
        (self.low - x).max(x - self.high).max(DVec3::ZERO).length()
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    sides: Sides,
    /// The first of its items, or its right half. The left half is the next node.
    first: u32,
    /// How many items it has. 0 for a node with halves.
    count: u32,
}

/// Numbered boxes.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

impl Tree {
    /// Divides the boxes at the median of their middles along the longest side.
    pub fn new(boxes: &[Sides]) -> Self {
        let mut tree = Tree { nodes: vec![], items: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.divide(boxes, 0, boxes.len());
        }
        tree
    }

    fn divide(&mut self, boxes: &[Sides], from: usize, to: usize) {
        let items = &mut self.items[from..to];
        let all = items.iter().fold(Sides::EMPTY, |all, &k| all.with(boxes[k as usize]));
        let own = self.nodes.len();
        let count = to - from;
        self.nodes.push(Node { sides: all, first: from as u32, count: count as u32 });
        if count <= TOGETHER {
            return;
        }
        let middles: Vec<DVec3> = items.iter().map(|&k| boxes[k as usize].middle()).collect();
        let spread = Sides::around(&middles);
        let axis = (spread.high - spread.low).max_position();
        items.select_nth_unstable_by(count / 2, |&a, &b| {
            let [a, b] = [a, b].map(|k| boxes[k as usize].middle()[axis]);
            a.total_cmp(&b)
        });
        self.divide(boxes, from, from + count / 2);
        let right = self.nodes.len() as u32;
        self.divide(boxes, from + count / 2, to);
        (self.nodes[own].first, self.nodes[own].count) = (right, 0);
    }

    fn items(&self, node: &Node) -> impl Iterator<Item = usize> {
        let first = node.first as usize;
        self.items[first..first + node.count as usize].iter().map(|&k| k as usize)
    }

    /// The item nearest to a point. `distance` gives its distance and the result.
    pub fn nearest<T>(&self, x: DVec3, mut distance: impl FnMut(usize) -> (f64, T)) -> Option<T> {
        let (mut least, mut nearest) = (f64::INFINITY, None);
        let mut later: Vec<(f64, usize)> =
            self.nodes.first().map(|root| (root.sides.distance(x), 0)).into_iter().collect();
        while let Some((bound, at)) = later.pop() {
            if bound >= least {
                continue;
            }
            let node = &self.nodes[at];
            if node.count > 0 {
                for item in self.items(node) {
                    let (own, what) = distance(item);
                    if own < least {
                        (least, nearest) = (own, Some(what));
                    }
                }
                continue;
            }
            let halves = [at + 1, node.first as usize].map(|half| (self.nodes[half].sides.distance(x), half));
            // The nearer half is looked at first.
            let [near, far] = if halves[0].0 <= halves[1].0 { halves } else { [halves[1], halves[0]] };
            later.extend([far, near]);
        }
        nearest
    }
}
