//! Records, differentiates and evaluates the formulas of custom energies, and prints them in WGSL.
//!
//! Calling a function of [`Expression`]s records its operations as nodes of a [`Tape`]. A node
//! follows its operands, and no two nodes are equal. Reverse-mode differentiation appends the nodes
//! of the derivatives. A [`Program`] holds the nodes that some results need.
//!
//! Source: A. Griewank and A. Walther, *Evaluating Derivatives* (2008).

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::wgsl::{literal, power};
use crate::linalg::Scalar;

/// One operation. Numbers are stored as bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Node {
    Number(u64),
    Variable(usize),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Root(usize),
    Power(usize, u64),
    /// The second operand where the first is positive, else the third.
    IfPositive(usize, usize, usize),
}

impl Node {
    /// The same operation on other nodes.
    fn map(self, mut of: impl FnMut(usize) -> usize) -> Node {
        match self {
            Node::Number(_) | Node::Variable(_) => self,
            Node::Add(a, b) => Node::Add(of(a), of(b)),
            Node::Subtract(a, b) => Node::Subtract(of(a), of(b)),
            Node::Multiply(a, b) => Node::Multiply(of(a), of(b)),
            Node::Divide(a, b) => Node::Divide(of(a), of(b)),
            Node::Root(a) => Node::Root(of(a)),
            Node::Power(a, exponent) => Node::Power(of(a), exponent),
            Node::IfPositive(a, b, c) => Node::IfPositive(of(a), of(b), of(c)),
        }
    }
}

/// The recorded nodes, without duplicates.
#[derive(Debug, Default)]
pub(super) struct Tape {
    nodes: RefCell<Vec<Node>>,
    known: RefCell<BTreeMap<Node, usize>>,
}

impl Tape {
    pub fn variable(&self, index: usize) -> Expression<'_> {
        self.record(Node::Variable(index))
    }

    pub fn zero(&self) -> Expression<'_> {
        self.number(0.0)
    }

    fn number(&self, x: f64) -> Expression<'_> {
        self.record(Node::Number(x.to_bits()))
    }

    fn record(&self, node: Node) -> Expression<'_> {
        let add = || {
            let mut nodes = self.nodes.borrow_mut();
            nodes.push(node);
            nodes.len() - 1
        };
        Expression { tape: self, at: *self.known.borrow_mut().entry(node).or_insert_with(add) }
    }

    /// The derivatives of an expression with respect to variables 0 … count − 1.
    pub fn derivatives<'t>(&'t self, of: Expression<'t>, count: usize) -> Vec<Expression<'t>> {
        let zero = self.number(0.0);
        let mut adjoints = vec![zero; of.at + 1];
        adjoints[of.at] = self.number(1.0);
        let mut derivatives = vec![zero; count];
        for at in (0..=of.at).rev() {
            let (node, adjoint) = (self.nodes.borrow()[at], adjoints[at]);
            let here = Expression { tape: self, at };
            let of = |at: usize| Expression { tape: self, at };
            let mut add = |at: usize, x: Expression<'t>| adjoints[at] = adjoints[at] + x;
            match node {
                Node::Number(_) => {}
                Node::Variable(index) => derivatives[index] = adjoint,
                Node::Add(a, b) => {
                    add(a, adjoint);
                    add(b, adjoint);
                }
                Node::Subtract(a, b) => {
                    add(a, adjoint);
                    add(b, -adjoint);
                }
                Node::Multiply(a, b) => {
                    add(a, adjoint * of(b));
                    add(b, adjoint * of(a));
                }
                Node::Divide(a, b) => {
                    let share = adjoint / of(b);
                    add(a, share);
                    add(b, -(share * here));
                }
                Node::Root(a) => add(a, 0.5 * adjoint / here),
                Node::Power(a, bits) => {
                    let exponent = f64::from_bits(bits);
                    add(a, exponent * adjoint * of(a).powf(exponent - 1.0));
                }
                Node::IfPositive(a, b, c) => {
                    add(b, of(a).if_positive(adjoint, zero));
                    add(c, of(a).if_positive(zero, adjoint));
                }
            }
        }
        derivatives
    }

    /// The nodes that these expressions need.
    pub fn program(&self, results: &[Expression<'_>]) -> Program {
        let nodes = self.nodes.borrow();
        let mut is_needed = vec![false; nodes.len()];
        results.iter().for_each(|result| is_needed[result.at] = true);
        for at in (0..nodes.len()).rev() {
            if is_needed[at] {
                nodes[at].map(|below| {
                    is_needed[below] = true;
                    below
                });
            }
        }
        let mut places = vec![0; nodes.len()];
        let mut needed = Vec::new();
        for at in (0..nodes.len()).filter(|&at| is_needed[at]) {
            places[at] = needed.len();
            needed.push(nodes[at].map(|below| places[below]));
        }
        Program { nodes: needed, results: results.iter().map(|result| places[result.at]).collect() }
    }
}

/// A number that a formula computes.
///
/// It supports +, −, ·, / with other expressions and with `f64`, and the functions here. A formula
/// is recorded when it is called, so write a comparison with [`if_positive`](Self::if_positive) or
/// [`max`](Self::max).
#[derive(Clone, Copy, Debug)]
pub struct Expression<'t> {
    tape: &'t Tape,
    at: usize,
}

impl<'t> Expression<'t> {
    fn as_number(self) -> Option<f64> {
        match self.tape.nodes.borrow()[self.at] {
            Node::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// A constant of the same formula.
    #[must_use]
    pub fn number(self, x: f64) -> Self {
        self.tape.number(x)
    }

    /// √x
    #[must_use]
    pub fn sqrt(self) -> Self {
        match self.as_number() {
            Some(x) => self.tape.number(x.sqrt()),
            None => self.tape.record(Node::Root(self.at)),
        }
    }

    /// x^exponent for x ≥ 0.
    #[must_use]
    pub fn powf(self, exponent: f64) -> Self {
        match self.as_number() {
            Some(x) => self.tape.number(x.powf(exponent)),
            None if exponent == 0.0 => self.tape.number(1.0),
            None if exponent == 1.0 => self,
            None if exponent == 2.0 => self * self,
            None => self.tape.record(Node::Power(self.at, exponent.to_bits())),
        }
    }

    /// `yes` where this is > 0, else `no`.
    #[must_use]
    pub fn if_positive(self, yes: Self, no: Self) -> Self {
        match self.as_number() {
            Some(x) => {
                if x > 0.0 {
                    yes
                } else {
                    no
                }
            }
            None if yes.at == no.at => yes,
            None => self.tape.record(Node::IfPositive(self.at, yes.at, no.at)),
        }
    }

    /// The larger of two.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        (self - other).if_positive(self, other)
    }

    /// |x|
    #[must_use]
    pub fn abs(self) -> Self {
        self.if_positive(self, -self)
    }
}

/// Implements an operator of two expressions, and of an expression and a number on either side.
///
/// The arms give the result if one side is a particular number.
macro_rules! operator {
    ($Trait:ident, $method:ident, $Node:ident, $($sides:pat => $simple:expr),+) => {
        impl<'t> $Trait for Expression<'t> {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                match ((self.as_number(), self), (other.as_number(), other)) {
                    ((Some(a), _), (Some(b), _)) => self.tape.number(a.$method(b)),
                    $($sides => $simple,)+
                    _ => self.tape.record(Node::$Node(self.at, other.at)),
                }
            }
        }

        impl<'t> $Trait<f64> for Expression<'t> {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                self.$method(self.tape.number(other))
            }
        }

        impl<'t> $Trait<Expression<'t>> for f64 {
            type Output = Expression<'t>;

            fn $method(self, other: Expression<'t>) -> Expression<'t> {
                other.tape.number(self).$method(other)
            }
        }
    };
}

operator!(Add, add, Add, ((Some(0.0), _), (_, b)) => b, ((_, a), (Some(0.0), _)) => a);
operator!(Sub, sub, Subtract, ((_, a), (Some(0.0), _)) => a);
operator!(Mul, mul, Multiply,
    ((Some(0.0), zero), _) | (_, (Some(0.0), zero)) => zero,
    ((Some(1.0), _), (_, x)) | ((_, x), (Some(1.0), _)) => x);
operator!(Div, div, Divide, ((Some(0.0), zero), _) => zero, ((_, a), (Some(1.0), _)) => a);

impl Neg for Expression<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        0.0 - self
    }
}

/// A vector of three [`Expression`]s.
#[derive(Clone, Copy, Debug)]
pub struct ExpressionVector<'t> {
    /// The first component.
    pub x: Expression<'t>,
    /// The second component.
    pub y: Expression<'t>,
    /// The third component, 0 in the plane.
    pub z: Expression<'t>,
}

impl<'t> ExpressionVector<'t> {
    /// a·b
    #[must_use]
    pub fn dot(self, other: Self) -> Expression<'t> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// a × b
    #[must_use]
    pub fn cross(self, other: Self) -> Self {
        ExpressionVector {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// a·a
    #[must_use]
    pub fn length_squared(self) -> Expression<'t> {
        self.dot(self)
    }
}

impl Add for ExpressionVector<'_> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        ExpressionVector { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for ExpressionVector<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        ExpressionVector { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<'t> Mul<ExpressionVector<'t>> for Expression<'t> {
    type Output = ExpressionVector<'t>;

    fn mul(self, vector: ExpressionVector<'t>) -> ExpressionVector<'t> {
        ExpressionVector { x: self * vector.x, y: self * vector.y, z: self * vector.z }
    }
}

impl<'t> Mul<ExpressionVector<'t>> for f64 {
    type Output = ExpressionVector<'t>;

    fn mul(self, vector: ExpressionVector<'t>) -> ExpressionVector<'t> {
        vector.x.tape.number(self) * vector
    }
}

/// Results, with the operations that they need.
#[derive(Debug)]
pub(super) struct Program {
    nodes: Vec<Node>,
    /// The node of each result.
    results: Vec<usize>,
}

impl Program {
    /// Computes the results.
    pub fn run<S: Scalar>(&self, variables: &[S]) -> Vec<S> {
        let mut values: Vec<S> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            values.push(match *node {
                Node::Number(bits) => S::of(f64::from_bits(bits)),
                Node::Variable(index) => variables[index],
                Node::Add(a, b) => values[a] + values[b],
                Node::Subtract(a, b) => values[a] - values[b],
                Node::Multiply(a, b) => values[a] * values[b],
                Node::Divide(a, b) => values[a] / values[b],
                Node::Root(a) => values[a].sqrt(),
                Node::Power(a, bits) => values[a].powf(f64::from_bits(bits)),
                Node::IfPositive(a, b, c) => values[a].if_positive(values[b], values[c]),
            });
        }
        self.results.iter().map(|&at| values[at]).collect()
    }

    /// WGSL statements that compute the results from variables with these names, and the results'
    /// names.
    pub fn wgsl(&self, variables: &[String]) -> (String, Vec<String>) {
        let mut text = String::new();
        let mut names: Vec<String> = Vec::new();
        for (at, node) in self.nodes.iter().enumerate() {
            let name = |at: usize| &names[at];
            let value = match *node {
                Node::Number(bits) => {
                    names.push(format!("real({})", literal(f64::from_bits(bits))));
                    continue;
                }
                Node::Variable(index) => {
                    names.push(variables[index].clone());
                    continue;
                }
                Node::Add(a, b) => format!("{} + {}", name(a), name(b)),
                Node::Subtract(a, b) => format!("{} - {}", name(a), name(b)),
                Node::Multiply(a, b) => format!("{} * {}", name(a), name(b)),
                Node::Divide(a, b) => format!("{} / {}", name(a), name(b)),
                Node::Root(a) => format!("sqrt({})", name(a)),
                Node::Power(a, bits) => power(name(a), f64::from_bits(bits)),
                Node::IfPositive(a, b, c) => format!("select({}, {}, {} > real(0))", name(c), name(b), name(a)),
            };
            writeln!(text, "    let n{at} = {value};").expect("writing to a string");
            names.push(format!("n{at}"));
        }
        (text, self.results.iter().map(|&at| names[at].clone()).collect())
    }
}
