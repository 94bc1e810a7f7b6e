"""A station and a real vehicle, in memory, tick by tick."""

import pytest

from mavherd.gcs.station import Station, stack_of
from mavherd.transport.frames import Origin
from mavherd.transport.mavlink import Codec
from mavherd.vehicles.config import VehicleConfig
from mavherd.vehicles.vehicle import Vehicle

RATE_HZ = 20.0
SYSTEM_ID = 5
FLEET = Origin()
OFF = (10.0, -5.0, 12.0)  # of an external vehicle's origin: m north, east, up


class Pair:
    """A station and its vehicle, which stands at the fleet's origin.

    An `external` one has an origin of its own. `deaf` and `mute` break either direction;
    `drop` says which messages of the vehicle do not get through.
    """

    def __init__(self, kind="quadcopter", autopilot="ardupilot", *, external=False, auto=False):
        north, east, up = OFF if external else (0.0, 0.0, 0.0)
        lat_deg, lon_deg = FLEET.to_geodetic(north, east)
        self.vehicle = Vehicle(
            VehicleConfig(
                kind=kind,
                system_id=SYSTEM_ID,
                autopilot=autopilot,
                origin=Origin(lat_deg, lon_deg, FLEET.alt_m + up),
                north=-north,
                east=-east,
                down=up - 3.0 if external else 0.0,  # its GPS is 3 m wrong, too
            )
        )
        self.link = self.vehicle.converse(channel=1)
        self.station = Station(
            "q",
            SYSTEM_ID,
            RATE_HZ,
            kind=kind,
            stack=None if auto else stack_of(autopilot),
            origin=FLEET if external else None,
        )
        self.now = 0.0
        self.deaf = self.mute = False
        self.drop = frozenset()
        self.sent = []
        self.each_tick = None

    @property
    def status(self):
        return self.station.status

    def run(self, seconds):
        for _ in range(round(seconds * RATE_HZ)):
            self.tick()

    def until(self, condition, seconds=10.0):
        """Run until the condition holds; fail when it does not in time."""
        for _ in range(round(seconds * RATE_HZ)):
            if condition():
                return
            self.tick()
        raise AssertionError(f"not within {seconds} s: {self.status}")

    def tick(self):
        if self.each_tick:
            self.each_tick()
        out = self.station.transmit(self.now)
        self.sent += [(self.now, m) for m in Codec(SYSTEM_ID).decode(out)]
        data = self.vehicle.handle(out, self.link) if not self.deaf else b""
        for _ in range(5):
            self.vehicle.step()
            data += self.vehicle.report(self.link, self.vehicle.take_broadcasts())
        self.now = self.vehicle.now_us * 1e-6
        if self.drop:
            messages = Codec(1).decode_frames(data)
            data = b"".join(f for m, f in messages if m.get_type() not in self.drop)
        if not self.mute:
            self.station.receive(data, self.now)

    def hear(self, *messages, component=1):
        """Have the station hear messages that the vehicle has not sent."""
        self.station.receive(Codec(SYSTEM_ID, component).encode(messages), self.now)

    def commands(self, number):
        return [m for _, m in self.sent if m.get_type() == "COMMAND_LONG" and m.command == number]


@pytest.fixture
def make_pair():
    """Make a pair: make_pair(kind, autopilot, external=..., auto=...)."""
    return Pair
