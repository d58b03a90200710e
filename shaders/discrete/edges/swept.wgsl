// The sums of a sweep: the energy, the regularisation apart from it, and the slope along a
// direction.
struct Swept {
    energy: real,
    regularisation: real,
    slope: real,
}
