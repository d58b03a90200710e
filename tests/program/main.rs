//! The program, and what holds for all methods and formats.

mod any_batch;
mod builds;
mod cli;
mod cli_bezier;
mod cli_drawings;
mod cli_exponent;
mod cli_fair;
mod cli_fair_deviation;
mod cli_fair_limits;
mod cli_files;
mod cli_grid;
mod cli_map;
mod cli_scf;
mod cli_smoothing;
mod cli_surfaces;
mod cli_tracks;
mod experiments;
mod finished;
mod house;
mod io;
mod msrv;
mod public_face;
mod ran;
mod reference;
mod unfitted;
