// What a sweep sums over its vertices: energies, the gauge apart, and the slope along a direction.
struct Swept {
    energy: real,
    gauge: real,
    slope: real,
}
