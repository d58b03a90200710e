//! [`Layout`]: the positions of a chunk's curves on the device. [`Results`]: their results.

use std::ops::Range;

use super::{GROUP, NONE, Product, Products};

/// The curves of one workgroup, which share an operator.
///
/// Number `at` of its curve k is stored at `at · curves + k`.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    /// The number of the operator.
    pub number: u32,
    /// The first of its curves among the members.
    pub first: usize,
    pub curves: usize,
    /// The first number of the data, and of the results.
    pub start: usize,
    pub out: usize,
}

/// A chunk, sorted by operators.
pub(super) struct Layout {
    /// The first curve of the chunk.
    first: usize,
    /// The curves, sorted by operator, in order within each.
    pub members: Vec<u32>,
    pub tiles: Vec<Tile>,
    /// Tile and lane of every curve of the chunk.
    places: Vec<(u32, u32)>,
    /// Numbers of data, and of results.
    pub data: usize,
    pub results: usize,
}

impl Layout {
    pub fn new(products: &Products, chunk: &Range<usize>) -> Self {
        let for_kernel: Vec<bool> =
            (0..products.operators.len() as u32).map(|k| products.product(k).is_some()).collect();
        let number = |i: usize| Some(products.numbers[i]).filter(|&k| k != NONE && for_kernel[k as usize]);
        let mut ends = vec![0; for_kernel.len()];
        chunk.clone().filter_map(number).for_each(|k| ends[k as usize] += 1);
        let counts = ends.clone();
        let mut total = 0;
        for end in &mut ends {
            // At first where the operator's curves begin. After all are placed, where they end.
            (*end, total) = (total, total + *end);
        }
        let mut members = vec![0; total];
        for i in chunk.clone() {
            if let Some(k) = number(i) {
                members[ends[k as usize]] = i as u32;
                ends[k as usize] += 1;
            }
        }
        let mut layout = Layout {
            first: chunk.start,
            members,
            tiles: Vec::new(),
            places: vec![(NONE, 0); chunk.len()],
            data: 0,
            results: 0,
        };
        for k in (0..counts.len()).filter(|&k| counts[k] > 0) {
            let product = products.product(k as u32).expect("it was counted");
            for first in (ends[k] - counts[k]..ends[k]).step_by(GROUP) {
                let curves = (ends[k] - first).min(GROUP);
                for lane in 0..curves {
                    let i = layout.members[first + lane] as usize;
                    layout.places[i - chunk.start] = (layout.tiles.len() as u32, lane as u32);
                }
                layout.tiles.push(Tile { number: k as u32, first, curves, start: layout.data, out: layout.results });
                layout.data += product.operator.columns() * products.dimension * curves;
                layout.results += products.results_of(product) * curves;
            }
        }
        layout
    }
}

/// The results of a chunk.
pub(super) struct Results<'a> {
    products: &'a Products<'a>,
    layout: &'a Layout,
    sizes: &'a [f64],
    numbers: &'a [f64],
}

impl<'a> Results<'a> {
    pub fn new(products: &'a Products<'a>, layout: &'a Layout, sizes: &'a [f64], numbers: &'a [f64]) -> Self {
        Results { products, layout, sizes, numbers }
    }

    /// The results of a curve, if it was sent.
    #[inline(always)]
    pub fn of(&self, i: usize) -> Option<CurveResults<'_>> {
        let (tile, lane) = self.layout.places[i - self.layout.first];
        let tile = self.layout.tiles.get(tile as usize)?;
        let size = self.sizes[tile.first + lane as usize];
        let product = self.products.product(tile.number)?;
        let place = tile.out + lane as usize;
        let magnitudes = self.products.magnitudes();
        let at_once = product.rows_at_once();
        (!size.is_nan()).then_some(CurveResults {
            numbers: self.numbers,
            product,
            dimension: self.products.dimension,
            place,
            stride: tile.curves,
            size,
            magnitudes,
            at_once,
        })
    }
}

/// The results of a curve.
pub(super) struct CurveResults<'a> {
    numbers: &'a [f64],
    product: Product<'a>,
    dimension: usize,
    place: usize,
    stride: usize,
    size: f64,
    magnitudes: usize,
    at_once: usize,
}

impl CurveResults<'_> {
    #[inline(always)]
    fn at(&self, number: usize) -> f64 {
        self.numbers[self.place + number * self.stride]
    }

    /// Row times data.
    #[inline(always)]
    pub fn point<const D: usize>(&self, row: usize) -> [f64; D] {
        debug_assert_eq!(D, self.dimension);
        // Every thread before this one has left its magnitude too.
        let first = row * D + if row < self.at_once { 0 } else { row / self.at_once * self.magnitudes };
        std::array::from_fn(|c| self.at(first + c) * self.size)
    }

    /// The sum of squares of the other rows.
    pub fn energy(&self) -> f64 {
        if self.product.has_energy() {
            self.at(self.product.points * self.dimension + self.magnitudes) * self.size * self.size
        } else {
            0.0
        }
    }

    /// The largest Σ|entry · datum| of a coordinate, in f32.
    pub fn magnitude(&self) -> Option<f64> {
        if self.magnitudes == 0 {
            return None;
        }
        let threads = self.product.points.div_ceil(self.at_once).max(1);
        let of =
            |thread: usize| self.at(self.product.points.min((thread + 1) * self.at_once) * self.dimension + thread);
        // A NaN must not get lost.
        Some((0..threads).map(of).fold(0.0, |largest: f64, x| if x <= largest { largest } else { x }) * self.size)
    }

    /// The sum of the squared magnitudes of the energy's rows, in f32.
    pub fn energy_magnitude(&self) -> Option<f64> {
        let number = self.product.points * self.dimension + self.magnitudes + 1;
        (self.magnitudes == 1 && self.product.has_energy()).then(|| self.at(number) * self.size * self.size)
    }
}
