"""Runs are watched live and again, by viewers that come, go, freeze and die as they like."""

import os
import re
import signal
import subprocess
import urllib.request
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip("rerun")

import rerun as rr

from mavherd.gcs import Fleet
from mavherd.gcs.recording.served import proxy_url
from mavherd.gcs.recording.stream import Stream
from mavherd.gcs.recording.viewers import OTHER_BINARY, ViewerError, rerun_binary

NO_WINDOW = ("env", "-u", "DISPLAY", "-u", "WAYLAND_DISPLAY", "-u", "WAYLAND_SOCKET")
NOWHERE = (*NO_WINDOW, "DISPLAY=:98765")  # a display that is none
needs_graphics = pytest.mark.skipif(
    not list(Path("/usr/share/vulkan/icd.d").glob("*.json")),
    reason="a native viewer needs a graphics driver, such as mesa-vulkan-drivers",
)


def words_of(sandbox, kind="viewer"):
    """Return what the newest run's events of a kind say."""
    folder = sandbox.run_folder()
    log = folder / "events.jsonl" if folder else None
    text = log.read_text() if log and log.exists() else ""
    return re.findall(rf'"kind": "{kind}", "text": "(.*?)"', text)


def page_of(sandbox):
    """Wait until a page is served; return its URL and that of the data."""

    def served():
        return [text for text in words_of(sandbox) if "browser: " in text]

    (text,) = sandbox.wait_for(served, "the page")
    url = text.rpartition(" ")[2]
    return url, urllib.request.unquote(url.partition("?url=")[2])


def listeners(port):
    """Return the addresses, as the kernel writes them, at which somebody listens on a port."""
    rows = [
        line.split()
        for table in Path("/proc/net").glob("tcp*")  # tcp6 only where there is IPv6
        for line in table.read_text().splitlines()[1:]
    ]
    listening = [row[1].partition(":") for row in rows if row[3] == "0A"]
    return {address for address, _, at in listening if int(at, 16) == port}


def viewer_pid(sandbox, *words):
    """Return the process of a viewer, not of the shell that holds its leash."""

    def find():
        for pid, line in sandbox.processes().items():
            if line.startswith(str(rerun_binary())) and all(word in line for word in words):
                return pid
        return None

    return sandbox.wait_for(find, "a viewer")


@pytest.fixture(scope="module")
def unwatched(make_sandbox):
    """A run that nobody watched: what the others must equal, and what can be seen again."""
    sandbox = make_sandbox("unwatched")
    return sandbox.run("run", sandbox.scenario(far=6))


def watch(sandbox, *options, prefix=()):
    """Start a run that waits for `clock`: viewers come in their own time."""
    common = "--paused", "--speed=max", "--view-port=0"
    return sandbox.start("run", sandbox.scenario(far=6), *common, *options, prefix=prefix)


def clock(sandbox, *words):
    assert sandbox.start("clock", sandbox.run_folder(), *words).wait(60) == 0


def test_a_page_is_served_on_loopback_and_its_end_changes_nothing(sandbox, unwatched):
    process = watch(sandbox, "--web", "--web-port=0")
    url, source = page_of(sandbox)
    with sandbox.wait_for(lambda: opened(url), "an answer") as page:
        assert b"Rerun" in page.read()
    ports = [int(re.search(r":(\d+)/", address)[1]) for address in (url, source)]
    assert [listeners(port) for port in ports] == [{"0100007F"}] * 2
    os.kill(viewer_pid(sandbox, "--serve-web"), signal.SIGKILL)
    told = "the web server was killed by SIGKILL; the run goes on"
    sandbox.wait_for(lambda: told in words_of(sandbox), "a word of it")
    clock(sandbox, "resume")
    done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["digest"] == unwatched.report["digest"]
    assert not done.report["partial"]
    assert (done.folder / "run.rrd").stat().st_size > 1000


def opened(url):
    with suppress(OSError):
        return urllib.request.urlopen(url, timeout=5)
    return None


@pytest.fixture
def headless(tmp_path):
    """A prefix with which the native viewer comes up without a window."""
    script = tmp_path / "headless"
    script.write_text(f'#!/bin/sh\nexec "{rerun_binary()}" --headless --window-size 320x200 "$@"\n')
    script.chmod(0o755)
    return ("env", "DISPLAY=:0", f"{OTHER_BINARY}={script}")


@needs_graphics
def test_viewers_freeze_and_come_late_and_the_window_stays(sandbox, unwatched, headless):
    from rerun.experimental import ViewerClient

    process = watch(sandbox, "--view", "--no-record", prefix=headless)
    first = viewer_pid(sandbox, "--connect=")
    source = re.search(r"--connect=(\S+)", sandbox.processes()[first])[1]
    sandbox.wait_for(lambda: connected(first, source), "a connection")
    clock(sandbox, "step", 100)
    os.kill(first, signal.SIGSTOP)
    port = str(sandbox.free_port())
    options = "--headless", "--window-size", "320x200", "--bind", "127.0.0.1", "--port", port
    late = subprocess.Popen(
        [rerun_binary(), f"--connect={source}", *options], stderr=subprocess.DEVNULL
    )
    try:
        client = sandbox.wait_for(lambda: reach(ViewerClient, int(port)), "the late viewer")
        sandbox.wait_for(lambda: history(client) and history(client)[1] > 4.5, "what was before")
        assert history(client)[0] < 0.5
        clock(sandbox, "resume")
        process.wait(60)
        sandbox.wait_for(lambda: history(client)[1] > 8.0, "the end")
    finally:
        late.kill()
        late.wait()
    sandbox.wait_for(lambda: list(sandbox.processes()) == [first], "all but the user's to close")
    os.kill(first, signal.SIGKILL)
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all")
    done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["digest"] == unwatched.report["digest"]
    assert not list(done.folder.glob("run.rrd*"))


def reach(client, port):
    with suppress(RuntimeError, ConnectionError):
        found = client.connect(proxy_url(port))
        found.get_state()
        return found
    return None


def history(client):
    """Return from when to when a viewer has data, nothing while it has none."""
    lines = [line for r in client.get_state().recordings for line in r.timelines]
    return (lines[0].start * 1e-9, lines[0].end * 1e-9) if lines else ()


def connected(pid, source):
    """Return whether a process has a connection to what is served at `source`."""
    port = int(re.search(r":(\d+)/", source)[1])
    inodes = {
        line.split()[9]
        for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
        if line.split()[2].endswith(f":{port:04X}") and line.split()[3] == "01"
    }
    own = set()
    for fd in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # it opens and closes some meanwhile
            own.add(str(fd.readlink()))
    return any(f"socket:[{inode}]" in own for inode in inodes)


def test_a_viewer_that_cannot_come_up_is_told_and_the_run_goes_on(sandbox, unwatched):
    process = watch(sandbox, "--view", prefix=NOWHERE)
    sandbox.wait_for(lambda: words_of(sandbox), "a word of it")
    clock(sandbox, "resume")
    done = sandbox.finish(process)
    assert done.code == 0
    assert done.report["digest"] == unwatched.report["digest"]
    (told,) = words_of(sandbox)
    assert re.match("the viewer ended with exit code 1: .*X server.*; the run goes on", told)
    assert told in done.err.replace("\n", "")


def test_a_script_is_watched_like_a_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with (
        pytest.raises(ViewerError, match="no display"),
        Fleet.from_scenario("one-rover", view=True),
    ):
        pass
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setenv("DISPLAY", ":98765")  # a display that is none: the viewer dies
    told = "the viewer ended with exit code 1"
    with Fleet.from_scenario("one-rover", view=True, speed=20) as fleet:
        fleet.wait(lambda: any(told in event.text for event in fleet.events), timeout=1200)
        fleet["rover1"].arm()
        fleet["rover1"].goto(east=1, north=0)
    assert fleet.outcome.report["passed"]


def test_a_recording_is_served_until_it_is_enough(sandbox, unwatched):
    port = sandbox.free_port()
    command = "view", unwatched.folder, "--web", "--web-port", port
    process = sandbox.start(*command)
    url = f"http://127.0.0.1:{port}/"
    sandbox.wait_for(lambda: opened(url), "the page").close()
    data = re.search(r"--port (\d+)", sandbox.processes()[viewer_pid(sandbox)])[1]
    assert listeners(int(data)) == {"0100007F"}
    other = sandbox.start(*command)
    told = f"mavherd: --web-port {port}: the port is taken (give another, or 0 for any)\n"
    assert (other.communicate(), other.returncode) == (("", told), 2)
    process.send_signal(signal.SIGINT)
    done = sandbox.finish(process)
    assert (done.code, done.out) == (0, "")
    assert url in done.err


@needs_graphics
def test_a_picture_of_a_recording_that_breaks_off_is_taken(sandbox, unwatched, tmp_path):
    from PIL import Image

    run = tmp_path / "killed"
    run.mkdir()
    (run / "vehicles").mkdir()
    (run / "scenario.yaml").write_text((unwatched.folder / "scenario.yaml").read_text())
    whole = (unwatched.folder / "run.rrd").read_bytes()
    (run / "run.rrd.part").write_bytes(whole[: len(whole) * 2 // 3])
    picture = tmp_path / "picture.png"
    options = "--select", "quad1", "--size", "800x500", "--time", "3"
    done = sandbox.run("view", run, "--screenshot", picture, *options)
    assert done.code == 0
    assert f"note: {run}/run.rrd.part: this recording is partial, it breaks off" in done.err
    with Image.open(picture) as image:
        assert image.size == (800, 500)
        assert len(image.convert("RGB").getcolors(1 << 24)) > 100


@needs_graphics
def test_a_picture_of_something_else_is_refused(sandbox, unwatched, tmp_path):
    other = tmp_path / "other.rrd"
    stream = Stream("other", file=other)
    stream.log("events", 1.0, rr.TextLog("begin"))
    stream.close()
    script = tmp_path / "astray"
    options = r"""$(printf '%s\n' "$@" | grep -v '\.rrd$')"""
    script.write_text(f'#!/bin/sh\nexec "{rerun_binary()}" {options} {other}\n')
    script.chmod(0o755)
    command = "view", unwatched.folder, "--screenshot", tmp_path / "picture.png"
    done = sandbox.finish(sandbox.start(*command, prefix=("env", f"{OTHER_BINARY}={script}")))
    assert done.code == 2
    assert done.complaint == "mavherd: the viewer shows other, which is not asked for"
    assert not list(tmp_path.glob("*.png*"))


def test_what_the_terminal_closes_leaves_no_page_behind(sandbox, unwatched):
    process = sandbox.start("view", unwatched.folder, "--web", "--web-port", 0)
    viewer_pid(sandbox)
    process.kill()
    sandbox.wait_for(lambda: not sandbox.processes(), "the end of all")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ("run one-quad --in-process --view", "--view: with --in-process nothing is recorded"),
        ("run one-quad --view-port 7", "--view-port 7: nobody watches (add --view or --web)"),
        ("run one-quad --view --web-port 7", "--web-port 7: there is no page (add --web)"),
        ("run one-quad --view", "there is no display for a viewer's window"),
        ("view", "which run? give its folder (as `mavherd run` prints it)"),
        ("view nowhere", "nowhere: there is no such folder"),
        ("view nowhere.rrd", "nowhere.rrd: there is no such file"),
        ("view bare", "bare: the run left no recording (`mavherd convert bare` makes one"),
        ("view bare/text.rrd", "bare/text.rrd: this is no Rerun recording"),
        ("view void", "void/run.rrd.part: nothing was recorded (`mavherd convert void`"),
        ("view early", "early/run.rrd.part: nothing was recorded yet (`mavherd convert early`"),
        ("view early --screenshot p.png", "early/run.rrd.part: nothing was recorded yet"),
        ("view blank", "blank/run.rrd: nothing was recorded (`mavherd convert blank --force`"),
        ("view bare --screenshot p.jpg", "--screenshot p.jpg: pictures are PNG (name it .png)"),
        ("view bare --web-port 7", "--web-port 7: there is no page (add --web)"),
        ("view bare --size 9x9", "argument --size: '9x9' is no size"),
        ("view bare --listen udp:1", "RUN is not for vehicles that are live (leave it out)"),
    ],
)
def test_what_cannot_be_viewed_is_said_in_one_line(make_bare, options, complaint):
    done = make_bare.finish(make_bare.start(*options.split(), prefix=NO_WINDOW))
    assert done.code == 2
    assert done.complaint.removeprefix("mavherd: ").startswith(complaint)
    assert done.err.count("\n") == 1
    assert not (make_bare.folder / "runs").exists()


@pytest.fixture(scope="module")
def make_bare(make_sandbox, unwatched):
    """A folder with runs that have nothing to show."""
    sandbox = make_sandbox("bare")
    for name in ("bare", "void", "early", "blank"):
        (sandbox.folder / name / "vehicles").mkdir(parents=True)
        scenario = (unwatched.folder / "scenario.yaml").read_text()
        (sandbox.folder / name / "scenario.yaml").write_text(scenario)
    (sandbox.folder / "void/run.rrd.part").touch()
    (sandbox.folder / "blank/run.rrd").touch()
    stream = Stream("early", file=sandbox.folder / "early/whole")
    stream.name("early")
    stream.flush_file()  # its recorder was killed here
    killed = (sandbox.folder / "early/whole").read_bytes()
    (sandbox.folder / "early/run.rrd.part").write_bytes(killed)
    stream.close()
    (sandbox.folder / "bare/text.rrd").write_text("not a recording")
    return sandbox


def test_without_rerun_a_run_can_be_flown_and_one_line_says_what_to_install(sandbox):
    hidden = "import sys\nsys.modules['rerun'] = sys.modules['rerun_cli'] = None\n"
    (sandbox.folder / "sitecustomize.py").write_text(hidden)
    prefix = (*NOWHERE, f"PYTHONPATH={sandbox.folder}")
    scenario = sandbox.scenario()
    refused = sandbox.finish(sandbox.start("run", scenario, "--view", prefix=prefix))
    assert (refused.code, refused.folder) == (2, None)
    assert refused.complaint == (
        "mavherd: rerun is not installed, so there is no viewer: pip install 'mavherd[view]'"
    )
    flown = sandbox.finish(sandbox.start("run", scenario, prefix=prefix))
    assert flown.code == 0
    assert "mavherd[view]" in flown.err
    viewed = sandbox.finish(sandbox.start("view", flown.folder, prefix=prefix))
    assert viewed.code == 2
    assert "convert" in viewed.complaint


def test_at_a_terminal_the_page_can_be_loaded_again_until_enter(sandbox):
    master, slave = os.openpty()
    ends = {"stdin": slave, "stderr": slave}
    options = "--web", "--web-port=0", "--speed=max"
    process = sandbox.start("run", sandbox.scenario(), *options, **ends)
    os.close(slave)
    said = b""
    while b"still to be seen at" not in said or not said.endswith(b"\n"):
        said += os.read(master, 4096)
    url, source = page_of(sandbox)
    with sandbox.wait_for(lambda: opened(url), "an answer") as page:
        assert page.status == 200
    assert listeners(int(re.search(r":(\d+)/", source)[1]))
    assert (sandbox.run_folder() / "report.json").exists()
    os.write(master, b"\n")
    done = sandbox.finish(process)
    os.close(master)
    assert done.code == 0
