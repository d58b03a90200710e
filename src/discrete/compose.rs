//! What a kernel compiles in of an energy, and what it is told of every curve: the definitions and the weights that
//! `shaders/discrete/energy/mod.wgsl` asks for.

use std::fmt::Write as _;

use super::energy::{Energy, Functional, TORSION_CURVATURE};
use crate::gpu::source::{Definitions, definitions};
use crate::precision::Precision;

/// An energy as a kernel has it.
#[derive(Clone, Debug)]
pub(crate) struct Composition {
    /// Definitions for the kernel's text.
    pub definitions: Definitions,
    /// Per entry of a curve's weights: what it is.
    entries: Vec<Entry>,
    /// Edges that a term sees at most.
    width: usize,
}

#[derive(Clone, Copy, Debug)]
enum Entry {
    /// A weight, and the degree of its functional.
    Weight(f64, f64),
    /// ε of torsion.
    TorsionCurvature,
    Gauge,
}

/// The weights of a curve on a device, where it has the size 1.
#[derive(Clone, Debug)]
pub(crate) struct DeviceWeights {
    /// In the kernel's order.
    pub entries: Vec<f64>,
    /// An energy of 1 there is so much in the units of the input.
    pub unit: f64,
}

impl Composition {
    /// Composes the energies of curves of a dimension, and the gauge if asked for.
    ///
    /// # Errors
    /// A sentence that says what no kernel can be made of.
    pub fn of(energy: &Energy, with_gauge: bool, dimension: usize, precision: Precision) -> Result<Self, String> {
        let mut composing =
            Composition { definitions: definitions([("DIM", &dimension)]), entries: Vec::new(), width: 1 };
        if dimension == 3 {
            composing.define("SPATIAL", 1);
        }
        if precision == Precision::F64 {
            composing.define("DOUBLE", 1);
        }
        let mut placed: Vec<&Functional> = Vec::new();
        for (weight, functional) in energy.terms() {
            if let Some(index) = placed.iter().position(|other| is_same(other, functional)) {
                composing.add_weight(placed[index], *weight);
                continue;
            }
            composing.place(functional, *weight, precision)?;
            placed.push(functional);
            composing.width = composing.width.max(edges(functional));
        }
        if with_gauge {
            composing.define("GAUGE", composing.entries.len());
            composing.entries.push(Entry::Gauge);
            composing.width = composing.width.max(2);
        }
        let width = composing.width;
        composing.define("WIDTH", width);
        (2..=width).for_each(|edges| composing.define(&format!("EDGES_{edges}"), 1));
        Ok(composing)
    }

    fn define(&mut self, name: &str, value: impl ToString) {
        self.definitions.insert(name.to_string(), value.to_string());
    }

    fn place(&mut self, functional: &Functional, weight: f64, precision: Precision) -> Result<(), String> {
        let name = define_name(functional);
        if self.definitions.contains_key(name) {
            return Err(match functional {
                Functional::Custom(custom) => format!(
                    "a kernel has room for one energy of a user's own, and {} is the second: fit on the CPU",
                    custom.name()
                ),
                _ => "a kernel has room for one exponent of bending, and there are two: fit on the CPU".into(),
            });
        }
        self.define(name, self.entries.len());
        self.entries.push(Entry::Weight(weight, functional.degree()));
        match functional {
            Functional::Bending { exponent } => self.define_bending(*exponent, precision),
            Functional::Variation => self.define("ACROSS", 1),
            Functional::Torsion => {
                self.define("ACROSS", 1);
                self.define("TORSION_CURVATURE", self.entries.len());
                self.entries.push(Entry::TorsionCurvature);
            }
            Functional::Custom(custom) => {
                let text = custom.wgsl();
                let text = text.ok_or_else(|| format!("the energy {} has no WGSL: fit on the CPU", custom.name()))?;
                self.define("CUSTOM_WGSL", text);
                self.define("CUSTOM_NAME", custom.name());
                self.define("CUSTOM_EDGES", custom.edges());
                // It may call what the energies here call.
                self.define("POWER", 1);
                self.define("ACROSS", 1);
            }
            Functional::Length | Functional::Tension | Functional::Attachment => {}
        }
        Ok(())
    }

    fn add_weight(&mut self, functional: &Functional, more: f64) {
        let index: usize = self.definitions[define_name(functional)].parse().expect("an index was written");
        if let Entry::Weight(weight, _) = &mut self.entries[index] {
            *weight += more;
        }
    }

    /// Powers of q = |T′ − T|² and of a = Δa for |T′ − T|^ν Δa^(1−ν) and its derivatives.
    fn define_bending(&mut self, nu: f64, precision: Precision) {
        for lower in 0..3 {
            let exponent = 0.5 * nu - f64::from(lower);
            // c is q where that is above rounding, as src/discrete/energy/bending.rs has it.
            let base = if exponent == 1.0 { "q" } else { "c" };
            self.define_power(&format!("BENDING_POWER_{lower}"), base, exponent);
            self.define_power(&format!("BENDING_MEASURE_{lower}"), "a", 1.0 - nu - f64::from(lower));
        }
        let epsilon = if precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
        self.define("BENDING_ROUNDING", literal(epsilon * epsilon));
        self.define("BENDING_EXPONENT", literal(nu));
        self.define("BENDING_BY_LENGTH", literal(0.5 * (1.0 - nu)));
        self.define("BENDING_BY_LENGTHS", literal(0.25 * nu * (nu - 1.0)));
        if nu != 2.0 {
            self.define("BENDING_ALONG", literal(nu * (nu - 2.0)));
        }
    }

    fn define_power(&mut self, name: &str, base: &str, exponent: f64) {
        let text = power(base, exponent);
        if text.contains("power(") {
            self.define("POWER", 1);
        }
        self.define(name, text);
    }

    /// Entries of a curve in the kernel's table of weights.
    pub fn width(&self) -> usize {
        self.entries.len()
    }

    /// Edges that a term sees at most.
    pub fn edges(&self) -> usize {
        self.width
    }

    /// Of each term of the energy composed, where its weight stands among the entries.
    pub fn entries_of(&self, energy: &Energy) -> Vec<usize> {
        let entry = |functional| self.definitions[define_name(functional)].parse().expect("an index was written");
        energy.terms().iter().map(|(_, functional)| entry(functional)).collect()
    }

    /// The entries of a curve of size 1 whose terms have these weights, placed as [`entries_of`](Self::entries_of) says.
    /// An attachment is weighed at its points.
    pub fn entries(&self, places: &[usize], weights: &[f64], gauge: f64) -> Vec<f64> {
        let mut entries = vec![0.0; self.width()];
        places.iter().zip(weights).for_each(|(&place, weight)| entries[place] += weight);
        let attachment = self.definitions.get("ATTACHMENT").map(|place| place.parse().expect("an index was written"));
        for (place, (entry, kind)) in entries.iter_mut().zip(&self.entries).enumerate() {
            match kind {
                Entry::Gauge => *entry = gauge,
                Entry::TorsionCurvature => *entry = TORSION_CURVATURE,
                Entry::Weight(..) if attachment == Some(place) => *entry = 1.0,
                Entry::Weight(..) => {}
            }
        }
        entries
    }

    /// The weights of a curve that the device has divided by `size`; the weight of its gauge and ε of torsion are in the units of the input.
    pub fn weights(&self, size: f64, gauge: f64, torsion_curvature: f64) -> DeviceWeights {
        let scaled = |entry: &Entry| match *entry {
            Entry::Weight(weight, degree) => weight * size.powf(degree),
            Entry::Gauge => gauge * size * size,
            Entry::TorsionCurvature => torsion_curvature * size,
        };
        let weighing = self.entries.iter().filter(|entry| matches!(entry, Entry::Weight(..)));
        let unit = weighing.map(|entry| scaled(entry).abs()).fold(0.0, f64::max);
        let unit = if unit > 0.0 && unit.is_finite() { unit } else { 1.0 };
        let divided = |entry: &Entry| match entry {
            Entry::TorsionCurvature => scaled(entry),
            _ => scaled(entry) / unit,
        };
        DeviceWeights { entries: self.entries.iter().map(divided).collect(), unit }
    }
}

/// Whether two functionals are one but for their weights.
fn is_same(a: &Functional, b: &Functional) -> bool {
    match (a, b) {
        (Functional::Bending { exponent }, Functional::Bending { exponent: other }) => exponent == other,
        (Functional::Custom(a), Functional::Custom(b)) => std::sync::Arc::ptr_eq(a, b),
        _ => std::mem::discriminant(a) == std::mem::discriminant(b),
    }
}

/// Edges that a term sees; an attachment sees none, but a sweep has at least one.
fn edges(functional: &Functional) -> usize {
    match functional {
        Functional::Length | Functional::Tension | Functional::Attachment => 1,
        Functional::Bending { .. } => 2,
        Functional::Variation | Functional::Torsion => 3,
        Functional::Custom(custom) => custom.edges().clamp(1, 3),
    }
}

fn define_name(functional: &Functional) -> &'static str {
    match functional {
        Functional::Length => "LENGTH",
        Functional::Tension => "TENSION",
        Functional::Bending { .. } => "BENDING",
        Functional::Variation => "VARIATION",
        Functional::Torsion => "TORSION",
        Functional::Attachment => "ATTACHMENT",
        Functional::Custom(_) => "CUSTOM",
    }
}

/// A number as WGSL has it.
fn literal(x: f64) -> String {
    format!("{x:?}")
}

/// base^exponent in WGSL: products and square roots for multiples of a quarter up to six, else a call of `power`.
fn power(base: &str, exponent: f64) -> String {
    if exponent < 0.0 {
        return format!("real(1) / ({})", power(base, -exponent));
    }
    let quarters = 4.0 * exponent;
    if quarters != quarters.trunc() || exponent > 6.0 {
        return format!("power({base}, real({}))", literal(exponent));
    }
    let (whole, quarters) = (quarters as usize / 4, quarters as usize % 4);
    let mut factors = vec![base.to_string(); whole];
    if quarters & 2 != 0 {
        factors.push(format!("sqrt({base})"));
    }
    if quarters & 1 != 0 {
        factors.push(format!("sqrt(sqrt({base}))"));
    }
    let mut text = String::new();
    for (k, factor) in factors.iter().enumerate() {
        write!(text, "{}{factor}", if k > 0 { " * " } else { "" }).expect("writing to a string");
    }
    if text.is_empty() { "real(1)".into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::super::{bending, length, tension, torsion};
    use super::*;

    #[test]
    fn powers_of_quarters_are_products_and_roots() {
        let cases = [
            (0.0, "real(1)"),
            (1.0, "q"),
            (-1.0, "real(1) / (q)"),
            (2.25, "q * q * sqrt(sqrt(q))"),
            (-0.75, "real(1) / (sqrt(q) * sqrt(sqrt(q)))"),
            (1.35, "power(q, real(1.35))"),
            (-7.0, "real(1) / (power(q, real(7.0)))"),
        ];
        for (exponent, wanted) in cases {
            assert_eq!(power("q", exponent), wanted);
        }
    }

    #[test]
    fn equal_functionals_share_a_weight() {
        let energy = bending(2.0) + 0.5 * length() + 3.0 * bending(2.0);
        let composition = Composition::of(&energy, true, 2, Precision::F32).unwrap();
        assert_eq!(composition.width(), 3);
        // Of degrees −1 and 1, on a curve of size 4: 4/4 and 0.5·4; the larger is the unit. The gauge has degree 2.
        let weights = composition.weights(4.0, 0.25, 0.0);
        assert_eq!((weights.unit, weights.entries), (2.0, vec![0.5, 1.0, 2.0]));
    }

    #[test]
    fn the_curvature_of_torsion_is_scaled_as_curvatures_are() {
        let composition = Composition::of(&(tension() + torsion()), false, 3, Precision::F64).unwrap();
        let weights = composition.weights(0.5, 0.0, 1e-3);
        assert_eq!((weights.unit, weights.entries), (8.0, vec![0.25 / 8.0, 1.0, 5e-4]));
    }

    #[test]
    fn two_exponents_are_refused_in_a_sentence() {
        let error = Composition::of(&(bending(2.0) + bending(3.0)), false, 2, Precision::F32).unwrap_err();
        assert_eq!(error, "a kernel has room for one exponent of bending, and there are two: fit on the CPU");
    }
}
