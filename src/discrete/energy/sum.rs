//! [`Energy`]: weighted sums of functionals.

use std::ops::{Add, Mul};

use super::{Functional, LIMIT_KINDS, LimitTerms};
use crate::error::{Error, Result};

/// A weighted sum of energies.
///
/// ```
/// use faircurve::discrete::{bending, length};
/// let energy = bending(2.0) + 0.1 * length();
/// assert_eq!(energy.to_string(), "bending + 0.1 length");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Energy {
    terms: Vec<(f64, Functional)>,
    /// The largest number of region penalties per vertex.
    regions: usize,
    /// Whether the length has its own weight for each curve.
    has_tether: bool,
    /// Whether the area has a weight for each curve.
    has_area: bool,
}

impl Energy {
    /// One functional with weight 1.
    pub(crate) fn of(functional: Functional) -> Self {
        Energy { terms: vec![(1.0, functional)], ..Energy::default() }
    }

    /// The same energy, with this exponent in its bending terms.
    #[must_use]
    pub fn with_exponent(mut self, exponent: f64) -> Self {
        self.terms.iter_mut().for_each(|(_, functional)| functional.set_exponent(exponent));
        self
    }

    /// The weights and functionals.
    pub(crate) fn terms(&self) -> &[(f64, Functional)] {
        &self.terms
    }

    pub(crate) fn terms_mut(&mut self) -> &mut [(f64, Functional)] {
        &mut self.terms
    }

    /// Checks all weights, exponents and custom energies.
    ///
    /// # Errors
    /// A weight that is negative or not finite. An exponent below 1. A custom energy over no edges
    /// or too many.
    pub(crate) fn check(&self) -> Result<()> {
        for (weight, functional) in &self.terms {
            let word = functional.word();
            if !(*weight >= 0.0 && weight.is_finite()) {
                let why = format!("the weight of {word} is {weight}: give a finite number of at least 0");
                return Err(Error::argument(why));
            }
            functional.facts().check().map_err(Error::Argument)?;
        }
        Ok(())
    }

    /// Whether it contains an attachment to data, of any weight.
    pub(crate) fn is_attached(&self) -> bool {
        self.terms.iter().any(|(_, functional)| matches!(functional, Functional::Attachment))
    }

    /// Whether it contains geodesic bending, of any weight, and so needs a surface.
    pub(crate) fn is_geodesic(&self) -> bool {
        self.terms.iter().any(|(_, functional)| matches!(functional, Functional::GeodesicBending(_)))
    }

    /// Whether it contains tautness, of any weight, and so needs the spans.
    pub(crate) fn is_taut(&self) -> bool {
        self.terms.iter().any(|(_, functional)| matches!(functional, Functional::Tautness(_)))
    }

    /// The same energy, with the penalties of limits added.
    pub(crate) fn with_limits(&self, limit_terms: LimitTerms) -> Energy {
        let mut with_limits = self.clone();
        with_limits.terms.extend(limit_terms.quantities.into_iter().map(|quantity| (1.0, quantity)));
        if limit_terms.stretch {
            with_limits = with_limits + Energy::of(Functional::Length(Default::default()));
        }
        Energy {
            regions: limit_terms.regions,
            has_tether: limit_terms.stretch,
            has_area: limit_terms.area,
            ..with_limits
        }
    }

    /// Which kinds of penalties it contains.
    pub(crate) fn penalties(&self) -> [bool; LIMIT_KINDS] {
        let mut penalties = [false; LIMIT_KINDS];
        self.terms.iter().filter_map(|(_, functional)| functional.penalty()).for_each(|kind| penalties[kind] = true);
        penalties
    }

    /// The largest number of region penalties per vertex.
    pub(crate) fn regions(&self) -> usize {
        self.regions
    }

    /// Whether the area has a weight for each curve. Kernels do not support it.
    pub(crate) fn has_area(&self) -> bool {
        self.has_area
    }

    /// Whether [`with_limits`](Self::with_limits) has added penalties or weights.
    pub(crate) fn has_limits(&self) -> bool {
        self.regions > 0 || self.has_tether || self.has_area || self.penalties().contains(&true)
    }

    /// The weight of the attachment to data, 0 without one.
    pub(crate) fn attachment_weight(&self) -> f64 {
        self.terms.iter().filter(|(_, f)| matches!(f, Functional::Attachment)).map(|(weight, _)| weight).sum()
    }

    /// Whether a term of positive weight bounds the length of the curve.
    pub(crate) fn bounds_length(&self) -> bool {
        self.terms.iter().any(|(weight, functional)| *weight > 0.0 && functional.facts().bounds_length())
    }

    /// The highest order among the functionals of positive weight.
    pub fn order(&self) -> usize {
        self.terms
            .iter()
            .filter(|(weight, _)| *weight > 0.0)
            .map(|(_, functional)| functional.order())
            .max()
            .unwrap_or(0)
    }
}

impl Add for Energy {
    type Output = Energy;

    fn add(mut self, other: Energy) -> Energy {
        self.terms.extend(other.terms);
        self.regions = self.regions.max(other.regions);
        self.has_tether = self.has_tether || other.has_tether;
        self.has_area = self.has_area || other.has_area;
        self
    }
}

impl Mul<Energy> for f64 {
    type Output = Energy;

    fn mul(self, mut energy: Energy) -> Energy {
        energy.terms.iter_mut().for_each(|(weight, _)| *weight *= self);
        energy
    }
}

impl std::fmt::Display for Energy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, (weight, functional)) in self.terms.iter().enumerate() {
            f.write_str(if k > 0 { " + " } else { "" })?;
            if *weight != 1.0 {
                write!(f, "{weight} ")?;
            }
            write!(f, "{}{}", functional.word(), functional.facts().note())?;
        }
        Ok(())
    }
}
