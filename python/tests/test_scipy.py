"""CubicSplineBatch is a loop of SciPy's CubicSpline."""

import pickle

import numpy as np
import pytest

import faircurve as fc

interpolate = pytest.importorskip("scipy.interpolate")
CubicSpline = interpolate.CubicSpline

RNG = np.random.default_rng(17)
CURVES, KNOTS = 1000, 11
X = np.cumsum(RNG.uniform(0.1, 2.0, size=(CURVES, KNOTS)), axis=1)
Y = RNG.normal(size=(CURVES, KNOTS, 2))
FIRST = RNG.normal(size=(CURVES, 2))
BOUNDARIES = {
    "not-a-knot": "not-a-knot",
    "natural": "natural",
    "clamped": "clamped",
    "periodic": "periodic",
    "first and second": ((1, FIRST), (2, 0.7)),
    "second and not-a-knot": ((2, FIRST), "not-a-knot"),
    "natural and clamped": ("natural", "clamped"),
}


def of_curve(boundary, i):
    """The condition as SciPy takes it, for one curve."""
    pick = lambda end: end if isinstance(end, str) else (end[0], end[1][i] if np.ndim(end[1]) else np.full(2, end[1]))
    return boundary if isinstance(boundary, str) else tuple(pick(end) for end in boundary)


def close(a, b, scale=None):
    scale = np.nanmax(np.abs(b)) if scale is None else scale
    assert np.array_equal(np.isnan(a), np.isnan(b))
    error = np.nanmax(np.abs(a - b), initial=0.0) / max(scale, 1e-300)
    assert error <= 1e-12, error


@pytest.mark.parametrize("name", BOUNDARIES)
def test_a_thousand_splines_are_scipys_by_every_boundary_condition(name):
    boundary = BOUNDARIES[name]
    y = np.concatenate([Y[:, :-1], Y[:, :1]], axis=1) if name == "periodic" else Y
    ours = fc.CubicSplineBatch(X, y, bc_type=boundary)
    inside = X[:, :1] + (X[:, -1:] - X[:, :1]) * RNG.uniform(0, 1, size=(CURVES, 40))
    beyond = X[:, :1] + (X[:, -1:] - X[:, :1]) * RNG.uniform(-0.5, 1.5, size=(CURVES, 10))
    x = np.concatenate([inside, X, beyond], axis=1)
    values = [ours(x, nu) for nu in range(4)]
    within = ours(x, extrapolate=False)
    turned = ours(x, extrapolate="periodic")
    roots, primitives, second = ours.roots(), ours.antiderivative()(x), ours(x, -2)
    inner_roots = ours.derivative().roots(extrapolate=False)
    integrals = {(a, b): ours.integrate(a, b) for a, b in [(1.0, 7.0), (9.0, 2.0), (-3.0, 40.0)]}
    for i in range(CURVES):
        theirs = interpolate.CubicSpline(X[i], y[i], bc_type=of_curve(boundary, i))
        for nu in range(4):
            close(values[nu][i], theirs(x[i], nu))
        close(within[i], theirs(x[i], extrapolate=False))
        close(turned[i], theirs(x[i], extrapolate="periodic"))
        if i % 10:
            continue
        close(primitives[i], theirs.antiderivative()(x[i]))
        close(second[i], theirs.antiderivative(2)(x[i]))
        for (a, b), integral in integrals.items():
            reference = theirs.integrate(a, b)
            close(integral[i], reference, max(1.0, np.abs(reference).max()))
        for column in range(2):
            # SciPy says that "periodic" finds no roots beyond the knots, and finds them.
            beyond_too = name != "periodic"
            expected = np.sort(theirs.roots(discontinuity=False, extrapolate=beyond_too)[column])
            assert len(roots[i][column]) == len(expected), (i, roots[i][column], expected)
            if len(expected):
                apart = np.abs(roots[i][column] - expected) / np.maximum(1, np.abs(expected))
                # Far beyond the knots both are this far from the exact roots (computed with 60 digits): the cubic
                # term of the last span has lost digits there.
                inside = (expected >= X[i, 0]) & (expected <= X[i, -1])
                assert (apart <= np.where(inside, 1e-12, 1e-11)).all()
            # Whether a derivative that is 0 at an end counts is a matter of rounding.
            inner = lambda roots: roots[(roots > X[i, 0] + 1e-9) & (roots < X[i, -1] - 1e-9)]
            extrema = np.sort(theirs.derivative().roots(discontinuity=False, extrapolate=False)[column])
            assert np.allclose(inner(inner_roots[i][column]), inner(extrema), atol=1e-9)
    coefficients = ours.c
    for i in range(0, CURVES, 7):
        theirs = interpolate.CubicSpline(X[i], y[i], bc_type=of_curve(boundary, i)).c
        for power in range(4):
            close(coefficients[i][power], theirs[power])
    assert ours.antiderivative(2).c.shape == (CURVES, 6, KNOTS - 1, 2)


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("boundary", ["not-a-knot", "natural", "clamped", "periodic", ("natural", "not-a-knot")])
def test_few_knots_are_scipys_too(count, boundary):
    x = np.array([0.0, 1.0, 3.0, 3.5])[:count]
    y = RNG.normal(size=(20, count))
    if boundary == "periodic":
        y[:, -1] = y[:, 0]
    ours = fc.CubicSplineBatch(x, y, boundary)
    u = np.linspace(-1, 5, 31)
    for i in range(20):
        theirs = interpolate.CubicSpline(x, y[i], bc_type=boundary)
        close(ours(u)[i], theirs(u))


def test_shapes_are_those_of_a_loop():
    shared = np.arange(6.0)
    for inner in [(), (3,), (2, 4)]:
        y = RNG.normal(size=(5, 6, *inner))
        ours = fc.CubicSplineBatch(shared, y)
        theirs = [interpolate.CubicSpline(shared, one) for one in y]
        for u in (0.5, np.array([0.5, 1.0]), np.ones((2, 2, 3))):
            assert np.allclose(ours(u), np.stack([one(u) for one in theirs]), rtol=1e-12, atol=1e-12)
        assert ours.c.shape == (5, *theirs[0].c.shape) and ours.x.shape == (5, 6)
        assert np.allclose(ours.integrate(0, 4), np.stack([one.integrate(0, 4) for one in theirs]), atol=1e-12)
        assert np.allclose(ours(0.3, 1), ours.derivative()(0.3)) and np.allclose(ours.antiderivative()(2.0), ours(2.0, -1))


def test_curves_of_different_lengths_are_lists():
    x = [np.sort(RNG.uniform(size=n)) for n in (2, 3, 8)]
    y = [RNG.normal(size=(len(one), 2)) for one in x]
    ours = fc.CubicSplineBatch(x, y)
    theirs = [interpolate.CubicSpline(a, b) for a, b in zip(x, y)]
    u = [np.linspace(0, 1, m) for m in (4, 1, 6)]
    for ours_u, theirs_u in zip(ours(u), [one(v) for one, v in zip(theirs, u)]):
        close(ours_u, theirs_u)
    assert [c.shape for c in ours.c] == [one.c.shape for one in theirs] and [len(k) for k in ours.x] == [2, 3, 8]
    assert ours(np.linspace(0, 1, 9)).shape == (3, 9, 2)


def test_bad_curves_are_data_and_bad_arguments_are_errors():
    x, y = np.arange(5.0), RNG.normal(size=(4, 5))
    knots = np.stack([x, x[::-1], x, x])
    y[2, 3] = np.nan
    ours = fc.CubicSplineBatch(knots, y)
    assert ours.status.tolist() == ["converged", "invalid", "invalid", "converged"]
    assert "knots must increase" in ours.messages[1] and "value at knot 3 is NaN" in ours.messages[2]
    assert np.isnan(ours(0.5)[[1, 2]]).all() and ours.roots()[1].size == 0
    close(ours(0.5)[3], interpolate.CubicSpline(x, y[3])(0.5))
    assert fc.CubicSplineBatch(x, y[:1], "periodic").status.tolist() == ["invalid"]
    for arguments, sentence in [
        ((x, y, "open"), 'bc_type is "open"'),
        ((x, y, ((3, 0), "natural")), "derivatives of order 1 and 2"),
        ((x, y, ((1, [1, 2]), "natural")), r"it must be \(4,\)"),
        ((x[:4], y), "curve 0 has knots of the shape"),
        ((x, y[0]), "y has a row of values for each curve"),
    ]:
        with pytest.raises(ValueError, match=sentence):
            fc.CubicSplineBatch(*arguments)


def test_constant_spans_have_all_their_places_as_roots():
    x = np.arange(5.0)
    flat = fc.CubicSplineBatch(x, np.zeros((1, 5)), "natural").roots()[0]
    assert np.array_equal(flat, interpolate.CubicSpline(x, np.zeros(5), bc_type="natural").roots(), equal_nan=True)
    touching = fc.CubicSplineBatch(x, ((x - 2) ** 2)[None]).roots()[0]
    assert np.allclose(touching, 2)


class One:
    """A CubicSpline of SciPy's tests: a batch of one curve."""

    def __init__(self, x, y, axis=0, bc_type="not-a-knot", extrapolate=None):
        x, y = np.asarray(x), np.moveaxis(np.asarray(y), axis, 0)
        self.batch = fc.CubicSplineBatch(x[None], y[None], bc_type=bc_type, extrapolate=extrapolate)
        if self.batch.status[0] != "converged":
            raise ValueError(self.batch.messages[0])
        self.x, self.c = self.batch.x[0], self.batch.c[0]

    def __call__(self, x, nu=0):
        return np.asarray(self.batch(x, nu)[0])

    def derivative(self, nu=1):
        return lambda x: self.batch.derivative(nu)(x)[0]


def smoothing_spline(x, y, w=None, lam=None):
    """``make_smoothing_spline`` of SciPy's tests: a plane curve of one coordinate."""
    curve = np.stack([np.asarray(y, float), np.zeros(len(y))], axis=1)
    weights = None if w is None else [np.asarray(w, float)]
    fit = fc.Smoothing(lam="gcv" if lam is None else lam).fit([curve], t=[np.asarray(x, float)], weights=weights, device="cpu")
    return lambda u: fit(np.asarray(u))[0][..., 0]


@pytest.mark.parametrize(
    ("module", "suite", "name"),
    [
        *(
            ("test_polyint", "TestCubicSpline", f"test_{name}")
            for name in (
                "general", "periodic", "periodic_eval", "periodic_three_points_multidim",
                "second_derivative_continuity_gh_11758", "small_dx", "three_points",
            )  # fmt: skip
        ),
        *(
            ("test_bsplines", "TestSmoothingSpline", f"test_{name}")
            for name in ("compare_with_GCVSPL", "non_regularized_case", "weighted_smoothing_spline")
        ),
    ],
)
def test_scipys_own_tests_pass(monkeypatch, module, suite, name):
    """Left out are those of complex numbers, and of smoothing splines that SciPy refuses: of four points, or with equal parameters."""
    tests = pytest.importorskip(f"scipy.interpolate.tests.{module}")
    monkeypatch.setattr(tests, "CubicSpline", One, raising=False)
    monkeypatch.setattr(tests, "make_smoothing_spline", smoothing_spline, raising=False)
    own = getattr(getattr(tests, suite)(), name)
    own(*([np] if "xp" in own.__code__.co_varnames[: own.__code__.co_argcount] else []))


@pytest.mark.parametrize("boundary", ["not-a-knot", "periodic", ((1, np.arange(6.0).reshape(6, 1)), (2, 0.5))])
def test_some_of_the_splines_are_the_same_splines(boundary):
    x, y = np.cumsum(RNG.uniform(0.5, 2, (6, 7)), axis=1), RNG.normal(size=(6, 7, 2))
    y[:, -1] = y[:, 0]
    at = np.linspace(x[:, 0] - 0.5, x[:, -1] + 0.5, 9, axis=1)
    for knots, values in ((x, y), (list(x), list(y)), (x[0], y)):
        splines = fc.CubicSplineBatch(knots, values, boundary)
        for which in (4, slice(1, 5, 2), [3, 0], np.arange(6) > 3):
            rows = np.atleast_1d(np.arange(6)[which])
            assert np.array_equal(splines[which](list(at[rows])), splines(list(at))[rows[0] : rows[0] + 1] if len(rows) == 1 else [splines(list(at))[k] for k in rows])
            slopes = splines.derivative()[which]
            assert np.array_equal(slopes(at[rows]), splines.derivative()(at)[rows]) and len(slopes) == len(rows)
    assert len(list(splines)) == 6 and splines[-1].extrapolate == splines.extrapolate
    with pytest.raises(IndexError, match="there is no curve 6 of 6"):
        splines[6]


def test_extrapolation_set_by_hand_is_kept_by_copies_and_parts():
    splines = fc.CubicSplineBatch(np.arange(5.0), RNG.normal(size=(3, 5)))
    splines.extrapolate = False
    for one in (pickle.loads(pickle.dumps(splines)), splines[1:], splines.derivative(), pickle.loads(pickle.dumps(splines.antiderivative(2)))):
        assert one.extrapolate is False and np.isnan(one(9.0)).all()


@pytest.mark.parametrize("axis", [0, 1, 2, -1])
def test_axes_are_scipys(axis):
    x, shape = np.arange(5.0), [2, 3, 4]
    shape[axis] = 5
    y = RNG.normal(size=(3, *shape))
    splines = fc.CubicSplineBatch(x, y, axis=axis)
    own = np.cumsum(RNG.uniform(0.1, 1, (3, 4)), axis=1)
    for i in range(3):
        theirs = CubicSpline(x, y[i], axis=axis)
        for u in (1.5, [0.5, 1.5], [[0.5, 1.5], [2.0, 3.0]]):
            close(splines(np.array([u])[0] if np.ndim(u) != 2 else np.array(u).reshape(-1))[i], theirs(np.reshape(u, -1) if np.ndim(u) else u))
        close(splines(own)[i], theirs(own[i]))
        close(splines(list(own))[i], theirs(own[i]))
        close(splines.derivative()(0.5)[i], theirs.derivative()(0.5))
        close(splines.integrate(0, 2.5)[i], theirs.integrate(0, 2.5))
        close(splines.to_ppoly()[i](own[i]), theirs(own[i]))
    with pytest.raises(ValueError, match="axis is 3; the values of a curve have 3 axes"):
        fc.CubicSplineBatch(x, y, axis=3)


@pytest.mark.parametrize("extrapolate", [True, False, "periodic"])
def test_ends_of_integrals_may_be_each_curves_own(extrapolate):
    x, y = np.cumsum(RNG.uniform(0.5, 2, (5, 8)), axis=1), RNG.normal(size=(5, 8, 2))
    splines = fc.CubicSplineBatch(x, y)
    a, b = x[:, 0] + [0.1, 2, -1, 3, 0], x[:, -1] + [0, -5, 1, 9, 0]
    made = splines.integrate(a, b, extrapolate)
    for i in range(5):
        theirs = CubicSpline(x[i], y[i]).integrate(a[i], b[i], extrapolate)
        scale = max(1.0, np.abs(theirs).max())
        close(made[i], theirs, scale)
        close(splines.integrate(a[i], b, extrapolate)[i], made[i], scale)
    with pytest.raises(ValueError, match="b has the shape"):
        splines.integrate(0, [1.0, 2])
