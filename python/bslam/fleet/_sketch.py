"""Sketches of keyframes, and pairs of maps that may show the same place.

The sketch of a keyframe contains the minima of some hashes of its visual words (MinHash: Broder, 1997): the fraction of
equal minima of two keyframes estimates the fraction of their words that they share. Bands of minima are compared by
their buckets (locality-sensitive hashing), so that only maps with a bucket in common are ever looked at together.
"""

from __future__ import annotations

import pathlib
from collections import Counter
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import _bslam

HASHES, ROWS = 64, 2  # a band has ROWS minima

Sketch: TypeAlias = NDArray[np.uint32]  # (k, HASHES)
_SEEDS = np.arange(1, HASHES + 1, dtype=np.uint64)


def sketch(words: Sequence[NDArray[np.int32]]) -> Sketch:
    """The sketch of the keyframes with these words."""
    rows = [_hashes(w).min(axis=0) for w in words if len(w) > 0]
    return np.stack(rows) if rows else np.zeros((0, HASHES), np.uint32)


def _hashes(words: NDArray[np.int32]) -> NDArray[np.uint32]:
    x = words.astype(np.uint64)[:, None] + _SEEDS[None, :] * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):  # splitmix64
        x = (x ^ (x >> np.uint64(shift))) * np.uint64(factor)
    return (x >> np.uint64(32)).astype(np.uint32)


def sketch_in(folder: pathlib.Path) -> Sketch:
    """The sketch in the folder of a map in the cache."""
    try:
        return np.load(folder / "sketch.npy")
    except (OSError, ValueError, EOFError) as error:
        raise _bslam.Error(
            f"cannot read {folder / 'sketch.npy'}: {getattr(error, 'strerror', None) or error}; delete its folder, "
            "which the same command makes again"
        ) from error


def likely_pairs(sketches: Sequence[Sketch], partners: int) -> list[tuple[int, int]]:
    """The pairs of maps to compare, the most similar ones first: each map with about `partners` others.

    The result depends on the order of the sketches if similarities are equal, or if more than `partners` + 1 maps share
    a bucket.
    """
    if not sketches:
        return []
    owner = np.repeat(np.arange(len(sketches)), [len(s) for s in sketches])
    common: Counter[tuple[int, int]] = Counter()
    for band in range(0, HASHES, ROWS):
        buckets: dict[bytes, list[int]] = {}
        for i, row in zip(owner.tolist(), np.concatenate([s[:, band : band + ROWS] for s in sketches]), strict=True):
            members = buckets.setdefault(row.tobytes(), [])
            if not members or members[-1] != i:  # owners ascend
                members.append(i)
        for members in buckets.values():
            for n, i in enumerate(members):  # bounds the number of pairs if most maps share a bucket
                common.update((i, j) for j in members[n + 1 : n + 1 + partners])
    size = [max(1, len(s)) for s in sketches]
    ranked = sorted(common, key=lambda p: (-common[p] / min(size[p[0]], size[p[1]]), p))
    chosen: Counter[int] = Counter()
    out = []
    for pair in ranked:
        if min(chosen[i] for i in pair) < partners:
            out.append(pair)
            chosen.update(pair)
    return out
