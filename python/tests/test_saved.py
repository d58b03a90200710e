"""A fit that was saved gives the same bits, the same kinds and the same labels when it is loaded."""

import os
import pickle
import re
import warnings

import numpy as np
import pytest

import faircurve as fc

RNG = np.random.default_rng(11)
CURVES = RNG.normal(size=(12, 7, 2)).cumsum(axis=1)
LINES = [RNG.normal(size=(n, 2)).cumsum(axis=0) for n in (5, 3, 9)]
T = np.cumsum(RNG.uniform(0.5, 2, size=(12, 7)), axis=1)
ENDS = np.full(CURVES.shape, np.nan)
ENDS[:, 0] = [1, 0]


def again(fit, tmp_path):
    fit.save(tmp_path / "fit.npz")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return fc.load(tmp_path / "fit.npz")


def same(one, other):
    assert len(one) == len(other) and one.device == other.device
    first, second = one._report, other._report
    assert first.keys() == second.keys()
    # Sentences number the curves of what was fitted, which may be a part.
    for name in first.keys() - {"message"}:
        assert np.array_equal(first[name], second[name], equal_nan=first[name].dtype.kind == "f"), name
    for a, b in zip(one.knots, other.knots):
        assert type(a) is type(b) and a.dtype == b.dtype and np.array_equal(a, b)
    u = 0.3 * (one._ends[0] + one._ends[1])[:, None] + np.zeros((1, 3))
    for nu in range(4):
        assert np.array_equal(one._fit.evaluate(u.ravel(), np.arange(len(one) + 1) * 3, nu), other._fit.evaluate(u.ravel(), np.arange(len(one) + 1) * 3, nu), equal_nan=True)
    for a, b in zip(one._fit.sample("per_span", 5.0), other._fit.sample("per_span", 5.0)):
        assert np.array_equal(a, b, equal_nan=True)
    assert np.array_equal(one.rows, other.rows) and np.array_equal(one.length, other.length)


@pytest.mark.parametrize(
    "method, options",
    [
        (fc.Natural(), {}),
        (fc.Natural(), {"t": T, "tangents": ENDS}),
        (fc.Natural(surface="sphere"), {"closed": True}),
        (fc.Natural(preserve_shape=True), {"closed": np.arange(12) % 2 == 0}),
        (fc.Smoothing(lam="gcv"), {"t": T, "weights": RNG.uniform(1, 2, (12, 7)), "pinned": CURVES[..., 0] > 0}),
        (fc.Smoothing(within="2%", corners="auto"), {"closed": "auto"}),
        (fc.Fair(), {}),
        (fc.Fair({"bending": 1, "length": 0.1}, max_curvature=np.linspace(5, 6, 12), keep_out=[[50, 50, 1]], per_span=8), {"corridors": np.full((12, 7), 3.0)}),
        (fc.Fair(fc.custom("own", 2, -1, lambda t, s: (t[1] - t[0]).dot(t[1] - t[0]) / s[0]) + fc.tautness(), per_span=4), {}),
        (fc.Smooth(tension=1), {"exponents": np.full((12, 7), 2.5)}),
    ],
)
def test_every_method_gives_its_bits_again(method, options, tmp_path):
    fit = method.fit(CURVES, device="cpu", **options)
    loaded = again(fit, tmp_path)
    same(fit, loaded)
    same(fit[[1, 4]], again(loaded[[1, 4]], tmp_path))
    assert type(loaded.sample(6)) is np.ndarray and np.array_equal(loaded.sample(6), fit.sample(6), equal_nan=True)
    with np.load(tmp_path / "fit.npz", allow_pickle=False) as file:
        assert all(array.dtype != object for array in file.values())


def test_surfaces_of_arrays_are_saved(tmp_path):
    x = np.linspace(-20, 20, 31)
    hills = fc.HeightField(np.cos(x / 5) + np.sin(x[:, None] / 7), spacing=40 / 30, origin=(-20, -20))
    fit = fc.Geodesic(hills, per_span=8).fit(CURVES[:3, :3] / 4, device="cpu")
    same(fit, again(fit, tmp_path))


def test_dates_tables_and_kinds_come_back(tmp_path):
    pd, pa, ak = pytest.importorskip("pandas"), pytest.importorskip("pyarrow"), pytest.importorskip("awkward")
    for zone in (None, "Europe/Berlin", "UTC"):
        dates = pd.date_range("2024-03-30", periods=7, freq="6h", tz=zone).as_unit("ns")
        fit = fc.Natural().fit(CURVES, t=[dates] * 12, device="cpu")
        loaded = again(fit, tmp_path)
        same(fit, loaded)
        assert np.array_equal(loaded(dates), fit(dates))
        table = pd.DataFrame({"ship": np.repeat(["a", "b"], 7), "lon": CURVES[:2].reshape(-1, 2)[:, 0], "lat": CURVES[:2].reshape(-1, 2)[:, 1], "when": [*dates, *dates], "kind": "x", "cog": 350.0})
        tracks = fc.Natural(surface="wgs84").fit(fc.from_dataframe(table, by="ship", coords=("lon", "lat"), t="when", carry=["kind", "cog"]), device="cpu")
        assert again(tracks, tmp_path).at("1h").equals(tracks.at("1h"))
    polars = pytest.importorskip("polars")
    tracks = fc.Natural().fit(fc.from_dataframe(polars.DataFrame({"id": [3, 3, 3, 1, 1], "x": [0.0, 1, 2, 0, 1], "y": 0.0, "t": [0.0, 1, 2, 0, 1]}), by="id", t="t"), device="cpu")
    assert again(tracks, tmp_path).at(0.5).equals(tracks.at(0.5))
    offsets = np.cumsum([0, *map(len, LINES)])
    kind = pa.list_(pa.struct([("lon", pa.float64()), ("lat", pa.float64())]))
    structs = pa.array([[{"lon": x, "lat": y} for x, y in line] for line in LINES] + [None], kind)
    for curves in (LINES, (np.concatenate(LINES), offsets), ak.Array([line.tolist() for line in LINES]), structs):
        fit = fc.Natural().fit(curves, device="cpu")
        loaded = again(fit, tmp_path)
        same(fit, loaded)
        assert type(loaded.sample(4)) is type(fit.sample(4)) and str(loaded.sample(4)) == str(fit.sample(4))


def test_geometries_come_back_with_their_labels(tmp_path):
    gpd, shapely = pytest.importorskip("geopandas"), pytest.importorskip("shapely")
    ring = shapely.Polygon([(0, 0), (10, 0), (11, 5), (0, 10)], [[(3, 3), (6, 3), (6, 6)]])
    series = gpd.GeoSeries([ring, None, shapely.affinity.translate(ring, 20, 0)], index=["a", "b", "c"], crs=3035, name="land")
    frame = gpd.GeoDataFrame({"n": [1, 2, 3]}, index=series.index, geometry=series)
    for curves in (series, frame, [ring, ring], ring):
        fit = fc.Natural().fit(curves, device="cpu")
        loaded = again(fit, tmp_path)
        same(fit, loaded)
        one, other = fit.sample(per_span=3), loaded.sample(per_span=3)
        assert type(one) is type(other)
        if hasattr(one, "crs"):
            assert other.crs == one.crs and other.index.equals(one.index) and (other.geometry.to_wkb() == one.geometry.to_wkb()).drop("b").all()
            assert loaded.length.index.equals(fit.length.index) and loaded.to_frame().equals(fit.to_frame())
    assert again(fc.Natural().fit(series), tmp_path).sample(3).name == "land"


def test_what_is_no_fit_is_a_sentence_and_other_bits_are_told(tmp_path):
    np.savez(tmp_path / "other.npz", coords=np.zeros((3, 2)))
    with pytest.raises(ValueError, match="other.npz holds coords; a fit is what Fit.save writes"):
        fc.load(tmp_path / "other.npz")
    gpd, shapely = pytest.importorskip("geopandas"), pytest.importorskip("shapely")
    mixed = gpd.GeoSeries([shapely.LineString([(0, 0), (1, 1)])] * 2, index=[1, "a"])
    with pytest.raises(TypeError, match="labels or columns cannot be saved, since no Parquet file holds them; pickle takes them"):
        fc.Natural().fit(mixed).save(tmp_path / "mixed.npz")
    fit = fc.Natural().fit(CURVES, device="cpu")
    fit.save(tmp_path / "fit.npz")
    with np.load(tmp_path / "fit.npz") as file:
        arrays = dict(file)
    name = next(name for name, array in arrays.items() if array.dtype == np.float64)
    arrays[name][0] += 1e-9
    np.savez(tmp_path / "fit.npz", **arrays)
    with pytest.warns(UserWarning, match="differ from them in their last digits"):
        fc.load(tmp_path / "fit.npz")
    same(fit, pickle.loads(pickle.dumps(fit)))


@pytest.mark.skipif("FAIRCURVE_REQUIRE_GPU" not in os.environ and not fc.adapters(), reason="no GPU")
def test_fits_of_a_gpu_are_made_again_where_there_is_none(tmp_path):
    fit = fc.Natural().fit(CURVES, device="gpu", precision="f64")
    same(fit, again(fit, tmp_path))
    same(fit, pickle.loads(pickle.dumps(fit)))
    make, (method, curves, options, device) = fit.__reduce__()
    with pytest.warns(UserWarning, match=f"the fit was made on {re.escape(device)}; made again on .*CPU.* its curves differ in their last digits"):
        here = make(method, curves, {**options, "device": "gpu:99"}, device)
    assert np.abs(here.sample(20) - fit.sample(20)).max() < 1e-10


def test_a_file_is_replaced_once_the_new_one_is_whole(tmp_path, monkeypatch):
    path = tmp_path / "fit.npz"
    fit = fc.Natural().fit(CURVES, device="cpu")
    fit.save(path)
    before = path.read_bytes()

    def interrupted(file, **_):
        file.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fit[:3].save(path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
