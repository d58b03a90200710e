//! Own surfaces with a text: what it reads from a table, the curves that it leaves to the CPU, and loops that a driver ends.

use std::sync::Arc;

use faircurve::discrete::{Fair, Segments, geodesic_bending, tautness};
use faircurve::surface::{Surface, SurfaceKernel};
use faircurve::{CurveBatch, Device, Precision};
use glam::{DMat3, DVec3};
use rand::RngExt;

use crate::common::{device, precisions, seeded};
use crate::conformance_surfaces::conform_in;

/// z = a x² + b y² + c x y, with a, b and c in a table, and behind them 300 and 0.
#[derive(Clone, Debug)]
struct Saddle {
    numbers: [f64; 3],
    /// What the text has besides F.
    more: &'static str,
    /// What it finds F by.
    value: &'static str,
    turns: usize,
}

impl Saddle {
    fn bend(&self) -> DMat3 {
        let [a, b, c] = self.numbers;
        DMat3::from_cols(DVec3::new(-2.0 * a, -c, 0.0), DVec3::new(-c, -2.0 * b, 0.0), DVec3::ZERO)
    }
}

impl Surface for Saddle {
    fn name(&self) -> String {
        "the saddle".into()
    }

    fn value(&self, x: DVec3) -> f64 {
        x.z + 0.5 * x.dot(self.bend() * x)
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        DVec3::Z + self.bend() * x
    }

    fn hessian(&self, _x: DVec3) -> DMat3 {
        self.bend()
    }

    fn third(&self, _x: DVec3, _along: DVec3) -> DMat3 {
        DMat3::ZERO
    }

    fn kernel(&self) -> Option<&dyn SurfaceKernel> {
        Some(self)
    }
}

impl SurfaceKernel for Saddle {
    fn text(&self) -> String {
        let text = "
            fn surface_bend() -> matrix {
                let c = -surface_table[2];
                return matrix(
                    vector(real(-2) * surface_table[0], c, real(0)),
                    vector(c, real(-2) * surface_table[1], real(0)),
                    vector(),
                );
            }
            fn surface_exact(x: vector) -> real {
                return x.z + real(0.5) * dot(x, surface_bend() * x);
            }
            fn surface_value(x: vector) -> real {
                return VALUE;
            }
            fn surface_gradient(x: vector) -> vector {
                return vector(real(0), real(0), real(1)) + surface_bend() * x;
            }
            fn surface_hessian(x: vector) -> matrix {
                return surface_bend();
            }
            fn surface_third(x: vector, along: vector) -> matrix {
                return matrix();
            }";
        text.replace("VALUE", self.value) + self.more
    }

    fn table(&self) -> Vec<f64> {
        [&self.numbers[..], &[300.0, 0.0]].concat()
    }

    fn loop_iterations(&self) -> usize {
        self.turns
    }
}

const SADDLE: Saddle = Saddle { numbers: [0.3, -0.2, 0.1], more: "", value: "surface_exact(x)", turns: 0 };

/// Curves of 5 points in the saddle, at x from −2 to 0 and from 0 to 2 in turn.
fn curves(surface: &Saddle) -> CurveBatch {
    let mut rng = seeded(81);
    let mut coords = Vec::new();
    for i in 0..20 {
        let start = if i % 2 == 0 { -2.0 } else { 0.1 };
        let y = rng.random_range(-1.0..1.0);
        for k in 0..5 {
            let (x, y) = (start + 0.45 * f64::from(k), y + rng.random_range(-0.2..0.2));
            coords.extend([x, y, -surface.value(DVec3::new(x, y, 0.0))]);
        }
    }
    CurveBatch::from_ragged(3, coords, (0..=20).map(|i| 5 * i).collect()).unwrap()
}

/// The curves of a surface on the GPU are those of the CPU; how many the CPU has descended is returned.
fn left(what: &str, surface: Saddle) -> Option<usize> {
    let device = device()?;
    if !precisions(device.as_gpu()?).contains(&Precision::F64) {
        return None;
    }
    let batch = curves(&surface);
    let energy = geodesic_bending(2.0) + tautness();
    let fair = Fair { energy, surface: Some(Arc::new(surface)), segments: Segments::PerSpan(8), ..Fair::default() };
    let report = conform_in(&[Precision::F64], what, &fair, &batch, &device);
    assert!(report.is_gpu);
    println!("{what}: {} of {} left to the CPU", report.finished_on_cpu, batch.len());
    let cpu = fair.fit(&batch, &Device::cpu()).unwrap();
    assert_eq!(cpu.usable(), batch.len());
    Some(report.finished_on_cpu)
}

#[test]
fn texts_read_the_numbers_of_a_table() {
    for numbers in [[0.3, -0.2, 0.1], [-0.5, 0.25, 0.0]] {
        let Some(left) = left("saddle", Saddle { numbers, ..SADDLE }) else { return };
        assert_eq!(left, 0);
    }
}

#[test]
fn curves_that_a_text_leaves_are_the_cpus_alone() {
    let more = "
        fn surface_jet(x: vector) -> SurfaceJet {
            return SurfaceJet(surface_value(x), surface_gradient(x), surface_hessian(x));
        }
        fn surface_project(x: vector) -> vector {
            if (x.x < real(0)) {
                return surface_left(x);
            }
            var foot = x;
            for (var k = 0u; k < 20u; k++) {
                let gradient = surface_gradient(foot);
                foot -= (surface_value(foot) / dot(gradient, gradient)) * gradient;
            }
            return foot;
        }";
    let Some(left) = left("half a saddle", Saddle { more, ..SADDLE }) else { return };
    assert_eq!(left, 10);
}

#[test]
fn curves_whose_loops_a_driver_ends_are_the_cpus() {
    // 300 turns that add nothing, where the surface names none.
    let more = "
        fn surface_slow(x: vector) -> real {
            var sum = surface_exact(x);
            for (var k = 0u; k < u32(surface_table[3]); k++) {
                sum += surface_table[4];
            }
            return sum;
        }";
    let Some(device) = device() else { return };
    let is_software = device.as_gpu().unwrap().summary().is_software();
    let Some(left) = left("a slow saddle", Saddle { more, value: "surface_slow(x)", ..SADDLE }) else { return };
    assert_eq!(left > 0, is_software, "{left}");
}

#[test]
fn curves_that_may_turn_loops_too_often_are_the_cpus() {
    let Some(device) = device() else { return };
    let is_software = device.as_gpu().unwrap().summary().is_software();
    let Some(left) = left("a saddle of many turns", Saddle { turns: 10_000, ..SADDLE }) else { return };
    assert!(left == 20 || !is_software, "{left}");
}
