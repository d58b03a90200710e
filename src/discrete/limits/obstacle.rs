//! [`Obstacle`]: a polygon that curves stay out of, and the shortest ways around obstacles.

use glam::DVec2;

use crate::error::{Error, Result};
use crate::topology::crossings::meet;

/// A way around a corner keeps this fraction of the shorter edge there as clearance.
const CLEARANCE: f64 = 0.02;

/// A polygon that planar curves stay out of.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacle {
    /// Its corners, in either direction. The last edge leads to the first corner.
    pub corners: Vec<[f64; 2]>,
    /// What messages call it.
    pub name: String,
    /// The name of the one curve that stays out of it. `None` means all curves.
    pub curve: Option<String>,
}

impl Obstacle {
    /// # Errors
    /// Fewer than three corners. A coordinate that is not finite.
    pub(super) fn check(&self, dimension: usize) -> Result<()> {
        let name = &self.name;
        if dimension != 2 {
            return Err(Error::argument(format!(
                "obstacle {name} is a polygon, and only planar curves stay out of it"
            )));
        }
        if self.corners.len() < 3 || !self.corners.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(Error::argument(format!(
                "obstacle {name} needs three corners or more, with finite coordinates"
            )));
        }
        Ok(())
    }

    /// Whether a curve of this name stays out of it.
    pub(in crate::discrete) fn is_for(&self, curve: &str) -> bool {
        self.curve.as_ref().is_none_or(|own| own == curve)
    }

    /// Whether a point lies within it, by the number of its edges on a ray.
    pub(in crate::discrete) fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let is_on_ray =
            |&[a, b]: &[DVec2; 2]| (a.y > y) != (b.y > y) && x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
        self.edges().filter(is_on_ray).count() % 2 == 1
    }

    fn edges(&self) -> impl Iterator<Item = [DVec2; 2]> {
        let count = self.corners.len();
        (0..count).map(move |k| [k, (k + 1) % count].map(|k| DVec2::from(self.corners[k])))
    }

    /// Its corners, without repeated ones.
    fn turns(&self) -> Vec<Turn> {
        let edges: Vec<[DVec2; 2]> = self.edges().filter(|[a, b]| a != b).collect();
        let area: f64 = edges.iter().map(|[a, b]| a.perp_dot(*b)).sum();
        let turn = |(k, &[corner, next]): (usize, &[DVec2; 2])| {
            let [before, _] = edges[(k + edges.len() - 1) % edges.len()];
            let sides = [corner - before, next - corner];
            let outward = sides.map(|side| -area.signum() * side.normalize().perp());
            Turn { corner, sides, outward, is_convex: sides[0].perp_dot(sides[1]) * area > 0.0 }
        };
        edges.iter().enumerate().map(turn).collect()
    }

    /// The polygon of what is within a distance of it. Sharp corners are cut off outside of that.
    pub(super) fn grown(&self, distance: f64) -> Obstacle {
        let mut corners = Vec::with_capacity(self.corners.len());
        for Turn { corner, sides, outward: [n, m], is_convex } in self.turns() {
            let mitre = |n: DVec2, m: DVec2| (corner + distance * (n + m) / (1.0 + n.dot(m))).to_array();
            if n.dot(m) > 0.0 || !is_convex && n.dot(m) > -0.9 {
                corners.push(mitre(n, m));
            } else if is_convex {
                let middle = (n + m).try_normalize().unwrap_or(sides[0].normalize());
                corners.extend([mitre(n, middle), mitre(middle, m)]);
            } else {
                corners.push(corner.to_array());
            }
        }
        Obstacle { corners, ..self.clone() }
    }

    pub(super) fn meets(&self, segment: [DVec2; 2]) -> bool {
        self.edges().any(|edge| meet(segment, edge))
    }

    /// Points next to its convex corners, outside by the clearance.
    fn ways_round(&self) -> impl Iterator<Item = DVec2> {
        self.turns().into_iter().filter(|turn| turn.is_convex).map(|Turn { corner, sides, outward: [n, m], .. }| {
            corner + CLEARANCE * sides[0].length().min(sides[1].length()) * (n + m).normalize_or_zero()
        })
    }
}

/// A corner between two sides of a polygon.
struct Turn {
    corner: DVec2,
    /// The sides that lead to it and on.
    sides: [DVec2; 2],
    /// Unit vectors orthogonal to them.
    outward: [DVec2; 2],
    is_convex: bool,
}

/// The corners of the shortest way from a point to another around the obstacles, empty where the straight
/// way is free. `None` without a way.
///
/// Dijkstra's algorithm on the lines of sight between corners of those obstacles that are in the way.
pub(in crate::discrete) fn way_round(from: DVec2, to: DVec2, obstacles: &[&Obstacle]) -> Option<Vec<DVec2>> {
    let mut in_the_way: Vec<usize> = Vec::new();
    let mut corners = vec![from, to];
    loop {
        let is_free = |segment: [DVec2; 2]| !in_the_way.iter().any(|&k| obstacles[k].meets(segment));
        let way = shortest(&corners, &is_free)?;
        let meets = |k: &usize| way.windows(2).any(|pair| obstacles[*k].meets([pair[0], pair[1]]));
        let new: Vec<usize> = (0..obstacles.len()).filter(|k| !in_the_way.contains(k) && meets(k)).collect();
        if new.is_empty() {
            return Some(way[1..way.len() - 1].to_vec());
        }
        in_the_way.extend(new);
        let round = in_the_way.iter().flat_map(|&k| obstacles[k].ways_round());
        let is_outside = |point: &DVec2| !in_the_way.iter().any(|&k| obstacles[k].contains(point.to_array()));
        corners = [from, to].into_iter().chain(round.filter(is_outside)).collect();
    }
}

/// The shortest way from the first point to the second over the others, along free segments.
fn shortest(points: &[DVec2], is_free: &dyn Fn([DVec2; 2]) -> bool) -> Option<Vec<DVec2>> {
    let (mut length, mut before) = (vec![f64::INFINITY; points.len()], vec![usize::MAX; points.len()]);
    let mut done = vec![false; points.len()];
    length[0] = 0.0;
    while !done[1] {
        let next = (0..points.len()).filter(|&k| !done[k] && length[k].is_finite());
        let next = next.min_by(|&a, &b| length[a].total_cmp(&length[b]))?;
        done[next] = true;
        for k in 0..points.len() {
            let by_next = length[next] + points[next].distance(points[k]);
            if !done[k] && by_next < length[k] && is_free([points[next], points[k]]) {
                (length[k], before[k]) = (by_next, next);
            }
        }
    }
    let mut way = vec![points[1]];
    let mut at = 1;
    while at != 0 {
        at = before[at];
        way.push(points[at]);
    }
    way.reverse();
    Some(way)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, half: f64) -> Obstacle {
        let corners = vec![[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]];
        Obstacle { corners, name: "square".into(), curve: None }
    }

    #[test]
    fn the_shortest_way_goes_round_corners() {
        let (from, to) = (DVec2::ZERO, DVec2::new(10.0, 0.0));
        let [near, far] = [square(5.0, 0.5, 1.0), square(5.0, 7.0, 1.0)];
        assert_eq!(way_round(from, to, &[&far]), Some(vec![]));
        let way = way_round(from, to, &[&near, &far]).unwrap();
        assert!(way.len() == 2 && way.iter().all(|point| point.y < -0.5 && point.y > -0.6), "{way:?}");
        // An obstacle on the way round makes it go the other way, or between the two.
        let below = square(5.0, -2.0, 1.3);
        let way = way_round(from, to, &[&near, &below]).unwrap();
        let whole: Vec<DVec2> = [from].into_iter().chain(way).chain([to]).collect();
        assert!(whole.windows(2).all(|pair| !near.meets([pair[0], pair[1]]) && !below.meets([pair[0], pair[1]])));
        // From within there is no way out.
        assert_eq!(way_round(DVec2::new(5.0, 0.0), to, &[&near]), None);
        assert!(near.contains([5.0, 0.0]) && !near.contains([5.0, -3.0]));
    }
}
