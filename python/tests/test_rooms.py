"""Béziers, grids and tridiagonal systems."""

import numpy as np
import pytest

import faircurve as fc
from faircurve import bezier, laplacian, linalg, scf

RNG = np.random.default_rng(9)


def test_tridiagonal_systems_are_solved_as_by_numpy():
    lower, upper = RNG.uniform(-1, 1, size=(2, 50, 13))
    diagonal = RNG.uniform(2.5, 4, size=(50, 13))
    for rhs in (RNG.normal(size=(50, 13)), RNG.normal(size=(50, 13, 3))):
        for cyclic in (False, True):
            x = linalg.solve_tridiagonal(lower, diagonal, upper, rhs, cyclic=cyclic)
            for i in range(50):
                dense = np.diag(diagonal[i]) + np.diag(lower[i, 1:], -1) + np.diag(upper[i, :-1], 1)
                if cyclic:
                    dense[0, -1], dense[-1, 0] = lower[i, 0], upper[i, -1]
                assert np.allclose(x[i], np.linalg.solve(dense, rhs[i]), rtol=1e-12, atol=1e-13)
    singular = linalg.solve_tridiagonal([[0, 0], [0, 0]], [[1, 1], [1, 0]], [[0, 0], [0, 0]], [[1, 2], [1, 2]])
    assert singular[0].tolist() == [1, 2] and np.isnan(singular[1]).all()
    with pytest.raises(ValueError, match="have one shape"):
        linalg.solve_tridiagonal([1], [1, 2], [1], [1, 2])


def test_elevated_beziers_are_the_same_curves_and_reduce_to_what_they_were():
    given = RNG.normal(size=(40, 4, 2))
    raised = bezier.elevate(given, 2)
    assert raised.shape == (40, 6, 2)
    back, errors = bezier.reduce(raised, 2)
    assert np.allclose(back, given, atol=1e-12) and (errors < 1e-12).all()


def test_completed_beziers_keep_what_is_known_and_bend_least():
    given = RNG.normal(size=(5, 6, 2))
    holed = given.copy()
    holed[:, 2:4] = np.nan
    done = bezier.complete(holed)
    assert np.array_equal(done.controls[:, [0, 1, 4, 5]], given[:, [0, 1, 4, 5]])
    assert np.isfinite(done.controls).all() and (done.report["status"] == "converged").all()
    energy = lambda controls: bezier.complete(controls).report["energy"]
    assert (done.report["energy"] <= energy(given) + 1e-9).all()
    chain = bezier.Chain(joints="c2").fit([[(0, 0), (np.nan,) * 2, (np.nan,) * 2, (1, 1), (np.nan,) * 2, (np.nan,) * 2, (2, 0)]])
    spline = fc.Natural().fit([[(0, 0), (1, 1), (2, 0)]]).to_bezier()[0]
    assert np.allclose(chain.controls[0], np.concatenate([spline[0], spline[1][1:]]), atol=1e-12)


def test_simplified_chains_have_fewer_pieces():
    angle = np.linspace(0, np.pi, 40)
    chain = fc.Natural().fit([np.stack([np.cos(angle), np.sin(angle)], axis=1)]).to_bezier()[0]
    controls = np.concatenate([chain[:, :3].reshape(-1, 2), chain[-1:, 3]])
    made = bezier.Simplify(1e-3).fit([controls])
    assert len(made.controls[0]) < 20 and np.array_equal(made.controls[0][0], controls[0])


def test_flat_grids_stay_flat_and_bad_ones_are_data():
    fine = laplacian.subdivide([np.full((4, 5), 7.0)], rounds=3)[0]
    assert fine.shape == (25, 33) and np.allclose(fine, 7, atol=1e-12)
    grids = RNG.normal(size=(3, 4, 5, 2))
    fine = laplacian.subdivide(grids, 2)
    assert fine.shape == (3, 13, 17, 2)
    assert np.allclose(fine[1, :, :, 0], laplacian.subdivide([grids[1, :, :, 0]], 2)[0], atol=1e-12)
    grids[1, 2, 3] = np.nan
    bad = laplacian.subdivide(grids, 2)
    assert np.isnan(bad[1]).all() and np.array_equal(bad[[0, 2]], fine[[0, 2]])


def test_sparse_rules_keep_what_they_promise_and_refuse_what_they_are_not():
    x, y = np.meshgrid(np.arange(8.0), np.arange(9.0))
    plane = 2 * x - 3 * y + 1
    kept = laplacian.subdivide([plane], 2, support=5, linear=True)[0]
    fine_x, fine_y = np.meshgrid(np.arange(29) / 4, np.arange(33) / 4)
    assert np.allclose(kept, 2 * fine_x - 3 * fine_y + 1, atol=1e-9)
    peak = np.zeros((1, 13, 13))
    peak[0, 6, 6] = 1
    sparse, exact = laplacian.subdivide(peak, 1, support=11), laplacian.subdivide(peak, 1)
    assert np.abs(sparse - exact).max() < 0.02
    # Masks of 11 points reach 5 from the peak's place, and no further.
    assert (sparse[0, :, :7] == 0).all() and (exact[0, :, :7] != 0).any()
    with pytest.raises(ValueError, match="a support of 4 points: sparse rules have a support of 3, 5, 7, 9 or 11"):
        laplacian.subdivide(peak, support=4)
    with pytest.raises(ValueError, match="linear belongs to sparse rules"):
        laplacian.subdivide(peak, linear=True)


def test_segments_cost_what_the_curves_through_their_ends_do_and_have_its_derivatives():
    angles = RNG.uniform(-1.2, 1.2, size=(40, 5, 2))
    exponents = np.array([1.5, 2, 3, 4, 8.0])
    of = scf.segments(angles, chord=2.0, exponent=exponents)
    assert of.cost.shape == (40, 5) and of.gradient.shape == (40, 5, 2) and of.hessian.shape == (40, 5, 2, 2)
    # The same curves by the method of whole curves, with both tangents given.
    for k, exponent in enumerate(exponents):
        ends = np.stack([np.zeros(40), np.full(40, 2.0)], axis=1)
        points = np.stack([ends, np.zeros((40, 2))], axis=2)
        tangents = np.stack([np.cos(angles[:, k]), np.sin(angles[:, k])], axis=2)
        fit = fc.Smooth(exponent=exponent).fit(points, tangents=tangents)
        assert np.allclose(fit.energy, of.cost[:, k], rtol=1e-10)
    step = 1e-6
    for c in range(2):
        there, back = angles.copy(), angles.copy()
        there[..., c] += step
        back[..., c] -= step
        ahead, behind = (scf.segments(at, 2.0, exponents) for at in (there, back))
        assert np.allclose((ahead.cost - behind.cost) / (2 * step), of.gradient[..., c], rtol=1e-6, atol=1e-6)
        assert np.allclose((ahead.gradient - behind.gradient) / (2 * step), of.hessian[..., c], rtol=1e-5, atol=1e-5)
    assert np.isnan(scf.segments([3.0, -3.0]).cost) and np.ndim(scf.segments([0.1, 0.2]).cost) == 0
    with pytest.raises(ValueError, match="their last axis holds two"):
        scf.segments([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="chord"):
        scf.segments([0.1, 0.2], chord=-1.0)
