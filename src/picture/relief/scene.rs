//! The content of a panel: a grid in space, projected, shaded and sorted.

use glam::{DVec2, DVec3};

use super::super::layout::Bounds;
use super::super::panel;
use super::paint::{self, Colour};
use super::{MOST_NET_POINTS, Relief};
use crate::sort;

/// Tints from the lowest height to the highest.
pub(super) const HEIGHTS: [[u8; 3]; 5] =
    [[20, 66, 122], [0, 114, 178], [71, 170, 190], [171, 211, 169], [250, 236, 180]];

/// Colours of surfaces in space, and of meshes in the plane.
const SURFACE: [u8; 3] = [64, 146, 200];
const MESH: [u8; 3] = [196, 222, 240];
const LINES: [u8; 3] = [96, 160, 204];
const WALL: [u8; 3] = [222, 227, 232];

/// The height of the range of heights, and the depth of the walls below it, in the longer side of
/// the ground.
const HIGH: f64 = 0.30;
const DEEP: f64 = 0.06;

/// The angle of the ground about the vertical, and the height of the eye above the horizon.
const TURN: f64 = 28.0;
const ELEVATION: f64 = 33.0;

/// Larger coordinates are not drawn, since differences would overflow.
const DRAWABLE: f64 = 1e150;

/// The direction that a grid is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum View {
    /// In a parallel view, from the front and above.
    Oblique,
    /// x to the right, y up.
    Above,
    /// x to the right, z up, for heights of one row.
    Front,
}

impl View {
    /// x and y on the page, and the distance from the eye.
    pub fn project(self, p: DVec3) -> DVec3 {
        match self {
            View::Above => DVec3::new(p.x, p.y, -p.z),
            View::Front => DVec3::new(p.x, p.z, p.y),
            View::Oblique => {
                let (turn, elevation) = (TURN.to_radians().sin_cos(), ELEVATION.to_radians().sin_cos());
                let across = p.x * turn.1 + p.y * turn.0;
                let away = p.y * turn.1 - p.x * turn.0;
                DVec3::new(across, away * elevation.0 + p.z * elevation.1, away * elevation.1 - p.z * elevation.0)
            }
        }
    }

    /// The direction towards the eye.
    fn eye(self) -> DVec3 {
        // The gradient of the distance, reversed.
        let distance = |p: DVec3| self.project(p).z;
        -DVec3::new(distance(DVec3::X), distance(DVec3::Y), distance(DVec3::Z))
    }
}

/// A polygon on the page.
pub(super) struct Face {
    pub corners: Vec<DVec2>,
    pub colour: Colour,
    /// The colour of its edges.
    pub stroke: Colour,
}

/// A panel's content.
pub(super) struct Scene {
    pub view: View,
    /// The faces, from the back to the front.
    pub faces: Vec<Face>,
    pub walls: Vec<Face>,
    /// A grid of one row, in pieces of finite points.
    pub curve: Vec<Vec<DVec2>>,
    pub net: Vec<Vec<DVec2>>,
    pub dots: Vec<DVec2>,
    pub bounds: Bounds,
    /// The step between lines that are drawn.
    pub every: usize,
    /// The lowest and the highest height.
    pub heights: Option<[f64; 2]>,
}

impl Scene {
    /// The scene of a relief, with at most `most` quadrangles.
    pub fn of(relief: &Relief, most: usize) -> Self {
        let wanted = |shape: [usize; 2]| shape[0] * shape[1] * relief.dimension.max(1);
        assert_eq!(relief.values.len(), wanted(relief.shape), "a relief has as many values as its shape says");
        if let Some(net) = relief.net {
            assert_eq!(net.values.len(), wanted(net.shape), "a net has as many values as its shape says");
        }
        let space = Space::of(relief);
        let [rows, columns] = relief.shape;
        let is_line = rows.min(columns) == 1;
        let every = if is_line { 1 } else { every(relief.shape, between(relief), most) };
        let surface = Sheet { shape: relief.shape, values: relief.values, space: &space };
        let mut scene = Scene {
            view: space.view,
            faces: Vec::new(),
            walls: Vec::new(),
            curve: Vec::new(),
            net: Vec::new(),
            dots: Vec::new(),
            bounds: Bounds::EMPTY,
            every,
            heights: space.range,
        };
        if is_line {
            scene.curve = surface.polyline((0..rows).flat_map(|row| (0..columns).map(move |column| [row, column])));
        } else if rows > 0 && columns > 0 {
            let (down, across) = (lines(rows, every), lines(columns, every));
            scene.faces = surface.faces(&down, &across);
            if space.view == View::Oblique && relief.dimension == 1 {
                scene.walls = surface.walls(&down, &across);
            }
        }
        if let Some(net) = relief.net.filter(|net| net.shape[0] * net.shape[1] <= MOST_NET_POINTS) {
            let net = Sheet { shape: net.shape, values: net.values, space: &space };
            scene.net = net.net();
            scene.dots = net.dots();
        }
        let faces = scene.faces.iter().chain(&scene.walls).flat_map(|face| &face.corners);
        let points = faces.chain(scene.curve.iter().chain(&scene.net).flatten()).chain(&scene.dots);
        scene.bounds = points.fold(Bounds::EMPTY, |bounds, &point| bounds.with(point));
        scene
    }

    /// The heights of the first and the last tint, if there are tints.
    pub fn tints(&self) -> Option<[f64; 2]> {
        self.heights.filter(|_| self.view == View::Oblique)
    }

    /// Whether nothing of the surface can be drawn.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty() && self.curve.is_empty()
    }
}

/// The least step between lines that leaves at most `most` quadrangles.
///
/// Surfaces have peaks at their control points, `between` lines apart. The step divides `between`
/// or is a multiple of it, so that no false waves appear.
fn every([rows, columns]: [usize; 2], between: usize, most: usize) -> usize {
    let quads = |k: usize| (rows - 1).div_ceil(k).saturating_mul((columns - 1).div_ceil(k));
    let longest = rows.max(columns);
    let mut steps = (1..longest).filter(|&k| k.is_multiple_of(between) || between.is_multiple_of(k));
    if rows < 2 || columns < 2 { 1 } else { steps.find(|&k| quads(k) <= most.max(1)).unwrap_or(longest) }
}

/// Lines between neighbouring control points, or 1 if unknown.
fn between(relief: &Relief) -> usize {
    let step = |fine: usize, coarse: usize| fine.saturating_sub(1).checked_div(coarse.saturating_sub(1));
    let net = relief.net.map_or([0, 0], |net| net.shape);
    step(relief.shape[0], net[0]).or(step(relief.shape[1], net[1])).unwrap_or(1).max(1)
}

/// The lines to draw, including the last.
fn lines(count: usize, every: usize) -> Vec<usize> {
    let last = !(count - 1).is_multiple_of(every);
    (0..count).step_by(every).chain(last.then_some(count - 1)).collect()
}

/// The map from points to a space of unit size.
struct Space {
    view: View,
    dimension: usize,
    /// For heights: the sides of the ground, and the range.
    ground: DVec2,
    range: Option<[f64; 2]>,
    /// For points: the middle and the size of their box.
    middle: DVec3,
    size: f64,
}

impl Space {
    fn of(relief: &Relief) -> Self {
        let sides = relief.shape.map(|count| count.saturating_sub(1) as f64);
        let longer = sides[0].max(sides[1]).max(1.0);
        let all = || relief.values.iter().chain(relief.net.map_or(&[][..], |net| net.values));
        let mut space = Space {
            view: View::Oblique,
            dimension: relief.dimension.max(1),
            ground: DVec2::new(sides[1], sides[0]) / longer,
            range: None,
            middle: DVec3::ZERO,
            size: 1.0,
        };
        if relief.dimension <= 1 {
            let drawable = all().filter(|x| x.abs() < DRAWABLE);
            let (low, high) =
                drawable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
            let given = relief.range.filter(|[low, high]| low <= high && low.abs() < DRAWABLE && high.abs() < DRAWABLE);
            space.range = given.or((low <= high).then_some([low, high]));
            if relief.shape.contains(&1) {
                space.view = View::Front;
                // A column is drawn like a row.
                space.ground = DVec2::splat(1.0);
            }
            return space;
        }
        if relief.dimension == 2 {
            space.view = View::Above;
        }
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let net = relief.net.map_or(&[][..], |net| net.values);
        for p in relief.values.chunks_exact(space.dimension).chain(net.chunks_exact(space.dimension)).map(point) {
            if drawable(p) {
                (low, high) = (low.min(p), high.max(p));
            }
        }
        let size = (high - low).max_element();
        if size > 0.0 {
            (space.middle, space.size) = (low.midpoint(high), size);
        }
        space
    }

    /// The position of a point, if it can be drawn.
    fn place(&self, shape: [usize; 2], [row, column]: [usize; 2], values: &[f64]) -> Option<DVec3> {
        let [height] = *values else {
            return Some((point(values) - self.middle) / self.size).filter(|p| drawable(*p));
        };
        let part = |at: usize, count: usize| at as f64 / count.saturating_sub(1).max(1) as f64;
        let [y, x] = [part(row, shape[0]), part(column, shape[1])];
        let z = self.part(height)? * HIGH;
        Some(match self.view {
            View::Front => DVec3::new(x.max(y), 0.0, z),
            _ => DVec3::new(x * self.ground.x, y * self.ground.y, z),
        })
    }

    /// The height as a fraction of the range.
    fn part(&self, height: f64) -> Option<f64> {
        let [low, high] = self.range?;
        (height.abs() < DRAWABLE).then(|| if high > low { (height - low) / (high - low) } else { 0.5 })
    }
}

fn drawable(p: DVec3) -> bool {
    // False for NaN too.
    p.abs().to_array().iter().all(|&x| x < DRAWABLE)
}

/// The first three values of a point.
fn point(values: &[f64]) -> DVec3 {
    let at = |k: usize| values.get(k).copied().unwrap_or(0.0);
    DVec3::new(at(0), at(1), at(2))
}

/// A grid in its space.
struct Sheet<'a> {
    shape: [usize; 2],
    values: &'a [f64],
    space: &'a Space,
}

impl Sheet<'_> {
    fn values(&self, [row, column]: [usize; 2]) -> &[f64] {
        let d = self.space.dimension;
        &self.values[(row * self.shape[1] + column) * d..][..d]
    }

    fn at(&self, place: [usize; 2]) -> Option<DVec3> {
        self.space.place(self.shape, place, self.values(place))
    }

    fn on_page(&self, place: [usize; 2]) -> Option<DVec2> {
        self.at(place).map(|p| self.space.view.project(p).truncate())
    }

    /// The quadrangles between these lines, from the back to the front.
    fn faces(&self, down: &[usize], across: &[usize]) -> Vec<Face> {
        let mut faces: Vec<(f64, Face)> = Vec::with_capacity((down.len() - 1) * (across.len() - 1));
        for rows in down.windows(2) {
            for columns in across.windows(2) {
                let places =
                    [[rows[0], columns[0]], [rows[0], columns[1]], [rows[1], columns[1]], [rows[1], columns[0]]];
                let [Some(a), Some(b), Some(c), Some(d)] = places.map(|place| self.at(place)) else { continue };
                let corners = [a, b, c, d];
                let middle = (a + b + c + d) * 0.25;
                // Heights hide each other in the order of the ground below them.
                let depth = if self.space.dimension == 1 { DVec3::new(middle.x, middle.y, 0.0) } else { middle };
                let colour = self.colour(corners, middle);
                let corners = corners.map(|p| self.space.view.project(p).truncate()).to_vec();
                // Meshes in the plane are not shaded but show their lines.
                let stroke = if self.space.view == View::Above { paint::colour(LINES) } else { colour };
                faces.push((self.space.view.project(depth).z, Face { corners, colour, stroke }));
            }
        }
        sort::by(&mut faces, |(a, _), (b, _)| b.total_cmp(a));
        faces.into_iter().map(|(_, face)| face).collect()
    }

    fn colour(&self, [a, b, c, d]: [DVec3; 4], middle: DVec3) -> Colour {
        let normal = (c - a).cross(d - b).try_normalize().unwrap_or(DVec3::Z);
        let normal = if normal.dot(self.space.view.eye()) < 0.0 { -normal } else { normal };
        match self.space.view {
            View::Above => paint::colour(MESH),
            _ if self.space.dimension == 1 => paint::shaded(panel::mix_exact(&HEIGHTS, middle.z / HIGH), normal),
            _ => paint::shaded(paint::colour(SURFACE), normal),
        }
    }

    /// Walls from the front borders, the first row and the last column, down to the ground.
    ///
    /// A border with gaps has no wall.
    fn walls(&self, down: &[usize], across: &[usize]) -> Vec<Face> {
        let (last_row, last_column) = (down[down.len() - 1], across[across.len() - 1]);
        let front = across.iter().map(|&column| [0, column]).collect::<Vec<_>>();
        let side = down.iter().map(|&row| [row, last_column]).collect::<Vec<_>>();
        let whole = [[0, 0], [last_row, last_column]].iter().all(|&place| self.at(place).is_some());
        let wall = |border: Vec<[usize; 2]>, normal: DVec3| {
            let top: Option<Vec<DVec3>> = border.into_iter().map(|place| self.at(place)).collect();
            let top = top.filter(|_| whole)?;
            let foot = |p: DVec3| DVec3::new(p.x, p.y, -DEEP);
            let feet = [foot(*top.last()?), foot(*top.first()?)];
            let corners = top.into_iter().chain(feet).map(|p| self.space.view.project(p).truncate()).collect();
            let colour = paint::shaded(paint::colour(WALL), normal);
            Some(Face { corners, colour, stroke: colour })
        };
        [wall(front, -DVec3::Y), wall(side, DVec3::X)].into_iter().flatten().collect()
    }

    /// The rows and the columns of the net.
    fn net(&self) -> Vec<Vec<DVec2>> {
        let [rows, columns] = self.shape;
        let mut lines = Vec::new();
        if columns > 1 {
            for row in 0..rows {
                lines.extend(self.polyline((0..columns).map(|column| [row, column])));
            }
        }
        if rows > 1 {
            for column in 0..columns {
                lines.extend(self.polyline((0..rows).map(|row| [row, column])));
            }
        }
        lines
    }

    fn dots(&self) -> Vec<DVec2> {
        let [rows, columns] = self.shape;
        (0..rows).flat_map(|row| (0..columns).filter_map(move |column| self.on_page([row, column]))).collect()
    }

    /// The points in pieces, broken where one cannot be drawn.
    fn polyline(&self, places: impl Iterator<Item = [usize; 2]>) -> Vec<Vec<DVec2>> {
        let points: Vec<Option<DVec2>> = places.map(|place| self.on_page(place)).collect();
        points
            .split(|point| point.is_none())
            .filter(|piece| !piece.is_empty())
            .map(|piece| piece.iter().flatten().copied().collect())
            .collect()
    }
}
