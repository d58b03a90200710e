"""Tracks on the unit sphere that the peers of surfaces are timed on."""

import numpy as np


def walks(rng, curves, points, step, sigma):
    """Points of the unit sphere, at steps of an angle that turn by a normal angle of sigma; and the turns."""
    at = rng.normal(size=(curves, 3))
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    ahead = np.cross(at, rng.normal(size=(curves, 3)))
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    turns = sigma * rng.normal(size=(curves, points - 1))
    places = [at]
    for turn in turns.T[..., None]:
        ahead = np.cos(turn) * ahead + np.sin(turn) * np.cross(at, ahead)
        at, ahead = np.cos(step) * at + np.sin(step) * ahead, np.cos(step) * ahead - np.sin(step) * at
        places.append(at)
    return np.stack(places, axis=1), turns
