"""Bézier curves of least bending energy (Eberly): what is not given of them is completed.

Control points come as curves do: a ragged batch, each curve with its own number of control points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from . import _core
from ._arrays import Floats, ragged, split
from ._methods import _batch

__all__ = ["Chain", "Completed", "Simplify", "complete", "elevate", "reduce"]

_ENERGIES = ("tension", "bending", "variation")


def _weights(energy: Mapping[str, float]) -> list[float]:
    for name in energy:
        if name not in _ENERGIES:
            raise ValueError(f'there is no energy "{name}" of Béziers: {", ".join(_ENERGIES)} are possible')
    return [float(energy.get(name, 0.0)) for name in _ENERGIES]


@dataclass(frozen=True)
class Completed:
    """Control points, as the kind of thing that was given, and a report of arrays (see ``Fit.report``)."""

    controls: Any
    report: dict[str, Any]


def _completed(made: Any, given: Any, closed: Any) -> Completed:
    (coords, offsets), report = made
    coords = coords.reshape(-1, given.coords.shape[1])
    return Completed(given.back(coords, offsets, closed), {**report, "status": np.array(report["status"], object)})


def complete(
    controls: Any,
    *,
    known: Any = None,
    tangents: Any = None,
    energy: Mapping[str, float] | None = None,
    end_tangents: Literal["derivatives", "directions"] = "derivatives",
    device: str = "auto",
    precision: str = "auto",
) -> Completed:
    """Finds the control points that each Bézier curve lacks: those of least energy.

    Parameters
    ----------
    controls
        Control points (n_i, d) of every curve; those that are not known may be NaN.
    known : optional
        A flag a control point. By default those that are numbers.
    energy : dict
        Weights of ∫|X′|² (tension), ∫|X″|² (bending) and ∫|X‴|² (variation) over the parameter 0 … 1.

    Examples
    --------
    >>> import numpy as np
    >>> from faircurve import bezier
    >>> done = bezier.complete([[(0, 0), (np.nan, np.nan), (np.nan, np.nan), (3, 0)]])
    >>> np.round(done.controls[0], 12).tolist()
    [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]
    """
    given = ragged(controls)
    if known is None:
        known = split(np.asarray(np.isfinite(given.coords).all(axis=1)), given.offsets)
    batch, _ = _batch(given, closed=False, known=known, tangents=tangents)
    made = _core.complete(batch, _weights(energy or {"bending": 1.0}), end_tangents, device, precision)
    return _completed(made, given, batch.closed)


@dataclass(frozen=True)
class Chain:
    """Chains of Béziers of one degree, completed to the least energy.

    Parameters
    ----------
    degree : int
        A chain has ``degree`` control points a piece and one more.
    joints : {"free", "c1", "c2", "g1"}
        How pieces meet.
    lengths : {"chords", "equal"}
        How long pieces are in the parameter.
    energy : dict
        As in :func:`complete`.
    corners : float, optional
        Joints whose handles turn by more than this angle (degrees) stay corners.
    """

    degree: int = 3
    joints: Literal["free", "c1", "c2", "g1"] = "free"
    lengths: Literal["chords", "equal"] = "chords"
    energy: Mapping[str, float] | None = None
    corners: float | None = None

    def fit(self, controls: Any, *, known: Any = None, closed: Any = None, device: str = "auto", precision: str = "auto") -> Completed:
        """Completes every chain. ``known`` flags control points; by default those that are numbers."""
        given = ragged(controls)
        if known is None:
            known = split(np.asarray(np.isfinite(given.coords).all(axis=1)), given.offsets)
        batch, _ = _batch(given, closed=closed, known=known)
        weights = _weights(self.energy or {"bending": 1.0})
        made = _core.chain(batch, self.degree, self.joints, self.lengths, weights, self.corners, device, precision)
        return _completed(made, given, batch.closed)


@dataclass(frozen=True)
class Simplify:
    """As few cubics as possible within a tolerance of those given, measured both ways; corners (degrees) are kept.

    With ``extremes`` joints lie where x or y is extreme, with level handles, as fonts ask.
    """

    tolerance: float
    corners: float = 1.0
    extremes: bool = False

    def fit(self, controls: Any, *, closed: Any = None) -> Completed:
        """Simplifies chains of cubics."""
        given = ragged(controls)
        batch, _ = _batch(given, closed=closed)
        return _completed(_core.simplify(batch, self.tolerance, self.corners, self.extremes), given, batch.closed)


def elevate(controls: Any, by: int = 1, *, device: str = "auto", precision: str = "auto") -> Any:
    """Control points of the same curves, of a degree higher by ``by``.

    >>> from faircurve import bezier
    >>> bezier.elevate([[(0, 0), (2, 2)]])[0].tolist()
    [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]
    """
    given = ragged(controls)
    coords, offsets = _core.elevate(given.coords, given.offsets, by, device, precision)
    return given.back(coords.reshape(-1, given.coords.shape[1]), offsets, np.zeros(len(given), bool))


def reduce(controls: Any, by: int = 1, *, device: str = "auto", precision: str = "auto") -> tuple[Any, Floats]:
    """The nearest curves of a degree lower by ``by`` with the same ends, and how far away they are (units of the input)."""
    given = ragged(controls)
    (coords, offsets), errors = _core.reduce(given.coords, given.offsets, by, device, precision)
    return given.back(coords.reshape(-1, given.coords.shape[1]), offsets, np.zeros(len(given), bool)), errors
