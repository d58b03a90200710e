"""Writes a ragged batch as the NPZ that faircurve reads: coords (N, d) f64 and offsets (B + 1) int64."""

import numpy as np


def save(path, curves):
    """Saves a list of (n, d) arrays."""
    counts = [len(curve) for curve in curves]
    save_flat(path, np.concatenate(curves), np.concatenate([[0], np.cumsum(counts)]))


def save_flat(path, coords, offsets):
    """Saves coordinates and offsets, and says what was saved."""
    coords = np.ascontiguousarray(coords, dtype=np.float64)
    offsets = np.ascontiguousarray(offsets, dtype=np.int64)
    assert offsets[0] == 0 and offsets[-1] == len(coords) and (np.diff(offsets) >= 0).all()
    np.savez(path, coords=coords, offsets=offsets)
    counts = np.diff(offsets)
    print(f"{path}: {len(counts):,} curves, {len(coords):,} points, {counts.min()} to {counts.max()} a curve")
