//! The papers' own procedures, their tables and their figures.
//!
//! faircurve is measured against these procedures. No fit uses them. The program `faircurve-papers`
//! repeats what the papers show.
//!
//! | module | procedure | source |
//! |---|---|---|
//! | [`renka`] | descents by ordinary and Sobolev gradients and by Newton's method, step by step | Renka 2006 |
//! | [`toms828`] | nonlinear splines as graphs y(t) | Renka 2003, Algorithm 828 |
//! | [`searches`] | greedy search and Gaussian adaptation for the slopes at dots | Alon & Bergmann |
//! | [`programmes`] | the linear programmes whose solutions are the sparse rules | Weimer & Warren 1997 |
//! | [`unbounded`] | the exact subdivision rule of a grid without borders, in closed form | Weimer & Warren 1997 |
//! | [`experiments`] | what the papers show, computed again | all of them, and Eberly 2010 |

mod banded;
pub mod experiments;
mod line_search;
mod picture;
pub mod programmes;
pub mod renka;
pub mod searches;
pub mod toms828;
pub mod unbounded;
