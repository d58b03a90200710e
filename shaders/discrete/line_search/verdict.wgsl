// What is said of a trial, and what bounds it.

const MOST_OF_AN_EDGE: real = real(0.5);

//:include damping/verdict.wgsl
