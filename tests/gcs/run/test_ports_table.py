"""Where to connect is printed whole for a few vehicles, and as ranges for many."""

from io import StringIO

from rich.console import Console

from mavherd.gcs.run.ports import PortPlan
from mavherd.gcs.run.ports_table import ports_table


def printed(ports):
    """Return the words of each line, as they come to a terminal of 80 columns."""
    out = Console(file=StringIO(), width=80)
    out.print(ports_table(ports))
    return [line.split() for line in out.file.getvalue().splitlines()]


def test_the_ports_of_a_hundred_vehicles_become_ranges():
    plan = PortPlan()
    ports = {}
    for i in range(100):
        name = f"quad{i + 1}" if i < 50 else f"rover{i - 49}"
        udp = [f"{host}:{port}" for host, port in plan.udp_targets(i)]
        tcp = f"127.0.0.1:{5760 + 10 * i}"
        ports[name] = {"system_id": i + 1, "udp": udp, "tcp": tcp}
    _, quads, rovers, note = printed({**ports, "zenoh": "tcp/127.0.0.1:1"})
    assert quads == [
        *("quad1..quad50", "1..50"),
        *("127.0.0.1:14550,", "14540..14590", "127.0.0.1:5760..6250"),
    ]
    assert rovers[:2] == ["rover1..rover50", "51..100"]
    assert rovers[-1] == "127.0.0.1:6260..6750"
    assert note[-1] == "ports.json"


def test_what_does_not_count_up_is_no_range():
    def vehicle(system_id, **other):
        return {"system_id": system_id, "udp": [], "tcp": f"127.0.0.1:{5750 + system_id}", **other}

    ports = {
        **{f"a{i}": vehicle(i) for i in (1, 2, 4)},  # a number is missing
        "lead": vehicle(5),
        "b1": vehicle(6, connect="udpin:0.0.0.0:14600"),
        "b2": vehicle(7),
        **{f"c{i}": vehicle(i + (i > 9)) for i in (8, 9, 10, 11)},  # an id is missing
        **{f"d{i}": vehicle(i) for i in range(20, 40, 2)},
    }
    lines = printed(ports)[1:]
    assert [line[0] for line in lines[:-1]] == [
        *("a1..a2", "a4", "lead", "b1", "b2", "c8..c9", "c10..c11", "d20")
    ]
    assert lines[0] == ["a1..a2", "1..2", "-", "127.0.0.1:5751..5752"]
    assert " ".join(lines[-1]) == "and 9 more; each vehicle's own: ports.json"


def test_an_external_vehicle_is_listed_by_its_address():
    ports = {
        "quad1": {"system_id": 1, "connect": "tcp:127.0.0.1:5760", "udp": [], "tcp": None},
        "rover1": {"system_id": 2, "udp": ["127.0.0.1:14550"], "tcp": None},
    }
    assert printed(ports)[1] == ["quad1", "1", "external", "tcp:127.0.0.1:5760"]
