"""DroneKit 2.9.2: a whole flight or drive, by the book.

Arguments: the address of the vehicle's link, and `quadcopter` or `rover`.
"""

import collections
import collections.abc
import sys
import threading
import time
from collections.abc import Callable

collections.MutableMapping = collections.abc.MutableMapping  # gone since Python 3.10

import dronekit  # noqa: E402 - after the shim
from dronekit import Command, LocationGlobalRelative, VehicleMode  # noqa: E402
from facts import distance, fact, offset  # noqa: E402
from pymavlink import mavutil  # noqa: E402

PATIENCE = 60.0  # s
mav = mavutil.mavlink
RELATIVE = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT
_HEARD = ("location.local_frame", "attitude", "gps_0", "battery", "velocity", "heading", "ekf_ok")


def until(condition: Callable[[], object], what: str, patience: float = PATIENCE) -> None:
    """Wait for what DroneKit's threads bring; it has no other way of waiting."""
    deadline = time.monotonic() + patience
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(what)
        time.sleep(0.02)


class Job:
    """One vehicle."""

    def __init__(self, vehicle: dronekit.Vehicle, kind: str) -> None:
        self.vehicle = vehicle
        self.flies = kind == "quadcopter"
        self.height = 5.0 if self.flies else 0.0
        self.heard: dict[str, int] = {}
        self._texts: list[str] = []
        self.home = (0.0, 0.0)

    def look_around(self) -> None:
        """Attributes, listeners and parameters."""
        vehicle = self.vehicle
        for name in _HEARD:
            vehicle.add_attribute_listener(name, self._count)

        @vehicle.on_message("STATUSTEXT")
        def _(_vehicle: object, _name: str, message: object) -> None:
            self._texts.append(message.text)

        until(lambda: vehicle.is_armable, "armable")
        until(lambda: vehicle.location.global_frame.lat, "a position")
        vehicle.commands.download()
        vehicle.commands.wait_ready(timeout=20)
        self.home = (vehicle.home_location.lat, vehicle.home_location.lon)
        fact(
            version=str(vehicle.version),
            home=self.home,
            gps=[vehicle.gps_0.fix_type, vehicle.gps_0.satellites_visible],
            ekf_ok=vehicle.ekf_ok,
            battery=vehicle.battery.voltage,
            state=vehicle.system_status.state,
            empty_mission=vehicle.commands.count,
            capabilities=vehicle.capabilities.mission_int,
            parameters=len(vehicle.parameters),
        )

    def handle_parameters(self) -> None:
        parameters = self.vehicle.parameters
        heard = threading.Event()
        name, value = ("RTL_ALT", 1300) if self.flies else ("WP_RADIUS", 1.5)

        @parameters.on_attribute(name)
        def _(_vehicle: object, _name: str, new: float) -> None:
            if new == value:
                heard.set()

        before = parameters[name]
        parameters.set(name, value, wait_ready=True)
        fact(set_parameter=[before, parameters[name]], parameter_listener=heard.wait(PATIENCE))

    def start(self) -> None:
        vehicle = self.vehicle
        vehicle.wait_for_mode("GUIDED", timeout=PATIENCE)
        vehicle.arm(wait=True, timeout=PATIENCE)
        fact(armed=vehicle.armed, said=list(self._texts))
        if self.flies:
            vehicle.simple_takeoff(self.height)
            until(lambda: abs(self._up() - self.height) < 0.5, "takeoff height")
            fact(took_off=self._up(), status=vehicle.system_status.state)

    def go(self) -> None:
        self.vehicle.simple_goto(self._place(8, 3), groundspeed=3)
        until(lambda: self._off(8, 3) < 1.5, "simple_goto")
        fact(went=True, attitude=self.vehicle.attitude.yaw)

    def fly_mission(self) -> None:
        """Upload, read back, fly."""
        commands = self.vehicle.commands
        commands.clear()
        if self.flies:
            commands.add(self._command(mav.MAV_CMD_NAV_TAKEOFF, 0, 0))
        for north, east in ((0, 6), (-6, 6)):
            commands.add(self._command(mav.MAV_CMD_NAV_WAYPOINT, north, east))
        count = commands.count
        commands.upload(timeout=20)
        commands.download()
        commands.wait_ready(timeout=20)
        fact(
            uploaded=count,
            downloaded=[[c.command, round(c.x, 5), round(c.y, 5), c.z] for c in commands],
        )
        commands.next = 1
        self.vehicle.wait_for_mode("AUTO", timeout=PATIENCE)
        seen: set[int] = set()

        def is_there() -> bool:
            seen.add(commands.next)
            return self._off(-6, 6) < 2.0

        until(is_there, "the end of the mission")
        fact(mission=True, next_seen=sorted(seen))

    def come_home(self) -> None:
        vehicle = self.vehicle
        vehicle.mode = VehicleMode("RTL")
        until(lambda: self._off(0, 0) < 2.5, "RTL")
        if self.flies:
            vehicle.mode = VehicleMode("LAND")
            until(lambda: not vehicle.armed, "landed and disarmed")
        else:
            vehicle.wait_for_mode("HOLD", timeout=PATIENCE)
            vehicle.disarm(wait=True, timeout=PATIENCE)
        fact(landed=True, off_home=self._off(0, 0), heard=self.heard)

    def _count(self, _vehicle: object, name: str, _value: object) -> None:
        self.heard[name] = self.heard.get(name, 0) + 1

    def _up(self) -> float:
        return self.vehicle.location.global_relative_frame.alt

    def _off(self, north: float, east: float) -> float:
        at = self.vehicle.location.global_frame
        return distance((at.lat, at.lon), offset(*self.home, north, east))

    def _place(self, north: float, east: float) -> LocationGlobalRelative:
        return LocationGlobalRelative(*offset(*self.home, north, east), self.height)

    def _command(self, command: int, north: float, east: float) -> Command:
        lat, lon = offset(*self.home, north, east)
        return Command(0, 0, 0, RELATIVE, command, 0, 1, 0, 0, 0, 0, lat, lon, self.height)


def work(address: str, kind: str) -> None:
    """Connect, then do one thing after the other."""
    vehicle = dronekit.connect(address, wait_ready=True, rate=10, timeout=40)
    fact(connected=True)
    try:
        job = Job(vehicle, kind)
        job.look_around()
        job.handle_parameters()
        job.start()
        job.go()
        job.fly_mission()
        job.come_home()
    finally:
        vehicle.close()


if __name__ == "__main__":
    work(*sys.argv[1:])
