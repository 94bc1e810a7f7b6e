"""What is wrong is said in one line, with exit code 2, before any process is left behind."""

import socket

import pytest

ROBOT = "{kind: rover, start: {east: %s, north: 0}, goto: {east: 5, north: 5}%s}"


def scenario(*robots, more=""):
    return "name: bad\nrobots:\n" + "".join(f"  - {r}\n" for r in robots) + more


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        pytest.param(scenario(ROBOT % (0, ""), more="durration: 9\n"), "durration", id="key"),
        pytest.param(scenario(ROBOT % ("[1]", "")), "east", id="type"),
        pytest.param(scenario(ROBOT % (".nan", "")), "east", id="nan"),
        pytest.param(scenario(ROBOT % (0, ", params: {mass: -1}")), "mass", id="negative mass"),
        pytest.param(
            scenario(ROBOT % (0, ", system_id: 7"), ROBOT % (9, ", system_id: 7")),
            "system_id",
            id="one id twice",
        ),
        pytest.param(
            scenario(ROBOT % (0, ""), ROBOT % (0.1, "")), "inside one another", id="one in another"
        ),
        pytest.param("name: [", "not YAML", id="no yaml"),
        pytest.param("\0\1\2", "character", id="binary"),
    ],
)
def test_a_scenario_that_cannot_be(sandbox, text, complaint):
    (sandbox.folder / "bad.yaml").write_text(text)
    done = sandbox.run("run", "bad.yaml")
    assert one_line(done).startswith("mavherd: bad.yaml:")
    assert complaint in done.err
    assert done.folder is None


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ("run missing.yaml", "missing.yaml"),
        ("run no-such-name", "no shipped scenario"),
        ("run one-rover --set team.law=nonsense", "nonsense"),
        ("run one-rover --set team.speed=3", "--set team.speed=3"),
        ("run one-rover --set duration", "key=value"),
        ("run one-rover --seed -1", "--seed"),
        ("run one-rover --seed x", "--seed"),
        ("run one-rover --speed fast", "--speed fast"),
        ("run one-rover --speed nan", "--speed nan"),
        ("run one-rover --speed 0", "--speed 0"),
        ("run one-rover --free-run --speed 2", "--speed"),
        ("run one-rover --free-run --lockstep", "--lockstep"),
        ("run one-rover --gcs-udp 70000", "'70000' is not a port"),
        ("run one-rover --tcp -1", "--tcp"),
        ("run one-rover --api-udp 65535 --set robots.rover1.system_id=2", "65536"),
        ("run one-rover --out /dev/null/runs", "/dev/null/runs"),
        ("check missing.yaml", "missing.yaml"),
        ("digest missing", "missing"),
        ("digest /dev/null", "/dev/null"),
        ("vehicle quadcopter --sysid 241 --tcp 0", "1..240"),
        ("vehicle quadcopter --sysid one", "--sysid"),
        ("vehicle quadcopter --instance -1", "--instance"),
        ("vehicle submarine", "submarine"),
        ("vehicle quadcopter --param mass=-1 --udpin 0", "mass"),
        ("vehicle quadcopter --param mass=nan --udpin 0", "mass"),
        ("vehicle quadcopter --param mas=1 --udpin 0", "did you mean 'mass'?"),
        ("vehicle quadcopter --param mass --udpin 0", "NAME=VALUE"),
        ("vehicle quadcopter --home 999,0,0,0 --udpin 0", "latitude"),
        ("vehicle quadcopter --home 1,2 --udpin 0", "--home"),
        ("vehicle quadcopter --position 1e300,0,0 --udpin 0", "--position"),
        ("vehicle quadcopter --position nan,0,0 --udpin 0", "--position"),
        ("vehicle quadcopter --speed 0 --udpin 0", "--speed"),
        ("vehicle quadcopter --udpin 127.0.0.1", "--udpin"),
        ("vehicle quadcopter --udpout 127.0.0.1:0", "udpout"),
        ("vehicle quadcopter --udpout no.such.host.invalid:14550", "no.such.host.invalid"),
        ("", "COMMAND"),
        ("fly", "fly"),
    ],
)
def test_an_argument_that_cannot_be(sandbox, arguments, complaint):
    quick = "env", "RES_OPTIONS=timeout:1 attempts:1"  # where names cannot be looked up
    done = sandbox.run(*(arguments.split() or [""]), prefix=quick)
    assert complaint in one_line(done)


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("run one-rover --in-process --no-record", 0),
        ("sweep one-rover --seeds 0:2", 0),
        ("run missing.yaml", 2),
        ("fly", 2),
        ("scenarios", 0),
    ],
)
def test_stderr_that_cannot_be_written_does_not_look_like_a_failed_assertion(
    sandbox, arguments, code
):
    full = "sh", "-c", 'exec "$@" 2>/dev/full', "full"
    assert sandbox.run(*arguments.split(), prefix=full).code == code


def test_a_port_that_is_taken(sandbox):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        for command in (("run", "one-rover", "--no-record"), ("vehicle", "rover")):
            done = sandbox.run(*command, "--tcp", port)
            assert f"{port}: Address already in use" in one_line(done)


def test_a_run_folder_that_cannot_be_written(sandbox):
    (sandbox.folder / "file").write_text("")
    done = sandbox.run("run", "one-rover", "--out", "file")
    assert "cannot write the run folder: Not a directory" in one_line(done)


def test_a_run_folder_that_there_is_no_room_for_is_not_left_behind(sandbox):
    done = sandbox.run("run", "one-rover", "--no-record", prefix=room_for(1))
    assert "cannot write the run folder: File too large" in one_line(done)
    assert done.folder is None


def test_a_disk_that_is_full_while_running(sandbox):
    done = sandbox.run("run", "one-rover", "--no-record", prefix=room_for(64))
    assert done.code == 3
    assert "rover1 (pid " in done.complaint
    assert "ended with exit code 3 at " in done.complaint
    assert "File too large" in (done.folder / "vehicles/rover1/log.txt").read_text()


@pytest.mark.parametrize("arguments", ["scenarios", "run one-rover --no-record --json"])
def test_stdout_that_is_full(sandbox, arguments):
    with open("/dev/full", "w") as full:  # noqa: PTH123 - not a file
        done = sandbox.run(*arguments.split(), stdout=full)
    assert done.code == 2
    assert done.complaint == "mavherd: standard output: No space left on device"


def test_a_reader_of_stdout_that_leaves_early_is_no_error(sandbox):
    shell = '"$@" | head -c 1; exit ${PIPESTATUS[0]}'
    done = sandbox.run("scenarios", prefix=("bash", "-c", shell, "shell"))
    assert (done.code, done.err) == (0, "")


def test_closed_standard_streams_are_no_error(sandbox):
    closed = "sh", "-c", 'exec "$@" <&- >&- 2>&-', "closed"
    done = sandbox.run("run", sandbox.scenario(), "--no-record", prefix=closed)
    assert (done.code, done.out, done.err) == (0, "", "")
    assert done.report["passed"]


def room_for(blocks):
    """Return what starts a command that may write so many blocks of 512 bytes into each file.

    None is byte code: Python leaves half a file where others look for a whole one.
    """
    limited = f'ulimit -f {blocks}; PYTHONDONTWRITEBYTECODE=1 exec "$@"'
    return "sh", "-c", limited, "limit"


def one_line(done):
    """Return the only line of complaint; a slow machine also says what it is at."""
    assert done.code == 2
    assert done.out == ""
    (line,) = (line for line in done.err.splitlines() if not line.endswith(" ..."))
    assert line.startswith("mavherd: ")
    return line
