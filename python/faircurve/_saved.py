"""Fits in files: NPZ of plain arrays, and JSON that says what they are. Reading one runs no code of it."""

from __future__ import annotations

import contextlib
import datetime
import functools
import hashlib
import io
import json
import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from os import PathLike
from typing import Any

import numpy as np

from . import _arrays, _times
from ._arrays import Ragged, flags_per_point, per_point, split, vectors_per_point
from ._core import __version__
from ._energy import Energy
from ._fit import Fit, _fitted_again, _Selection, _selected_again
from ._methods import Fair, Geodesic, Natural, Smooth, Smoothing
from ._surfaces import HeightField, Mesh
from ._tables import _Table
from ._times import Clock

_CLASSES: dict[str, Any] = {one.__name__: one for one in (Natural, Smoothing, Fair, Smooth, Geodesic, Energy, HeightField, Mesh, Ragged, Clock, _Table)}
_BACKS = {one.__name__: one for one in (_arrays._array_back, _arrays._list_back, _arrays._pair_back, _arrays._awkward_back, _arrays._sequence_back, _arrays._numbers_back, _arrays._lists_of_numbers_back)}


def save(fit: Fit[Any], path: str | PathLike[str]) -> None:
    """See :meth:`Fit.save`."""
    arrays: dict[str, Any] = {}
    text = json.dumps({"faircurve": __version__, "device": fit.device, "digest": _digest(fit), "fit": _packed(fit, arrays)})
    # A file that is there is replaced once the new one is whole.
    part = f"{os.fspath(path)}.{os.getpid()}.part"
    try:
        with open(part, "xb") as file:
            np.savez(file, allow_pickle=False, fit=np.frombuffer(text.encode(), np.uint8), **arrays)
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(part)
        raise


def load(path: str | PathLike[str]) -> Fit[Any]:
    """A fit that :meth:`Fit.save` wrote.

    The curves are made again from their points and their method, and compared with a digest of those that were saved.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Fit
        The same values, reports, rows, times and labels; samples are of the kind that was fitted.

    Raises
    ------
    ValueError
        A file that holds no fit.

    Warns
    -----
    UserWarning
        Another version or another device, such as the CPU where there is no GPU, gives curves that differ in their last digits.

    Examples
    --------
    >>> import os, tempfile, numpy as np, faircurve as fc
    >>> fit = fc.Natural().fit(np.random.default_rng(0).normal(size=(100, 10, 2)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fit.save(os.path.join(folder, "curves.npz"))
    ...     again = fc.load(os.path.join(folder, "curves.npz"))
    >>> np.array_equal(again.sample(80), fit.sample(80))
    True
    """
    with np.load(path, allow_pickle=False) as arrays:
        if "fit" not in arrays:
            raise ValueError(f"{path} holds {', '.join(arrays) or 'nothing'}; a fit is what Fit.save writes")
        head = json.loads(bytes(arrays["fit"]))
        fit: Fit[Any] = _unpacked(head["fit"], arrays)
    # Another kind of device has been told of.
    if ("CPU" in fit.device) == ("CPU" in head["device"]) and _digest(fit) != head["digest"]:
        warnings.warn(
            f"{path} was fitted by faircurve {head['faircurve']} on {head['device']}; curves of faircurve {__version__} on {fit.device} "
            "differ from them in their last digits",
            UserWarning,
            stacklevel=2,
        )
    return fit


def _digest(fit: Fit[Any]) -> str:
    """What curves with other bits, statuses or knots have another one of."""
    found = hashlib.sha256(" ".join(fit._report["status"]).encode())
    for array in (*fit._fit.knots(), *fit._fit.sample("per_span", 3.0), fit._report["energy"]):
        found.update(array.tobytes())
    return found.hexdigest()


def _of_points(name: str, values: Any, curves: Ragged[Any]) -> Any:
    """An option of points as lists of plain numbers."""
    if name in ("tangents", "curvatures", "widths"):
        flat: Any = vectors_per_point(values, curves, name)
    else:
        flat = (flags_per_point if name == "pinned" else per_point)(values, curves, name)
    return split(flat, curves.offsets)


def _packed_fit(fit: Fit[Any], arrays: dict[str, Any]) -> Any:
    if isinstance(fit._recipe, _Selection):
        return {"whole": _packed(fit._recipe.whole, arrays), "numbers": list(map(int, fit._recipe.numbers))}
    _, (method, curves, options, device) = fit.__reduce__()
    if options.get("t") is not None:
        seconds, clock = _times.times(options["t"], curves)
        curves = replace(curves, t=seconds, clock=clock)
    kept = {name: value for name, value in options.items() if name in ("topology", "device", "precision")}
    if options.get("closed") is not None:
        kept["closed"] = options["closed"] if isinstance(options["closed"], str) else np.asarray(options["closed"])
    columns = {name: _of_points(name, value, curves) for name, value in options.items() if name not in (*kept, "t", "closed")}
    return {"method": _packed(method, arrays), "curves": _packed(curves, arrays), "options": _packed({**kept, **columns}, arrays), "device": device}


def _packed(value: Any, arrays: dict[str, Any]) -> Any:
    """A value as JSON, with its arrays beside it."""

    def kept(array: Any) -> str:
        name = f"array_{len(arrays)}"
        arrays[name] = array
        return name

    pack = functools.partial(_packed, arrays=arrays)
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (np.bool_, np.number)):
        return value.item()
    if isinstance(value, np.ndarray):
        if value.dtype != object:
            return {"array": kept(value)}
        return {"objects": [pack(one) for one in value.flat], "shape": value.shape}
    if isinstance(value, (list, tuple)):
        return {type(value).__name__ if type(value) in (list, tuple) else "list": [pack(one) for one in value]}
    if isinstance(value, Mapping):
        return {"dict": [[pack(key), pack(one)] for key, one in value.items()]}
    if isinstance(value, Fit):
        return {"fit": _packed_fit(value, arrays)}
    if type(value).__name__ in _CLASSES and type(value) is _CLASSES[type(value).__name__]:
        if not is_dataclass(value):
            return {"class": type(value).__name__, "given": [pack(one) for one in value._given]}
        own = {field.name: pack(getattr(value, field.name)) for field in fields(value)}
        return {"class": type(value).__name__, "fields": own}
    if isinstance(value, datetime.tzinfo):
        return str(value)
    if isinstance(value, functools.partial):
        # What geometries come out as is read from them again.
        if value.func.__module__.endswith("_geometries"):
            return {"geometries": pack(value.args[-1])}
        return {"arrow": [pack(one) for one in value.args]}
    if getattr(value, "__name__", None) in _BACKS:
        return {"back": value.__name__}
    module = type(value).__module__.partition(".")[0]
    if module in ("pandas", "geopandas"):
        return _of_pandas(value, kept)
    if module == "polars":
        buffer = io.BytesIO()
        value.to_frame("names").write_ipc(buffer)
        return {"polars": kept(np.frombuffer(buffer.getvalue(), np.uint8))}
    if module == "pyarrow":
        import pyarrow as pa

        return {"type": kept(np.frombuffer(pa.schema([("kind", value)]).serialize(), np.uint8))}
    if module == "shapely":
        return {"wkb": value.wkb_hex}
    raise TypeError(f"a {type(value).__name__} cannot be saved: a fit of numbers, words, arrays and tables can; pickle takes the rest")


def _of_pandas(value: Any, kept: Callable[[Any], str]) -> Any:
    """A series, an index or a frame of pandas or GeoPandas, as Parquet has it."""
    import pandas as pd

    buffer, frame, name = io.BytesIO(), value, None
    if isinstance(value, pd.Index):
        kind, frame = "index", pd.DataFrame(index=value)
    elif value.ndim == 1:
        kind, name = "series", value.name
        frame = value.to_frame("geometry" if hasattr(value, "crs") else "values")
    else:
        kind = "frame"
    try:
        frame.to_parquet(buffer)
    except ImportError as error:
        raise ImportError("labels of pandas are saved by pyarrow, which is not there: pip install pyarrow") from error
    except (TypeError, ValueError) as error:
        raise TypeError(f"labels or columns cannot be saved, since no Parquet file holds them; pickle takes them: {error}") from None
    return {"pandas": kept(np.frombuffer(buffer.getvalue(), np.uint8)), "kind": kind, "name": name, "geo": hasattr(frame, "geometry")}


def _to_pandas(given: Any, data: bytes) -> Any:
    if given["geo"]:
        import geopandas

        read: Any = geopandas.read_parquet
        frame: Any = read(io.BytesIO(data))
    else:
        import pandas as pd

        frame = pd.read_parquet(io.BytesIO(data))
    if given["kind"] == "index":
        return frame.index
    return frame.iloc[:, 0].rename(given["name"]) if given["kind"] == "series" else frame


def _unpacked(given: Any, arrays: Any) -> Any:
    """What :func:`_packed` packed."""
    if not isinstance(given, dict):
        return given
    unpack = functools.partial(_unpacked, arrays=arrays)
    match given:
        case {"array": name}:
            return arrays[name]
        case {"objects": items, "shape": shape}:
            made = np.empty(len(items), object)
            made[:] = [unpack(one) for one in items]
            return made.reshape(shape)
        case {"list": items}:
            return [unpack(one) for one in items]
        case {"tuple": items}:
            return tuple(unpack(one) for one in items)
        case {"dict": pairs}:
            return {unpack(key): unpack(one) for key, one in pairs}
        case {"fit": {"whole": whole, "numbers": numbers}}:
            return _selected_again(unpack(whole), numbers)
        case {"fit": {"method": method, "curves": curves, "options": options, "device": device}}:
            return _fitted_again(unpack(method), unpack(curves), unpack(options), device)
        case {"class": name, "given": items}:
            return _CLASSES[name](*map(unpack, items))
        case {"class": name, "fields": own}:
            return _CLASSES[name](**{key: unpack(one) for key, one in own.items()})
        case {"back": name}:
            return _BACKS[name]
        case {"geometries": geometries}:
            from . import _geometries

            return _geometries.ragged(unpack(geometries)).back
        case {"arrow": items}:
            from . import _arrow

            return functools.partial(_arrow._back, *map(unpack, items))
        case {"pandas": name}:
            return _to_pandas(given, bytes(arrays[name]))
        case {"polars": name}:
            import polars

            return polars.read_ipc(io.BytesIO(bytes(arrays[name])))["names"]
        case {"type": name}:
            import pyarrow as pa

            return pa.ipc.read_schema(pa.py_buffer(bytes(arrays[name]))).field(0).type
        case {"wkb": text}:
            import shapely

            return shapely.from_wkb(text)
    raise ValueError(f"the file holds {', '.join(given)}, which this version does not know")
