"""What a coordination law is told and what it answers. Ground side: ENU, SI, radians."""

from collections.abc import Callable, Sequence
from math import inf
from typing import NamedTuple, Protocol

from ...transport.frames import Triple


class Peer(NamedTuple):
    """What is known of one robot (of oneself with age 0)."""

    system_id: int
    kind: str  # quadcopter | rover
    position: Triple  # m
    velocity: Triple  # m/s
    heading: float  # rad, counter-clockwise from east
    age: float = 0.0  # s since position and velocity were true
    vertical: bool = False  # taking off or landing: moves through all heights where it stands
    delay: float = 0.0  # s by which commands have lately come too late (of oneself)


class Nominal(NamedTuple):
    """Where the robot would be and how it would move, were it alone."""

    position: Triple
    velocity: Triple = (0.0, 0.0, 0.0)
    yaw: float | None = None  # rad, ENU heading; None: the vehicle's own choice


class Command(NamedTuple):
    """What to send: a position target with feed-forwards, a velocity, or (all None) hold.

    `feed_forward` is what the law added to the nominal velocity, for show.
    """

    position: Triple | None = None
    velocity: Triple | None = None
    acceleration: Triple | None = None
    yaw: float | None = None
    yaw_rate: float | None = None  # rad/s, positive turns left (ENU)
    feed_forward: Triple = (0.0, 0.0, 0.0)


HOLD = Command()


class Law(Protocol):
    """A pure function from what one robot knows to what it is told to do.

    A law may have a method `reach(age, delay)` that says how far it looks; see `reach_of`.
    """

    def __call__(self, me: Peer, neighbours: Sequence[Peer], nominal: Nominal) -> Command:
        """Return the command for `me`.

        `neighbours` holds all others within its reach, of any kind and age, and may hold more.
        """
        ...


def reach_of(law: Law, age: float, delay: float) -> float:
    """Return from how far away (m, in the plane) a robot can matter to `law`; inf: it does not say.

    That is from where one is by now to where the other is, or was when it was last heard of, while
    no state that still counts is older than `age`, and own commands come `delay` late (s).
    """
    reach: Callable[[float, float], float] | None = getattr(law, "reach", None)
    return inf if reach is None else reach(age, delay)
