//! The GPU against the CPU, and kernels against their twins.

#[path = "../common/chains.rs"]
mod chains;
#[path = "../common/elastica.rs"]
mod elastica;
#[path = "../common/meshes.rs"]
mod meshes;
#[path = "../common/rough.rs"]
mod rough;

mod bits;
mod browser;
mod common;
mod compilers;
mod conformance;
mod conformance_bezier;
mod conformance_bezier_chain;
mod conformance_discrete;
mod conformance_fair;
mod conformance_laplacian;
mod conformance_linalg;
mod conformance_scf;
mod conformance_scf_tension;
mod conformance_sheets;
mod conformance_smoothing;
mod conformance_surfaces;
mod conformance_texts;
mod robustness;
mod shader_lint;
mod twins;
