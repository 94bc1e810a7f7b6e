"""Who is near enough to matter to whom, by a spatial index. No I/O; ENU, m."""

from collections.abc import Sequence
from math import inf
from typing import Any

from ..laws import Peer

WORTH_IT = 1200
"""Own vehicles times all: with more of them an index costs less than that all look at all."""

_SLACK = 1.0 + 1e-9  # of a reach: an index rounds in its own way
_NOWHERE = 1e150  # m; what is so far away, or has no place, is put there and near nobody


class Neighbours:
    """Finds, among all peers of a tick, those within the reach of each own vehicle.

    In the plane: heights are the law's business. A peer is where it is by now if it kept its
    velocity; one whose state is older than `timeout`, where it was.
    """

    def __init__(self, timeout: float) -> None:
        from scipy.spatial import cKDTree  # takes long: for those who need it

        self._tree: Any = cKDTree
        self._timeout = timeout

    def of(
        self, peers: Sequence[Peer], askers: Sequence[int], reaches: Sequence[float]
    ) -> list[list[Peer]]:
        """Return who is within reach of each of `askers`, which are numbers of peers.

        In the order of `peers`, and without itself.
        """
        timeout = self._timeout
        places = [_place(peer, timeout) for peer in peers]
        tree = self._tree(places, balanced_tree=False, compact_nodes=False)
        found: list[list[int]] = tree.query_ball_point(
            [places[i] if peers[i].age <= timeout else _place(peers[i], inf) for i in askers],
            [reach * _SLACK for reach in reaches],
            return_sorted=True,
        ).tolist()
        return [[peers[j] for j in near if j != i] for i, near in zip(askers, found, strict=True)]


def _place(peer: Peer, timeout: float) -> tuple[float, float]:
    _, _, (x, y, _), (vx, vy, _), _, age, _, _ = peer
    if 0.0 < age <= timeout:
        x, y = x + vx * age, y + vy * age
    if -_NOWHERE < x < _NOWHERE and -_NOWHERE < y < _NOWHERE:
        return x, y
    return _NOWHERE, _NOWHERE
