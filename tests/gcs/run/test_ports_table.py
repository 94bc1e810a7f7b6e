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
    _, quads, others, rovers, note = printed({**ports, "zenoh": "tcp/127.0.0.1:1"})
    assert quads == [
        *("quad1..quad10", "1..10"),
        *("127.0.0.1:14550,", "14540..14549", "127.0.0.1:5760..5850"),
    ]
    assert others == [  # 14550 is stepped over
        *("quad11..quad50", "11..50"),
        *("127.0.0.1:14550,", "14551..14590", "127.0.0.1:5860..6250"),
    ]
    assert rovers[:2] == ["rover1..rover50", "51..100"]
    assert rovers[-1] == "127.0.0.1:6260..6750"
    assert " ".join(note) == "TCP ports in a range are 10 apart; each vehicle's own: ports.json"


def test_a_port_that_is_out_of_line_ends_a_range():
    places = [(f"h:{14540 + i}", f"h:{5760 + 10 * i}") for i in range(9)]
    places[3] = "h:14543", "h:40012"  # the standard one was taken
    places[7] = "g:14547", "h:5830"
    ports = {
        f"a{i}": {"system_id": i, "udp": ["h:14550", udp], "tcp": tcp}
        for i, (udp, tcp) in enumerate(places)
    }
    assert [(line[0], line[3:]) for line in printed(ports)[1:-1]] == [
        ("a0..a2", ["14540..14542", "h:5760..5780"]),
        ("a3", ["h:14543", "h:40012"]),
        ("a4..a6", ["14544..14546", "h:5800..5820"]),
        ("a7", ["g:14547", "h:5830"]),
        ("a8", ["h:14548", "h:5840"]),
    ]


def test_a_range_either_has_one_port_or_counts_up():
    udp = [7, 7, 7, 8, 9, 10, 10, 10, 10]
    ports = {
        f"a{i}": {"system_id": i, "udp": [f"h:{port}"], "tcp": None} for i, port in enumerate(udp)
    }
    lines = printed(ports)[1:]
    assert [(line[0], line[2]) for line in lines[:-1]] == [
        *(("a0..a2", "h:7"), ("a3..a5", "h:8..10"), ("a6..a8", "h:10"))
    ]
    assert " ".join(lines[-1]) == "each vehicle's own: ports.json"


def test_what_does_not_count_up_is_no_range():
    def vehicle(system_id, **other):
        tcp = f"127.0.0.1:{5750 + 10 * system_id}"
        return {"system_id": system_id, "udp": [], "tcp": tcp, **other}

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
    assert lines[0] == ["a1..a2", "1..2", "-", "127.0.0.1:5760..5770"]
    assert " ".join(lines[-1]) == (
        "and 9 more; TCP ports in a range are 10 apart; each vehicle's own: ports.json"
    )


def test_an_external_vehicle_is_listed_by_its_address():
    ports = {
        "quad1": {"system_id": 1, "connect": "tcp:127.0.0.1:5760", "udp": [], "tcp": None},
        "rover1": {"system_id": 2, "udp": ["127.0.0.1:14550"], "tcp": None},
    }
    assert printed(ports)[1] == ["quad1", "1", "external", "tcp:127.0.0.1:5760"]
