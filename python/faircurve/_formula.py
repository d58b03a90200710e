"""Formulas of custom energies: what a function of tangents and lengths computes, recorded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ._energy import Energy

Number = float | int


class Expression:
    """A number that a formula computes.

    It has ``+``, ``-``, ``*``, ``/`` with others and with numbers, ``**`` with numbers, :func:`abs` and the methods here. Formulas are
    recorded when they are called, so a comparison is written with :meth:`if_positive` or :meth:`maximum`.
    """

    __slots__ = ("kind", "number", "operands")
    # NumPy's numbers leave operators to expressions.
    __array_ufunc__ = None

    def __init__(self, kind: str, number: float = 0.0, *operands: Expression) -> None:
        self.kind: str = kind
        self.number: float = number
        self.operands: tuple[Expression, ...] = operands

    def __add__(self, other: Expression | Number) -> Expression:
        return Expression("add", 0.0, self, _number(other))

    def __radd__(self, other: Number) -> Expression:
        return _number(other) + self

    def __sub__(self, other: Expression | Number) -> Expression:
        return Expression("subtract", 0.0, self, _number(other))

    def __rsub__(self, other: Number) -> Expression:
        return _number(other) - self

    def __mul__(self, other: Expression | Number) -> Expression:
        return Expression("multiply", 0.0, self, _number(other))

    def __rmul__(self, other: Number) -> Expression:
        return _number(other) * self

    def __truediv__(self, other: Expression | Number) -> Expression:
        return Expression("divide", 0.0, self, _number(other))

    def __rtruediv__(self, other: Number) -> Expression:
        return _number(other) / self

    def __neg__(self) -> Expression:
        return 0.0 - self

    def __pow__(self, exponent: Number) -> Expression:
        return Expression("power", float(exponent), self)

    def __abs__(self) -> Expression:
        return self.if_positive(self, -self)

    def __bool__(self) -> bool:
        raise TypeError("a formula is recorded once and has no value yet: write x.if_positive(yes, no) or x.maximum(y)")

    def sqrt(self) -> Expression:
        """√x."""
        return Expression("sqrt", 0.0, self)

    def if_positive(self, yes: Expression | Number, no: Expression | Number) -> Expression:
        """``yes`` where this is > 0, else ``no``."""
        return Expression("if_positive", 0.0, self, _number(yes), _number(no))

    def maximum(self, other: Expression | Number) -> Expression:
        """The larger of two."""
        return (self - other).if_positive(self, other)


@dataclass(frozen=True)
class ExpressionVector:
    """A vector of three expressions; z is 0 in the plane."""

    x: Expression
    y: Expression
    z: Expression
    __array_ufunc__ = None

    def __add__(self, other: ExpressionVector) -> ExpressionVector:
        return ExpressionVector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: ExpressionVector) -> ExpressionVector:
        return ExpressionVector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, factor: Expression | Number) -> ExpressionVector:
        return ExpressionVector(self.x * factor, self.y * factor, self.z * factor)

    __rmul__ = __mul__

    def dot(self, other: ExpressionVector) -> Expression:
        """a·b."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: ExpressionVector) -> ExpressionVector:
        """a × b."""
        return ExpressionVector(
            self.y * other.z - self.z * other.y, self.z * other.x - self.x * other.z, self.x * other.y - self.y * other.x
        )


def custom(
    name: str,
    edges: int,
    degree: float,
    term: Callable[[Sequence[ExpressionVector], Sequence[Expression]], Expression],
) -> Energy:
    """A custom energy: the sum of a term over every run of consecutive edges of a curve, on the CPU or on a GPU.

    Parameters
    ----------
    name : str
        The name, of letters, digits and underscores.
    edges : int
        The number of edges that a term sees, from 1 to 3. It is also the number of derivatives that the term holds.
    degree : float
        k in E(c·f) = c^k E(f), which is -1 for bending.
    term : callable
        The term, a function of the unit tangents and the lengths of the edges. It is called once. Its derivatives and its kernel
        follow from the formula.

    Examples
    --------
    >>> import faircurve as fc
    >>> elastica = fc.custom("elastica", 2, -1, lambda t, s: 2 * (t[1] - t[0]).dot(t[1] - t[0]) / (s[0] + s[1]))
    >>> points = [(0, 0), (1, 1), (2, 0)]
    >>> own, built_in = [fc.Fair(e + 0.1 * fc.length()).fit([points]).report()["energy"] for e in (elastica, fc.bending())]
    >>> bool(abs(own[0] - built_in[0]) < 1e-9)
    True
    """
    tangents = [ExpressionVector(*(Expression(axis, float(k)) for axis in "xyz")) for k in range(edges)]
    result = term(tangents, [Expression("length", float(k)) for k in range(edges)])
    if not isinstance(result, Expression):
        raise TypeError(f"the term of {name} is a {type(result).__name__}: it must be a number made of tangents and lengths")
    return Energy(((name, 1.0, (edges, float(degree), _recorded(result))),))


def _number(given: Expression | Number) -> Expression:
    return given if isinstance(given, Expression) else Expression("number", float(given))


def _recorded(result: Expression) -> tuple[tuple[str, float, tuple[int, ...]], ...]:
    """The operations, each after those that it needs."""
    places: dict[int, int] = {}
    steps: list[tuple[str, float, tuple[int, ...]]] = []
    pending = [result]
    while pending:
        step = pending[-1]
        missing = [operand for operand in step.operands if id(operand) not in places]
        if missing:
            pending.extend(missing)
            continue
        pending.pop()
        if id(step) not in places:
            places[id(step)] = len(steps)
            steps.append((step.kind, step.number, tuple(places[id(operand)] for operand in step.operands)))
    return tuple(steps)
