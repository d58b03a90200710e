"""Values of one number, or of more than three: what SciPy gives for each of them."""

import pickle

import numpy as np
import pytest

import faircurve as fc

interpolate = pytest.importorskip("scipy.interpolate")
RNG = np.random.default_rng(23)
T = np.cumsum(RNG.uniform(0.5, 2, (20, 9)), axis=1)
U = np.linspace(T[:, 0], T[:, -1], 11, axis=1)
WEIGHTS = RNG.uniform(0.5, 2, (20, 9))


@pytest.mark.parametrize("width", [0, 1, 4, 5, 7])
@pytest.mark.parametrize("kind", ["natural", "smoothing"])
def test_values_of_any_width_are_scipys(kind, width, tmp_path):
    y = RNG.normal(size=(20, 9, *([width] if width else [])))
    y[3] = 2.0
    y[4, 3:6] = y[4, 2]
    method, options = (fc.Natural(), {}) if kind == "natural" else (fc.Smoothing(lam=0.3), {"weights": WEIGHTS})
    fit = method.fit(y, t=T, **options)
    assert (fit.status == "converged").all()
    made, slopes = fit(U), fit(U, 1)
    assert made.shape == (20, 11, *y.shape[2:]) and fit(3.0).shape == (20, *y.shape[2:])
    assert fit.sample(6).shape == (20, 6, *y.shape[2:]) and fit.integrate().shape == (20, *y.shape[2:])
    for i in range(20):
        spline = interpolate.CubicSpline(T[i], y[i], bc_type="natural") if kind == "natural" else interpolate.make_smoothing_spline(T[i], y[i], WEIGHTS[i], lam=0.3)
        assert np.abs(made[i] - spline(U[i])).max() < 1e-10
        assert np.abs(slopes[i] - spline.derivative()(U[i])).max() < 1e-10
        assert np.abs(fit.report()["max_deviation"][i] - np.linalg.norm((spline(T[i]) - y[i]).reshape(9, -1), axis=1).max()) < 1e-10
    lists = method.fit(list(y), t=list(T), **{name: list(value) for name, value in options.items()})
    assert all(np.array_equal(a, b) for a, b in zip(lists.sample(6), fit.sample(6)))
    assert all(np.array_equal(a, b) for a, b in zip(lists(list(U)), made))
    assert np.array_equal(fit[[3, 7]].sample(6), fit.sample(6)[[3, 7]])
    fit.save(tmp_path / "fit.npz")
    for again in (pickle.loads(pickle.dumps(fit)), fc.load(tmp_path / "fit.npz"), pickle.loads(pickle.dumps(lists))):
        assert np.array_equal(again(U), made) and np.array_equal(again.sample(6), fit.sample(6))
    out = np.empty(fit.sample(6).shape)
    assert np.shares_memory(fit.sample(6, out=out), out) and np.array_equal(out, fit.sample(6))


def test_what_is_not_linear_is_refused_in_a_sentence():
    y = RNG.normal(size=(4, 6, 5))
    for method, word in ((fc.Smoothing(lam="gcv"), "lam='gcv'"), (fc.Smoothing(deviation=0.1), "deviation"), (fc.Natural(preserve_shape=True), "preserve_shape")):
        with pytest.raises(ValueError, match=f"with {word} is of points of 2 or 3 coordinates, and values have 5"):
            method.fit(y, t=np.arange(6))
    with pytest.raises(ValueError, match="closed is of points of 2 or 3 coordinates"):
        fc.Natural().fit(y, t=np.arange(6), closed=True)
    fit = fc.Natural().fit(y, t=np.arange(6))
    for act in (lambda: fit.length, lambda: fit.sample(9, by="length"), lambda: fit.curvature(0.5), lambda: fit.to_svg()):
        with pytest.raises(TypeError, match="points of 2 or 3 coordinates, and values have 5"):
            act()
    with pytest.raises(ValueError, match=r"one curve of shape \(n, d\) is curves\[None\]"):
        fc.Natural().fit(y[..., 0])
    with pytest.raises(ValueError, match="points have 5 coordinates; 2 and 3 are possible"):
        fc.Natural().fit(y)
    with pytest.raises(ValueError, match="parametrisation is 'chord', and values of 5 numbers have the parameters t"):
        fc.Natural(parametrisation="chord").fit(y, t=np.arange(6))
    y[1, 2, 4] = np.nan
    assert fc.Natural().fit(y, t=np.arange(6)).status.tolist() == ["converged", "invalid", "converged", "converged"]
