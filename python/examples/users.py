"""Seven users, before and after: what each writes with SciPy, NumPy and pandas, and what with faircurve, run on the same data.

usage: python users.py      needs scipy, pandas, geopandas and pyarrow
"""

import inspect
import time
from collections.abc import Callable
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyarrow as pa
import shapely
from scipy.interpolate import CubicSpline, make_smoothing_spline
from scipy.optimize import minimize

import faircurve as fc

random = np.random.default_rng(7)
x = np.cumsum(random.uniform(0.5, 2, (500, 12)), axis=1)
y = random.normal(size=(500, 12, 2)).cumsum(axis=1)
angles = np.linspace(0, 2 * np.pi, 25)[:-1]
radii = random.uniform(0.8, 1.2, (40, 24)) * 1000
land = gpd.GeoDataFrame({"name": range(40)}, geometry=[shapely.Polygon(np.stack([r * np.cos(angles) + 3000 * k, r * np.sin(angles)], axis=1)) for k, r in enumerate(radii)], crs=32632)
fixes = pd.concat(
    pd.DataFrame({"animal": f"elk {k}", "when": pd.Timestamp("2024-05-01", tz="UTC") + pd.to_timedelta(np.cumsum(random.uniform(20, 90, 50)), "min"), "lon": 10 + np.cumsum(random.normal(scale=0.01, size=50)), "lat": 60 + np.cumsum(random.normal(scale=0.005, size=50))})
    for k in range(20)
)  # fmt: skip
noisy = np.stack([np.linspace(0, 6, 40) + np.zeros((100, 1)), np.sin(np.linspace(0, 6, 40)) + random.normal(scale=0.1, size=(100, 40))], axis=2)
route = np.stack([np.linspace(0, 20, 6), [0, 2, -2, 2, -2, 0]], axis=1).astype(float)
strokes = pa.table({"id": range(200), "points": pa.array([one.tolist() for one in y[:200]], pa.list_(pa.list_(pa.float64(), 2)))})
fibres = [random.normal(size=(int(n), 3)).cumsum(axis=0) for n in random.integers(20, 60, 200)]


def migrant_before() -> Any:
    values, slopes, areas = [], [], []
    for t, p in zip(x, y):
        spline = CubicSpline(t, p, bc_type="natural")
        u = np.linspace(t[0], t[-1], 50)
        values.append(spline(u))
        slopes.append(spline(u, 1))
        areas.append(spline.integrate(t[0], t[-1]))
    return np.stack(values)


def migrant_after() -> Any:
    splines, u = fc.CubicSplineBatch(x, y, "natural"), np.linspace(x[:, 0], x[:, -1], 50, axis=1)
    values, slopes, areas = splines(u), splines(u, 1), splines.integrate(x[:, 0], x[:, -1])
    return values


def analyst_before() -> Any:
    shapes, lengths = [], []
    for polygon in land.geometry:
        ring = np.array(polygon.exterior.coords)
        t = np.concatenate([[0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(ring, axis=0), axis=1)))])
        spline = CubicSpline(t, ring, bc_type="periodic")
        u = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in zip(t, t[1:])])
        shape = shapely.Polygon(spline(u))
        shapes.append(shape)
        lengths.append(shape.exterior.length)
    smooth = land.set_geometry(gpd.GeoSeries(shapes, index=land.index, crs=land.crs))
    return smooth.assign(length=lengths).area.to_numpy()


def analyst_after() -> Any:
    fit = fc.Natural().fit(land, topology=False)
    return fit.sample(8, by="span").assign(length=fit.length).area.to_numpy()


def ecologist_before() -> Any:
    parts = []
    for animal, rows in fixes.groupby("animal", sort=False):
        rows = rows.sort_values("when")
        t = (rows["when"] - rows["when"].iloc[0]).dt.total_seconds().to_numpy()
        spline = CubicSpline(t, rows[["lon", "lat"]].to_numpy(), bc_type="natural")
        hours = pd.date_range(rows["when"].iloc[0].ceil("1h"), rows["when"].iloc[-1], freq="1h")
        u = (hours - rows["when"].iloc[0]).total_seconds().to_numpy()
        places, rates = spline(u), np.radians(spline(u, 1)) * 6_371_009
        rates[:, 0] *= np.cos(np.radians(places[:, 1]))
        heading = np.degrees(np.arctan2(rates[:, 0], rates[:, 1])) % 360
        parts.append(pd.DataFrame({"animal": animal, "when": hours, "lon": places[:, 0], "lat": places[:, 1], "speed": np.hypot(*rates.T), "heading": heading}))
    return pd.concat(parts, ignore_index=True)[["lon", "lat"]].to_numpy()


def ecologist_after() -> Any:
    tracks = fc.from_dataframe(fixes, by="animal", coords=("lon", "lat"), t="when")
    return fc.Natural().fit(tracks).at("1h")[["lon", "lat"]].to_numpy()


def notebook_before() -> Any:
    smooth = []
    for points in noisy:
        t = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        u = np.linspace(0, t[-1], 100)
        smooth.append(np.stack([make_smoothing_spline(t, points[:, k])(u) for k in range(2)], axis=1))
    return np.stack(smooth)


def notebook_after() -> Any:
    return fc.Smoothing(lam="gcv").fit(noisy).sample(100)


def engineer_before() -> Any:
    def curve(inner: Any) -> Any:
        return CubicSpline(np.arange(6), np.concatenate([route[:1], inner.reshape(-1, 2), route[-1:]]))

    def curvature(inner: Any) -> Any:
        (dx, dy), (ddx, ddy) = (curve(inner)(np.linspace(0, 5, 101), nu).T for nu in (1, 2))
        return (dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3

    def energy(inner: Any) -> float:
        speed = np.hypot(*curve(inner)(np.linspace(0, 5, 101), 1).T)
        return float(np.mean(curvature(inner) ** 2 * speed))

    near = {"type": "ineq", "fun": lambda inner: 1.5**2 - ((inner.reshape(-1, 2) - route[1:-1]) ** 2).sum(axis=1)}
    bound = {"type": "ineq", "fun": lambda inner: 0.5 - np.abs(curvature(inner))}
    found = minimize(energy, route[1:-1].ravel(), constraints=[near, bound], method="SLSQP")
    return curve(found.x)(np.linspace(0, 5, 101))


def engineer_after() -> Any:
    return fc.Fair(deviation=1.5, max_curvature=0.5).fit([route]).sample(101)[0]


def cluster_before() -> Any:
    samples, statuses = [], []
    for points in strokes["points"].to_pylist():
        p = np.array(points)
        try:
            t = np.concatenate([[0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1)))])
            samples.append(CubicSpline(t, p, bc_type="natural")(np.linspace(0, t[-1], 16)).tolist())
            statuses.append("converged")
        except ValueError:
            samples.append(points)
            statuses.append("invalid")
    made = strokes.append_column("fair_points", pa.array(samples, strokes.schema.field("points").type))
    return np.array(made.append_column("fair_status", pa.array(statuses))["fair_points"].to_pylist())


def cluster_after() -> Any:
    return np.array(fc.FairBatch(fc.Natural(), samples={"count": 16})(strokes)["fair_points"].to_pylist())


def anatomist_before() -> Any:
    resampled = []
    for line in fibres:
        t = np.concatenate([[0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(line, axis=0), axis=1)))])
        spline = CubicSpline(t, line, bc_type="natural")
        fine = np.linspace(0, t[-1], 20 * len(line))
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(spline(fine), axis=0), axis=1))])
        resampled.append(spline(np.interp(np.linspace(0, along[-1], 20), along, fine)))
    return np.stack(resampled)


def anatomist_after() -> Any:
    return np.stack(fc.Natural().fit(fibres).sample(20, by="length"))


def lines(function: Callable[[], Any]) -> int:
    """Lines of code of a function, but for its first."""
    return sum(bool(line.strip()) for line in inspect.getsource(function).splitlines()[1:])


def seconds(function: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    made = function()
    return time.perf_counter() - start, made


PAIRS = {
    "SciPy migrant": (migrant_before, migrant_after), "GeoPandas analyst": (analyst_before, analyst_after),
    "movement ecologist": (ecologist_before, ecologist_after), "notebook user": (notebook_before, notebook_after),
    "robotics engineer": (engineer_before, engineer_after), "cluster user": (cluster_before, cluster_after),
    "anatomist": (anatomist_before, anatomist_after),
}  # fmt: skip

if __name__ == "__main__":
    print(f"{'':<20}{'lines before':>13}{'after':>7}{'ms before':>11}{'after':>8}{'difference':>12}")
    for name, (before, after) in PAIRS.items():
        after()
        (slow, theirs), (fast, ours) = seconds(before), seconds(after)
        difference = np.abs(theirs - ours).max() / np.abs(theirs).max()
        print(f"{name:<20}{lines(before):>13}{lines(after):>7}{1e3 * slow:>11.1f}{1e3 * fast:>8.1f}{difference:>12.0e}")
