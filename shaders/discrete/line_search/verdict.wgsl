// What is said of a trial, and what bounds it.

// See src/discrete/line_search.rs.
const MOST_OF_AN_EDGE: real = real(0.5);

//:include damping/verdict.wgsl
