"""Finds the lines of least curvature on made race tracks by `faircurve path` and TUM's helpers, and compares them.

    python benches/peers/race.py [--program PATH]

Tracks are closed, with a point about every 5 m and widths that vary from 3.3 to 7.2 m. The helpers are `opt_min_curv` of
trajectory-planning-helpers 0.79, one quadratic programme about the centre line, and its repetition `iqp_handler`. All lines are made
periodic splines by arc length, with ∫κ² by 4,000 samples, and driven by one profile: 80 m/s, 10 m/s² across, 6 m/s² ahead and 9 m/s² back,
within an ellipse. `out` is how far a line leaves its widths. Milliseconds are of one run: the program from file to file, the helpers
without files.
"""

import argparse
import contextlib
import io
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import trajectory_planning_helpers as tph
from scipy.interpolate import CubicSpline
from shapely.geometry import Point, Polygon

SAMPLES, RADIUS = 4000, 5.0
SHAPES = {
    "bean": (300, 5.0, lambda t: 1 + 0.45 * np.cos(2 * t) + 0.12 * np.sin(3 * t)),
    "star": (320, 6.0, lambda t: 1 + 0.22 * np.sin(5 * t) + 0.1 * np.cos(3 * t)),
    "pin": (280, 4.5, lambda t: 1 + 0.3 * np.cos(t) + 0.28 * np.sin(4 * t) * np.cos(t)),
}


def track(scale: float, width: float, radius) -> np.ndarray:
    """Points with the widths to the right and to the left, as TUM writes them."""
    t = np.linspace(0, 2 * np.pi, 2000, endpoint=False)
    points = scale * np.c_[radius(t) * np.cos(t), 0.7 * radius(t) * np.sin(t)]
    closed = np.vstack([points, points[:1]])
    s = np.r_[0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T))]
    at = np.linspace(0, s[-1], int(s[-1] / 5), endpoint=False)
    turn = 2 * np.pi * at / s[-1]
    return np.c_[[np.interp(at, s, axis) for axis in closed.T]].T, np.c_[width + 1.2 * np.sin(3 * turn), width - 0.8 * np.cos(2 * turn)]


def sampled(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Samples of the periodic spline by arc length, their curvatures, and the length."""
    points = np.vstack([points, points[:1]])
    s = np.r_[0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    for _ in range(2):
        fine = np.linspace(0, s[-1], 20 * SAMPLES)
        length = np.r_[0, np.cumsum(np.hypot(*np.diff(CubicSpline(s, points, bc_type="periodic")(fine), axis=0).T))]
        s = np.interp(s, fine, length)
    spline, at = CubicSpline(s, points, bc_type="periodic"), np.linspace(0, s[-1], SAMPLES, endpoint=False)
    first, second = spline(at, 1), spline(at, 2)
    return spline(at), (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / np.hypot(*first.T) ** 3, s[-1]


def lap_time(curvature: np.ndarray, length: float) -> float:
    step, v = length / SAMPLES, np.minimum(80, np.sqrt(10 / np.maximum(abs(curvature), 1e-9)))

    def pass_by(order, away, most):
        for k in order:
            left = most * np.sqrt(max(0, 1 - (v[k] ** 2 * abs(curvature[k]) / 10) ** 2))
            v[(k + away) % SAMPLES] = min(v[(k + away) % SAMPLES], np.sqrt(v[k] ** 2 + 2 * left * step))

    for _ in range(2):
        pass_by(range(SAMPLES), 1, 6)
        pass_by(range(SAMPLES - 1, -1, -1), -1, 9)
    return float((step / v).sum())


def outside(samples: np.ndarray, centre: np.ndarray, widths: np.ndarray) -> float:
    along = np.roll(centre, -1, 0) - np.roll(centre, 1, 0)
    left = np.c_[-along[:, 1], along[:, 0]] / np.hypot(*along.T)[:, None]
    inner, outer = sorted((Polygon(centre - left * widths[:, :1]), Polygon(centre + left * widths[:, 1:])), key=lambda own: own.area)
    points = [Point(p) for p in samples[::4]]
    return max(max(0 if outer.contains(p) else outer.distance(p), inner.exterior.distance(p) if inner.contains(p) else 0) for p in points)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/faircurve")
    program = parser.parse_args().program
    print(f"{'track':6}{'line':34}{'∫κ² (1/m)':>10}{'length (m)':>12}{'lap (s)':>9}{'out (m)':>9}{'ms':>7}")
    for name, (scale, width, radius) in SHAPES.items():
        centre, widths = track(scale, width, radius)

        def line(what: str, find) -> None:
            start = time.perf_counter()
            with contextlib.redirect_stdout(io.StringIO()):
                points = find()
            seconds = time.perf_counter() - start
            samples, curvature, length = sampled(points)
            energy, out = (curvature**2).mean() * length, outside(samples, centre, widths)
            print(f"{name:6}{what:34}{energy:10.5f}{length:12.1f}{lap_time(curvature, length):9.2f}{out:9.3f}{1e3 * seconds:7.0f}")

        def once() -> np.ndarray:
            _, _, system, normals = tph.calc_splines.calc_splines(path=np.vstack([centre, centre[:1]]))
            reference = np.c_[centre, widths]
            moved, _ = tph.opt_min_curv.opt_min_curv(
                reftrack=reference, normvectors=normals, A=system, kappa_bound=1 / RADIUS, w_veh=0.0, closed=True
            )
            return centre + normals * moved[:, None]

        def repeated() -> np.ndarray:
            _, _, system, normals = tph.calc_splines.calc_splines(path=np.vstack([centre, centre[:1]]))
            none = np.zeros(1)
            moved, reference, normals, *_ = tph.iqp_handler.iqp_handler(
                reftrack=np.c_[centre, widths], normvectors=normals, A=system, kappa_bound=1 / RADIUS, w_veh=0.0, print_debug=False,
                plot_debug=False, stepsize_interp=5.0, spline_len=none, psi=none, kappa=none, dkappa=none
            )  # fmt: skip
            return reference[:, :2] + normals * moved[:, None]

        def fair(energy: str) -> np.ndarray:
            with tempfile.TemporaryDirectory() as folder:
                given, out = pathlib.Path(folder, "track.csv"), pathlib.Path(folder, "line.csv")
                np.savetxt(given, np.c_[centre, widths], delimiter=",", header="x_m,y_m,w_tr_right_m,w_tr_left_m", fmt="%.6f")
                options = f"--min-radius {RADIUS} --deviation 9 --closed yes --samples 2 --energy {energy} -q"
                # 1 tells of a curve that has not converged.
                subprocess.run([program, "path", given, "-o", out, *options.split()], check=False)
                points = np.loadtxt(out, delimiter=",", skiprows=1, usecols=(1, 2))
            return points[:-1] if np.array_equal(points[0], points[-1]) else points

        line("the centre", lambda: centre)
        line("opt_min_curv", once)
        line("iqp_handler", repeated)
        line("faircurve path, bending=1", lambda: fair("bending=1"))
        line("faircurve path, and tautness=0.05", lambda: fair("bending=1,tautness=0.05"))


if __name__ == "__main__":
    main()
