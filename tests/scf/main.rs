//! Curves of least ∫|κ|^ν ds, made of smooth connection segments.

#[path = "../common/points.rs"]
mod points;
#[path = "../common/rough.rs"]
mod rough;
#[path = "../common/sides.rs"]
mod sides;

mod common;
mod curves;
mod made;
mod segments;
mod shape;
mod sites;
mod status;
mod tension;
mod universal;
