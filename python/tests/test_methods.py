"""The methods against SciPy and themselves, and what is refused."""

import pickle

import numpy as np
import pytest

import faircurve as fc

RNG = np.random.default_rng(3)
CURVES = RNG.normal(size=(200, 9, 2))
T = np.cumsum(RNG.uniform(0.2, 2.0, size=(200, 9)), axis=1)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


def test_natural_splines_are_scipys():
    interpolate = pytest.importorskip("scipy.interpolate")
    fit = fc.Natural().fit(CURVES, t=T)
    u = [np.linspace(t[0], t[-1], 33) for t in T]
    for nu in range(4):
        ours = fit(u, nu)
        for i in range(0, 200, 7):
            spline = interpolate.CubicSpline(T[i], CURVES[i], bc_type="natural")
            inside = slice(None) if nu < 3 else slice(1, -1)
            assert relative(ours[i][inside], spline(u[i], nu)[inside]) < 1e-11, (i, nu)


def test_closed_splines_are_scipys_periodic_ones():
    interpolate = pytest.importorskip("scipy.interpolate")
    rings = np.concatenate([CURVES, CURVES[:, :1]], axis=1)
    t = np.concatenate([T, T[:, -1:] + 1.0], axis=1)
    fit = fc.Natural().fit(rings, t=t, closed=True)
    u = [np.linspace(row[0], row[-1], 41) for row in t]
    ours = fit(u)
    for i in range(0, 200, 9):
        spline = interpolate.CubicSpline(t[i], rings[i], bc_type="periodic")
        assert relative(ours[i], spline(u[i])) < 1e-11, i
    assert fc.Natural().fit(rings, t=t, closed="auto").sample(12).shape == (200, 12, 2)


def test_smoothing_splines_are_scipys_make_smoothing_spline():
    interpolate = pytest.importorskip("scipy.interpolate")
    weights = RNG.uniform(0.5, 2.0, size=T.shape)
    fit = fc.Smoothing(lam=0.3, pin_ends=False).fit(CURVES, t=T, weights=weights)
    ours = fit([t for t in T])
    for i in range(0, 200, 9):
        spline = interpolate.make_smoothing_spline(T[i], CURVES[i], w=weights[i], lam=0.3)
        assert relative(ours[i], spline(T[i])) < 1e-9, i


def test_deviations_are_kept_and_reported():
    fit = fc.Smoothing(deviation=0.2).fit(CURVES)
    report = fit.report()
    assert (report["max_deviation"] <= 0.2).all() and (report["smoothing"] > 0).all()
    tube = fc.Smoothing(tube=0.2).fit(CURVES)
    assert (tube.energy <= fit.energy * (1 + 1e-9)).all()


def test_deviations_may_be_parts_of_each_curves_size():
    size = np.linalg.norm(np.ptp(CURVES, axis=1), axis=1)
    for method in (fc.Smoothing(deviation="2%"), fc.Smoothing(tube="2%"), fc.Fair(deviation="2%")):
        fit = method.fit(CURVES[:20])
        assert (fit.report()["max_deviation"] <= 0.02 * size[:20]).all(), method
        assert (fit.report()["max_deviation"] > 0.0199 * size[:20]).any(), method
    with pytest.raises(ValueError, match='"2x" is no deviation'):
        fc.Fair(deviation="2x").fit(CURVES[:1])
    with pytest.raises(ValueError, match="tube is '-2%'; it must be a positive number, or a part such as '2%'"):
        fc.Smoothing(tube="-2%")
    for method in (fc.Fair(deviation="2m"), fc.Smoothing(within="2m")):
        with pytest.raises(ValueError, match="2m is a length in metres"):
            method.fit(CURVES[:1])


def test_further_starts_never_cost_energy_and_say_what_they_saved():
    once, often = (fc.Fair({"bending": 1, "length": 0.1}, starts=n).fit(CURVES[:20]) for n in (1, 6))
    gain = often.report()["gain"]
    both = (once.status == "converged") & (often.status == "converged")
    assert np.isnan(once.report()["gain"]).all() and both.sum() > 10
    assert np.allclose(1 - often.energy[both] / once.energy[both], gain[both], atol=1e-12) and (gain >= 0).all()


def test_fair_curves_take_energies_as_sums_and_as_dicts():
    points = CURVES[:20]
    summed = fc.Fair(fc.bending(2) + 0.5 * fc.length()).fit(points)
    named = fc.Fair({"bending": 1, "length": 0.5}).fit(points)
    assert np.array_equal(summed.sample(per_span=16), named.sample(per_span=16))
    assert (summed.status == "converged").all()
    waves = np.stack([T[:20], np.sin(T[:20]) + 0.1 * CURVES[:20, :, 0]], axis=2)
    through, near = (fc.Fair({"bending": 1, "length": 0.5}, deviation=d).fit(waves) for d in (None, 0.1))
    assert (near.status == "converged").all() and (near.report()["max_deviation"] <= 0.1).all()
    assert (near.energy < through.energy).all()
    with pytest.raises(ValueError, match='there is no energy "bend"'):
        fc.Fair({"bend": 1}).fit(points)
    with pytest.raises(ValueError, match="weights are 0 or positive"):
        fc.Fair({"bending": -1}).fit(points)
    with pytest.raises(TypeError, match="an energy is a sum"):
        fc.Fair("bending").fit(points)


def test_rough_paths_in_bending_and_tautness_converge_without_loops_in_any_unit():
    rng = np.random.default_rng(8)
    paths = np.stack([np.tile(np.arange(10.0), (300, 1)), rng.normal(0, 1.2, (300, 10))], axis=2)
    energy = fc.bending() + fc.tautness()
    fit = fc.Fair(energy).fit(paths, device="cpu")
    assert (fit.status == "converged").all()
    chords = np.linalg.norm(np.diff(paths, axis=1), axis=2).sum(axis=1)
    assert (fit.length < 1.2 * chords).all()
    assert np.array_equal(fc.Fair().fit(paths, device="cpu").sample(16), fit.sample(16))
    near = [fc.Fair(own, deviation=0.1).fit(paths[:20], device="cpu").sample(16) for own in (None, energy)]
    assert np.array_equal(*near)
    far = fc.Fair(energy).fit(1000 * paths, device="cpu")
    assert np.allclose(far.sample(64), 1000 * fit.sample(64), atol=1e-2, rtol=0)
    assert (fc.Fair(fc.bending()).fit(paths, device="cpu").status == "converged").mean() < 0.5


def test_smooth_connection_functions_through_points_of_a_circle_are_hardly_a_circle_less_bent():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    fit = fc.Smooth().fit([ring], closed=True)
    # Through the points there is a closed curve of hardly less energy than the circle.
    assert fit.status.tolist() == ["converged"] and 0.9999 < fit.energy[0] / (2 * np.pi) < 1
    assert abs(fit.length[0] / (2 * np.pi) - 1) < 1e-3 and abs(fit.max_curvature[0] - 1) < 0.02
    assert np.allclose(fit.curvature(np.linspace(0, 6, 50)), 1, atol=0.02)


def test_bad_curves_are_data_and_leave_their_neighbours_alone():
    bad = [CURVES[0], [(0, 0), (np.nan, 1), (2, 2)], [(1, 1)], CURVES[1], []]
    for method in (fc.Natural(), fc.Smoothing(lam=0.1), fc.Fair({"bending": 1, "length": 0.1}), fc.Smooth()):
        fit = method.fit(bad)
        assert fit.status[1] == "invalid" and fit.status[2] == "degenerate" and fit.status[4] == "degenerate"
        assert "NaN" in fit.messages[1]
        alone = method.fit([CURVES[0], CURVES[1]])
        for i, k in ((0, 0), (3, 1)):
            assert np.array_equal(fit.sample(per_span=8)[i], alone.sample(per_span=8)[k])


@pytest.mark.parametrize(
    ("act", "error", "sentence"),
    [
        (lambda: fc.Natural().fit(CURVES, t=T[:5]), ValueError, r"t has the shape \(5, 9\); it must be as the points are: \(200, 9\)"),
        (lambda: fc.Natural(ends="open").fit(CURVES), ValueError, "ends is 'open'; auto, natural, clamped are possible"),
        (lambda: fc.Natural().fit(CURVES, device="tpu"), ValueError, "tpu"),
        (lambda: fc.Natural().fit(CURVES, device="cpu", precision="f32"), ValueError, "belongs to a GPU"),
        (lambda: fc.Natural().fit(CURVES, closed=[True]), ValueError, "1 flags for 200 curves"),
        (lambda: fc.Natural().fit(CURVES, closed="yes"), ValueError, '"auto" and one flag a curve are possible'),
        (lambda: fc.Smoothing().fit(CURVES), TypeError, "give one of lam, deviation, tube, s and within"),
        (lambda: fc.Smoothing(lam=1, tube=1).fit(CURVES), TypeError, "give one of"),
        (lambda: fc.Smoothing(deviation=-1).fit(CURVES), ValueError, "deviation is -1"),
        (lambda: fc.Natural().fit(CURVES, device="gpu:99"), RuntimeError, "99"),
        (lambda: fc.Natural().fit(CURVES, device="pci:ffff:00:00.0"), RuntimeError, 'no GPU is at the PCI address "ffff:00:00.0"'),
        (lambda: fc.Natural().fit(CURVES).sample(4, points=5), TypeError, "one way"),
        (lambda: fc.Natural().fit(CURVES).sample(0), ValueError, "count is 0"),
        (lambda: fc.Natural().fit(CURVES)([[1.0], [2.0]]), ValueError, "2 lists of parameters for 200 curves"),
        (lambda: fc.Natural().fit(CURVES)(0.5, nu=-1), ValueError, "nu is -1"),
        (lambda: fc.Natural().fit(CURVES)[200], IndexError, "no curve 200 of 200"),
    ],
)
def test_wrong_arguments_are_sentences(act, error, sentence):
    with pytest.raises(error, match=sentence):
        act()


def test_fair_curves_keep_a_largest_curvature_and_the_shape_of_their_points():
    points = np.array([(-0.3, 1.2), (0, 0), (1.5, 0), (3, 0.15)])
    free = fc.Fair({"bending": 1, "length": 0.5}).fit([points])
    assert "violation" not in free.report()
    bounded = fc.Fair({"bending": 1, "length": 0.5}, max_curvature=1.2).fit([points, points[:3]])
    report = bounded.report()
    assert report["violation"].tolist() == [0, 0] and report["active"][0] > 0 and report["cost"][0] > 0
    single = fc.Fair({"bending": 1, "length": 0.5}).fit([points], largest_curvatures=np.array([np.nan, 1.2, np.nan, np.nan]))
    assert single.report()["cost"][0] <= report["cost"][0]
    kept = fc.Fair({"bending": 1, "length": 0.5}, preserve_shape=True).fit([points])
    assert abs(kept.report()["energy"][0] / 4.309049964273713 - 1) < 1e-6
    wide = fc.Fair(max_curvature=0.1).fit([points])
    assert wide.status.tolist() == ["converged"] and wide.report()["loops"][0] > 2
    tight = fc.Fair(max_curvature=0.1, max_stretch=2.0).fit([points])
    assert tight.status.tolist() == ["infeasible"]
    with pytest.raises(ValueError, match="max_curvature is -1"):
        fc.Fair(max_curvature=-1.0).fit([points])


def test_smooth_connection_functions_keep_the_shape_of_their_points():
    points = np.array([(-0.3, 1.2), (0, 0), (1.5, 0), (3, 0.15), (3.2, 1.4)])
    free, kept = fc.Smooth().fit([points]), fc.Smooth(preserve_shape=True).fit([points])
    assert "violation" not in free.report() and kept.status.tolist() == ["converged"]
    report = kept.report()
    assert report["violation"][0] == 0 and report["active"][0] > 0
    assert abs(kept.energy[0] / free.energy[0] - 1 - report["cost"][0]) < 1e-12
    with pytest.raises(ValueError, match="keep the shape of their points without a tension"):
        fc.Smooth(preserve_shape=True, tension=1.0).fit([points])


def test_fair_curves_of_a_batch_do_not_cross_where_their_points_do_not():
    few = np.array([(0, 0), (1, 0), (1.2, 1), (2.2, 1)])
    many = np.array([(1, 0.2), (1.1, 1.05), (1.6, 1.05), (2.2, 1.05)])
    free, apart = fc.Fair().fit([few, many]), fc.Fair(no_crossing=True).fit([few, many])
    assert "neighbours" not in free.report()
    report = apart.report()
    assert apart.status.tolist() == ["converged"] * 2 and report["neighbours"].tolist() == [1, 1]
    assert report["touching"].tolist() == [0, 0] and report["violation"].tolist() == [0, 0]

    def above(fit):
        """Whether the first curve stays below the line that the second comes from, between its last points."""
        x, y = np.concatenate([fit.sample(per_span=16)[0][33:-1]]).T
        own = np.array(fit.sample(per_span=16)[1])
        return bool((y < np.interp(x, own[16:, 0], own[16:, 1])).all())

    assert not above(free) and above(apart)
    with pytest.raises(ValueError, match="curves in space pass by each other"):
        fc.Fair(no_crossing=True).fit([np.array([(0, 0, 0), (1, 1, 1), (2, 0, 0)])])


def test_a_custom_energy_is_that_of_its_formula():
    def elastica(t, s):
        turn = t[1] - t[0]
        return np.float64(2) * turn.dot(turn) / (s[0] + s[1])

    curves = np.random.default_rng(5).normal(size=(20, 6, 3)).cumsum(axis=1)
    own, built_in = (fc.Fair(energy + 0.5 * fc.length()).fit(curves) for energy in (fc.custom("elastica", 2, -1, elastica), fc.bending()))
    assert own.status.tolist() == built_in.status.tolist()
    assert np.allclose(own.report()["energy"], built_in.report()["energy"], rtol=1e-9)
    # Every operation: stretched edges cost, short ones do not.
    piece = fc.custom("piece", 1, 1, lambda t, s: abs(s[0] - 1).sqrt().maximum(0.0) ** 2 + (s[0] - 0.1).if_positive(-t[0].z, s[0] / 3))
    assert pickle.loads(pickle.dumps(piece)) == piece
    with pytest.raises(TypeError, match="has no value yet"):
        fc.custom("choice", 1, 1, lambda t, s: s[0] if s[0] - 1 else t[0].x)
    with pytest.raises(ValueError, match="0 edges"):
        fc.Fair(fc.custom("nothing", 0, 1, lambda t, s: fc.Expression("number", 1.0))).fit(curves)
    with pytest.raises(TypeError, match="must be a number made of tangents and lengths"):
        fc.custom("constant", 1, 1, lambda t, s: 3.0)


def test_fair_curves_keep_corridors_regions_directions_and_lengths():
    points = np.array([(0, 0), (1, 0.8), (2, -0.6), (3, 0.9), (4, 0)])
    energy = {"bending": 1, "length": 0.1}

    def kept(**limits):
        fit = fc.Fair(energy, **limits).fit([points])
        report = fit.report()
        assert fit.status.tolist() == ["converged"] and report["violation"][0] == 0
        # A length holds the curve as a whole, and no vertex.
        assert (report["active"][0] > 0) != ("max_stretch" in limits)
        return fit

    # The energies of an interior-point method, which keeps edges equal: see tests/discrete/fair_places.rs.
    assert abs(kept(corridor=0.1).report()["energy"][0] / 17.87999638 - 1) < 3e-4
    assert abs(kept(half_planes=(0, 1, 0.95)).report()["energy"][0] / 12.85059387 - 1) < 1e-6
    around = kept(keep_out=[(1.5, 0.2, 0.3), (9, 9, 1)], keep_in=[(2, 0, 3)])
    assert np.linalg.norm(around.sample(per_span=16)[0] - (1.5, 0.2), axis=1).min() >= 0.3
    turning = kept(max_curvature_rate=2.3).sample(per_span=16)[0]
    edges = np.diff(turning, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    sines = (edges[:-1, 0] * edges[1:, 1] - edges[:-1, 1] * edges[1:, 0]) / (lengths[:-1] * lengths[1:])
    curvature = 2 * sines / (lengths[:-1] + lengths[1:])
    assert 2.29 < np.abs(np.diff(curvature) / lengths[1:-1]).max() <= 2.3
    with pytest.raises(ValueError, match="planar curves have no slope"):
        fc.Fair(max_climb=0.1).fit([points])
    assert kept(max_stretch=1.1).report()["stretch"][0] <= 1.1
    ring = [(0, 0), (2, 0), (2, 1), (0, 1)]
    island = fc.Fair(deviation=0.2, preserve_area=True).fit([ring], closed=True).sample(per_span=16)[0]
    x, y = island.T
    assert abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)) - 4) < 1e-5
    single = fc.Fair(energy).fit([points], corridors=np.array([np.nan, 0.05, np.nan, np.nan, np.nan]))
    assert single.report()["active"][0] > 0
    assert single.report()["energy"][0] < kept(corridor=0.05).report()["energy"][0]
    bumpy = [(0, 0), (1, 1.2), (1.3, 1.3), (3, 1.35), (3.2, 2.5), (4, 2.6)]
    for direction in ("y", (0, 2)):
        grown = fc.Fair(energy, monotone=direction).fit([bumpy])
        assert abs(grown.report()["energy"][0] / 10.00142854 - 1) < 2e-5
        # It goes back along x.
        assert np.diff(grown.sample(per_span=16)[0][:, 0]).min() < 0
    both = [fc.Fair(energy, monotone=directions).fit([bumpy]) for directions in ("xy", [(0, 1), (1, 0)])]
    assert both[0].report()["energy"][0] == both[1].report()["energy"][0] > grown.report()["energy"][0]
    assert np.diff(both[0].sample(per_span=16)[0], axis=0).min() >= 0
    from shapely import LineString, Polygon

    house = Polygon([(1.2, -0.5), (1.6, -0.5), (1.6, 0.6), (1.2, 0.6)], holes=[[(1.3, 0), (1.4, 0), (1.4, 0.1)]])
    for obstacles in ([house], [np.array(house.exterior.coords[:-1])]):
        away = kept(obstacles=obstacles, clearance=0.05)
        assert LineString(away.sample(per_span=16)[0]).distance(Polygon(house.exterior)) >= 0.05
    sides = fc.Fair(energy, deviation=1).fit([points], widths=np.tile([0.05, 0.2], (len(points), 1)))
    assert sides.status.tolist() == ["converged"] and sides.report()["active"][0] > 0
    own = fc.Fair(energy, obstacles=[obstacles, []], clearance=0.05).fit([points, points])
    assert np.array_equal(own.sample(50)[0], away.sample(50)[0])
    assert np.array_equal(own.sample(50)[1], fc.Fair(energy).fit([points]).sample(50)[0])
    with pytest.raises(ValueError, match="obstacles has 2 lists for 1 curves"):
        fc.Fair(obstacles=[[house], []]).fit([points])
    with pytest.raises(ValueError, match="obstacles has a polygon of the shape"):
        fc.Fair(obstacles=[(1, 2)]).fit([points])
    with pytest.raises(ValueError, match="keep_out has the shape"):
        fc.Fair(keep_out=[(1, 2)]).fit([points])
    with pytest.raises(ValueError, match="max_stretch is 1.0; it must be more than 1"):
        fc.Fair(max_stretch=1.0).fit([points])
    with pytest.raises(ValueError, match="no direction"):
        fc.Fair(monotone=(0, 0)).fit([points])
    with pytest.raises(ValueError, match="axes are 'x', 'y', 'z' or some of them"):
        fc.Fair(monotone="up").fit([points])


def test_curves_on_a_globe_do_not_know_where_its_poles_and_its_date_line_are():
    track = np.array([(0.0, -8.0), (6.0, 3.0), (15.0, 1.0), (22.0, 9.0)])
    fit = fc.Fair(surface="sphere:1").fit([track])
    here = _places(fit.sample(per_span=16)[0])
    turn = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    moved = _angles(_places(track) @ turn.T)
    there = _places(fc.Fair(surface="sphere:1").fit([moved]).sample(per_span=16)[0])
    assert np.abs(here @ turn.T - there).max() < 1e-9
    with pytest.raises(ValueError, match="there is no surface 'ball'"):
        fc.Fair(surface="ball").fit([track])


def test_splines_in_a_surface_keep_the_times_of_their_points():
    track = np.array([(170.0, 0.0), (176.0, 0.0), (-174.0, 0.0), (-170.0, 0.0)])
    hours = np.array([0.0, 6.0, 16.0, 20.0])
    fit = fc.Natural(surface="wgs84").fit([track], t=[hours])
    at = fit([np.array([3.0, 10.0, 18.0])])[0]
    assert np.abs(at - [(173, 0), (180, 0), (188, 0)]).max() < 1e-7
    smooth = fc.Smoothing(lam=100.0, surface="sphere").fit([track + [(0, 0), (0, 1), (0, -1), (0, 0)]], t=[hours])
    assert smooth.status.tolist() == ["converged"] and smooth.report()["max_deviation"][0] > 1e4
    near = fc.Smoothing(tube=5e3, surface="wgs84").fit([track + [(0, 0), (0, 0.1), (0, -0.1), (0, 0)]], t=[hours])
    assert near.status.tolist() == ["converged"] and near.report()["max_deviation"][0] <= 5e3
    with pytest.raises(ValueError, match="take lam, deviation or tube, and not within"):
        fc.Smoothing(within=1.0, surface="sphere").fit([track])
    with pytest.raises(ValueError, match="keep no shape"):
        fc.Natural(surface="sphere", preserve_shape=True).fit([track])


def test_geodesics_have_their_lengths():
    quarter = fc.Geodesic("sphere:1").fit([[(0, 0), (90, 0)], [(0, 0), (90, 0), (90, 90)]])
    assert np.abs(quarter.length / (np.pi / 2) - [1, 2]).max() < 1e-6
    ring = [(2 + np.cos(0.3 * np.sin(s)) * 0.9, s) for s in np.linspace(0, 2 * np.pi, 32, endpoint=False)]
    start = [(r * np.cos(s), r * np.sin(s), np.sqrt(max(0.0, 1 - (r - 2) ** 2))) for r, s in ring]
    outer = fc.Geodesic("torus:2,1").fit([start], closed=True)
    assert outer.status.tolist() == ["converged"] and abs(outer.length[0] / (6 * np.pi) - 1) < 1e-5


def _places(angles):
    lon, lat = np.radians(angles).T
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)


def _angles(places):
    x, y, z = places.T
    return np.degrees(np.stack([np.arctan2(y, x), np.arcsin(z)], axis=1))


def test_curves_within_a_distance_of_their_polygon_stay_straight_and_keep_their_area():
    house = np.array([[0, 0], [60, 0], [60, 20], [0, 20.0]])
    fit = fc.Smoothing(within=1).fit([house], closed=True)
    points = fit.sample(per_span=64)[0]
    assert fit.report()["max_deviation"][0] <= 1
    middle = points[(abs(points[:, 0] - 30) < 15) & (points[:, 1] < 10)]
    assert len(middle) > 3 and abs(middle[:, 1]).max() < 0.02
    x, y = points.T
    assert abs(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)) - 1200) < 1.2
    sharp = fc.Smoothing(within=1, corners="auto").fit([house], closed=True)
    assert sharp.max_curvature[0] < 1e-6 < fit.max_curvature[0]
    few = sharp.sample(tolerance=0.1)[0]
    assert len(few) <= 8 < len(fit.sample(tolerance=0.01)[0])
    with pytest.raises(ValueError, match="corners go with within"):
        fc.Smoothing(lam=1, corners="auto").fit([house])
    with pytest.raises(ValueError, match="corners is 'sharp'; auto, straight are possible"):
        fc.Smoothing(within=1, corners="sharp").fit([house])
    with pytest.raises(TypeError, match="give one of lam, deviation, tube, s and within"):
        fc.Smoothing(within=1, tube=1).fit([house])
    with pytest.raises(ValueError, match="within goes by arc length"):
        fc.Smoothing(within=1, parametrisation="uniform").fit([house])


@pytest.mark.parametrize(("kind", "name"), [(fc.Smoothing, "lam"), (fc.Smoothing, "deviation"), (fc.Smoothing, "tube"), (fc.Fair, "deviation")])
def test_amounts_of_each_curve_are_those_of_fits_alone(kind, name):
    curves = np.random.default_rng(2).normal(size=(5, 12, 2)).cumsum(axis=1)
    amounts = np.array([0.01, 0.1, 0.3, 0.5, 1.0])
    method = kind(**{name: amounts})
    fit = method.fit(curves)
    for i, amount in enumerate(amounts.tolist()):
        alone = kind(**{name: amount}).fit(curves[i : i + 1])
        assert np.array_equal(fit[i : i + 1].sample(40), alone.sample(40)), i
    assert method == kind(**{name: amounts.tolist()})
    with pytest.raises(ValueError, match=f"{name} has 5 numbers for 4 curves"):
        method.fit(curves[:4])
    with pytest.raises(ValueError, match=rf"{name}\[1\] is -1"):
        kind(**{name: [1.0, -1.0]})
    with pytest.raises(ValueError, match=f"{name} of each curve is not possible in a surface"):
        kind(surface="sphere", **{name: amounts}).fit(curves)


def test_ends_that_rounding_parts_are_one_point():
    angles = np.linspace(0, 2 * np.pi, 9)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert (ring[-1] != ring[0]).any()
    exact = ring.copy()
    exact[-1] = exact[0]
    apart = ring.copy()
    apart[-1, 1] = 1e-9
    for scale in (1.0, 1e6, 1e-6):
        fit = fc.Natural().fit([ring * scale, exact * scale, apart * scale], closed="auto")
        assert [len(k) for k in fit.knots] == [9, 9, 9] and fit._closed().tolist() == [True, True, False]
        assert np.array_equal(fit.sample(64)[0], fit.sample(64)[1])


def test_sums_of_squares_are_those_asked_for():
    rng = np.random.default_rng(7)
    curves = [rng.normal(size=(n, 2)).cumsum(axis=0) for n in (12, 5, 30)] + [np.array([[0, 0], [1, 1], [1, 1], [2, 0], [3, 1.0]])]
    given = np.array([0.5, 0.01, 3.0, 0.02])
    weights = [rng.uniform(0.5, 2, len(one)) for one in curves]
    for closed in (False, True):
        fit = fc.Smoothing(s=given).fit(curves, weights=weights, closed=closed)
        places = [fc._methods._places_of(knots, one) for knots, one in zip(fit.knots, curves)]
        sums = [float((w * ((at - one) ** 2).sum(axis=1)).sum()) for w, at, one in zip(weights, fit(places), curves)]
        assert np.allclose(sums, given, rtol=1e-6, atol=0) and (fit.status == "converged").all(), sums
    ring = np.concatenate([curves[0], curves[0][:1]])
    assert np.array_equal(fc.Smoothing(s=0.5).fit([ring], closed="auto").sample(30)[0], fc.Smoothing(s=0.5).fit(curves[:1], closed=True).sample(30)[0])
    interpolate = pytest.importorskip("scipy.interpolate")
    x = np.linspace(0, 6, 40)
    y = np.sin(x) + 0.2 * rng.normal(size=40)
    theirs = interpolate.UnivariateSpline(x, y, s=2.0)
    # SciPy takes as few knots as do, and bends as much or more.
    ours = fc.Smoothing(s=2.0).fit(y[None], t=x)
    def bending(second):
        return float(np.trapezoid(second**2, np.linspace(0, 6, 2001)))
    assert bending(ours(np.linspace(0, 6, 2001), 2)[0]) <= bending(theirs.derivative(2)(np.linspace(0, 6, 2001)))
    with pytest.raises(ValueError, match="s is -1"):
        fc.Smoothing(s=-1)
    with pytest.raises(ValueError, match="s has 2 numbers for 1 curves"):
        fc.Smoothing(s=[1.0, 2.0]).fit(curves[:1])
