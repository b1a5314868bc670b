# SPDX-License-Identifier: LGPL-2.1-or-later
"""Points that lie together: k-means, with the number of clusters that fits best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from silo.inertia.arrays import Floats

Labels = NDArray[np.intp]

MOST_CLUSTERS = 8
"""As many links are tried for an export without sub-assemblies, unless the user says how many."""


def clustered(points: Floats, count: int | None) -> Labels:
    """Return the cluster (n,) of each point; if no count is given, with the count that has the best
    silhouette.
    """
    different = len(np.unique(points.round(9), axis=0)) if len(points) else 0
    if count is not None:
        return _lloyd(points, max(1, min(count, different)))
    best: Labels = np.zeros(len(points), np.intp)
    best_score = 0.6
    for tried in range(2, min(MOST_CLUSTERS, different // 3) + 1):
        labels = _lloyd(points, tried)
        score = _silhouette(points, labels)
        # One more link must be clearly better.
        if score > best_score + 0.02:
            best, best_score = labels, score
    return best


def _lloyd(points: Floats, count: int) -> Labels:
    """Run k-means, starting from the points that are farthest apart; equal points give equal clusters."""
    if not len(points):
        return np.zeros(0, np.intp)
    start = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())
    centres = [points[start]]
    for _ in range(count - 1):
        near = np.min([np.linalg.norm(points - centre, axis=1) for centre in centres], axis=0)
        centres.append(points[int(near.argmax())])
    labels: Labels = np.full(len(points), -1, np.intp)
    for _ in range(100):
        distance = np.array([np.linalg.norm(points - centre, axis=1) for centre in centres])
        new: Labels = distance.argmin(axis=0)
        if np.array_equal(new, labels):
            break
        labels = new
        centres = [
            points[labels == n].mean(axis=0) if (labels == n).any() else centres[n] for n in range(count)
        ]
    return labels


def _silhouette(points: Floats, labels: Labels) -> float:
    """Rate clusters from -1 to 1 by the distances to their centres; 1 means tight clusters that are far
    apart.
    """
    numbers = np.unique(labels)
    if len(numbers) < 2:
        return -1.0
    centres = np.array([points[labels == n].mean(axis=0) for n in numbers])
    distance = np.linalg.norm(points[:, None] - centres[None], axis=2)
    own = distance[np.arange(len(points)), np.searchsorted(numbers, labels)]
    distance[np.arange(len(points)), np.searchsorted(numbers, labels)] = np.inf
    other = distance.min(axis=1)
    return float(np.mean((other - own) / np.maximum(np.maximum(other, own), 1e-12)))
