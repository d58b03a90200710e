"""Every kind of batch comes in, and the same kind goes out, with the same numbers, without copies where that is said."""

import numpy as np
import pytest

import faircurve as fc

RNG = np.random.default_rng(7)
LINES = [RNG.normal(size=(n, 2)).cumsum(axis=0) for n in (4, 7, 3, 12)]
EXPECTED = [s for s in fc.Natural().fit(LINES).sample(per_span=4)]


def address(array):
    return array.__array_interface__["data"][0]


def test_arrays_of_equal_curves_are_not_copied_and_come_back_as_one():
    curves = RNG.normal(size=(5, 8, 3))
    given = fc.ragged(curves)
    assert address(given.coords) == address(curves)
    sampled = fc.Natural().fit(curves).sample(per_span=4)
    assert sampled.shape == (5, 29, 3)
    assert np.array_equal(sampled[:, ::4], curves)
    # Other memory orders and types are copied, and mean the same.
    for other in (np.asfortranarray(curves), curves.astype(np.float32).astype(float), curves[::-1][::-1]):
        assert np.allclose(fc.Natural().fit(other).sample(per_span=4), sampled, rtol=1e-6)


def test_pairs_of_coordinates_and_offsets_are_not_copied_and_come_back_as_pairs():
    coords, offsets = np.concatenate(LINES), np.cumsum([0] + [len(line) for line in LINES])
    given = fc.ragged((coords, offsets))
    assert address(given.coords) == address(coords) and address(given.offsets) == address(offsets)
    samples, ends = fc.Natural().fit((coords, offsets)).sample(per_span=4)
    assert np.array_equal(samples, np.concatenate(EXPECTED)) and ends.tolist() == [0, 13, 38, 47, 92]


def test_lists_come_back_as_lists():
    samples = fc.Natural().fit([line.tolist() for line in LINES]).sample(per_span=4)
    assert isinstance(samples, list) and all(np.array_equal(a, b) for a, b in zip(samples, EXPECTED))
    assert fc.Natural().fit([]).sample(8) == []
    assert [len(s) for s in fc.Natural().fit([[], LINES[0]]).sample(8)] == [0, 8]


@pytest.mark.parametrize("large", [False, True])
@pytest.mark.parametrize("layout", ["separated", "interleaved", "plain lists"])
def test_pyarrow_lists_in_every_layout_sliced_and_with_nulls(layout, large):
    pa = pytest.importorskip("pyarrow")
    separated = layout == "separated"
    lists = (pa.large_list if large else pa.list_)(pa.float64()) if layout == "plain lists" else pa.list_(pa.float64(), 2)
    point = pa.struct([("x", pa.float64()), ("y", pa.float64())]) if separated else lists
    kind = (pa.large_list if large else pa.list_)(point)
    rows = [[{"x": x, "y": y} if separated else [x, y] for x, y in line] for line in LINES]
    plain = pa.array(rows, kind)
    fit = fc.Natural().fit(plain)
    samples = fit.sample(per_span=4)
    assert samples.type == kind
    if not separated:
        assert address(fc.ragged(plain).coords) == plain.values.values.buffers()[1].address
    unpacked = lambda lists: [[list(p.values()) if separated else p for p in line] for line in lists.to_pylist()]
    assert unpacked(samples) == [line.tolist() for line in EXPECTED]
    # Slices and chunks.
    for sliced in (plain.slice(1, 2), pa.chunked_array([plain.slice(1, 1), plain.slice(2, 1)])):
        assert unpacked(fc.Natural().fit(sliced).sample(per_span=4)) == [line.tolist() for line in EXPECTED[1:3]]
    # A null stays one.
    holed = pa.array([rows[0], None, rows[2]], kind)
    fit = fc.Natural().fit(holed)
    samples = fit.sample(per_span=4)
    assert samples.is_valid().to_pylist() == [True, False, True] and samples[2].as_py() == fc.Natural().fit(plain).sample(per_span=4)[2].as_py()
    # Parameters are lists too.
    t = pa.array([np.arange(len(line), dtype=float).tolist() for line in LINES])
    timed = fc.Natural().fit(plain, t=t).sample(per_span=4).to_pylist()
    listed = fc.Natural().fit(LINES, t=[np.arange(len(line)) for line in LINES]).sample(per_span=4)
    assert (list(timed[3][5].values()) if separated else timed[3][5]) == listed[3][5].tolist()


@pytest.mark.parametrize("width", [16, 32, 64])
@pytest.mark.parametrize("layout", ["separated", "interleaved", "plain lists"])
def test_short_floats_of_pyarrow_come_out_short(layout, width):
    pa = pytest.importorskip("pyarrow")
    number = {16: pa.float16(), 32: pa.float32(), 64: pa.float64()}[width]
    point = {"separated": pa.struct([("lat", number), ("lon", number)]), "interleaved": pa.list_(number, 2), "plain lists": pa.list_(number)}[layout]
    short = [line.astype(f"f{width // 8}") for line in LINES]
    rows = [[{"lat": y, "lon": x} if layout == "separated" else [x, y] for x, y in line] for line in short]
    samples = fc.Natural().fit(pa.array(rows, pa.list_(point))).sample(per_span=4)
    assert samples.type == pa.list_(point)
    exact = fc.Natural().fit([line.astype(float) for line in short]).sample(per_span=4)
    found = [[[p["lon"], p["lat"]] if layout == "separated" else p for p in line] for line in samples.to_pylist()]
    assert all(np.array_equal(np.array(a), b.astype(f"f{width // 8}")) for a, b in zip(found, exact))


def test_plain_lists_of_unequal_widths_are_a_sentence_and_no_points_at_all_are_none():
    pa = pytest.importorskip("pyarrow")
    kind = pa.list_(pa.list_(pa.float64()))
    with pytest.raises(ValueError, match="curve 2 has a point of 3 numbers, and the first point has 2"):
        fc.Natural().fit(pa.array([[[0, 0], [1, 1]], [], [[0, 0], [1, 1, 1]]], kind))
    assert fc.Natural().fit(pa.array([[], None], kind)).sample(8).to_pylist() == [[], None]
    holed = fc.Natural().fit(pa.array([[[0, 0], [1, None], [2, 0]], [[0, 0], [1, 1]]], kind))
    assert holed.status.tolist() == ["invalid", "converged"]


def test_awkward_arrays_come_back_as_awkward_arrays():
    ak = pytest.importorskip("awkward")
    samples = fc.Natural().fit(ak.Array([line.tolist() for line in LINES])).sample(per_span=4)
    assert isinstance(samples, ak.Array) and samples.to_list() == [line.tolist() for line in EXPECTED]


def test_streamlines_of_nibabel_come_back_as_streamlines():
    pytest.importorskip("nibabel")
    from nibabel.streamlines import ArraySequence

    lines = [RNG.normal(size=(n, 3)).cumsum(axis=0) for n in (5, 9, 4)]
    sequence = ArraySequence(lines)
    samples = fc.Natural().fit(sequence).sample(points=6)
    assert isinstance(samples, ArraySequence) and [len(one) for one in samples] == [6, 6, 6]
    assert np.allclose(samples[1][0], lines[1][0]) and np.allclose(samples[1][-1], lines[1][-1])
    # A selection, whose rows lie apart in memory.
    chosen = fc.Natural().fit(sequence[[2, 0]]).sample(points=6)
    assert np.array_equal(chosen[0], samples[2]) and np.array_equal(chosen[1], samples[0])


def test_geometries_keep_their_kinds_their_holes_their_index_and_their_crs():
    gpd = pytest.importorskip("geopandas")
    import shapely

    ring = [(0, 0), (10, 0), (11, 5), (10, 10), (0, 10), (0, 0)]
    hole = [(3, 3), (6, 3), (6, 6), (3, 6), (3, 3)]
    polygon = shapely.Polygon(ring, [hole])
    series = gpd.GeoSeries(
        [
            polygon,
            shapely.LineString([(0, 0), (1, 2), (3, 0)]),
            None,
            shapely.MultiPolygon([polygon, shapely.affinity.translate(polygon, 20, 0)]),
            shapely.MultiLineString([[(0, 0), (1, 1), (2, 0)], [(5, 5), (6, 7), (8, 5)]]),
        ],
        index=list("abcde"),
        crs=3035,
    )
    fit = fc.Natural().fit(series)
    out = fit.sample(per_span=8)
    assert out.index.tolist() == list("abcde") and out.crs == series.crs
    assert out.geom_type.tolist() == series.geom_type.tolist()
    assert out["a"].is_valid and len(out["a"].interiors) == 1 and len(out["a"].exterior.coords) == 5 * 8 + 1
    assert len(fit) == 2 + 1 + 4 + 2
    # The corners are points of the curves, and a ring is smooth where it begins.
    assert all(min(abs(np.array(out["a"].exterior.coords) - corner).sum(axis=1)) == 0 for corner in ring)
    frame = gpd.GeoDataFrame({"name": range(5)}, index=series.index, geometry=series)
    back = fc.Natural().fit(frame).sample(per_span=8)
    assert isinstance(back, gpd.GeoDataFrame) and back["name"].tolist() == [0, 1, 2, 3, 4]
    assert back.geometry.geom_equals(out).drop("c").all()
    assert fc.Natural().fit(polygon).sample(per_span=8).equals(out["a"])
    with pytest.raises(TypeError, match="a Point is no curve"):
        fc.Natural().fit([shapely.Point(0, 0)])


@pytest.mark.parametrize(
    ("curves", "error", "sentence"),
    [
        (np.zeros((5, 2)), ValueError, r"one curve of shape \(n, d\) is curves\[None\]"),
        (np.zeros((2, 5, 4)), ValueError, "points have 4 coordinates; 2 and 3 are possible"),
        ([np.zeros((4, 2)), np.zeros((4, 3))], ValueError, "curve 1 has the shape"),
        (7, TypeError, "curves are a int"),
        ([["a", "b"]], TypeError, "the points of curve 0 must be numbers"),
        ((np.zeros((4, 2)), np.array([0, 5])), ValueError, "offsets end at 5, but there are 4 points"),
        ((np.zeros((4, 2)), np.array([0, -1, 4])), ValueError, "an offset is -1"),
        ((np.zeros((4, 2)), np.array([0.0, 4.0])), TypeError, "offsets are whole numbers"),
    ],
)
def test_what_is_no_batch_is_said_in_a_sentence(curves, error, sentence):
    with pytest.raises(error, match=sentence):
        fc.Natural().fit(curves)
