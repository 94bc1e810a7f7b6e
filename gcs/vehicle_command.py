"""`mavherd vehicle`: options, and from options to vehicles with ports."""

import argparse
import math
import os
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path

from ..transport.errors import LinkError, MavherdError
from ..transport.frames import Origin
from ..transport.links import listen_tcp
from ..vehicles.config import AUTOPILOTS, KINDS, MAX_SYSTEM_ID, PROFILES, VehicleConfig
from .ports import LOOPBACK, PortPlan

EPILOG = """\
examples:
  mavherd vehicle quadcopter                           sends to UDP 14550 and 14540, serves TCP 5760
  mavherd vehicle rover --sysid 2 --position 4,4,0     sends to UDP 14550 and 14541, serves TCP 5770
  mavherd vehicle quadcopter --count 10                ten of them, 3 m apart
  mavherd vehicle quadcopter --mission field.plan --params tuned.param --speed 5
  mavherd vehicle quadcopter --autopilot px4 --tcp 0 --udpin 127.0.0.1:14600

Connect with  mavproxy.py --master tcp:127.0.0.1:5760  or  QGroundControl (UDP 14550).
PX4_HOME_LAT, PX4_HOME_LON, PX4_HOME_ALT and PX4_SIM_SPEED_FACTOR count where no option is given.
"""
_HOME = "47.3977,8.5456,488,0"
_FARTHEST = 1e5  # m that a vehicle may start from its origin
_LAST_PORT = 65535
_ENDS = f"ports end at {_LAST_PORT}"
_APART = 3.0  # m between vehicles of --count


def add_options(vehicle: argparse.ArgumentParser) -> None:
    """Give the parser what `mavherd vehicle` understands."""
    vehicle.add_argument("kind", choices=KINDS)
    vehicle.add_argument("--sysid", type=int, default=1, metavar="N", help="system id, 1..240 (1)")
    vehicle.add_argument(
        "-I", "-i", "--instance", type=int, metavar="I", help="for the ports (sysid - 1)"
    )
    vehicle.add_argument(
        "-n", "--count", type=int, default=1, metavar="N", help="so many vehicles, ids counting up"
    )
    vehicle.add_argument("--name", help="for the log (kind and system id)")
    vehicle.add_argument(
        "--autopilot", choices=AUTOPILOTS, default="ardupilot", help="be taken for (%(default)s)"
    )
    where = vehicle.add_argument_group("where it starts")
    where.add_argument(
        "-O",
        "--home",
        metavar="LAT,LON,ALT,HEADING_DEG",
        help=f"origin of local positions, and the compass heading at the start ({_HOME})",
    )
    where.add_argument(
        "--position", default="0,0,0", metavar="E,N,U", help="start from there, m (%(default)s)"
    )
    vehicle.add_argument(
        "-s", "--speed", "--speedup", type=float, metavar="S", help="times real time (1)"
    )
    loads = vehicle.add_argument_group("parameters and missions")
    loads.add_argument(
        "--profile", choices=PROFILES, default="ardupilot", help="gains and limits (%(default)s)"
    )
    loads.add_argument(
        "--param",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter (RTL_ALT=2000), or any constant or gain in SI units (mass=1.4)",
    )
    loads.add_argument(
        "--params",
        "--defaults",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a .param file",
    )
    loads.add_argument("--mission", type=Path, metavar="FILE", help=".plan, or QGC WPL 110")
    loads.add_argument(
        "--folder", type=Path, metavar="DIR", help="keep parameters there that clients set"
    )
    loads.add_argument(
        "-w", "--wipe", action="store_true", help="forget what --folder has kept so far"
    )
    ports = vehicle.add_argument_group("ports (vehicle i of --count: TCP + 10 i, UDP in + i)")
    ports.add_argument("--tcp", type=port, metavar="PORT", help="serve here; 0 serves none")
    ports.add_argument(
        "--udpin", action="append", default=[], metavar="HOST:PORT", help="answer who sends here"
    )
    ports.add_argument(
        "--udpout", "--out", action="append", default=[], metavar="HOST:PORT", help="send there"
    )


def port(text: str) -> int:
    """Return a port number for argparse."""
    if not (text.isdecimal() and len(text) <= 5 and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port, 0..65535")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Start what the options say and serve it until it is stopped."""
    from ..vehicles.standalone import Start, serve

    if not 1 <= args.sysid <= MAX_SYSTEM_ID:
        raise MavherdError(f"--sysid {args.sysid}: system ids are 1..{MAX_SYSTEM_ID}")
    last = args.sysid + args.count - 1
    if args.count < 1 or last > MAX_SYSTEM_ID:
        raise MavherdError(
            f"--count {args.count}: system ids {args.sysid}..{last}, expected 1..{MAX_SYSTEM_ID}"
        )
    instance = args.sysid - 1 if args.instance is None else args.instance
    if not 0 <= instance <= MAX_SYSTEM_ID:
        raise MavherdError(f"--instance {instance}: instances are 0..{MAX_SYSTEM_ID}")
    speed = _speed(args.speed, os.environ)
    try:
        starts = [
            Start(
                config=config,
                tcp=_tcp(args, instance, index),
                udpin=[_shifted(text, index) for text in args.udpin],
                udpout=_udpout(args, instance + index),
                mission=args.mission,
                folder=_folder(args, config),
            )
            for index, config in enumerate(_configs(args))
        ]
        return serve(starts, speed=speed, parameter_files=args.params, wipe=args.wipe)
    except (ValueError, ArithmeticError) as error:
        raise MavherdError(f"vehicle: {error}") from None


def _configs(args: argparse.Namespace) -> Iterator[VehicleConfig]:
    home = args.home or _home(os.environ)
    lat_deg, lon_deg, alt_m, heading_deg = _numbers(home, 4, "--home LAT,LON,ALT,HEADING_DEG")
    east, north, up = _numbers(args.position, 3, "--position E,N,U")
    if max(map(abs, (east, north, up))) > _FARTHEST:
        raise MavherdError(f"--position {args.position}: at most {_FARTHEST:g} m from the origin")
    for index in range(args.count):
        system_id = args.sysid + index
        name = args.name or args.kind
        yield VehicleConfig(
            kind=args.kind,
            system_id=system_id,
            name=name if args.name and args.count == 1 else f"{name}{system_id}",
            origin=Origin(lat_deg, lon_deg, alt_m),
            north=north,
            east=east + index * _APART,
            down=-up,
            yaw=math.radians(heading_deg),
            autopilot=args.autopilot,
            profile=args.profile,
            params=dict(_parameter(text) for text in args.param),
        )


def _tcp(args: argparse.Namespace, instance: int, index: int) -> socket.socket | None:
    """Return the listening socket of vehicle `index` of --count."""
    if args.tcp:
        number = args.tcp + 10 * index
        if number > _LAST_PORT:
            raise LinkError(f"--tcp {args.tcp}: vehicle {index + 1} needs {number}; {_ENDS}")
        return listen_tcp(LOOPBACK, number)
    if args.tcp == 0 or args.udpin:
        return None
    return PortPlan().listen(instance + index)


def _udpout(args: argparse.Namespace, instance: int) -> list[str]:
    """Return where a vehicle sends to: as told, or where ground stations and APIs listen."""
    if args.udpout or args.udpin:
        return list(args.udpout)
    return [f"{host}:{number}" for host, number in PortPlan().udp_targets(instance)]


def _shifted(address: str, index: int) -> str:
    """Return HOST:PORT for vehicle `index`; what is no address is complained of later."""
    host, _, number = address.rpartition(":")
    return f"{host}:{int(number) + index}" if index and number.isdecimal() else address


def _folder(args: argparse.Namespace, config: VehicleConfig) -> Path | None:
    """Return where this vehicle keeps its parameters."""
    if args.folder is None:
        return None
    folder: Path = args.folder
    return folder / config.name if args.count > 1 else folder


def _home(environ: Mapping[str, str]) -> str:
    """Return the home that PX4's environment variables change in our own."""
    parts = _HOME.split(",")
    names = ("PX4_HOME_LAT", "PX4_HOME_LON", "PX4_HOME_ALT")
    return ",".join(environ.get(n) or part for n, part in zip((*names, ""), parts, strict=True))


def _speed(given: float | None, environ: Mapping[str, str]) -> float:
    if given is not None:
        return given
    text = environ.get("PX4_SIM_SPEED_FACTOR") or "1"
    try:
        return float(text)
    except ValueError:
        raise MavherdError(f"PX4_SIM_SPEED_FACTOR={text}: expected a number") from None


def _numbers(text: str, count: int, what: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise LinkError(f"{what}: {text!r} is not {count} numbers with commas between them")
    return values


def _parameter(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        problem = "is not a number" if equals else "has no value"
        raise MavherdError(f"--param {text}: {name} {problem}; write --param NAME=VALUE") from None
