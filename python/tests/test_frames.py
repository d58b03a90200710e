"""Rows, dates and tables: what goes in comes out, in its place."""

import copy
import datetime
import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest

import faircurve as fc

gpd = pytest.importorskip("geopandas")
pd = pytest.importorskip("pandas")
shapely = pytest.importorskip("shapely")
from shapely.geometry import LineString, Polygon  # noqa: E402

PATH = np.array([[0, 0], [1, 1], [2, 0], [3, 1], [4, 0.0]])


def test_columns_of_a_fit_align_with_rows_or_raise():
    hole = Polygon([(0, 0), (100, 0), (100, 100), (0, 100)], [[(30, 30), (60, 30), (60, 60), (30, 60)]])
    plain = Polygon([(200, 0), (201, 0), (201, 1)])
    frame = gpd.GeoDataFrame({"n": ["holed", "missing", "plain"]}, geometry=[hole, None, plain], index=[7, 8, 9], crs=32632)
    fit = fc.Natural().fit(frame)
    assert fit.rows.tolist() == [0, 0, 2] and fit.length.index.tolist() == [7, 7, 9]
    with pytest.raises(ValueError, match="duplicate labels"):
        frame["length"] = fit.length
    rows = fit.to_frame()
    assert rows.index.tolist() == [7, 8, 9] and rows["status"].tolist()[::2] == ["converged"] * 2
    assert np.isclose(rows["length"].iloc[0], fit.length.iloc[:2].sum()) and np.isnan(rows["length"].iloc[1])
    assert fit.to_frame(per="curve")["row"].tolist() == [0, 0, 2]
    single = frame.loc[[9, 8]]
    single["length"] = fc.Natural().fit(single).length
    assert np.isclose(single["length"].iloc[0], fit.length.iloc[2]) and np.isnan(single["length"].iloc[1])
    with pytest.raises(ValueError, match="per is 'ring'"):
        fit.to_frame(per="ring")


@pytest.mark.parametrize("method", [fc.Natural(), fc.Smoothing(deviation=3), fc.Fair()])
def test_borders_of_polygons_stay_shared(method):
    rng = np.random.default_rng(0)
    seam = list(zip(50 + rng.normal(scale=6, size=11), np.linspace(0, 100, 11)))
    shapes = [Polygon([(0, 0), *seam, (0, 100)]), Polygon([(100, 0), *seam, (100, 100)])]
    frame = gpd.GeoDataFrame(geometry=shapes, crs=32632)
    made = method.fit(frame).sample(per_span=8)
    assert shapely.coverage_is_valid(made.geometry.values) and made.crs == frame.crs
    apart = fc.Smoothing(deviation=3).fit(frame, topology=False).sample(per_span=8)
    assert not shapely.coverage_is_valid(apart.geometry.values)


def test_a_geographic_crs_is_warned_of_as_geopandas_does():
    lines = gpd.GeoSeries([LineString(PATH)], crs=4326)
    for act in (lambda: fc.Smoothing(deviation=0.1).fit(lines), lambda: fc.Natural().fit(lines).length):
        with pytest.warns(UserWarning, match="Geometry is in a geographic CRS"):
            act()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fc.Natural(surface="wgs84").fit(lines).length
        fc.Smoothing(deviation="2%").fit(lines)


def test_lines_that_close_and_mixed_dimensions_are_as_in_the_command():
    ring = np.stack([np.cos(np.linspace(0, 2 * np.pi, 9)), np.sin(np.linspace(0, 2 * np.pi, 9))], axis=1)
    ring[-1] = ring[0]
    fit = fc.Natural().fit(gpd.GeoSeries([LineString(ring), LineString(PATH)]))
    assert fit._closed().tolist() == [True, False]
    with pytest.raises(ValueError, match="row 1 has heights and row 0 has none"):
        fc.Natural().fit([LineString(PATH), LineString([(0, 0, 1), (1, 1, 2)])])
    measured = fc.Natural().fit([shapely.from_wkt("LINESTRING M (0 0 0, 1 1 10, 2 0 11)")])
    assert measured.knots[0].tolist() == [0, 10, 11]


@pytest.mark.parametrize("unit", ["ns", "us", "ms", "s", "m"])
def test_dates_of_any_unit_are_the_same_times(unit):
    dates = np.datetime64("2024-03-28T06:00") + np.arange(5) * np.timedelta64(6, "h")
    plain = fc.Natural().fit([PATH], t=[np.arange(5) * 6 * 3600.0])
    fit = fc.Natural().fit([PATH], t=[dates.astype(f"M8[{unit}]")])
    assert fit.knots[0].dtype == f"M8[{unit}]" and (fit.knots[0] == dates).all()
    for asked in ("ns", "us", "ms", "s"):
        found = fit(np.array(["2024-03-28T09:00"], f"M8[{asked}]"))
        assert np.abs(found - plain([3 * 3600.0])).max() < 1e-6
    # Derivatives are by seconds.
    assert np.abs(fit(dates[1], nu=1) - plain(6 * 3600.0, nu=1)).max() < 1e-9
    _, t = fit.sample(per_span=2, return_t=True)
    # Samples may fall between ticks of a coarser unit.
    assert t[0].dtype == f"M8[{unit if unit == 'ns' else 'us'}]" and t[0][2] == dates[1] and t[0][1] == dates[0] + np.timedelta64(3, "h")


def test_zones_spans_and_what_is_no_date():
    dates = pd.date_range("2024-03-28 06:00", periods=5, freq="6h", tz="Europe/Berlin")
    fit = fc.Natural().fit([PATH], t=pd.Series(dates))
    assert fit.knots[0].tolist() == dates.tolist()
    assert np.allclose(fit(dates[[1]].tz_convert("UTC"))[0], PATH[[1]])
    with pytest.raises(TypeError, match="u has no zone, and the times of the fit have one"):
        fit(dates.tz_localize(None))
    own = [datetime.datetime(2024, 3, 28, hour) for hour in range(5)]
    assert fc.Natural().fit([PATH], t=[own]).knots[0].astype(object).tolist() == own
    spans = fc.Natural().fit([PATH], t=[np.arange(5).astype("m8[h]")])
    assert np.allclose(spans(np.timedelta64(60, "m")), PATH[1])
    with pytest.raises(TypeError, match="u holds dates, and the parameters of the fit are spans of time"):
        spans(np.datetime64("2024-03-28"))
    missing = np.array(["NaT", "2024-03-28", "2024-03-29", "2024-03-30", "2024-03-31"], "M8[D]")
    assert fc.Natural().fit([PATH], t=[missing]).status.tolist() == ["invalid"]
    with pytest.raises(ValueError, match="t has dates for some curves and numbers for others"):
        fc.Natural().fit([PATH, PATH], t=[missing, np.arange(5.0)])


def test_values_of_points_that_do_not_fit_raise_with_their_name():
    curves = [PATH[:4], np.concatenate([PATH, PATH[-1:] + 1])]
    lists = [np.ones(4), np.ones(6)]
    for name in ("t", "weights", "pinned"):
        values = [np.arange(6.0), np.arange(4.0)] if name == "t" else [one.astype(bool) for one in lists[::-1]]
        with pytest.raises(ValueError, match=f"{name} has 6 numbers for the 4 points of curve 0"):
            fc.Smoothing(lam=1).fit(curves, **{name: values if name != "weights" else lists[::-1]})
    with pytest.raises(ValueError, match="tangents has 6 numbers for the 4 points of curve 0"):
        fc.Fair().fit(curves, tangents=[np.ones((6, 2)), np.ones((4, 2))])
    equal = np.random.default_rng(0).normal(size=(3, 5, 2))
    with pytest.raises(ValueError, match=r"weights has the shape \(5, 3\); it must be as the points are: \(3, 5\)"):
        fc.Smoothing(lam=1).fit(equal, weights=np.ones((5, 3)))
    with pytest.raises(ValueError, match="weights has 4 numbers for 4 curves of as many points"):
        fc.Smoothing(lam=1).fit(np.zeros((4, 4, 2)), weights=np.ones(4))
    for closed in (["no", "no", "no"], [0.0, 1.0, 2.0]):
        with pytest.raises(TypeError, match="closed holds"):
            fc.Natural().fit(equal, closed=closed)
    for bad in (equal.astype(str), equal + 5j, equal.astype("M8[D]")):
        with pytest.raises(TypeError, match="coordinates must be numbers"):
            fc.Natural().fit(bad)
    masked = np.ma.masked_equal(np.where(np.arange(5)[:, None] == 2, -9999, PATH)[None], -9999)
    assert fc.Natural().fit(masked).status.tolist() == ["invalid"]


def test_structs_are_read_by_the_names_of_their_fields():
    pa = pytest.importorskip("pyarrow")
    berlin, tokyo = {"lon": 13.4, "lat": 52.5}, {"lat": 35.7, "lon": 139.7}
    kind = pa.list_(pa.struct([("lat", pa.float64()), ("lon", pa.float64())]))
    fit = fc.Geodesic("wgs84").fit(pa.array([[berlin, tokyo]], kind))
    assert round(fit.length[0] / 1000) == 8940
    assert fit.sample(points=2).type == kind and abs(fit.sample(points=2)[0][0]["lat"].as_py() - 52.5) < 1e-9
    with pytest.raises(ValueError, match="points have the fields x, y, speed"):
        fc.Natural().fit(pa.array([[{"x": 0.0, "y": 1.0, "speed": 7.0}]]))


def test_options_are_checked_when_a_method_is_made():
    for make, error, sentence in (
        (lambda: fc.Smoothing(), TypeError, "give one of lam, deviation, tube, s and within"),
        (lambda: fc.Smoothing(lam=1, tube=2), TypeError, "and not lam and tube"),
        (lambda: fc.Smoothing(lam=np.ones((3, 1))), TypeError, r"lam is an array of the shape \(3, 1\)"),
        (lambda: fc.Fair(per_span=-1), ValueError, "per_span is -1; it must be at least 1"),
        (lambda: fc.Fair(max_stretch=1.0), ValueError, "max_stretch is 1.0; it must be more than 1"),
        (lambda: fc.Natural().fit([PATH]).sample(10.7), ValueError, "count is 10.7; it must be a whole number"),
        (lambda: fc.Natural().fit([PATH], precision=np.float32), TypeError, "precision is <class 'numpy.float32'>"),
    ):
        with pytest.raises(error, match=sentence):
            make()
    assert fc.Fair(keep_out=np.zeros((2, 3))) == fc.Fair(keep_out=np.zeros((2, 3)))
    assert sum([fc.bending(), fc.length()]) == fc.bending() + fc.length() and fc.bending() / 2 == 0.5 * fc.bending()


def test_largest_curvatures_may_be_each_curves_own():
    curves = np.stack([PATH, PATH, PATH])
    fit = fc.Fair(deviation=0.4, max_curvature=[1.0, 1.2, 9.0]).fit(curves)
    assert fit.status.tolist() == ["converged"] * 3
    assert (fit.max_curvature <= [1.0 + 1e-6, 1.2 + 1e-6, 9.0]).all() and fit.max_curvature[2] > 1.2
    with pytest.raises(ValueError, match="max_curvature has 2 numbers for 3 curves"):
        fc.Fair(max_curvature=[1, 2]).fit(curves)


def test_lambda_by_cross_validation_is_scipys():
    interpolate = pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(3)
    x = np.sort(rng.uniform(0, 10, size=(40, 60)), axis=1)
    y = np.stack([x, np.sin(x) + rng.normal(scale=0.2, size=x.shape)], axis=2)
    fit = fc.Smoothing(lam="gcv").fit(y, t=x)
    assert (fit.report()["smoothing"] > 0).all()
    # SciPy chooses for a column at a time: the first, which is x itself, says nothing of noise.
    ratio = []
    for i in range(40):
        wanted = interpolate.make_smoothing_spline(x[i], y[i, :, 1])
        ratio.append(np.abs(wanted(x[i]) - np.sin(x[i])).mean() / np.abs(fit(x[i])[i][:, 1] - np.sin(x[i])).mean())
    assert 0.8 < np.median(ratio) < 1.25
    assert fc.Smoothing(lam=0.3).fit(y, t=x).status.tolist() == ["converged"] * 40


def test_a_fit_can_be_pickled_and_copied():
    rng = np.random.default_rng(0)
    curves = [rng.normal(size=(n, 2)).cumsum(0) for n in (4, 9, 6)]
    for method in (fc.Natural(), fc.Smoothing(lam=0.5), fc.Fair(), fc.Smooth()):
        fit = method.fit(curves)
        for again in (pickle.loads(pickle.dumps(fit)), copy.deepcopy(fit), copy.copy(fit)):
            assert all(np.array_equal(a, b) for a, b in zip(fit.sample(9), again.sample(9)))
        assert np.array_equal(pickle.loads(pickle.dumps(fit[1])).sample(9)[0], fit.sample(9)[1])
    lines = gpd.GeoSeries([LineString(PATH)], index=["a"], crs=32632)
    again = pickle.loads(pickle.dumps(fc.Natural().fit(lines)))
    assert again.sample(per_span=4).geom_equals(fc.Natural().fit(lines).sample(per_span=4)).all() and again.length.index[0] == "a"
    splines = fc.CubicSplineBatch(np.arange(5.0), rng.normal(size=(3, 5)))
    for own in (splines, splines.derivative(), splines.antiderivative()):
        assert np.array_equal(pickle.loads(pickle.dumps(own))([0.3, 2.2]), own([0.3, 2.2]))


def test_beyond_the_ends_is_as_asked_for():
    turn = np.linspace(0, 2 * np.pi, 9)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)[:-1]
    closed = fc.Natural().fit([ring], t=[turn[:-1]], closed=True)
    end = closed.knots[0][-1]
    assert np.allclose(closed(end + 0.3), closed(0.3)) and np.allclose(closed(-0.3), closed(end - 0.3))
    fit = fc.Natural().fit([PATH], t=[np.arange(5.0)])
    assert fit(6.0).tolist() == [[4, 0]] and np.isnan(fit([3.0, 6.0], outside="nan")[0, 1]).all()
    with pytest.raises(ValueError, match="the parameter 6.0 is outside curve 0, which goes from 0.0 to 4.0"):
        fit(6.0, outside="raise")
    with pytest.raises(ValueError, match="curve 0 is open"):
        fit(6.0, outside="periodic")


def test_splines_are_scipys_bernstein_polynomials():
    pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(2)
    curves = [rng.normal(size=(n, 3)).cumsum(0) for n in (5, 8)]
    for method in (fc.Natural(), fc.Smoothing(lam=0.2)):
        fit = method.fit(curves)
        u = np.linspace(0.1, 2, 9)
        for nu in range(3):
            found = fit(u, nu)
            for own, wanted in zip(fit.to_bpoly(), found):
                assert np.abs(own.derivative(nu)(u) - wanted if nu else own(u) - wanted).max() < 1e-11 * max(1, np.abs(wanted).max())
    with pytest.raises(TypeError, match="curve 0 is no cubic between two points"):
        fc.Fair().fit(curves).to_bpoly()


@pytest.mark.parametrize("kind", ["pandas", "polars"])
def test_tracks_of_a_table_come_out_at_times(kind):
    library = pytest.importorskip(kind)
    times = pd.date_range("2024-03-28 06:10", periods=30, freq="20min", tz="UTC")
    # Two ships on circles of latitude, interleaved and shuffled; b goes west across the date line.
    rows = [("a", 4 + 0.05 * k, 0.0, t, 9.0 + k, f"s{k}") for k, t in enumerate(times)]
    rows += [("b", (-179.9 - 0.02 * k + 180) % 360 - 180, 10.0, t, 5.0, "w") for k, t in enumerate(times)]
    rows = [rows[k] for k in np.random.default_rng(0).permutation(len(rows))]
    columns = dict(zip(["ship", "lon", "lat", "when", "sog", "state"], map(list, zip(*rows))))
    table = library.DataFrame(columns)
    tracks = fc.from_dataframe(table, by="ship", coords=("lon", "lat"), t="when", carry=["sog", "state"])
    fit = fc.Natural(surface="wgs84").fit(tracks)
    hourly = fit.at("1h")
    assert type(hourly) is type(table)
    assert list(hourly.columns) == ["ship", "when", "lon", "lat", "speed", "heading", "sog", "state"]
    ships = hourly["ship"].to_list()
    assert ships == [rows[0][0]] * 9 + [name for name in "ab" if name != rows[0][0]] * 9
    for name, lon, metres, heading in (("a", 0.05, 5565.97, 90.0), ("b", -0.02, 2193.0, 270.0)):
        own = [k for k, ship in enumerate(ships) if ship == name]
        at = [hourly["when"].to_list()[k] for k in own]
        assert [one.hour for one in at] == list(range(7, 16)) and at[0].utcoffset() == datetime.timedelta(0)
        hours = np.array([(one - times[0].to_pydatetime()).total_seconds() / 1200 for one in at])
        start = 4 if name == "a" else -179.9
        found = np.array(hourly["lon"].to_list())[own]
        assert np.abs((found - start - lon * hours + 180) % 360 - 180).max() < 1e-6
        assert np.abs(np.array(hourly["speed"].to_list())[own] / (metres / 1200) - 1).max() < 1e-3
        assert np.abs(np.array(hourly["heading"].to_list())[own] - heading).max() < 0.1
    k = ships.index("a")
    assert abs(hourly["sog"].to_list()[k] - 11.5) < 1e-9 and hourly["state"].to_list()[k] in ("s2", "s3")
    assert len(fit.at(times[[0]])) == 2
    with pytest.raises(ValueError, match='there is no column "mmsi"'):
        fc.from_dataframe(table, by="mmsi")
    with pytest.raises(TypeError, match="times are of tracks of a table"):
        fc.Natural().fit([PATH]).at(1)


def test_times_of_arrow_tables_stay_times():
    pa = pytest.importorskip("pyarrow")
    kind = pa.list_(pa.timestamp("us"))
    when = [[datetime.datetime(2024, 3, 28, hour) for hour in (6, 12, 18)]]
    table = pa.table({"points": pa.array([[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]]), "when": pa.array(when, kind)})
    made = fc.FairBatch(fc.Natural(), t="when", samples={"per_span": 2})(table)
    assert made["fair_t"].type == kind and made["when"].to_pylist() == when
    assert [one.hour for one in made["fair_t"].to_pylist()[0]] == [6, 9, 12, 15, 18]


hypothesis = pytest.importorskip("hypothesis")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as some  # noqa: E402

COUNTS = some.lists(some.integers(3, 7), min_size=1, max_size=5)


@settings(max_examples=60, deadline=None)
@given(COUNTS, COUNTS, some.sampled_from(["t", "weights", "pinned", "list"]))
def test_lists_of_values_fit_the_curves_or_raise(counts, others, name):
    rng = np.random.default_rng(len(counts))
    curves = [rng.normal(size=(n, 2)).cumsum(0) for n in counts]
    values = [np.arange(n) > 0 if name == "pinned" else np.arange(1.0, n + 1) for n in others]
    given_values = {"weights" if name == "list" else name: [one.tolist() for one in values] if name == "list" else values}
    act = lambda: fc.Smoothing(lam=1.0).fit(curves, device="cpu", **given_values)  # noqa: E731
    if counts == others:
        assert (act().status == "converged").all()
    else:
        with pytest.raises(ValueError, match="numbers for the|has lists for"):
            act()


RINGS = some.lists(some.sampled_from(["none", "line", "ring", "holed", "lines", "parts"]), min_size=1, max_size=6)


@settings(max_examples=40, deadline=None)
@given(RINGS, some.booleans())
def test_rows_of_curves_are_those_of_their_geometries(kinds, labelled):
    def square(x, y, size):
        return [(x, y), (x + size, y), (x + size, y + size), (x, y + size)]

    def made(kind, x):
        line = LineString([(x, 0), (x + 1, 1), (x + 2, 0)])
        polygon = Polygon(square(x, 0, 3), [square(x + 1, 1, 1)] if kind == "holed" else [])
        other = Polygon(square(x, 10, 3))
        lines, parts = shapely.MultiLineString([line, LineString([(x, 5), (x + 1, 6)])]), shapely.MultiPolygon([polygon, other])
        return {"none": None, "line": line, "ring": polygon, "holed": polygon, "lines": lines, "parts": parts}[kind]

    index = [f"row {k}" for k in range(len(kinds))] if labelled else None
    series = gpd.GeoSeries([made(kind, 10.0 * k) for k, kind in enumerate(kinds)], index=index, crs=32632)
    fit = fc.Natural().fit(series, device="cpu")
    counts = [{"none": 0, "line": 1, "ring": 1}.get(kind, 2) for kind in kinds]
    assert fit.rows.tolist() == np.repeat(np.arange(len(kinds)), counts).tolist()
    assert fit.length.index.equals(series.index.take(fit.rows))
    rows = fit.to_frame()
    assert rows.index.equals(series.index) and (rows["status"].isna() == series.isna()).all()
    sums = fit.length.groupby(fit.rows).sum()
    assert np.allclose(rows["length"].dropna(), sums)
    samples = fit.sample(per_span=4)
    assert samples.index.equals(series.index) and (samples.geom_type == series.geom_type)[~series.isna()].all()


def test_short_steps_and_nanoseconds_keep_their_digits():
    start = np.datetime64("2024-01-01T00:00:00.123456789", "ns")
    for step in (np.timedelta64(3600, "s"), np.timedelta64(100, "ns")):
        dates = start + np.arange(5) * step
        assert (fc.Natural().fit([PATH], t=dates).knots[0] == dates).all()
    dates = pd.date_range("2024-01-01", periods=5, freq="1ms").as_unit("ns")
    line = np.stack([np.arange(5.0), np.zeros(5)], axis=1)
    assert np.abs(fc.Natural().fit([line], t=dates)(dates, 1)[0, :, 0] - 1000).max() < 1e-6


def test_parts_of_a_fit_keep_their_rows_and_tables():
    table = pd.DataFrame({"id": ["a"] * 4 + ["b"] * 4, "x": np.arange(8.0), "y": 0.0, "t": np.arange(8.0) * 10, "c": np.arange(8.0)})
    fit = fc.Natural().fit(fc.from_dataframe(table, by="id", coords=("x", "y"), t="t", carry=["c"]))
    assert fit[[1]].at(10)["id"].tolist() == ["b"] * 4 and fit[fit.status == "converged"].at(10).equals(fit.at(10))
    assert len(fit[[]]) == 0 and np.allclose(fit.at(5)["c"], fit.at(5)["t"] / 10)
    assert len(fit.at(np.int64(5))) == len(fit.at(5)) == 14
    turning = table.assign(COG=[350.0, 10, 30, 350] * 2)
    course = fc.Natural().fit(fc.from_dataframe(turning, by="id", coords=("x", "y"), t="t", carry=["COG"])).at(5)["COG"]
    assert np.abs(course[:7] - [350, 0, 10, 20, 30, 10, 350]).max() < 1e-9
    lines = fc.Natural().fit(gpd.GeoSeries([LineString(PATH)] * 2, index=["p", "q"]))
    assert lines[1:].length.index.tolist() == ["q"] and lines[1:].rows.tolist() == [1]
    with pytest.raises(TypeError, match='the parameters of the fit are not the times of column "t"'):
        fc.Smooth().fit(fc.from_dataframe(table, by="id", coords=("x", "y"), t="t")).at(10)


def test_tables_that_are_not_whole_are_read_as_far_as_they_go():
    times = pd.Series(pd.date_range("2024", periods=4, freq="1h"))
    table = pd.DataFrame({"id": pd.array(["a", "a", pd.NA, "a"], "string"), "x": np.arange(4.0), "y": 0.0, "t": times})
    fit = fc.Natural().fit(fc.from_dataframe(table, by="id", t="t"))
    assert fit.at("1h")["id"].tolist() == ["a"] * 4
    table.loc[1, "t"] = pd.NaT
    assert len(fc.Natural().fit(fc.from_dataframe(table, by="id", t="t")).at("1h")) == 0
    assert len(fc.Natural().fit(fc.from_dataframe(table[:0], by="id", t="t")).at("1h")) == 0
    whole = pd.DataFrame({"id": pd.array([2**53 + 1, None, 7], "Int64"), "x": [0.0, 1, 2], "y": 0.0})
    assert fc.from_dataframe(whole, by="id").table.names.tolist() == [2**53 + 1, 7]
    for arguments, error, sentence in (
        ({"carry": "x"}, TypeError, 'carry is "x"; it must be a list'),
        ({"carry": ["t"], "t": "t"}, ValueError, 'carry has "t", which comes out anyway'),
        ({"by": ["id"]}, TypeError, "it must be one column"),
    ):
        with pytest.raises(error, match=sentence):
            fc.from_dataframe(table, **arguments)
    # Weights may come in the order of the table.
    rows = pd.DataFrame({"x": [2.0, 0, 1, 3], "y": [0.0, 0, 5, 0], "t": [2.0, 0, 1, 3], "w": [1.0, 1, 1000, 1]})
    heavy = fc.Smoothing(lam=1).fit(fc.from_dataframe(rows, t="t"), weights=rows["w"])
    assert heavy(1.0)[0, 1] > 4.9
    missing = pd.DataFrame({"x": pd.array([0, None, 2], "Int64"), "y": pd.array([0, 1, 0], "Int64")})
    assert fc.Natural().fit([missing.to_numpy()]).status.tolist() == ["invalid"]


@pytest.mark.parametrize("kind", ["int64", "timestamp[s]", "timestamp[us, tz=Europe/Berlin]", "duration[ms]", "date32[day]"])
@pytest.mark.parametrize("large", [False, True])
def test_times_of_samples_have_one_type_whatever_they_are(kind, large):
    pa = pytest.importorskip("pyarrow")
    given = {"int64": pa.int64(), "timestamp[s]": pa.timestamp("s"), "duration[ms]": pa.duration("ms"), "date32[day]": pa.date32()}
    own = given.get(kind, pa.timestamp("us", "Europe/Berlin"))
    lists = (pa.large_list if large else pa.list_)(own)
    points = pa.array([[[0.0, 0], [1, 1], [2, 0], [3, 1]], None, [[0.0, 0], [1, 1], [2, 0], [3, 1]]], pa.list_(pa.list_(pa.float64(), 2)))
    values = [pa.array([1, 2, 3, 5]).cast(pa.int32() if kind.startswith("date") else pa.int64()).cast(own).to_pylist()]
    table = pa.table({"points": points, "t": pa.array([*values, *values, None], lists)})
    batch = fc.FairBatch(fc.Natural(), t="t", samples={"count": 5}, device="cpu")
    made = batch(table)
    assert batch.schema(table.schema).field("fair_t").type == made.schema.field("fair_t").type == batch(table[1:]).schema.field("fair_t").type
    assert [len(one) for one in made["fair_t"].to_pylist()] == [5, 0, 0] and made["fair_status"].to_pylist()[0] == "converged"
    if kind == "int64":
        assert made["fair_t"].to_pylist()[0] == [1, 2, 3, 4, 5]


def test_nulls_of_points_and_masked_dates_are_missing():
    pa = pytest.importorskip("pyarrow")
    x = [pa.array(column) for column in (PATH[:4] * 1.0).T.copy()]
    points = pa.StructArray.from_arrays(x, names=["x", "y"], mask=pa.array([False, True, False, False]))
    assert fc.Natural().fit(pa.ListArray.from_arrays(pa.array([0, 4], pa.int32()), points)).status.tolist() == ["invalid"]
    dates = np.ma.array(np.arange("2024-01-01", "2024-01-06", dtype="M8[D]"), mask=[0, 1, 0, 0, 0])
    assert fc.Natural().fit([PATH], t=dates).status.tolist() == ["invalid"]


def test_lengths_with_a_unit_are_on_the_ground():
    geographiclib = pytest.importorskip("pyproj").Geod(ellps="WGS84")
    rng = np.random.default_rng(5)
    lines = [np.array([10.0 * k, 10.0 * k]) + 0.02 * rng.normal(size=(30, 2)).cumsum(axis=0) for k in range(8)]
    degrees = gpd.GeoSeries([shapely.LineString(one) for one in lines], crs=4326)
    fit = fc.Smoothing(within="2km").fit(degrees)
    assert (fit.status == "converged").all()
    for line, one in zip(lines, fit.sample(600)):
        curve = np.array(one.coords)
        metres = [geographiclib.inv(*np.broadcast_arrays(*point, *curve.T))[2].min() for point in line]
        assert 1000.0 < max(metres) < 2010.0
    feet = degrees.to_crs(2263).iloc[4:5]
    assert feet.crs.axis_info[0].unit_name == "US survey foot"
    a, b = (fc.Smoothing(within=within).fit(feet).sample(100).iloc[0] for within in ("3281ft", 3281 * 0.3048 * 3937 / 1200))
    assert a.hausdorff_distance(b) < 1e-6
    with pytest.raises(ValueError, match="the unit of the points is not known"):
        fc.Smoothing(within="2km").fit(lines)


@pytest.mark.parametrize("zone", ["Europe/Berlin", "America/New_York", "UTC", "Asia/Kolkata"])
def test_days_are_those_of_the_zone(zone):
    times = pd.date_range("2024-03-29 15:00", periods=40, freq="5h", tz=zone)
    table = pd.DataFrame({"id": "a", "x": np.arange(40.0), "y": 0.0, "t": times})
    fit = fc.Natural().fit(fc.from_dataframe(table, by="id", t="t"))
    for step, days in (("1D", 1), ("D", 1), ("2 days", 2)):
        found = fit.at(step)["t"]
        assert (found == found.dt.normalize()).all() and (found.dt.date.diff().dropna() == pd.Timedelta(days=days)).all()
        assert len(found) == (8 if days == 1 else 4)
    assert fit.at("6h")["t"].dt.tz_convert("UTC").dt.hour.isin([0, 6, 12, 18]).all()
    polars = pytest.importorskip("polars")
    same = fc.Natural().fit(fc.from_dataframe(polars.DataFrame({"id": ["a"] * 40, "x": np.arange(40.0), "y": 0.0, "t": times.to_list()}), by="id", t="t"))
    theirs = same.at("1D")["t"]
    assert theirs.dtype.time_zone == zone and [t.isoformat() for t in theirs.to_list()] == [t.isoformat() for t in fit.at("1D")["t"]]


def test_polars_with_zones_needs_no_pandas():
    pytest.importorskip("polars")
    script = """
import sys
sys.modules["pandas"] = None
import numpy as np, polars as pl, faircurve as fc
times = pl.datetime_range(pl.datetime(2024, 3, 30), pl.datetime(2024, 4, 2), "6h", time_zone="Europe/Berlin", eager=True)
table = pl.DataFrame({"ship": ["a"] * len(times), "lon": np.linspace(4, 5, len(times)), "lat": 52.0, "when": times, "kind": "x"})
fit = fc.Natural(surface="wgs84").fit(fc.from_dataframe(table, by="ship", coords=("lon", "lat"), t="when", carry=["kind"]))
made = fit.at("1h")
assert made.schema["when"] == pl.Datetime("us", "Europe/Berlin") and made.columns == ["ship", "when", "lon", "lat", "speed", "heading", "kind"], made.schema
assert made["when"][0] == times[0] and len(made) == 67, len(made)
assert fit.at(times[1:3])["when"].to_list() == times[1:3].to_list()
assert len(fit.at("1D")) == 3
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-1500:]


def test_metres_are_metres_in_every_crs():
    th, noise = np.linspace(0, 6, 60), np.random.default_rng(0).normal(scale=10, size=(2, 60))
    metres = gpd.GeoSeries([LineString(np.stack([500_000 + 1000 * th + noise[0], 6_000_000 + 300 * np.sin(th) + noise[1]], axis=1))], crs=32632)
    made = fc.Smoothing(deviation=20, units="m")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plain, globe = made.fit(metres), made.fit(metres.to_crs(4326))
        there = globe.sample(per_span=4).to_crs(32632)
    assert plain.sample(per_span=4).hausdorff_distance(there).iloc[0] < 1
    assert globe.report()["max_deviation"].iloc[0] <= 20.001 and abs(globe.length.iloc[0] / plain.length.iloc[0] - 1) < 1e-3
    ground = fc.Smoothing(within=20, units="m")
    a, b = ground.fit(metres).sample(200), ground.fit(metres.to_crs(4326)).sample(200).to_crs(32632)
    # Two projections of one band: a tenth of the distance.
    assert a.hausdorff_distance(b).iloc[0] < 2
    feet = metres.to_crs(epsg=2263)
    unit = feet.crs.axis_info[0].unit_conversion_factor
    assert fc.Smoothing(deviation=[20], units="m").fit(feet).sample(50).geom_equals(fc.Smoothing(deviation=20 / unit).fit(feet).sample(50)).all()
    with pytest.raises(ValueError, match='units is "m", and the curves have no CRS'):
        made.fit([np.zeros((3, 2))])
