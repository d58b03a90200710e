//! [`Jet`]: a function with its derivatives at a point, and the rules for products and quotients.

use std::ops::AddAssign;

use glam::{DMat3, DVec3};

/// A function with its derivatives at a point.
#[derive(Clone, Copy, Debug)]
pub struct Jet {
    /// f
    pub value: f64,
    /// ∇f
    pub gradient: DVec3,
    /// ∇²f
    pub hessian: DMat3,
    /// The derivative of ∇²f along a vector.
    pub third: DMat3,
}

impl Jet {
    pub const ZERO: Self = Jet { value: 0.0, gradient: DVec3::ZERO, hessian: DMat3::ZERO, third: DMat3::ZERO };

    /// f g, with third derivatives along the vector of both.
    pub fn times(&self, other: &Self, along: DVec3) -> Self {
        let mut product = self.mixed(other, along);
        product.value = self.value * other.value;
        product.gradient += other.value * self.gradient;
        product.hessian += other.value * self.hessian;
        product.third += other.value * self.third;
        product.gradient += self.value * other.gradient;
        product.hessian += self.value * other.hessian;
        product.third += self.value * other.third;
        product
    }

    /// h = f/g, order by order from g h = f.
    pub fn over(&self, other: &Self, along: DVec3) -> Self {
        let value = self.value / other.value;
        let mut ratio = Jet { value, ..Jet::ZERO };
        ratio.gradient = (self.gradient - value * other.gradient) / other.value;
        let mixed = ratio.mixed(other, along).hessian;
        ratio.hessian = (self.hessian - value * other.hessian - mixed) * (1.0 / other.value);
        let mixed = ratio.mixed(other, along).third;
        ratio.third = (self.third - value * other.third - mixed) * (1.0 / other.value);
        ratio
    }

    /// The terms of a product's derivatives with derivatives of both factors.
    fn mixed(&self, other: &Self, along: DVec3) -> Self {
        let hessian = both(self.gradient, other.gradient);
        let half = |a: &Self, b: &Self| a.gradient.dot(along) * b.hessian + both(a.gradient, b.hessian * along);
        Jet { hessian, third: half(self, other) + half(other, self), ..Jet::ZERO }
    }
}

impl AddAssign for Jet {
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        self.gradient += other.gradient;
        self.hessian += other.hessian;
        self.third += other.third;
    }
}

/// a bᵀ + b aᵀ
pub fn both(a: DVec3, b: DVec3) -> DMat3 {
    outer(a, b) + outer(b, a)
}

/// a bᵀ
pub fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
