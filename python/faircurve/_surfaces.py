"""Surfaces of arrays: terrain over a grid of heights, and triangle meshes."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Floats, floats


class _OfArrays:
    """A surface that is made once, and the arrays that it was made of."""

    _made: _core.Surface
    _given: tuple[Any, ...]

    def closest(self, points: Any) -> Floats:
        """The points of the surface closest to some.

        Parameters
        ----------
        points : (n, 3) array
            Points near the surface.

        Returns
        -------
        (n, 3) array
            NaN where no point is found. High above a valley another place may be closer.
        """
        return self._made.closest(_rows(points, "points"))

    def __repr__(self) -> str:
        return f"<faircurve.{type(self).__name__}: {self._made.name}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._given

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _OfArrays) or type(self) is not type(other):
            return NotImplemented
        return all(np.array_equal(own, its) for own, its in zip(self._given, other._given))

    def __hash__(self) -> int:
        return hash(self._made.name)


class HeightField(_OfArrays):
    """Terrain over a grid of heights: the bicubic spline z = h(x, y) through them, with natural ends.

    Column j of row i stands at x = x₀ + j dx and y = y₀ + i dy. Planar points of curves are places, and are moved up onto the
    terrain; points in space must lie near it. Curves that leave the grid are ``infeasible``.

    Parameters
    ----------
    heights : (rows, columns) array
        Two of each or more. Values that are not finite, and the masked values of a masked array, are gaps: cells that touch one
        are holes, in which ``height`` is NaN and curves are ``infeasible``.
    spacing : float or (dx, dy)
        Distances of columns and of rows, in the unit of the heights. dy is below 0 where rows go from north to south.
    origin : (x0, y0)
        Where column 0 of row 0 stands.

    Attributes
    ----------
    heights : (rows, columns) array
        A copy that cannot be written to.
    spacing, origin : pair of floats

    Raises
    ------
    ValueError
        Arrays of other shapes or without any height, a spacing of 0.

    Notes
    -----
    The errors of h, its slopes and its second derivatives fall as D⁴, D³ and D² with the spacing D, and slower within four nodes of
    an edge across which the terrain bends. Source: C. de Boor, *Bicubic spline interpolation*, J. Math. Phys. 41 (1962).

    Examples
    --------
    >>> import numpy as np, faircurve as fc
    >>> x = np.linspace(0, 100, 21)
    >>> hill = fc.HeightField(20 * np.exp(-((x - 50) ** 2 + (x[:, None] - 50) ** 2) / 800), spacing=5)
    >>> hill
    <faircurve.HeightField: the height field of 21 × 21 heights>
    >>> way = fc.Geodesic(hill).fit([[(10, 40), (90, 45)]]).sample(50)[0]
    >>> bool(np.abs(hill.height(way[:, 0], way[:, 1]) - way[:, 2]).max() < 1e-12)
    True
    """

    heights: Floats
    spacing: tuple[float, float]
    origin: tuple[float, float]

    def __init__(self, heights: Any, spacing: Any = (1.0, 1.0), origin: Any = (0.0, 0.0)) -> None:
        if isinstance(heights, np.ma.MaskedArray):
            heights = np.ma.filled(heights.astype(np.float64), np.nan)
        own = floats(heights, "heights")
        if own.ndim != 2:
            raise ValueError(f"heights have the shape {own.shape}; rows of columns are needed, in an array of two dimensions")
        self.spacing = _pair((spacing, spacing) if np.ndim(spacing) == 0 else spacing, "spacing")
        self.origin = _pair(origin, "origin")
        self._made = _core.Surface.height_field(own, self.spacing, self.origin)
        self.heights = _kept(own)
        self._given = (self.heights, self.spacing, self.origin)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """The least x and y, and the largest x and y, of the grid."""
        ends = [(start, start + (count - 1) * step) for start, count, step in zip(self.origin, self.heights.shape[::-1], self.spacing)]
        (left, right), (bottom, top) = (sorted(pair) for pair in ends)
        return left, bottom, right, top

    def height(self, x: Any, y: Any) -> Any:
        """h(x, y), in the shape that x and y have together. Beyond the grid it goes on along its tangents, and is no terrain.

        Parameters
        ----------
        x, y : float or array
            Places.

        Returns
        -------
        float or array
        """
        try:
            shape = np.broadcast_shapes(np.shape(x), np.shape(y))
        except ValueError:
            raise ValueError(f"x has the shape {np.shape(x)} and y {np.shape(y)}; shapes that fit together are needed") from None
        places = [np.broadcast_to(floats(x, "x").reshape(np.shape(x)), shape), np.broadcast_to(floats(y, "y").reshape(np.shape(y)), shape)]
        return self._made.heights(np.stack(places, axis=-1).reshape(-1, 2)).reshape(shape)[()]


class Mesh(_OfArrays):
    """The smooth surface through the vertices of triangles: patches, one a vertex, blended three times differentiably.

    Parameters
    ----------
    vertices : (n, 3) array
        Those at one place are merged, and those of no triangle are passed over.
    triangles : (m, 3) array of integers
        The numbers of their vertices, from 0. They are turned over where neighbours have another orientation.

    Attributes
    ----------
    vertices, triangles : array
        Copies that cannot be written to.

    Raises
    ------
    ValueError
        Arrays of other shapes, vertices that are not there or not finite, edges of more than two triangles, one side only as a
        Möbius band, and sheets that are as near to each other as their triangles are long.

    Notes
    -----
    With edges of length h places have errors of order h⁴, normals of h³ and curvatures of h². Vertices are taken as they stand:
    smooth the noise of a scan first. Curves that leave the mesh over a rim are ``infeasible``. Source: Y. Ohtake, A. Belyaev,
    M. Alexa, G. Turk, H.-P. Seidel, *Multi-level partition of unity implicits*, SIGGRAPH 2003.

    Examples
    --------
    >>> import numpy as np, faircurve as fc
    >>> x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    >>> k = np.arange(72).reshape(8, 9)[:, :-1].ravel()
    >>> triangles = np.concatenate([np.stack([k, k + 1, k + 10], axis=1), np.stack([k, k + 10, k + 9], axis=1)])
    >>> roof = fc.Mesh(np.stack([x, y, 1 - x**2 / 2], axis=2).reshape(-1, 3), triangles)
    >>> roof
    <faircurve.Mesh: the mesh of 81 vertices and 128 triangles>
    >>> roof.closest([(0.0, 0.1, 1.2)]).round(3).tolist()
    [[0.0, 0.1, 1.0]]
    """

    vertices: Floats
    triangles: NDArray[np.int64]

    def __init__(self, vertices: Any, triangles: Any) -> None:
        places = _rows(vertices, "vertices")
        corners = np.asarray(triangles)
        if corners.ndim != 2 or corners.shape[1] != 3:
            raise ValueError(f"triangles have the shape {corners.shape}; rows of 3 numbers of vertices are needed")
        if corners.dtype.kind not in "iu":
            raise ValueError(f"triangles are {corners.dtype}; numbers of vertices are integers")
        own = np.ascontiguousarray(corners, np.int64)
        self._made = _core.Surface.mesh(places, own)
        self.vertices, self.triangles = _kept(places), _kept(own)
        self._given = (self.vertices, self.triangles)


#: What ``surface=`` takes.
Surface: TypeAlias = str | HeightField | Mesh


def made(surface: Surface) -> _core.Surface:
    """The surface of a word, of a file, or of arrays."""
    if isinstance(surface, str):
        return _core.Surface.named(surface)
    if isinstance(surface, _OfArrays):
        return surface._made
    raise TypeError(f'surface is a {type(surface).__name__}; a word such as "wgs84", a HeightField and a Mesh are possible')


def _kept(array: Any) -> Any:
    """A copy that stays as it is."""
    own = array.copy()
    own.flags.writeable = False
    return own


def _pair(values: Any, what: str) -> tuple[float, float]:
    found = floats(values, what)
    if np.shape(values) != (2,):
        raise ValueError(f"{what} has the shape {np.shape(values)}; a pair of numbers is needed")
    return float(found[0]), float(found[1])


def _rows(values: Any, what: str) -> Floats:
    """Rows of three coordinates."""
    found = floats(values, what)
    if found.ndim != 2 or found.shape[1] != 3:
        raise ValueError(f"{what} have the shape {found.shape}; rows of 3 coordinates are needed")
    return found
