"""The compiled half: flat arrays and offsets in, flat arrays and offsets out. What people use stands in the package."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Offsets = NDArray[np.int64]
_Arrays = tuple[_Floats, _Offsets]

__all__ = [
    "Batch",
    "Fit",
    "Piecewise",
    "Surface",
    "__version__",
    "adapters",
    "chain",
    "complete",
    "elevate",
    "fair",
    "in_surface",
    "natural",
    "num_threads",
    "reduce",
    "run",
    "segments",
    "set_num_threads",
    "simplify",
    "smooth",
    "smoothing",
    "solve_tridiagonal",
    "subdivide",
    "watch",
]

__version__: str

@final
class Batch:
    def __new__(
        cls,
        coords: _Floats,
        offsets: _Offsets,
        *,
        closed: Sequence[bool] | None = None,
        t: _Floats | None = None,
        weights: _Floats | None = None,
        tangents: _Floats | None = None,
        curvatures: _Floats | None = None,
        exponents: _Floats | None = None,
        known: Sequence[bool] | None = None,
        pinned: Sequence[bool] | None = None,
        largest_curvatures: NDArray[np.float64] | None = None,
        corridors: NDArray[np.float64] | None = None,
        widths: _Floats | None = None,
        auto_closed: bool = False,
        topology: bool = False,
        degrees: bool = False,
        metres: float | None = None,
    ) -> Batch: ...
    def __len__(self) -> int: ...
    @property
    def closed(self) -> NDArray[np.bool_]: ...

@final
class Fit:
    def __len__(self) -> int: ...
    @property
    def dimension(self) -> int: ...
    @property
    def batch(self) -> Batch: ...
    @property
    def device(self) -> str: ...
    def report(self) -> dict[str, Any]: ...
    def sample(self, how: str, value: float, out: _Floats | None = None) -> _Arrays: ...
    def sample_parameters(self, how: str, value: float) -> _Floats: ...
    def evaluate(self, u: _Floats, u_offsets: _Offsets | None, nu: int) -> _Floats: ...
    def curvature(self, u: _Floats, u_offsets: _Offsets | None) -> _Floats: ...
    def lengths(self) -> _Floats: ...
    def max_curvatures(self) -> _Floats: ...
    def knots(self) -> tuple[_Floats, _Offsets]: ...
    def beziers(self, tolerances: _Floats) -> _Arrays: ...
    def select(self, numbers: Sequence[int]) -> Fit: ...
    def svg(self, width: float, points: bool) -> str: ...

@final
class Piecewise:
    def __new__(
        cls,
        x: _Floats,
        offsets: _Offsets,
        y: _Floats,
        columns: int,
        periodic: bool,
        start: tuple[int, _Floats] | None,
        end: tuple[int, _Floats] | None,
        device: str,
        precision: str,
    ) -> Piecewise: ...
    @property
    def order(self) -> int: ...
    @property
    def status(self) -> list[str]: ...
    @property
    def messages(self) -> list[str | None]: ...
    def coefficients(self) -> _Floats: ...
    def evaluate(self, x: _Floats, ends: _Offsets | None, nu: int, extrapolate: str) -> _Floats: ...
    def derivative(self, nu: int) -> Piecewise: ...
    def antiderivative(self, nu: int) -> Piecewise: ...
    def integrate(self, a: float, b: float, extrapolate: str) -> _Floats: ...
    def solve(self, y: float, extrapolate: str) -> tuple[_Floats, _Offsets]: ...

@final
class Surface:
    @staticmethod
    def named(text: str) -> Surface: ...
    @staticmethod
    def height_field(heights: _Floats, spacing: tuple[float, float], origin: tuple[float, float]) -> Surface: ...
    @staticmethod
    def mesh(vertices: _Floats, triangles: NDArray[np.int64]) -> Surface: ...
    @property
    def name(self) -> str: ...
    def heights(self, places: _Floats) -> _Floats: ...
    def closest(self, points: _Floats) -> _Floats: ...

def run(arguments: Sequence[str]) -> int: ...
def adapters() -> list[tuple[str, str, str]]:
    """Names, drivers and addresses on the PCI bus of the GPUs that can be opened, in the order of their numbers."""

def num_threads() -> int:
    """The number of threads that work is done on."""

def set_num_threads(threads: int) -> None:
    """Sets the number of threads of later work; 0 is one per core."""

def watch(watcher: Callable[[int, int], object] | None) -> None:
    """Has a function called with the number of curves that are done and of all, some twenty times a second, or none."""

def natural(batch: Batch, ends: str, parametrisation: str, preserve_shape: bool, device: str, precision: str) -> Fit: ...
def smoothing(
    batch: Batch, amount: str, value: str | list[float], corners: str, pin_ends: bool, parametrisation: str, device: str, precision: str
) -> Fit: ...
def in_surface(
    batch: Batch,
    surface: Surface,
    off_surface: float | None,
    ends: str,
    smoothing: tuple[str, str] | None,
    pin_ends: bool,
    parametrisation: str,
    device: str,
    precision: str,
) -> Fit: ...
def fair(
    batch: Batch,
    terms: Sequence[tuple[str, float, float | tuple[int, float, Sequence[tuple[str, float, Sequence[int]]]]]],
    per_span: int,
    spacing: float | None,
    pins: str,
    deviation: str | Sequence[float] | None,
    limits: Mapping[str, object],
    surface: Surface | None,
    off_surface: float | None,
    corners: float | None,
    solver: str,
    tolerance: float,
    max_iterations: int,
    starts: int,
    seed: int,
    device: str,
    precision: str,
) -> Fit: ...
def smooth(
    batch: Batch,
    exponent: float,
    tension: float,
    preserve_shape: bool,
    start: str,
    starts: int,
    seed: int,
    tolerance: float,
    max_iterations: int,
    device: str,
    precision: str,
) -> Fit: ...
def complete(
    batch: Batch, weights: Sequence[float], tangents: str, device: str, precision: str
) -> tuple[_Arrays, dict[str, Any]]: ...
def chain(
    batch: Batch,
    degree: int,
    joints: str,
    lengths: str,
    weights: Sequence[float],
    corners: float | None,
    device: str,
    precision: str,
) -> tuple[_Arrays, dict[str, Any]]: ...
def simplify(batch: Batch, tolerance: float, corners: float, extremes: bool) -> tuple[_Arrays, dict[str, Any]]: ...
def elevate(coords: _Floats, offsets: _Offsets, by: int, device: str, precision: str) -> tuple[_Floats, _Offsets]: ...
def reduce(
    coords: _Floats, offsets: _Offsets, by: int, device: str, precision: str
) -> tuple[tuple[_Floats, _Offsets], _Floats]: ...
def subdivide(
    dimension: int,
    shapes: Sequence[tuple[int, int]],
    values: _Floats,
    rounds: int,
    support: int | None,
    linear: bool,
    device: str,
    precision: str,
) -> tuple[_Floats, list[list[int]], list[str]]: ...
def segments(chords: _Floats, angles: _Floats, exponents: _Floats, device: str, precision: str) -> _Floats: ...
def solve_tridiagonal(
    lower: _Floats,
    diagonal: _Floats,
    upper: _Floats,
    rhs: _Floats,
    columns: int,
    system_offsets: _Offsets,
    cyclic: bool,
    device: str,
    precision: str,
) -> tuple[_Floats, list[str]]: ...
