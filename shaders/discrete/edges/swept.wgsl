// What a sweep sums over its vertices: energies, the regularisation apart, and the slope along a direction.
struct Swept {
    energy: real,
    regularisation: real,
    slope: real,
}
