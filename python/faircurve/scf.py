"""Smooth connection functions between two points (Alon & Bergmann): what a segment costs. Whole curves: :class:`faircurve.Smooth`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._arrays import Floats, floats

__all__ = ["Costs", "segments"]


class Costs(NamedTuple):
    """What segments cost, NaN where there is no minimiser."""

    cost: Floats
    """∫|κ|^ν ds, shape (…)."""
    gradient: Floats
    """Derivatives in the two angles, shape (…, 2)."""
    hessian: Floats
    """Second derivatives in the two angles, shape (…, 2, 2)."""


def segments(angles: Any, chord: Any = 1.0, exponent: Any = 2.0, *, device: str = "auto", precision: str = "auto") -> Costs:
    """The least ∫|κ|^ν ds of planar curves between two points, for millions of pairs at once.

    Parameters
    ----------
    angles : (…, 2) array
        Angles of the tangents at both ends from the chord (radians from −π to π).
    chord : (…) array or float
        Distances of the two points.
    exponent : (…) array or float
        ν > 1. Few different ones are fastest.

    Returns
    -------
    Costs
        Relative errors of costs are about 1e-13 on the CPU. Segments that turn by 180° or more have no minimiser.

    Examples
    --------
    Both ends perpendicular to the chord: (2π/ϖ)², ϖ the lemniscate constant.

    >>> import numpy as np
    >>> from faircurve import scf
    >>> round(float(scf.segments([np.pi / 2, -np.pi / 2]).cost), 12)
    5.742160088369
    """
    turned = floats(angles, "angles")
    if turned.ndim == 0 or turned.shape[-1] != 2:
        raise ValueError(f"angles have the shape {turned.shape}; their last axis holds two, one for each end")
    shape = turned.shape[:-1]

    def each(given: Any, what: str) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(floats(given, what).reshape(np.shape(given)), shape)).reshape(-1)

    six = _core.segments(each(chord, "chord"), turned.reshape(-1), each(exponent, "exponent"), device, precision).reshape(*shape, 6)
    return Costs(six[..., 0], six[..., 1:3], six[..., [3, 4, 4, 5]].reshape(*shape, 2, 2))
