//! The WGSL text and the weights of an energy for a kernel.
//!
//! The text consists of the definitions that `shaders/discrete/energy/mod.wgsl` needs. Each curve
//! has its own weights.

use super::energy::{Energy, Functional, MOST_EDGES, TORSION_CURVATURE};
use crate::gpu::source::{Definitions, definitions};
use crate::precision::Precision;
use crate::sort;

/// Names that kernels use themselves.
///
/// No custom energy may have one of them.
const RESERVED: [&str; 12] = [
    "ratio_regularisation",
    "difference_regularisation",
    "smooth_regularisation",
    "end_regularisation",
    "anchor",
    "penalty",
    "region",
    "regions",
    "window",
    "edge",
    "across",
    "torsion_curvature",
];

/// An energy in the form a kernel needs.
#[derive(Clone, Debug)]
pub(crate) struct Composition {
    /// Definitions for the kernel's text.
    pub definitions: Definitions,
    /// The meaning of each entry of a curve's weights.
    entries: Vec<Entry>,
    /// The entry of each term of the energy.
    places: Vec<usize>,
    /// The largest number of edges in a term.
    edges: usize,
}

/// The coefficients of a quadric: a matrix, a vector and a number.
pub(crate) const QUADRIC: usize = 13;

/// The numbers of any other surface: the origin and the size of a curve's coordinates.
const PLACED: usize = 4;

/// The table that the text of a surface may read.
pub(super) const SURFACE_TABLE: &str = "surface_table";

#[derive(Clone, Copy, Debug)]
enum Entry {
    /// A weight, and the degree of its functional.
    Weight(f64, f64),
    /// The weight of the attachment and its degree.
    Attachment(f64, f64),
    Regularisation,
    /// ε of torsion.
    TorsionCurvature,
    /// A number of the surface that the curve lies in.
    Surface,
}

/// What distinguishes the text of one functional from another's.
///
/// Kernels add terms in this order, so sums do not depend on the order in which an energy is
/// written.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Kind {
    edges: usize,
    /// Its position in [`Energy::NAMES`], or `usize::MAX` for a custom energy.
    rank: usize,
    word: String,
    degree: String,
    /// The index of its kind of penalty, if it is a penalty.
    penalty: Option<usize>,
    definitions: Definitions,
}

impl Kind {
    fn of(functional: &Functional, epsilon: f64, dimension: usize) -> Self {
        let word = functional.word();
        let definitions = functional.facts().definitions(epsilon, dimension);
        Kind {
            edges: functional.order(),
            rank: Energy::NAMES.iter().position(|name| *name == word).unwrap_or(usize::MAX),
            word: word.into(),
            degree: functional.facts().degree().to_string(),
            penalty: functional.penalty(),
            definitions: sort::map(definitions.into_iter().map(|(name, value)| (name.to_string(), value))),
        }
    }
}

/// The weights of a curve on a device, where the curve has size 1.
#[derive(Clone, Debug)]
pub(crate) struct DeviceWeights {
    /// Weights in the kernel's order.
    pub entries: Vec<f64>,
    /// The unit of energy on the device, in units of the input.
    pub unit: f64,
}

impl Composition {
    /// Composes an energy for curves of a dimension, with the regularisation of a kind if it is not
    /// 0.
    ///
    /// Functionals that differ only in their weights share one entry.
    ///
    /// # Errors
    /// A sentence that says why the energy cannot be compiled into a kernel.
    pub fn of(energy: &Energy, regularisation: usize, dimension: usize, precision: Precision) -> Result<Self, String> {
        let epsilon = precision.epsilon();
        let of_terms = energy.terms().iter().map(|(_, functional)| Kind::of(functional, epsilon, dimension));
        let of_terms: Vec<Kind> = of_terms.collect();
        let mut kinds = of_terms.clone();
        sort::by(&mut kinds, Kind::cmp);
        kinds.dedup();
        let place = |kind: &Kind| kinds.binary_search(kind).expect("kinds are those of the terms");
        let places: Vec<usize> = of_terms.iter().map(place).collect();

        let edges = kinds
            .iter()
            .map(|kind| kind.edges)
            .fold(if regularisation > 0 { regularisation.max(2) } else { 1 }, usize::max);
        let mut composing = Composition {
            definitions: definitions([
                ("DIM", &dimension),
                ("MOST_EDGES", &MOST_EDGES),
                ("BLOCKS", &(MOST_EDGES + 1)),
                ("WIDTH", &edges),
                ("LAST", &(edges - 1)),
                ("VERTICES", &(edges + 1)),
            ]),
            entries: Vec::new(),
            places,
            edges,
        };
        let flags = [("SPATIAL", dimension == 3), ("WIDE", edges > 3), ("TAUT", energy.is_taut())];
        flags.into_iter().filter(|(_, is_so)| *is_so).for_each(|(name, _)| composing.define(name, 1));
        let penalties = energy.penalties();
        let place = |kind: usize| penalties[..kind].iter().filter(|has| **has).count();
        if penalties.contains(&true) {
            composing.define("PENALTIES", place(penalties.len()));
        }
        if energy.regions() > 0 {
            composing.define("REGIONS", energy.regions());
        }
        let mut names = RESERVED.map(String::from).to_vec();
        for (entry, kind) in kinds.into_iter().enumerate() {
            let own = || energy.terms().iter().zip(&composing.places).filter(|(_, place)| **place == entry);
            let weight = own().map(|((weight, _), _)| weight).sum();
            let degree = own().map(|((_, functional), _)| functional.facts().degree()).next().unwrap_or(0.0);
            if kind.edges == 0 {
                composing.define("ATTACHMENT", entry);
                composing.entries.push(Entry::Attachment(weight, degree));
            } else {
                composing.entries.push(Entry::Weight(weight, degree));
                let penalty = kind.penalty.map(place);
                names.push(composing.define_term(entry, kind, penalty, &names)?);
            }
        }
        if regularisation > 0 {
            composing.define("REGULARISATION", composing.entries.len());
            composing.entries.push(Entry::Regularisation);
            composing.define_regularisation(regularisation);
        }
        composing.define("TORSION_CURVATURE", composing.entries.len());
        composing.entries.push(Entry::TorsionCurvature);
        Ok(composing)
    }

    /// The entries of a curve that has been divided by its size, for this unit of energy. That of
    /// the regularisation is NaN.
    pub fn entries_at(&self, size: f64, unit: f64) -> impl Iterator<Item = f64> {
        self.entries.iter().map(move |entry| match *entry {
            Entry::Weight(weight, degree) => weight * size.powf(degree) / unit,
            Entry::Attachment(..) => 1.0,
            Entry::TorsionCurvature => TORSION_CURVATURE,
            Entry::Regularisation | Entry::Surface => f64::NAN,
        })
    }

    /// The same for curves in surfaces, either quadrics or surfaces with a WGSL text. The numbers
    /// of the surface follow the weights.
    pub fn in_surfaces(mut self, text: Option<&str>) -> Self {
        self.define("SURFACE", self.entries.len());
        let numbers = match text {
            Some(text) => {
                self.define("SURFACE_WGSL", text);
                let own = [
                    ("SURFACE_JET", "fn surface_jet("),
                    ("SURFACE_PROJECT", "fn surface_project("),
                    ("SURFACE_TABLE", SURFACE_TABLE),
                ];
                own.into_iter().filter(|(_, word)| text.contains(word)).for_each(|(name, _)| self.define(name, 1));
                PLACED
            }
            None => QUADRIC,
        };
        self.entries.extend((0..numbers).map(|_| Entry::Surface));
        self
    }

    /// Defines the list REGULARISATION_TERM: the terms of a kind of regularisation.
    fn define_regularisation(&mut self, kind: usize) {
        const FIRST: &str = "discrete/energy/regularisation.wgsl";
        const SMOOTH: &str = "discrete/energy/smooth_regularisation.wgsl";
        let terms: &[(&str, &str, usize)] = match kind {
            3 => &[("smooth_regularisation", SMOOTH, 3), ("end_regularisation", SMOOTH, 2)],
            2 => &[("ratio_regularisation", FIRST, 2)],
            _ => &[("difference_regularisation", FIRST, 2)],
        };
        for (k, (name, file, edges)) in terms.iter().enumerate() {
            self.define(&format!("REGULARISATION_TERM.{k}.NAME"), name);
            self.define(&format!("REGULARISATION_TERM.{k}.FILE"), file);
            self.define(&format!("REGULARISATION_TERM.{k}.EDGES"), edges);
        }
        if kind == 3 {
            self.define("SMOOTH_REGULARISATION", 1);
        }
    }

    fn define(&mut self, name: &str, value: impl ToString) {
        self.definitions.insert(name.to_string(), value.to_string());
    }

    /// Defines the next entry of the list TERM, and returns the name of its functions.
    ///
    /// `penalty` is the index of its penalty in a window.
    fn define_term(
        &mut self,
        entry: usize,
        kind: Kind,
        penalty: Option<usize>,
        names: &[String],
    ) -> Result<String, String> {
        let (Kind { edges, word, definitions, .. }, k) = (kind, names.len() - RESERVED.len());
        let is_taken = names.contains(&word);
        if is_taken && definitions.contains_key("WGSL") {
            return Err(format!("a kernel has something else called {word}: give each energy a name of its own"));
        }
        let name = if is_taken { format!("{word}_{k}") } else { word.clone() };
        let own: [(&str, &dyn ToString); 4] =
            [("FILE", &format!("discrete/energy/{word}.wgsl")), ("NAME", &name), ("EDGES", &edges), ("WEIGHT", &entry)];
        own.iter().for_each(|(name, value)| self.define(&format!("TERM.{k}.{name}"), value.to_string()));
        penalty.iter().for_each(|place| self.define(&format!("TERM.{k}.PENALTY"), place));
        definitions.iter().for_each(|(name, value)| self.define(&format!("TERM.{k}.{name}"), value));
        Ok(name)
    }

    /// The number of entries per curve in the kernel's table of weights.
    pub fn width(&self) -> usize {
        self.entries.len()
    }

    /// The entry of the regularisation, if there is one.
    pub fn regularisation(&self) -> Option<usize> {
        self.entries.iter().position(|entry| matches!(entry, Entry::Regularisation))
    }

    /// The largest number of edges in a term.
    pub fn edges(&self) -> usize {
        self.edges
    }

    /// The entries of a curve of size 1, from the weights of its terms.
    ///
    /// The entry of an attachment is 1, because its weights are stored with the points.
    pub fn entries(&self, weights: &[f64], regularisation: f64) -> Vec<f64> {
        let entry = |(place, entry): (usize, &Entry)| match entry {
            Entry::Weight(..) => {
                self.places.iter().zip(weights).filter(|(own, _)| **own == place).map(|(_, weight)| weight).sum()
            }
            Entry::Attachment(..) => 1.0,
            Entry::Regularisation => regularisation,
            Entry::TorsionCurvature => TORSION_CURVATURE,
            Entry::Surface => f64::NAN,
        };
        self.entries.iter().enumerate().map(entry).collect()
    }

    /// The weights of a curve that has been divided by `size`.
    ///
    /// `torsion_curvature` (ε of torsion) is in units of the input. The regularisation is the
    /// dimensionless one of order 2.
    pub fn weights(&self, size: f64, regularisation: f64, torsion_curvature: f64) -> DeviceWeights {
        let scaled = |entry: &Entry| match *entry {
            Entry::Weight(weight, degree) | Entry::Attachment(weight, degree) => weight * size.powf(degree),
            Entry::Regularisation => regularisation,
            Entry::TorsionCurvature => torsion_curvature * size,
            Entry::Surface => f64::NAN,
        };
        let weighing = self.entries.iter().filter(|entry| matches!(entry, Entry::Weight(..) | Entry::Attachment(..)));
        let unit = weighing.map(|entry| scaled(entry).abs()).fold(0.0, f64::max);
        let unit = if unit > 0.0 && unit.is_finite() { unit } else { 1.0 };
        let divided = |entry: &Entry| match entry {
            Entry::TorsionCurvature => scaled(entry),
            _ => scaled(entry) / unit,
        };
        DeviceWeights { entries: self.entries.iter().map(divided).collect(), unit }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{bending, length, tension, torsion};
    use super::*;

    #[test]
    fn equal_functionals_share_a_weight() {
        let energy = bending(2.0) + 0.5 * length() + 3.0 * bending(2.0);
        let composition = Composition::of(&energy, 2, 2, Precision::F32).unwrap();
        assert_eq!(composition.places, [1, 0, 1]);
        // The degrees are 1 and −1, and the curve has size 4: weights become 0.5·4 and 4/4. The
        // larger is the unit. The regularisation has degree 0.
        let weights = composition.weights(4.0, 0.25, 1e-3);
        assert_eq!((weights.unit, weights.entries), (2.0, vec![1.0, 0.5, 0.125, 4e-3]));
    }

    #[test]
    fn the_curvature_of_torsion_is_scaled_as_curvatures_are() {
        let composition = Composition::of(&(tension() + torsion()), 0, 3, Precision::F64).unwrap();
        let weights = composition.weights(0.5, 0.0, 1e-3);
        assert_eq!((weights.unit, weights.entries), (8.0, vec![0.25 / 8.0, 1.0, 5e-4]));
    }

    #[test]
    fn exponents_have_terms_of_their_own() {
        let composition = Composition::of(&(bending(3.0) + bending(2.0)), 0, 2, Precision::F32).unwrap();
        let names = [0, 1].map(|k| &composition.definitions[&format!("TERM.{k}.NAME")]);
        assert_eq!(names, ["bending", "bending_1"]);
        assert_eq!(composition.entries(&[5.0, 7.0], 0.0).iter().take(2).sum::<f64>(), 12.0);
    }

    #[test]
    fn texts_of_surfaces_say_what_they_bring() {
        let of = |text: &str| {
            let composition = Composition::of(&bending(2.0), 2, 3, Precision::F64).unwrap().in_surfaces(Some(text));
            let names = ["SURFACE_JET", "SURFACE_PROJECT", "SURFACE_TABLE"];
            names.map(|name| composition.definitions.contains_key(name))
        };
        assert_eq!(of("fn surface_value(x: vector) -> real"), [false, false, false]);
        assert_eq!(
            of("fn surface_project(x: vector) -> vector { return surface_jet(x).gradient; }"),
            [false, true, false]
        );
        assert_eq!(of("fn surface_jet(x: vector) -> SurfaceJet { return surface_table[0]; }"), [true, false, true]);
    }
}
