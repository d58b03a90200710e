"""Whatever points come in, each curve has a status, and none spoils its neighbours."""

import numpy as np
import pytest

import faircurve as fc

hypothesis = pytest.importorskip("hypothesis")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402
from hypothesis.extra import numpy as hnp  # noqa: E402

WORDS = {"converged", "degenerate", "infeasible", "invalid", "no_minimiser", "not_converged", "not_unique", "unbounded"}
# Numbers of all sizes, equal ones often, and what is none.
NUMBERS = st.one_of(st.integers(-3, 3).map(float), st.floats(width=64), st.floats(-10, 10))
METHODS = st.sampled_from(
    [
        fc.Natural(),
        fc.Natural(parametrisation="centripetal"),
        fc.Smoothing(lam=0.1),
        fc.Smoothing(deviation=0.3),
        fc.Smoothing(tube=0.3),
        fc.Fair({"bending": 1, "length": 1}, per_span=4, max_iterations=20),
        fc.Smooth(max_iterations=20),
    ]
)


def curves(dimension):
    return st.lists(hnp.arrays(np.float64, st.tuples(st.integers(0, 6), st.just(dimension)), elements=NUMBERS), max_size=4)


@settings(max_examples=150, deadline=None)
@given(st.integers(2, 3).flatmap(curves), METHODS, st.sampled_from([False, True, "auto"]))
def test_every_curve_has_a_status_and_its_neighbours_bits_are_its_own(lines, method, closed):
    if isinstance(method, fc.Smooth):
        lines = [line[:, :2] for line in lines]
    good = np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 0.0], [3.0, 1.0]])
    if lines and lines[0].shape[1] == 3:
        good = np.column_stack([good, [0.0, 1.0, 0.0, 1.0]])
    fit = method.fit([*lines, good], closed=closed, device="cpu")
    assert len(fit) == len(lines) + 1 and set(fit.status) <= WORDS
    report = fit.report()
    assert all((message is None) == (status == "converged") or status == "converged" for status, message in zip(report["status"], report["message"]))
    samples = fit.sample(7)
    alone = method.fit([good], closed=closed, device="cpu").sample(7)[0]
    assert np.array_equal(samples[-1], alone)
    for line, sampled, status in zip(lines, samples, report["status"]):
        if status in ("invalid", "degenerate") and not closed:
            assert np.array_equal(sampled, line, equal_nan=True)
    fit(0.5), fit.curvature([0.1, 0.2]), fit.length, fit.max_curvature, fit.to_bezier(), fit.to_svg()


@settings(max_examples=100, deadline=None)
@given(hnp.arrays(np.float64, st.tuples(st.integers(1, 3), st.integers(2, 7)), elements=NUMBERS), st.data())
def test_splines_of_any_values_are_numbers_or_invalid(y, data):
    x = data.draw(hnp.arrays(np.float64, y.shape[1], elements=NUMBERS))
    splines = fc.CubicSplineBatch(x, y)
    valid = splines.status == "converged"
    increasing = bool(np.isfinite(x).all() and (np.diff(x) > 0).all())
    assert np.array_equal(valid, increasing & np.isfinite(y).all(axis=1))
    values = splines(x)
    assert np.isnan(values[~valid]).all()
    splines.roots(), splines.integrate(0, 1), splines.antiderivative()(0.5), splines.derivative(2)(0.5)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(2, 9), min_size=1, max_size=5), st.randoms(use_true_random=False))
def test_every_kind_of_batch_gives_the_same_bits(counts, random):
    lines = [np.array([[random.uniform(-5, 5), random.uniform(-5, 5)] for _ in range(n)]) for n in counts]
    expected = fc.Natural().fit(lines).sample(per_span=3)
    coords, ends = fc.Natural().fit((np.concatenate(lines), np.cumsum([0, *counts]))).sample(per_span=3)
    assert np.array_equal(coords, np.concatenate(expected)) and np.array_equal(np.diff(ends), [len(one) for one in expected])
