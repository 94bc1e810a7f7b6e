"""`mavherd clock`: pause, step and hurry a run from another terminal."""

import argparse
import json
import socket
from pathlib import Path

from ...transport.errors import MavherdError

EPILOG = """\
commands:
  pause                stop after this tick
  resume               go on
  step [N]             stand still after one tick, or N; answers when they are done
  speed FACTOR|max     times real time, or as fast as it goes
  faster, slower       one of 0.1, 0.2, 0.5, 1, 2, 5, ... more, or less
  status               only ask

examples:
  mavherd clock runs/crossing-targets-20260101-120000-1a2b pause
  mavherd clock tcp/127.0.0.1:43657 step 20

The endpoint of a run is `zenoh` in its ports.json. None of this changes a byte of the run.
"""

_PATIENCE_S = 10.0  # a tick of a hundred vehicles on a busy machine
_STEP_PATIENCE_S = 3600.0
_KNOCK_S = 2.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `mavherd clock`."""
    parser.add_argument("where", metavar="RUN", help="a run's folder, or its Zenoh endpoint")
    parser.add_argument("order", nargs="+", metavar="COMMAND", help="see below")


def run(args: argparse.Namespace) -> int:
    """Ask the run's clock, print how it stands then."""
    from ...transport.bus import Bus

    endpoint, run_id = _address(args.where)
    _knock(endpoint, args.where)
    order = " ".join(args.order).lower().strip()
    patience = _STEP_PATIENCE_S if order.startswith("step") else _PATIENCE_S
    with Bus.client(endpoint, run_id) as bus:
        answer = bus.ask("clock/command", order, patience)
    if answer is None:
        raise MavherdError(
            f"{args.where}: no answer of its clock"
            " (the run has not begun, has ended, or is a script that is its own clock)"
        )
    if not answer.granted:
        raise MavherdError(answer.text)
    state = json.loads(answer.text)
    going = "paused" if state["paused"] else "running"
    speed = "max speed" if state["speed"] == "max" else f"speed {state['speed']:g}"
    print(f"{state['t']:.2f} s, {going}, {speed}")
    return 0


def _knock(endpoint: str, where: str) -> None:
    """Refuse an endpoint on this machine where nobody listens; Zenoh tries it for seconds."""
    from ..run.ports import LOOPBACK

    scheme, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if scheme != "tcp" or host != LOOPBACK or not port.isdigit():
        return
    try:
        socket.create_connection((host, int(port)), _KNOCK_S).close()
    except (OSError, OverflowError) as error:
        if isinstance(error, TimeoutError):
            return  # it is busy: Zenoh has more patience
        raise MavherdError(f"{where}: its clock is gone: the run has ended") from None


def _address(where: str) -> tuple[str, str]:
    """Return the Zenoh endpoint of a run, and its name; behind an endpoint there is only one."""
    if "/" in where and where.partition("/")[0] in ("tcp", "tls", "quic", "ws"):
        return where, "*"
    folder = Path(where)
    try:
        ports = json.loads((folder / "ports.json").read_text(encoding="utf-8"))
        return str(ports["zenoh"]), folder.resolve().name
    except OSError as error:
        if (folder / "scenario.yaml").is_file():
            raise MavherdError(
                f"{where}: no clock to ask"
                " (the run is in one process, with --in-process, or it is still starting)"
            ) from None
        raise MavherdError(
            f"{folder / 'ports.json'}: {error.strerror} (is {where} the folder of a run?)"
        ) from None
    except (ValueError, KeyError, TypeError):
        raise MavherdError(f"{folder / 'ports.json'} is not one of mavherd's") from None
