# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Feature matches between frames, before COLMAP chooses one motion for all of them, and their tracks."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
import pycolmap
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True)
class Matches:
    """Keypoints by name, pixels [K, 2] with centres at +0.5, and index pairs [M, 2] by (name, name)."""

    keypoints: dict[str, np.ndarray] = field(default_factory=dict)
    pairs: dict[tuple[str, str], np.ndarray] = field(default_factory=dict)

    def between(self, first: str, second: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the pixels [M, 2] in both frames of a pair in `pairs`."""
        index = self.pairs[first, second]
        return self.keypoints[first][index[:, 0]], self.keypoints[second][index[:, 1]]

    def scaled(self, scales: dict[str, tuple[float, float]]) -> Matches:
        """Return the matches in pictures of another size, their names without a folder.

        `scales` maps a name with its folder to the factors of width and height.
        """
        plain = {name: PurePosixPath(name).name for name in self.keypoints}
        keypoints = {plain[name]: pixels * scales[name] for name, pixels in self.keypoints.items()}
        return Matches(
            keypoints, {(plain[first], plain[second]): index for (first, second), index in self.pairs.items()}
        )

    def kept(self, keep: dict[tuple[str, str], np.ndarray]) -> Matches:
        """Return the matches that the masks `keep`, bool [M] for each pair, select."""
        return Matches(self.keypoints, {pair: index[keep[pair]] for pair, index in self.pairs.items() if pair in keep})


def read_matches(database: Path) -> Matches:
    """Read all matches of a COLMAP database, verified or not."""
    with pycolmap.Database.open(str(database)) as stored:
        names = {image.image_id: image.name for image in stored.read_all_images()}
        keypoints = {
            name: np.asarray(stored.read_keypoints(number), np.float64)[:, :2] for number, name in names.items()
        }
        numbers, indices = stored.read_all_matches()
        pairs = {}
        for number, index in zip(numbers, indices, strict=True):
            first, second = pycolmap.pair_id_to_image_pair(number)
            if len(index):
                pairs[names[first], names[second]] = np.asarray(index, np.int64)
    return Matches(keypoints, pairs)


def tracks(matches: Matches) -> list[list[tuple[str, int]]]:
    """Join matches to tracks, lists of (name, keypoint); a track that meets a frame twice is left out."""
    names = sorted({name for pair in matches.pairs for name in pair})
    start = dict(zip(names, np.cumsum([0] + [len(matches.keypoints[name]) for name in names])[:-1], strict=True))
    total = sum(len(matches.keypoints[name]) for name in names)
    links = [index + [start[first], start[second]] for (first, second), index in matches.pairs.items()]
    if not links:
        return []
    links = np.concatenate(links)
    _, label = connected_components(coo_array((np.ones(len(links)), links.T), (total, total)), directed=False)
    owner = np.repeat(np.arange(len(names)), [len(matches.keypoints[name]) for name in names])
    components: dict[int, list[tuple[str, int]]] = {}
    for node in np.unique(links):
        components.setdefault(int(label[node]), []).append((names[owner[node]], int(node - start[names[owner[node]]])))
    return [track for track in components.values() if len({name for name, _ in track}) == len(track) > 1]
