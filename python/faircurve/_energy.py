"""Energies of fair curves, added and scaled as in formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Formula = tuple[int, float, tuple[tuple[str, float, tuple[int, ...]], ...]]


@dataclass(frozen=True)
class Energy:
    """A weighted sum of energies.

    Made by :func:`bending`, :func:`geodesic_bending`, :func:`length`, :func:`tension`, :func:`tautness`, :func:`variation`, :func:`torsion`, :func:`attachment` and :func:`custom`.
    Weights are in units of the input; that of tautness against bending has none.

    >>> bending(2) + 0.1 * length()
    Energy(terms=(('bending', 1.0, 2.0), ('length', 0.1, 2.0)))
    """

    terms: tuple[tuple[str, float, float | Formula], ...]

    def __add__(self, other: Energy) -> Energy:
        if not isinstance(other, Energy):
            return NotImplemented
        return Energy(self.terms + other.terms)

    def __mul__(self, weight: float) -> Energy:
        return Energy(tuple((name, float(weight) * own, detail) for name, own, detail in self.terms))

    __rmul__ = __mul__

    def __radd__(self, other: object) -> Energy:
        # sum() begins with 0.
        return self if other == 0 else NotImplemented

    def __truediv__(self, divisor: float) -> Energy:
        return self * (1.0 / divisor)

    def has(self, name: str) -> bool:
        """Whether an energy takes part."""
        return any(term == name and weight > 0 for term, weight, _ in self.terms)


def _one(name: str, exponent: float = 2.0) -> Energy:
    return Energy(((name, 1.0, float(exponent)),))


def bending(exponent: float = 2.0) -> Energy:
    """∫ |κ|^ν ds, κ the curvature and ν ≥ 1 the exponent."""
    return _one("bending", exponent)


def geodesic_bending(exponent: float = 2.0) -> Energy:
    """∫ |κ_g|^ν ds, κ_g the curvature within a surface and ν ≥ 1 the exponent. For curves in a surface."""
    return _one("geodesic_bending", exponent)


def length() -> Energy:
    """∫ ds."""
    return _one("length")


def tension() -> Energy:
    """∫ |p′|² dt: elastic springs between neighbours."""
    return _one("tension")


def tautness() -> Energy:
    """∫ ds/w²: length, measured by the width w that the data leave a curve in each span. Beside bending its weight has no unit.

    w is the shortest of the span's chord and those beside it, times (1 + cos θ)/2 for the larger turn θ of the data's polygon at
    the span's ends, and at least a tenth of its chord.
    """
    return _one("tautness")


def variation() -> Energy:
    """∫ |dκ/ds|² ds, the variation of curvature; circles have none."""
    return _one("variation")


def torsion() -> Energy:
    """∫ τ² ds, τ the torsion of curves in space."""
    return _one("torsion")


def attachment() -> Energy:
    """Σ |p − q|² over the points q given: they are no longer fixed."""
    return _one("attachment")


def energy_of(given: Energy | Mapping[str, float]) -> Energy:
    """An energy, or one from names and weights such as ``{"bending": 1, "length": 0.1}``."""
    if isinstance(given, Energy):
        return given
    if isinstance(given, Mapping):
        return Energy(tuple((name, float(weight), 2.0) for name, weight in given.items()))
    raise TypeError(f"an energy is a sum such as bending() + 0.1 * length(), or a dict, not a {type(given).__name__}")
