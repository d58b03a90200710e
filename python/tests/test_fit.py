"""What a fit answers."""

import numpy as np
import pytest

import faircurve as fc

RNG = np.random.default_rng(5)
CURVES = RNG.normal(size=(30, 6, 2))


def test_values_have_the_shapes_of_their_parameters():
    fit = fc.Natural().fit(CURVES)
    assert fit(0.5).shape == (30, 2) and fit([0.5, 1]).shape == (30, 2, 2)
    assert fit(np.linspace(0, 1, 5)[None].repeat(30, 0)).shape == (30, 5, 2)
    lists = fit([np.linspace(0, 1, i) for i in range(30)])
    assert [one.shape for one in lists] == [(i, 2) for i in range(30)]
    assert np.array_equal(lists[4], fit(np.linspace(0, 1, 4))[4])
    assert fit.curvature([0.1, 0.2]).shape == (30, 2) and fit.curvature(0.1).shape == (30,)
    # Beyond the ends the ends are taken, and NaN is NaN.
    assert np.allclose(fit(1e9), CURVES[:, -1]) and np.isnan(fit(np.nan)).all()


def test_samples_are_written_into_memory_that_the_caller_keeps():
    curves = np.random.default_rng(7).normal(size=(5, 6, 2)).cumsum(axis=1)
    for fit in (fc.Natural().fit(curves), fc.Fair().fit(curves)):
        out = np.empty((5, 12, 2))
        found = fit.sample(12, out=out)
        assert np.shares_memory(found, out) and found.shape == out.shape
        assert np.array_equal(out, fit.sample(12))
        flat = np.empty(5 * (5 * 3 + 1) * 2)
        assert np.array_equal(fit.sample(per_span=3, out=flat).reshape(-1), flat)
        with pytest.raises(ValueError, match="out has 100 numbers; 60 samples have 120, 2 each"):
            fit.sample(12, out=np.empty(100))
        for wrong in (np.empty((5, 12, 2), np.float32), np.empty((5, 12, 4))[:, :, ::2], [0.0] * 120):
            with pytest.raises(ValueError, match="out must be a writable, C-contiguous array of float64"):
                fit.sample(12, out=wrong)


def test_samples_are_taken_by_number_by_span_by_length_and_by_spacing():
    fit = fc.Natural().fit(CURVES)
    assert fit.sample(17).shape == (30, 17, 2) and fit.sample(per_span=3).shape == (30, 16, 2)
    assert fit.sample().shape == (30, 81, 2)
    steps = np.linalg.norm(np.diff(fit.sample(points=200), axis=1), axis=2)
    assert (steps.max(axis=1) < 1.2 * np.median(steps, axis=1)).all()
    spaced = fit.sample(spacing=0.1)
    assert isinstance(spaced, np.ndarray) and np.nanmax(np.linalg.norm(np.diff(spaced, axis=1), axis=2)) <= 0.1
    listed = fc.Natural().fit(list(CURVES)).sample(spacing=0.1)
    assert isinstance(listed, list) and all(np.array_equal(row[: len(own)], own) for row, own in zip(spaced, listed))
    assert np.allclose(np.linalg.norm(np.diff(fit.sample(points=20_000), axis=1), axis=2).sum(axis=1), fit.length, rtol=1e-4)
    for by, other in (("parameter", "count"), ("length", "points"), ("span", "per_span")):
        assert np.array_equal(fit.sample(7, by=by), fit.sample(**{other: 7}))
    with pytest.raises(ValueError, match="by is 'arc'; parameter, length, span are possible"):
        fit.sample(7, by="arc")
    with pytest.raises(TypeError, match="by='length' needs a number of samples"):
        fit.sample(by="length")


@pytest.mark.parametrize("closed", [False, True, "some"])
def test_an_array_comes_out_as_an_array_whatever_its_curves_are(closed):
    curves = CURVES.copy()
    curves[2, 1, 0], curves[3] = np.nan, 1.0
    fit = fc.Natural().fit(curves, closed=np.arange(30) % 2 == 0 if closed == "some" else closed)
    good = ~np.isin(fit.status, ["invalid", "degenerate"])
    assert good.sum() == 28
    for by, width in (("parameter", 9), ("length", 9), ("span", 9 * (6 if closed else 5) + (not closed))):
        samples = fit.sample(9, by=by)
        assert samples.shape == (30, width, 2) and (samples[3] == 1).all()
        lists = fc.Natural().fit(list(curves), closed=np.arange(30) % 2 == 0 if closed == "some" else closed).sample(9, by=by)
        assert all(np.array_equal(samples[i, : len(lists[i])], lists[i]) and np.isnan(samples[i, len(lists[i]) :]).all() for i in np.flatnonzero(good))
        out = np.zeros(samples.shape)
        assert np.shares_memory(fit.sample(9, by=by, out=out), out) and np.array_equal(out, samples, equal_nan=True)
    assert fit.sample(spacing=0.5).shape[0] == 30 and fit[[2]].sample(4).shape == (1, 4, 2)


def test_beziers_are_the_splines():
    fit = fc.Natural().fit(CURVES)
    pieces = fit.to_bezier()
    u = np.linspace(0, 1, 9)[:, None]
    for i in (0, 11, 29):
        assert pieces[i].shape == (5, 4, 2)
        t = fit.knots[i]
        for k, (a, b, c, d) in enumerate(pieces[i]):
            bezier = (1 - u) ** 3 * a + 3 * u * (1 - u) ** 2 * b + 3 * u**2 * (1 - u) * c + u**3 * d
            assert np.allclose(bezier, fit[i](t[k] + (t[k + 1] - t[k]) * u[:, 0])[0], atol=1e-12)
    ring = fc.Natural().fit(CURVES[:1], closed=True).to_bezier()[0]
    assert ring.shape == (6, 4, 2) and np.array_equal(ring[-1, 3], ring[0, 0])
    with pytest.raises(ValueError, match="tolerance is 0"):
        fit.to_bezier(0)


def test_some_of_the_curves_are_a_fit_too():
    fit = fc.Natural().fit(CURVES)
    for which in ([3, 7], np.array([3, 7]), np.isin(np.arange(30), [3, 7]), slice(3, 8, 4)):
        assert np.array_equal(fit[which].sample(5), fit.sample(5)[[3, 7]])
    assert len(fit[-1]) == 1 and np.array_equal(fit[-1].sample(5)[0], fit.sample(5)[-1])
    assert len(list(fit)) == 30


def test_reports_are_tables_and_pictures_are_pictures():
    fit = fc.Natural().fit([*CURVES, [(0, 0)]])
    report = fit.report()
    assert {len(column) for column in report.values()} == {31}
    assert report["status"][30] == "degenerate" and report["message"][0] is None
    assert fit.to_svg().startswith("<svg") and fit._repr_svg_() == fit.to_svg()
    assert repr(fit).startswith("<faircurve.Fit: 31 curves (30 converged, 1 degenerate), CPU")
    pandas = pytest.importorskip("pandas")
    assert pandas.DataFrame(report).shape == (31, 9)


def test_matplotlib_draws_every_curve():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    axes = fc.Natural().fit(CURVES, closed=True).plot(color="k")
    assert len(axes.collections[0].get_segments()) == 30
    plt.close("all")


@pytest.mark.parametrize("method", [fc.Natural(), fc.Smoothing(lam=0.3), fc.Smoothing(deviation=0.2), fc.Fair(), fc.Smooth(tension=1)])
@pytest.mark.parametrize("closed", [False, True])
def test_integrals_are_those_of_the_values(method, closed):
    integrate = pytest.importorskip("scipy.integrate")
    fit = method.fit(CURVES[:3], closed=closed)
    first, last = fit._ends
    a, b = 0.9 * first + 0.1 * last, 0.2 * first + 0.8 * last
    made, back, whole = fit.integrate(a, b), fit.integrate(b, a), fit.integrate()
    assert np.array_equal(made, -back) and made.shape == (3, 2)
    for i in range(3):
        own = np.unique(np.concatenate([[a[i], b[i]], np.linspace(*fit.knots[i][[0, -1]], 97), fit.knots[i]]))
        own = own[(own >= a[i]) & (own <= b[i])]
        expected = sum(integrate.fixed_quad(lambda u: fit[i](u)[0].T, p, q, n=5)[0] for p, q in zip(own[:-1], own[1:]))
        assert np.abs(made[i] - expected).max() < (5e-5 if isinstance(method, fc.Fair) else 1e-7), np.abs(made[i] - expected).max()
    parts = fit.integrate(first, b) + fit.integrate(b, last)
    assert np.allclose(parts, whole, rtol=1e-5, atol=1e-5)
    with pytest.raises(ValueError, match="b is 1000000000.0, outside curve 0, which goes from 0.0 to"):
        fit.integrate(0, 1e9)


def test_derivatives_are_functions_and_splines_go_on_as_scipys_do():
    interpolate = pytest.importorskip("scipy.interpolate")
    t = np.cumsum(RNG.uniform(0.5, 2, (30, 6)), axis=1)
    fit = fc.Natural().fit(CURVES, t=t)
    u = np.linspace(t[:, 0] - 1, t[:, -1] + 2, 11, axis=1)
    slope = fit.derivative()
    assert np.array_equal(slope(u), fit(u, 1)) and np.array_equal(slope.derivative(2)(u), fit(u, 3)) and slope.nu == 1
    for nu in range(4):
        made, lists, shared = fit(u, nu, outside="extrapolate"), fit(list(u), nu, outside="extrapolate"), fit(u[0], nu, outside="extrapolate")
        for i in (0, 7, 29):
            spline = interpolate.CubicSpline(t[i], CURVES[i], bc_type="natural")
            assert np.abs(made[i] - spline(u[i], nu)).max() < 1e-10 and np.array_equal(made[i], lists[i])
            assert np.abs(shared[i] - spline(u[0], nu)).max() < 1e-8 * np.abs(shared[i]).max()
            assert np.abs(fit.to_ppoly()[i](u[i], nu) - spline(u[i], nu)).max() < 1e-10
    with pytest.raises(TypeError, match="extrapolate is of splines, and curves of Fair end where their points end: take outside='nan'"):
        fc.Fair().fit(CURVES)(0.5, outside="extrapolate")
    with pytest.raises(ValueError, match="nu is -1; orders of derivatives are 0 or more, and integrate has integrals"):
        fit.derivative(-1)
