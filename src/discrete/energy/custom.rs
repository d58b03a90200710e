//! Custom energies, given by a formula for their term.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Arc;

use super::formula::{Expression, ExpressionVector, Program, Tape};
use super::{Energy, Facts, Functional, MOST_EDGES, Partials, SecondPartials, Term, Visitor, Window};
use crate::linalg::Scalar;
use crate::sort;

impl Energy {
    /// A custom energy: Σ term(tangents, lengths) over every run of `edges` consecutive edges of a
    /// curve.
    ///
    /// The term is a function of unit tangents T and lengths Δs, with z = 0 in 2-D. It is called
    /// once per dimension to record its formula, from which its derivatives and its kernel follow.
    /// The name consists of letters, digits and underscores. `edges` is from 1 to [`MOST_EDGES`]
    /// and equals the order of the highest derivative that the term holds. `degree` is k in
    /// E(c·f) = c^k E(f), which is −1 for bending ∫κ² ds.
    ///
    /// ```
    /// use faircurve::discrete::{Energy, Fair, bending, length};
    /// use faircurve::{CurveBatch, Device};
    ///
    /// // ∫κ² ds
    /// let elastica = Energy::custom("elastica", 2, -1.0, |t, s| {
    ///     2.0 * (t[1] - t[0]).length_squared() / (s[0] + s[1])
    /// });
    /// let batch = CurveBatch::from_slices(&[&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]][..]])?;
    /// let of = |energy| Fair { energy, ..Fair::default() }.fit(&batch, &Device::cpu());
    /// let [own, built_in] = [of(elastica + 0.1 * length())?, of(bending(2.0) + 0.1 * length())?];
    /// assert!((own.reports()[0].energy - built_in.reports()[0].energy).abs() < 1e-12);
    /// # Ok::<(), faircurve::Error>(())
    /// ```
    pub fn custom(
        name: &str,
        edges: usize,
        degree: f64,
        term: impl for<'t> Fn(&[ExpressionVector<'t>], &[Expression<'t>]) -> Expression<'t>,
    ) -> Self {
        let derived = [2, 3].map(|dimension| Derived::of(&term, edges, dimension));
        Self::of(Functional::Custom(Arc::new(Custom { name: name.into(), edges, degree, derived })))
    }
}

/// A custom energy.
#[derive(Debug)]
pub(crate) struct Custom {
    pub name: String,
    edges: usize,
    degree: f64,
    /// In 2-D and in 3-D.
    derived: [Derived; 2],
}

/// A term, with its derivatives with respect to the components of its tangents, then to its
/// lengths.
#[derive(Debug)]
struct Derived {
    value: Program,
    /// The value, and the first derivatives.
    gradient: Program,
    /// The upper triangle of second derivatives, row by row.
    hessian: Program,
}

impl Derived {
    fn of(
        term: impl for<'t> Fn(&[ExpressionVector<'t>], &[Expression<'t>]) -> Expression<'t>,
        edges: usize,
        dimension: usize,
    ) -> Self {
        let tape = Tape::default();
        let component = |k: usize, c: usize| if c < dimension { tape.variable(k * dimension + c) } else { tape.zero() };
        let tangent = |k: usize| ExpressionVector { x: component(k, 0), y: component(k, 1), z: component(k, 2) };
        let tangents: Vec<_> = (0..edges).map(tangent).collect();
        let lengths: Vec<_> = (0..edges).map(|k| tape.variable(edges * dimension + k)).collect();
        let value = term(&tangents, &lengths);
        let count = edges * (dimension + 1);
        let first = tape.derivatives(value, count);
        let second: Vec<_> = (0..count).flat_map(|j| tape.derivatives(first[j], count).split_off(j)).collect();
        Derived {
            value: tape.program(&[value]),
            gradient: tape.program(&[&[value][..], &first].concat()),
            hessian: tape.program(&second),
        }
    }

    /// The term's functions in WGSL.
    fn wgsl(&self, name: &str, edges: usize, dimension: usize) -> String {
        let components = ["x", "y", "z"];
        let tangents = (0..edges * dimension).map(|at| format!("w.t{}.{}", at / dimension, components[at % dimension]));
        let variables: Vec<String> = tangents.chain((0..edges).map(|k| format!("w.s{k}"))).collect();
        let mut text = String::new();
        let mut add = |line: String| writeln!(text, "{line}").expect("writing to a string");
        let (statements, found) = self.value.wgsl(&variables);
        add(format!("fn {name}_value(w: Window) -> real {{\n{statements}    return {};\n}}\n", found[0]));
        let (statements, found) = self.gradient.wgsl(&variables);
        add(format!("fn {name}_gradient(w: Window) -> Partials {{\n{statements}    var p = Partials();"));
        add(format!("    p.value = {};", found[0]));
        for k in 0..edges {
            let by_tangent = found[1 + k * dimension..][..dimension].join(", ");
            add(format!("    p.t{k} = vector({by_tangent});\n    p.s{k} = {};", found[1 + edges * dimension + k]));
        }
        add(format!("    return p;\n}}\n\nfn {name}_hessian(w: Window) -> SecondPartials {{"));
        let (statements, found) = self.hessian.wgsl(&variables);
        add(format!("{statements}    var h = SecondPartials();"));
        let by = |i: usize, j: usize| &*found[place(i, j, variables.len())];
        for j in 0..edges {
            for k in 0..edges {
                let length = edges * dimension + k;
                let mixed: Vec<&str> = (0..dimension).map(|a| by(j * dimension + a, length)).collect();
                add(format!("    h.m{j}{k} = vector({});", mixed.join(", ")));
                if j <= k {
                    // Columns: components of the second tangent.
                    let entry = |at: usize| by(j * dimension + at % dimension, k * dimension + at / dimension);
                    let entries: Vec<&str> = (0..dimension * dimension).map(entry).collect();
                    add(format!("    h.t{j}{k} = matrix({});", entries.join(", ")));
                    add(format!("    h.s{j}{k} = {};", by(edges * dimension + j, length)));
                }
            }
        }
        add("    return h;\n}".into());
        text
    }
}

/// The index of entry (i, j) of a symmetric matrix in its upper triangle, stored row by row.
fn place(i: usize, j: usize, count: usize) -> usize {
    let (i, j) = (i.min(j), i.max(j));
    i * count - i * (i + 1) / 2 + j
}

impl Facts for Arc<Custom> {
    fn degree(&self) -> f64 {
        self.degree
    }

    fn stiffness(&self, _: f64) -> f64 {
        if self.edges == 1 { 1.0 } else { 2.0 }
    }

    fn definitions(&self, _: f64, dimension: usize) -> BTreeMap<&'static str, String> {
        sort::map([("WGSL", self.derived[dimension - 2].wgsl(&self.name, self.edges, dimension))])
    }

    fn check(&self) -> Result<(), String> {
        match self.edges {
            1..=MOST_EDGES => Ok(()),
            edges => {
                let name = &self.name;
                Err(format!("a term of the energy {name} is of {edges} edges; 1 to {MOST_EDGES} are possible"))
            }
        }
    }
}

/// Calls a visitor with the term of a custom energy.
#[inline(never)]
pub(super) fn visit<V: Visitor>(custom: &Custom, visitor: V) -> V::Output {
    // The compiler removes sizes above `MOST_EDGES`.
    match custom.edges {
        1 => visitor.visit(&Adapter::<1>(custom)),
        2 => visitor.visit(&Adapter::<2>(custom)),
        4 if MOST_EDGES >= 4 => visitor.visit(&Adapter::<4>(custom)),
        5 if MOST_EDGES >= 5 => visitor.visit(&Adapter::<5>(custom)),
        _ => visitor.visit(&Adapter::<3>(custom)),
    }
}

/// A custom energy as a [`Term`].
struct Adapter<'a, const W: usize>(&'a Custom);

impl<const W: usize> Adapter<'_, W> {
    fn run<S: Scalar, const D: usize>(
        &self,
        program: impl Fn(&Derived) -> &Program,
        window: &Window<S, D, W>,
    ) -> Vec<S> {
        let mut variables = Vec::with_capacity(W * (D + 1));
        window.tangent.iter().for_each(|tangent| variables.extend(tangent));
        variables.extend(window.length);
        program(&self.0.derived[D - 2]).run(&variables)
    }
}

impl<const W: usize> Term<W> for Adapter<'_, W> {
    fn value<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> S {
        self.run(|derived| &derived.value, window)[0]
    }

    fn gradient<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> Partials<S, D, W> {
        let found = self.run(|derived| &derived.gradient, window);
        Partials {
            value: found[0],
            tangent: std::array::from_fn(|k| std::array::from_fn(|c| found[1 + k * D + c])),
            length: std::array::from_fn(|k| found[1 + W * D + k]),
        }
    }

    fn hessian<S: Scalar, const D: usize>(&self, window: &Window<S, D, W>) -> SecondPartials<S, D, W> {
        let found = self.run(|derived| &derived.hessian, window);
        let by = |i: usize, j: usize| found[place(i, j, W * (D + 1))];
        let mut second = SecondPartials::<S, D, W>::ZERO;
        for j in 0..W {
            for k in 0..W {
                second.lengths[j][k] = by(W * D + j, W * D + k);
                for a in 0..D {
                    second.mixed[j][k][a] = by(j * D + a, W * D + k);
                    for b in 0..D {
                        second.tangents[j][k][a][b] = by(j * D + a, k * D + b);
                    }
                }
            }
        }
        second
    }
}
