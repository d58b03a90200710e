"""While fits run: their progress, and the threads that they run on."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from . import _core

_trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


def give_back() -> None:
    """Hands the memory that a large fit has freed back to the system, which glibc keeps: as much again as fair curves take."""
    if _trim is not None:
        _trim(0)


def _line(done: int, curves: int) -> None:
    print(f"\r{done:,} of {curves:,} curves", end="", file=sys.stderr, flush=True)


@contextmanager
def _bar() -> Iterator[Callable[[int, int], object]]:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        tqdm = None
    if tqdm is None:
        yield _line
        return
    with tqdm(unit=" curves") as bar:

        def show(done: int, curves: int) -> None:
            bar.total, bar.n = curves, done
            bar.refresh()

        yield show


@contextmanager
def progress(show: Callable[[int, int], object] | None = None) -> Iterator[None]:
    """Shows how many curves are done, of all fits within.

    Parameters
    ----------
    show : callable, optional
        Called some twenty times a second with the number of curves that are done and that of all. By default a bar of tqdm, or where
        there is no tqdm a line on standard error. An exception that it raises ends the fit.

    Examples
    --------
    >>> import faircurve as fc
    >>> with fc.progress(lambda done, curves: None):
    ...     fit = fc.Fair().fit([[(0, 0), (2, 1), (3, 0)]])
    """
    with _bar() if show is None else nullcontext(show) as called:
        _core.watch(called)
        try:
            yield
        finally:
            _core.watch(None)


def set_num_threads(threads: int) -> None:
    """Sets the number of threads of later fits; 0 is one per core, the default.

    Raises
    ------
    ValueError
        A negative number.
    """
    if threads < 0:
        raise ValueError(f"threads is {threads}; it must be 0 or more")
    _core.set_num_threads(threads)


def num_threads() -> int:
    """The number of threads of fits."""
    return _core.num_threads()
