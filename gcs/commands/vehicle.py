"""`mavherd vehicle`: options, and from options to vehicles with ports."""

import argparse
import math
import os
import re
import socket
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path

from ...transport.errors import LinkError, MavherdError
from ...transport.frames import Origin
from ...transport.links import listen_tcp, parse_address
from ...vehicles.config import AUTOPILOTS, KINDS, MAX_SYSTEM_ID, PROFILES, VehicleConfig
from ..run.ports import LOOPBACK, PortPlan

EPILOG = """\
examples:
  mavherd vehicle quadcopter              UDP to 14550 and 14540, TCP 5760
  mavherd vehicle rover --sysid 2         UDP to 14550 and 14541, TCP 5770
  mavherd vehicle quadcopter --count 10   ten of them, 3 m apart
  mavherd vehicle quadcopter --mission field.plan --params tuned.param --speed 5
  mavherd vehicle quadcopter --autopilot px4 --udpin 127.0.0.1:14600

Connect QGroundControl (UDP 14550) or  mavproxy.py --master tcp:127.0.0.1:5760
PX4_HOME_LAT, PX4_HOME_LON, PX4_HOME_ALT and PX4_SIM_SPEED_FACTOR count where no
option is given. Several vehicles end together: exit code 3 if one of them dies.
"""
_HOME = "47.3977,8.5456,488,0"
_FARTHEST = 1e5  # m that a vehicle may start from its origin
_LAST_PORT = 65535
_ENDS = f"ports end at {_LAST_PORT}"
_SLOWEST, _FASTEST = 0.01, 100.0  # times real time
_APART = 3.0  # m between vehicles of --count


def add_options(vehicle: argparse.ArgumentParser) -> None:
    """Give the parser what `mavherd vehicle` understands."""
    vehicle.usage = "%(prog)s {quadcopter,rover} [options]"
    vehicle.add_argument("kind", choices=KINDS, metavar="kind", help=" or ".join(KINDS))
    who = vehicle.add_argument_group("who it is")
    who.add_argument("--sysid", type=int, default=1, metavar="N", help="system id, 1..240 (1)")
    who.add_argument(
        *("-n", "--count"), type=int, default=1, metavar="N",
        help="so many vehicles, each a process of its own; ids count up (1)",
    )  # fmt: skip
    who.add_argument("--name", help="for the log (kind and system id)")
    who.add_argument(
        "--autopilot", choices=AUTOPILOTS, default="ardupilot", metavar="STACK",
        help=f"be taken for {', '.join(AUTOPILOTS)} (%(default)s)",
    )  # fmt: skip
    _add_start(vehicle.add_argument_group("where it starts, and how fast time passes"))
    _add_loads(vehicle.add_argument_group("parameters and missions"))
    _add_ports(vehicle.add_argument_group("ports"))


def _add_start(where: argparse._ArgumentGroup) -> None:
    where.add_argument(
        *("-O", "--home"), metavar="HOME",
        help="LAT,LON,ALT,HEADING_DEG: the origin of local positions, "
        f"and the compass heading at the start ({_HOME})",
    )  # fmt: skip
    where.add_argument(
        "--position", default="0,0,0", metavar="E,N,U",
        help=f"start there, m from the origin (%(default)s); others of --count {_APART:g} m apart",
    )  # fmt: skip
    where.add_argument(
        *("-s", "--speed", "--speedup"), type=float, metavar="S",
        help=f"times real time, {_SLOWEST:g}..{_FASTEST:g} (1)",
    )  # fmt: skip


def _add_loads(loads: argparse._ArgumentGroup) -> None:
    loads.add_argument(
        "--profile", choices=PROFILES, default="ardupilot", metavar="GAINS",
        help=f"gains and limits: {', '.join(PROFILES)} (%(default)s)",
    )  # fmt: skip
    loads.add_argument(
        "--param", action="append", default=[], metavar="NAME=VALUE",
        help="a parameter (RTL_ALT=2000), or any constant or gain in SI units (mass=1.4); "
        "may be repeated",
    )  # fmt: skip
    loads.add_argument(
        *("--params", "--defaults"), action="append", default=[], type=Path, metavar="FILE",
        help="a .param file; what the vehicle does not have is left out; may be repeated",
    )  # fmt: skip
    loads.add_argument(
        "--mission", type=Path, metavar="FILE",
        help=".plan (with fence and rally points) or QGC WPL 110",
    )  # fmt: skip
    loads.add_argument(
        "--folder", type=Path, metavar="DIR",
        help="keep parameters there that clients set, for the next start",
    )  # fmt: skip
    loads.add_argument(
        *("-w", "--wipe"), action="store_true", help="forget what --folder has kept so far"
    )


def _add_ports(ports: argparse._ArgumentGroup) -> None:
    ports.add_argument(
        *("-I", "-i", "--instance"), type=int, metavar="I",
        help="without the options below: TCP 5760 + 10 I, UDP 14540 + I (sysid - 1)",
    )  # fmt: skip
    ports.add_argument(
        "--tcp", type=port, metavar="PORT",
        help="serve here, vehicle i of --count on PORT + 10 i; 0 serves none",
    )  # fmt: skip
    ports.add_argument(
        "--udpin", action="append", default=[], metavar="HOST:PORT",
        help="answer who sends here (port + i); port 0 is any free one; may be repeated",
    )  # fmt: skip
    ports.add_argument(
        *("--udpout", "--out"), action="append", default=[], metavar="HOST:PORT",
        help="send there; may be repeated",
    )  # fmt: skip


def port(text: str) -> int:
    """Return a port number for argparse."""
    if not (text.isdecimal() and len(text) <= 5 and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port, 0..65535")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Start what the options say and serve it until it is stopped."""
    from ...vehicles.standalone import Start, serve

    if args.name is not None and not re.fullmatch(r"[\w.-]+", args.name):
        raise MavherdError(f"--name {args.name!r}: expected letters, digits and any of _ . -")
    if not 1 <= args.sysid <= MAX_SYSTEM_ID:
        raise MavherdError(f"--sysid {args.sysid}: system ids are 1..{MAX_SYSTEM_ID}")
    most = MAX_SYSTEM_ID - args.sysid + 1
    if not 1 <= args.count <= most:
        raise MavherdError(
            f"--count {args.count}: expected 1..{most}, as system ids end at {MAX_SYSTEM_ID}"
        )
    instance = args.sysid - 1 if args.instance is None else args.instance
    if not 0 <= instance <= MAX_SYSTEM_ID:
        raise MavherdError(f"--instance {instance}: instances are 0..{MAX_SYSTEM_ID}")
    speed = _speed(args.speed, os.environ)
    try:
        with ExitStack() as opened:
            starts = []
            for index, config in enumerate(_configs(args)):
                tcp = _tcp(args, instance, index)
                start = Start(
                    config=config,
                    tcp=opened.enter_context(tcp) if tcp else None,
                    udpin=[_shifted(text, index) for text in args.udpin],
                    udpout=_udpout(args, instance + index),
                    mission=args.mission,
                    folder=_folder(args, config),
                )
                starts.append(start)
            return serve(starts, speed=speed, parameter_files=args.params, wipe=args.wipe)
    except (ValueError, ArithmeticError) as error:
        raise MavherdError(f"vehicle: {error}") from None


def _configs(args: argparse.Namespace) -> Iterator[VehicleConfig]:
    given = "--home LAT,LON,ALT,HEADING_DEG", args.home
    what, home = _home(os.environ) if args.home is None else given
    lat_deg, lon_deg, alt_m, heading_deg = _numbers(home, 4, what)
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
    """Return HOST:PORT for vehicle `index`; 0 stays 0: any free port for each."""
    host, first = parse_address(address, "--udpin")
    number = first + index if first else 0
    if number > _LAST_PORT:
        raise LinkError(f"--udpin {address}: vehicle {index + 1} needs {number}; {_ENDS}")
    return f"{host}:{number}"


def _folder(args: argparse.Namespace, config: VehicleConfig) -> Path | None:
    """Return where this vehicle keeps its parameters."""
    if args.folder is None:
        return None
    folder: Path = args.folder
    return folder / config.name if args.count > 1 else folder


def _home(environ: Mapping[str, str]) -> tuple[str, str]:
    """Return which of PX4's environment variables are used, and our home as they change it."""
    names = ("PX4_HOME_LAT", "PX4_HOME_LON", "PX4_HOME_ALT")
    parts = [environ.get(n) or part for n, part in zip((*names, ""), _HOME.split(","), strict=True)]
    used = [n for n in names if environ.get(n)]
    return ", ".join(used), ",".join(parts)


def _speed(given: float | None, environ: Mapping[str, str]) -> float:
    """Return the speed asked for, by option or by PX4's environment variable."""
    name = "PX4_SIM_SPEED_FACTOR"
    text = environ.get(name)
    if given is None and text:
        try:
            speed = float(text)
        except ValueError:
            speed = math.nan
        what = f"{name}={text}"
    else:
        speed = 1.0 if given is None else given
        what = f"--speed {speed:g}"
    if not _SLOWEST <= speed <= _FASTEST:
        raise MavherdError(f"{what}: expected a factor of {_SLOWEST:g}..{_FASTEST:g}")
    return speed


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
