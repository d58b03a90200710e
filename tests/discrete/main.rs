//! Discrete fair curves and their energies.

#[path = "../common/elastica.rs"]
mod elastica;
#[path = "../common/meshes.rs"]
mod meshes;
#[path = "../common/points.rs"]
mod points;
#[path = "../common/rough.rs"]
mod rough;

mod common;
mod energies;
mod fair;
mod fair_area;
mod fair_constraints;
mod fair_corners;
mod fair_crossings;
mod fair_deviation;
mod fair_globe;
mod fair_limits;
mod fair_meshes;
mod fair_neighbours;
mod fair_obstacles;
mod fair_places;
mod fair_scf;
mod fair_shortest;
mod fair_starts;
mod fair_status;
mod fair_surfaces;
mod fair_terrain;
mod fair_written;
mod newton;
