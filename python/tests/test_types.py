# pyright: strict
"""Scripts as users write them, which mypy --strict and pyright check and nobody runs but the test below.

``assert_type`` says what both must infer: samples are of the kind that came in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import faircurve as fc

if TYPE_CHECKING:
    from typing_extensions import assert_type
else:

    def assert_type(value: Any, kind: Any) -> Any:
        return value


Floats = NDArray[np.float64]
Pair = tuple[NDArray[np.float64], NDArray[np.int64]]


def resampled(strokes: list[Floats], count: int) -> list[Floats]:
    return fc.Natural().fit(strokes).sample(points=count)


def smoothed(curves: Floats, t: Floats, weights: Floats) -> tuple[Floats, Floats]:
    fit = fc.Smoothing(lam="gcv").fit(curves, t=t, weights=weights, closed=False, device="cpu", precision="f64")
    return fit.sample(16), fit(t, nu=1)


def good(curves: Floats) -> fc.Fit[Floats]:
    fit = fc.Fair(fc.bending() + 0.1 * fc.length(), max_curvature=2.0).fit(curves, corridors=None)
    return fit[fit.status == "converged"]


def is_usable(status: fc.Status) -> bool:
    return status in fc.STATUSES and status != "invalid"


def kinds(array: Floats, single: NDArray[np.float32], offsets: NDArray[np.int64], points: Floats) -> None:
    assert_type(fc.Natural().fit(array).sample(8), Floats)
    assert_type(fc.Natural().fit(single).sample(8, by="length"), Floats)
    assert_type(fc.Natural().fit((points, offsets)).sample(8), Pair)
    assert_type(fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]]).sample(8), list[Floats])
    assert_type(fc.Natural().fit([points, points]).sample(8, return_t=True), tuple[list[Floats], list[Any]])
    assert_type(fc.ragged(array), fc.Ragged[Floats])
    assert_type(fc.Smooth(exponent=2.5).fit(fc.ragged([points])).sample(8), list[Floats])
    fit = fc.Geodesic("wgs84").fit(array)
    assert_type(fit(0.5), Floats)
    assert_type(fit([points[:, 0] for _ in range(4)]), list[Floats])
    assert_type(fit[3:5].sample(8), Floats)
    assert_type(fit.to_bezier(), list[Floats])
    assert_type(fit.knots[0], Any)


def statuses(curves: Floats) -> dict[str, list[str]]:
    methods = {"natural": fc.Natural(), "fair": fc.Fair(), "exact": fc.Smooth()}
    return {name: method.fit(curves).status.tolist() for name, method in methods.items()}


class Track:
    """A type of another library: what comes in comes out."""


def other(tracks: Track) -> Track:
    return fc.Natural().fit(tracks).sample(8)


def splines(x: Floats, y: Floats) -> Floats:
    made = fc.CubicSplineBatch(x, y, bc_type=((1, 0.0), "natural"), extrapolate="periodic")
    return made.derivative().integrate(0.0, 1.0)


def lengths(fits: dict[str, fc.Fit[Any]]) -> dict[str, float]:
    return {name: float(np.sum(fit.length)) for name, fit in fits.items()}


def elastica() -> fc.Energy:
    return fc.custom("elastica", 2, -1, lambda t, s: 2 * (t[1] - t[0]).dot(t[1] - t[0]) / (s[0] + s[1]))


def test_the_scripts_run() -> None:
    random = np.random.default_rng(3)
    curves = random.normal(size=(4, 6, 2)).cumsum(axis=1)
    t = np.broadcast_to(np.arange(6.0), (4, 6)).copy()
    assert [len(one) for one in resampled(list(curves), 9)] == [9] * 4
    samples, slopes = smoothed(curves, t, np.ones((4, 6)))
    assert samples.shape == (4, 16, 2) and slopes.shape == (4, 6, 2)
    assert good(curves).sample(5).shape[1:] == (5, 2) and is_usable("converged") and not is_usable("invalid")
    kinds(curves, curves.astype(np.float32), np.array([0, 6, 12]), curves[:2].reshape(-1, 2))
    assert set(statuses(curves)) == {"natural", "fair", "exact"}
    assert splines(np.arange(5.0), random.normal(size=(3, 5))).shape == (3,)
    assert set(lengths({"natural": fc.Natural().fit(curves)})) == {"natural"}
    assert fc.Fair(elastica()).fit(curves[:1]).status[0] in fc.STATUSES
