"""Smooths made tracks of ships by `faircurve track`, a Kalman smoother and SciPy, and compares with the truth.

    python benches/peers/tracks.py [--program PATH] [--fixes 600] [--tracks 10]

Ships go by geodesics of WGS84 (geographiclib) with a course that wanders: 8 m/s, a fix a minute, noise of 15 m in each direction. The
Kalman smoother (Rauch, Tung, Striebel; nearly constant velocity) and SciPy's make_smoothing_spline without lam work in metres east and
north of the middle of each track. The Kalman smoother is told the true noise, and the intensity of the acceleration that is best in
hindsight of 20; faircurve and SciPy are told nothing. SciPy seeks λ up to the number of points, so it gets fixes as the unit of time:
with seconds it follows the noise. Errors are root mean squares at the fixes. Seconds are of one run: the program
from file to file, the peers in Python without files.
"""

import argparse
import csv
import math
import pathlib
import subprocess
import tempfile
import time

import numpy as np
from geographiclib.geodesic import Geodesic
from scipy.interpolate import make_smoothing_spline

EARTH = Geodesic.WGS84
SPEED, STEP, NOISE = 8.0, 60.0, 15.0
STARTS = [(55, 10), (-17, 179.95), (0, 0), (70, 20), (36, -5), (-40, 150), (10, -80), (25, 55), (50, -4), (60, -30)]


def track(rng: np.random.Generator, latitude: float, longitude: float, fixes: int) -> tuple[np.ndarray, np.ndarray]:
    """The truth (latitude, longitude, course) and the fixes (latitude, longitude)."""
    course, turn = rng.uniform(0, 360), 0.0
    truth, noisy = [], []
    for _ in range(fixes):
        truth.append((latitude, longitude, course % 360))
        east, north = rng.normal(0, NOISE, 2)
        fix = EARTH.Direct(latitude, longitude, math.degrees(math.atan2(east, north)), math.hypot(east, north))
        noisy.append((fix["lat2"], fix["lon2"]))
        for _ in range(6):
            turn = 0.98 * turn + rng.normal(0, 0.003)
            course += turn * STEP / 6
            at = EARTH.Direct(latitude, longitude, course, SPEED * STEP / 6)
            latitude, longitude, course = at["lat2"], at["lon2"], at["azi2"]
    return np.array(truth), np.array(noisy)


def local(noisy: np.ndarray, middle: tuple[float, float]) -> np.ndarray:
    """Metres east and north of a middle, by geodesics."""
    away = [EARTH.Inverse(*middle, *point) for point in noisy]
    return np.array([[a["s12"] * math.sin(math.radians(a["azi1"])), a["s12"] * math.cos(math.radians(a["azi1"]))] for a in away])


def back(plane: np.ndarray, middle: tuple[float, float]) -> np.ndarray:
    ends = [EARTH.Direct(*middle, math.degrees(math.atan2(x, y)), math.hypot(x, y)) for x, y in plane]
    return np.array([[end["lat2"], end["lon2"]] for end in ends])


def kalman(z: np.ndarray, intensity: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and velocities of nearly constant velocity, smoothed."""
    n, f = len(z), np.array([[1, STEP], [0, 1]])
    q = intensity * np.array([[STEP**3 / 3, STEP**2 / 2], [STEP**2 / 2, STEP]])
    x, p = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
    ahead_x, ahead_p = np.zeros((n, 2, 2)), np.zeros((n, 2, 2))
    state, cov = np.array([z[0], (z[1] - z[0]) / STEP]), np.diag([NOISE**2, 2 * (NOISE / STEP) ** 2])
    for k in range(n):
        if k > 0:
            state, cov = f @ state, f @ cov @ f.T + q
        ahead_x[k], ahead_p[k] = state, cov
        gain = cov[:, 0] / (cov[0, 0] + NOISE**2)
        state = state + np.outer(gain, z[k] - state[0])
        cov = cov - np.outer(gain, cov[0])
        x[k], p[k] = state, cov
    for k in range(n - 2, -1, -1):
        c = p[k] @ f.T @ np.linalg.inv(ahead_p[k + 1])
        x[k] = x[k] + c @ (x[k + 1] - ahead_x[k + 1])
    return x[:, 0], x[:, 1]


def errors(places: np.ndarray, speeds: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    away = [EARTH.Inverse(a[0], a[1], b[0], b[1])["s12"] for a, b in zip(places, truth)]
    return math.sqrt(np.mean(np.square(away))), math.sqrt(np.mean((speeds - SPEED) ** 2))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default="target/release/faircurve")
    parser.add_argument("--fixes", type=int, default=600)
    parser.add_argument("--tracks", type=int, default=10)
    args = parser.parse_args()
    rng = np.random.default_rng(2)
    made = [track(rng, *STARTS[k % len(STARTS)], args.fixes) for k in range(args.tracks)]
    rows: dict[str, tuple[list, float]] = {}

    rows["the fixes, by chords"] = ([], 0.0)
    for truth, noisy in made:
        chords = [EARTH.Inverse(*a, *b)["s12"] / STEP for a, b in zip(noisy, noisy[1:])]
        rows["the fixes, by chords"][0].append(errors(noisy, np.array(chords + chords[-1:]), truth))
    with tempfile.TemporaryDirectory() as folder:
        given, out = pathlib.Path(folder, "in.csv"), pathlib.Path(folder, "out.csv")
        with given.open("w") as file:
            file.write("curve,lon,lat,t\n")
            for i, (_, noisy) in enumerate(made):
                file.writelines(f"{i},{lon:.9f},{lat:.9f},{STEP * k}\n" for k, (lat, lon) in enumerate(noisy))
        for options in [[], ["--within", "40m"], ["--within", "50m"]]:
            command = [args.program, "track", given, "-o", out, "--samples", "1", "--write", "speed", "--force", "-q"]
            start = time.perf_counter()
            subprocess.run([*command, *options], check=True)
            seconds = time.perf_counter() - start
            with out.open() as file:
                read = list(csv.DictReader(file))
            found = []
            for i, (truth, _) in enumerate(made):
                own = [row for row in read if row["curve"] == str(i)]
                places = np.array([[float(row["y"]), float(row["x"])] for row in own])
                found.append(errors(places, np.array([float(row["speed"]) for row in own]), truth))
            rows[" ".join(["faircurve track", *options])] = (found, seconds)

    middles = [tuple(noisy[len(noisy) // 2]) for _, noisy in made]
    planes = [local(noisy, middle) for (_, noisy), middle in zip(made, middles)]
    start, found = time.perf_counter(), []
    t = np.arange(args.fixes)
    splines = [[make_smoothing_spline(t, plane[:, axis]) for axis in (0, 1)] for plane in planes]
    seconds = time.perf_counter() - start
    for (truth, _), middle, own in zip(made, middles, splines):
        places = back(np.stack([spline(t) for spline in own], axis=1), middle)
        speeds = np.hypot(*[spline.derivative()(t) for spline in own]) / STEP
        found.append(errors(places, speeds, truth))
    rows["SciPy make_smoothing_spline, east and north"] = (found, seconds)
    best = None
    for intensity in np.geomspace(1e-9, 1e-2, 20):
        start = time.perf_counter()
        smooth = [kalman(plane, intensity) for plane in planes]
        seconds = time.perf_counter() - start
        found = [
            errors(back(x, middle), np.hypot(v[:, 0], v[:, 1]), truth)
            for (x, v), middle, (truth, _) in zip(smooth, middles, made)
        ]
        if best is None or np.mean(found, axis=0)[0] < np.mean(best[0], axis=0)[0]:
            best = (found, seconds)
    rows["Kalman smoother, told noise and the best intensity"] = best

    print(f"{args.tracks} tracks of {args.fixes} fixes, noise {NOISE} m a direction\n")
    print("| | position (m) | speed (m/s) | seconds |\n|---|---|---|---|")
    for name, (found, seconds) in rows.items():
        position, speed = np.sqrt(np.mean(np.square(found), axis=0))
        print(f"| {name} | {position:.1f} | {speed:.3f} | {seconds:.3f} |")


main()
