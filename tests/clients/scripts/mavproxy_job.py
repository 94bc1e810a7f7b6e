"""MAVProxy at its prompt, typed and read as a person does.

Arguments: the address of the vehicle's link, and `quadcopter` or `rover`. Files go to the working
directory.
"""

import re
import sys
from pathlib import Path

import pexpect
from facts import distance, fact, offset

PATIENCE = 60  # s
HOME = (47.3977, 8.5456)  # where a vehicle starts that is told nothing else
_POSITION = r"GLOBAL_POSITION_INT \{[^}]*lat : (-?\d+), lon : (-?\d+),[^}]*relative_alt : (-?\d+)"


class Prompt:
    """A running MAVProxy."""

    def __init__(self, address: str) -> None:
        program = Path(sys.executable).with_name("mavproxy.py")
        self._child = pexpect.spawn(
            sys.executable,
            ["-W", "ignore", str(program), f"--master={address}", "--streamrate=10"],
            timeout=PATIENCE,
            encoding="utf-8",
            codec_errors="replace",
            dimensions=(50, 400),
        )
        self._child.logfile_read = Path("mavproxy.txt").open("w")  # noqa: SIM115 - as long as we

    def type(self, line: str) -> None:
        """Type a line and press Enter."""
        self._child.sendline(line)

    def read(self, *patterns: str, patience: float = PATIENCE) -> re.Match[str]:
        """Return the match of one of the patterns in what comes next."""
        self._child.expect(list(patterns), timeout=patience)
        return self._child.match

    def ask(self, line: str, *patterns: str) -> re.Match[str]:
        """Type a line and return the match in the answer."""
        self.type(line)
        return self.read(*patterns)

    def be_at(self, north: float, east: float, up: float, within: float = 0.7) -> None:
        """Read the positions that are watched until the vehicle is there."""
        there = offset(*HOME, north, east)
        for _ in range(6000):
            lat, lon, height = (int(text) for text in self.read(_POSITION).groups())
            off = distance((lat / 1e7, lon / 1e7), there)
            if off < within and abs(height / 1e3 - up) < within:
                return
        raise TimeoutError(f"not at {north}, {east}, {up}")

    def close(self) -> None:
        """End the program."""
        self._child.close(force=True)


def write_items(name: str, *items: tuple[float, ...]) -> str:
    """Write a `QGC WPL 110` file of (command, frame, north, east, up, param 1); return its name."""
    lines = ["QGC WPL 110"]
    for i, (command, frame, north, east, up, p1) in enumerate(items):
        lat, lon = offset(*HOME, north, east)
        fields = i, int(i == 0), frame, command, p1, 0, 0, 0, f"{lat:.8f}", f"{lon:.8f}", up, 1
        lines.append("\t".join(map(str, fields)))
    Path(name).write_text("\n".join(lines) + "\n")
    return name


def transfer_lists(proxy: Prompt) -> None:
    """Mission, fence and rally points go up and are listed again."""
    mission = write_items(
        "mission.txt",
        (16, 0, 0, 0, 488, 0),
        (22, 3, 0, 0, 5, 0),
        (16, 3, 8, 0, 5, 0),
        (16, 3, 8, 8, 7, 0),
        (20, 3, 0, 0, 0, 0),
    )
    corners = ((60, 60), (60, -60), (-60, -60), (-60, 60))
    fence = write_items("fence.txt", *((5001, 0, *at, 0, 4) for at in corners))
    rally = write_items("rally.txt", (5100, 3, 5, 5, 10, 0), (5100, 3, -5, -5, 12, 0))
    listed = {}
    for command, file, count in (("wp", mission, 5), ("fence", fence, 4), ("rally", rally, 2)):
        proxy.ask(f"{command} load {file}", rf"Loaded {count} .*\d\.\d\ds")
        listed[command] = int(proxy.ask(f"{command} list", r"Requesting (\d+) ")[1])
        proxy.read(r"Saved \d+ ")
    fact(listed=listed)
    proxy.ask("wp changealt 3 6", r"Changed alt for WPs 3:3 to 6\.0")  # a partial write
    proxy.ask("wp list", r"Requesting 5 ")
    heights = [float(proxy.read(r"\n\d+ \d \S+ \S+ (\d+\.\d+) p1=")[1]) for _ in range(5)]
    fact(heights=heights)
    for word in ("enable", "disable"):
        proxy.ask(f"fence {word}", "DO_FENCE_ENABLE: ACCEPTED")
    proxy.ask("rally clear", "rally clear")
    fact(rally_after_clear=int(proxy.ask("rally list", r"Requesting (\d+) ")[1]))


def handle_parameters(proxy: Prompt) -> None:
    """Show, set and fetch one, and have a wrong value refused."""
    show = r"RTL_ALT +(\d+)(?:\.\d+)?\r"
    before = float(proxy.ask("param show RTL_ALT", show)[1])
    proxy.type("param set RTL_ALT 1200")
    fetched = float(proxy.ask("param fetch RTL_ALT", r"RTL_ALT = (\d+\.\d+)")[1])
    after = float(proxy.ask("param show RTL_ALT", show)[1])
    fact(rtl_alt=[before, fetched, after])


def fly(proxy: Prompt) -> None:
    """Take off in GUIDED, go somewhere, fly the mission, return."""
    proxy.type("watch GLOBAL_POSITION_INT")  # all the way: what is passed is not seen again
    proxy.ask("mode guided", "Mode GUIDED")
    fact(mode="GUIDED")
    proxy.ask("arm throttle", "ARMED")
    proxy.ask("takeoff 5", r"NAV_TAKEOFF: ACCEPTED")
    proxy.be_at(0, 0, 5)
    fact(took_off=True)
    lat, lon = offset(*HOME, 6, -4)
    proxy.ask(f"guided {lat:.7f} {lon:.7f} 6", "Guided ")
    proxy.be_at(6, -4, 6)
    fact(guided=True)
    proxy.ask("mode auto", "Mode AUTO")
    proxy.be_at(8, 0, 5)
    proxy.be_at(8, 8, 6)
    fact(mission=True)
    proxy.ask("mode loiter", "Mode LOITER")
    proxy.ask("rtl", "Mode RTL")
    proxy.read("DISARMED", patience=80)
    fact(returned=True)
    proxy.ask("arm throttle", r"Arm: RTL mode not armable")
    fact(refused="RTL mode not armable")


def drive(proxy: Prompt) -> None:
    """Drive somewhere in GUIDED, and stop."""
    proxy.type("watch GLOBAL_POSITION_INT")
    proxy.ask("mode guided", "Mode GUIDED")
    proxy.ask("arm throttle", "ARMED")
    lat, lon = offset(*HOME, 6, -4)
    proxy.ask(f"guided {lat:.7f} {lon:.7f} 0", "Guided ")
    proxy.be_at(6, -4, 0, within=2.5)
    fact(guided=True)
    proxy.ask("rtl", "Mode RTL")
    proxy.be_at(0, 0, 0, within=2.5)
    fact(returned=True)
    proxy.ask("mode hold", "Mode HOLD")
    proxy.ask("disarm", "DISARMED")
    fact(disarmed=True)


def work(address: str, kind: str) -> None:
    """Connect, then do one thing after the other."""
    proxy = Prompt(address)
    try:
        proxy.read(r"Detected vehicle 1:1")
        fact(parameters=int(proxy.read(r"Received (\d+) parameters")[1]))
        if kind == "quadcopter":
            handle_parameters(proxy)
            transfer_lists(proxy)
            fly(proxy)
        else:
            drive(proxy)
    except pexpect.ExceptionPexpect:
        print(Path("mavproxy.txt").read_text()[-6000:])
        raise
    finally:
        proxy.close()


if __name__ == "__main__":
    work(*sys.argv[1:])
