//! Splines, and the tridiagonal systems behind them.

#[path = "../common/sides.rs"]
mod sides;

mod band;
mod cross_validation;
mod in_surface;
mod in_surface_ends;
mod measures;
mod near_on_globe;
mod oracle;
mod piecewise;
mod samples;
mod scipy;
mod shape;
mod smoothing;
mod smoothing_bounds;
mod smoothing_closed;
mod smoothing_tube;
mod tridiagonal;
mod uniform;
