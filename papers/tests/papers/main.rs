//! The papers' procedures find what the papers say, and the program writes it.

mod curves;
mod experiments;
mod programmes;
mod renka;
mod rules;
mod search;
mod toms828;
mod unbounded;
