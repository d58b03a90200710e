//! Bézier curves: made, changed, chained, and made of other curves.

#[path = "../common/chains.rs"]
mod chains;
#[path = "../common/distance.rs"]
mod distance;

mod beziers_out;
mod chain;
mod chain_corners;
mod chain_g1;
mod chain_least;
mod complete;
mod curves;
mod oracle;
mod reference;
mod simplify;
