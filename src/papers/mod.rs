//! The papers' own procedures, which no fit uses.
//!
//! The other modules are measured against them, and `faircurve experiments` shows them.
//!
//! | module | procedure | source |
//! |---|---|---|
//! | [`renka`] | descents by ordinary and Sobolev gradients and by Newton's method, step by step | Renka 2006 |
//! | [`toms828`] | nonlinear splines as graphs y(t) | Renka 2003, Algorithm 828 |
//! | [`searches`] | greedy search and Gaussian adaptation for the slopes at dots | Alon & Bergmann |
//! | [`exponent`] | the exponent ν whose curve comes nearest to a given shape | Alon & Bergmann |
//! | [`programmes`] | the linear programmes whose solutions are the sparse rules | Weimer & Warren 1997 |
//! | [`unbounded`] | the exact subdivision rule of a grid without borders, in closed form | Weimer & Warren 1997 |

pub mod exponent;
pub mod programmes;
pub mod renka;
pub mod searches;
pub mod toms828;
pub mod unbounded;
