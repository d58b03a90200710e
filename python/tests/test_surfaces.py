"""Surfaces of arrays: the same as from files, against SciPy and closed forms, and what is refused."""

import pickle

import numpy as np
import pytest

import faircurve as fc

RNG = np.random.default_rng(11)
X, Y = 400 + 5.0 * np.arange(24), 900 - 4.0 * np.arange(19)
HEIGHTS = 30 * np.exp(-((X - 450) ** 2 + (Y[:, None] - 870) ** 2) / 900) + RNG.normal(0, 0.3, (19, 24))
HILL = fc.HeightField(HEIGHTS, spacing=(5, -4), origin=(400, 900))
#: Tracks over the hill, as places.
TRACKS = [np.array([(410, 895), (440, 880), (470, 860), (505, 835)]), np.array([(420, 840), (450, 865), (480, 890)])]


def triangles(rows, columns):
    """Two triangles for each cell of a grid of vertices."""
    k = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    return np.concatenate([np.stack([k, k + 1, k + columns + 1], axis=1), np.stack([k, k + columns + 1, k + columns], axis=1)])


def rolled(u, v):
    """Places of a sheet that is rolled around a cylinder of radius 2."""
    return np.stack([2 * np.cos(u / 2), 2 * np.sin(u / 2), v], axis=-1)


U, V = np.meshgrid(np.linspace(0, 3, 25), np.linspace(0, 2, 17))
SHEET = fc.Mesh(rolled(U, V).reshape(-1, 3), triangles(17, 25))
#: Tracks in the sheet, by u and v.
FLAT = [np.array([(0.4, 0.3), (1.2, 1.4), (2.5, 1.7)]), np.array([(2.6, 0.4), (1.5, 0.5), (0.5, 1.6)])]
METHODS = [fc.Natural, lambda **of: fc.Smoothing(lam=0.5, **of), fc.Fair, lambda **of: fc.Geodesic(per_span=8, **of)]


def same(ours, others):
    return all(np.array_equal(a, b) for a, b in zip(ours.sample(per_span=5), others.sample(per_span=5), strict=True))


@pytest.mark.parametrize("method", METHODS)
def test_curves_are_those_of_files_to_the_bit(method, tmp_path):
    np.savetxt(tmp_path / "hill.csv", HEIGHTS, delimiter=",")
    word = f"grid:{tmp_path}/hill.csv,5,-4,400,900"
    ours, others = (method(surface=surface).fit(TRACKS) for surface in (HILL, word))
    assert ours.status.tolist() == ["converged"] * 2 and same(ours, others)
    with open(tmp_path / "sheet.obj", "w") as file:
        file.writelines(f"v {x!r} {y!r} {z!r}\n" for x, y, z in SHEET.vertices.tolist())
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in (SHEET.triangles + 1).tolist())
    points = [rolled(*track.T) for track in FLAT]
    ours, others = (method(surface=surface).fit(points) for surface in (SHEET, f"mesh:{tmp_path}/sheet.obj"))
    assert ours.status.tolist() == ["converged"] * 2 and same(ours, others)


@pytest.mark.parametrize("method", METHODS)
def test_curves_over_terrain_lie_on_it_from_places_and_from_points(method):
    flat = method(surface=HILL).fit(TRACKS)
    assert flat.status.tolist() == ["converged"] * 2
    for samples in flat.sample(per_span=40):
        assert np.abs(HILL.height(samples[:, 0], samples[:, 1]) - samples[:, 2]).max() < 1e-11
    lifted = [np.column_stack([track, HILL.height(*track.T)]) for track in TRACKS]
    assert same(method(surface=HILL).fit(lifted), flat)


def test_heights_are_those_of_scipys_natural_splines_and_the_shape_of_places_is_kept():
    interpolate = pytest.importorskip("scipy.interpolate")
    x, y = RNG.uniform(400, 515, 60), RNG.uniform(828, 900, 50)
    across = interpolate.CubicSpline(X, HEIGHTS, axis=1, bc_type="natural")(x)
    wanted = interpolate.CubicSpline(Y[::-1], across[::-1], axis=0, bc_type="natural")(y)
    assert np.abs(HILL.height(x, y[:, None]) - wanted).max() < 1e-12 * HEIGHTS.max()
    assert HILL.height(405, 896).shape == () and HILL.height(405, 896) == pytest.approx(HEIGHTS[1, 1], abs=1e-12)
    assert HILL.height(np.zeros((0, 3)), 1).shape == (0, 3) and np.isnan(HILL.height(np.nan, 1))
    assert HILL.bounds == (400, 828, 515, 900)
    assert fc.HeightField(HEIGHTS, 2).bounds == (0, 0, 46, 36)


def test_closest_points_lie_straight_below():
    points = np.column_stack([RNG.uniform(420, 500, 40), RNG.uniform(840, 890, 40), np.full(40, 33.0)])
    found = HILL.closest(points)
    x, y, z = found.T
    assert found.shape == (40, 3) and np.abs(HILL.height(x, y) - z).max() < 1e-11
    slope = [(HILL.height(x + a, y + b) - HILL.height(x - a, y - b)) / 2e-4 for a, b in ((1e-4, 0), (0, 1e-4))]
    normal = np.stack([-slope[0], -slope[1], np.ones(40)], axis=1)
    away = points - found
    assert np.abs(np.cross(away, normal)).max() < 1e-6 * np.linalg.norm(away, axis=1).max()
    # Of a sheet around a cylinder: along the radius.
    places = rolled(*np.concatenate(FLAT).T)
    out = SHEET.closest(places * (1.05, 1.05, 1))
    assert np.abs(out - places).max() < 1e-5
    assert np.isnan(HILL.closest([(np.nan, 0, 0)])).all() and HILL.closest(np.zeros((0, 3))).shape == (0, 3)


def test_geodesics_and_splines_of_a_rolled_sheet_are_those_of_the_flat_one():
    points = [rolled(*track[[0, -1]].T) for track in FLAT]
    lengths = [np.linalg.norm(track[-1] - track[0]) for track in FLAT]
    assert np.abs(fc.Geodesic(SHEET).fit(points).length / lengths - 1).max() < 1e-6
    t = np.array([0.0, 1.0, 2.5])
    bent = fc.Natural(surface=SHEET).fit([rolled(*track.T) for track in FLAT], t=t)
    flat = fc.Natural().fit(FLAT, t=t)
    at = np.linspace(0, 2.5, 21)
    for curve, track in zip(bent(at), flat(at)):
        assert np.abs(curve - rolled(*track.T)).max() < 1e-4


def test_splines_in_a_surface_start_and_end_with_their_tangents():
    t = np.array([0.0, 1.0, 2.5])
    tangents = np.full((1, 3, 2), np.nan)
    tangents[0, 0], tangents[0, 2] = (1.5, -2), (0.5, 0.25)
    flat = fc.Natural(ends="clamped").fit([FLAT[0]], t=t, tangents=tangents)
    step = 1e-6
    # The places of the sheet that velocities lead to.
    lifted = np.full((1, 3, 3), np.nan)
    for k in (0, 2):
        ahead, behind = (rolled(*(FLAT[0][k] + h * tangents[0, k])) for h in (step, -step))
        lifted[0, k] = (ahead - behind) / (2 * step)
    at = np.linspace(0, 2.5, 21)
    for method in (fc.Natural(ends="clamped", surface=SHEET), fc.Smoothing(lam=0, surface=SHEET)):
        bent = method.fit([rolled(*FLAT[0].T)], t=t, tangents=lifted)
        assert bent.status.tolist() == ["converged"]
        assert np.abs(bent(at)[0] - rolled(*flat(at)[0].T)).max() < 1e-4
        assert np.abs(bent([0.0, 2.5], 1)[0] - lifted[0, [0, 2]]).max() < 1e-4
    track = np.array([(170.0, 10.0), (178.0, 14.0), (-175.0, 12.0)])
    fit = fc.Natural(surface="wgs84").fit([track], t=t, tangents=[[(2, -1), (np.nan, np.nan), (3, 0.5)]])
    assert np.abs(fit([0.0, 2.5], 1)[0] - [(2, -1), (3, 0.5)]).max() < 1e-10
    planar = fc.Natural(surface=HILL).fit(TRACKS[1:], t=t, tangents=[[(30, 10), (np.nan, np.nan), (np.nan, np.nan)]])
    assert np.abs(planar(0.0, 1)[0][:2] - (30, 10)).max() < 1e-10
    lost = fc.Natural(ends="clamped", surface="wgs84").fit([track], t=t)
    assert lost.status.tolist() == ["invalid"] and "clamped ends need a tangent here" in lost.messages[0]
    with pytest.raises(ValueError, match="know no tangents"):
        fc.Smoothing(lam=0.1).fit([FLAT[0]], t=t, tangents=tangents)


def test_surfaces_and_methods_that_have_one_can_be_pickled():
    for surface in (HILL, SHEET):
        copied = pickle.loads(pickle.dumps(surface))
        assert copied == surface and hash(copied) == hash(surface) and copied is not surface
        assert repr(copied) == repr(surface)
        method = fc.Natural(surface=surface)
        assert pickle.loads(pickle.dumps(method)) == method
    assert HILL != fc.HeightField(HEIGHTS) and HILL != SHEET and HILL != "hill"
    method = pickle.loads(pickle.dumps(fc.Fair(surface=HILL)))
    assert same(method.fit(TRACKS), fc.Fair(surface=HILL).fit(TRACKS))


def test_surfaces_say_what_they_are_and_keep_copies():
    assert repr(HILL) == "<faircurve.HeightField: the height field of 19 × 24 heights>"
    assert repr(SHEET) == "<faircurve.Mesh: the mesh of 425 vertices and 768 triangles>"
    heights = HEIGHTS.copy()
    own = fc.HeightField(heights, spacing=(5, -4), origin=(400, 900))
    heights[:] = 0
    assert np.array_equal(own.heights, HEIGHTS) and own == HILL
    for array in (HILL.heights, SHEET.vertices, SHEET.triangles):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    # Whole numbers, narrow floats and rows that lie apart are heights too.
    assert np.array_equal(fc.HeightField(np.eye(4, dtype=np.int16)[::2]).heights, np.eye(4)[::2])


def test_curves_that_leave_the_terrain_are_infeasible():
    fit = fc.Natural(surface=HILL).fit([[(410, 895), (514, 840), (514, 830), (410, 832)]], t=[0, 1, 1.2, 2])
    assert fit.status.tolist() == ["infeasible"]
    assert "lies beyond the grid of x from 400 to 515 and y from 828 to 900" in fit.messages[0]
    with pytest.raises(ValueError, match="have points of three coordinates, and these have two"):
        fc.Natural(surface=SHEET).fit(TRACKS)


GAP = HEIGHTS.copy()
GAP[2, 5] = np.nan
BAND = np.stack([np.array([np.cos(s) * (1 + w * np.cos(s / 2)), np.sin(s) * (1 + w * np.cos(s / 2)), w * np.sin(s / 2)]) for s in np.linspace(0, 2 * np.pi, 12, endpoint=False) for w in (-0.2, 0.2)])
TWISTED = [t for k in range(12) for a, b, c, d in [(2 * k, 2 * k + 1, *((1, 0) if k == 11 else (2 * k + 2, 2 * k + 3)))] for t in ((a, b, d), (a, d, c))]


def test_gaps_are_holes():
    heights = fc.HeightField(GAP).height([5, 8], [2, 2])
    assert np.isnan(heights[0]) and abs(heights[1] - fc.HeightField(HEIGHTS).height(8, 2)) < 0.05 * np.ptp(HEIGHTS)


@pytest.mark.parametrize(
    ("act", "error", "sentence"),
    [
        (lambda: fc.HeightField(GAP * np.nan), ValueError, "heights of a height field is a finite number: give some"),
        (lambda: fc.HeightField(np.ma.masked_all((3, 4))), ValueError, "none of the 3 × 4 heights"),
        (lambda: fc.HeightField(HEIGHTS[0]), ValueError, r"heights have the shape \(24,\); rows of columns are needed"),
        (lambda: fc.HeightField(HEIGHTS[:1]), ValueError, "1 × 24 heights is no surface"),
        (lambda: fc.HeightField([["high", "low"]] * 2), TypeError, "heights must be numbers"),
        (lambda: fc.HeightField(HEIGHTS, spacing=(1, 0)), ValueError, "the spacing of rows is 0"),
        (lambda: fc.HeightField(HEIGHTS, spacing=(1, 2, 3)), ValueError, r"spacing has the shape \(3,\); a pair"),
        (lambda: fc.HeightField(HEIGHTS, origin=5), ValueError, r"origin has the shape \(\); a pair"),
        (lambda: fc.HeightField(HEIGHTS, origin=(0, np.inf)), ValueError, "the origin of a height field is at inf"),
        (lambda: HILL.closest([(1, 2)]), ValueError, r"points have the shape \(1, 2\); rows of 3 coordinates"),
        (lambda: HILL.height([1, 2], [1, 2, 3]), ValueError, r"x has the shape \(2,\) and y \(3,\); shapes that fit"),
        (lambda: fc.Mesh(SHEET.vertices[:, :2], SHEET.triangles), ValueError, r"vertices have the shape \(425, 2\)"),
        (lambda: fc.Mesh(SHEET.vertices, SHEET.triangles.ravel()), ValueError, r"triangles have the shape \(2304,\)"),
        (lambda: fc.Mesh(SHEET.vertices, SHEET.triangles * 1.0), ValueError, "triangles are float64; numbers of vertices are integers"),
        (lambda: fc.Mesh(SHEET.vertices, SHEET.triangles - 1), ValueError, "triangle 0 has vertex -1: vertices are counted from 0"),
        (lambda: fc.Mesh(SHEET.vertices[:9], SHEET.triangles), ValueError, "but the mesh has 9 vertices, counted from 0"),
        (lambda: fc.Mesh(SHEET.vertices * np.nan, SHEET.triangles), ValueError, "give finite numbers"),
        (lambda: fc.Mesh(SHEET.vertices, np.zeros((0, 3), int)), ValueError, "the mesh has no triangles"),
        (lambda: fc.Mesh(BAND, TWISTED), ValueError, "the mesh has one side only, as a Möbius band"),
        (lambda: fc.Natural(surface=HEIGHTS).fit(TRACKS), TypeError, 'surface is a ndarray; a word such as "wgs84", a HeightField and a Mesh'),
    ],
)
def test_wrong_arrays_are_sentences(act, error, sentence):
    with pytest.raises(error, match=sentence):
        act()
