//! The closest point of a triangle (C. Ericson, Real-Time Collision Detection, 2005, section
//! 5.1.5).

use glam::DVec3;

/// The part of a triangle that a point lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrianglePart {
    Corner(usize),
    /// The side from this corner to the next.
    Side(usize),
    Inside,
}

/// The closest point of a triangle, and the part that it lies on.
pub fn closest([a, b, c]: [DVec3; 3], x: DVec3) -> (DVec3, TrianglePart) {
    let (ab, ac) = (b - a, c - a);
    let [a1, a2] = [ab.dot(x - a), ac.dot(x - a)];
    if a1 <= 0.0 && a2 <= 0.0 {
        return (a, TrianglePart::Corner(0));
    }
    let [b1, b2] = [ab.dot(x - b), ac.dot(x - b)];
    if b1 >= 0.0 && b2 <= b1 {
        return (b, TrianglePart::Corner(1));
    }
    let beyond_c = a1 * b2 - b1 * a2;
    if beyond_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        return (a + a1 / (a1 - b1) * ab, TrianglePart::Side(0));
    }
    let [c1, c2] = [ab.dot(x - c), ac.dot(x - c)];
    if c2 >= 0.0 && c1 <= c2 {
        return (c, TrianglePart::Corner(2));
    }
    let beyond_b = c1 * a2 - a1 * c2;
    if beyond_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        return (a + a2 / (a2 - c2) * ac, TrianglePart::Side(2));
    }
    let beyond_a = b1 * c2 - c1 * b2;
    let (from_b, from_c) = (b2 - b1, c1 - c2);
    if beyond_a <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
        return (b + from_b / (from_b + from_c) * (c - b), TrianglePart::Side(1));
    }
    let sum = beyond_a + beyond_b + beyond_c;
    (a + beyond_b / sum * ab + beyond_c / sum * ac, TrianglePart::Inside)
}
