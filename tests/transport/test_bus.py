"""Sessions of one run hear one another through the router, and no one hangs at the end."""

import subprocess
import sys
import threading
import time

import pytest

from mavherd.transport import bus as bus_module
from mavherd.transport.bus import Bus
from mavherd.transport.errors import LinkError
from mavherd.transport.questions import MAX_WAITING

PATIENCE = 60.0
LEASE_MS = 60_000


def until(condition):
    """Wait for the network; return what `condition` came to."""
    deadline = time.monotonic() + PATIENCE
    while not (result := condition()) and time.monotonic() < deadline:
        time.sleep(0.005)
    return result


@pytest.fixture(autouse=True)
def _long_lease(monkeypatch):
    """Let nobody be given up for having stood still."""
    monkeypatch.setattr(bus_module, "LEASE_MS", LEASE_MS)


@pytest.fixture
def endpoint(hold_port):
    return f"tcp/127.0.0.1:{hold_port()}"


@pytest.fixture
def router(endpoint):
    with Bus.router(endpoint, "run1") as bus:
        yield bus


@pytest.fixture
def client(router, endpoint):
    with Bus.client(endpoint, "run1") as bus:
        yield bus


def test_a_client_hears_the_router_and_another_client(router, client, endpoint):
    with Bus.client(endpoint, "run1") as other:
        box = client.latest("vehicle/*/state")
        for bus, name in ((router, "a"), (other, "b")):
            publisher = bus.publisher(f"vehicle/{name}/state")
            assert until(lambda publisher=publisher: publisher.wanted)
            publisher.put(name.encode())
        assert until(lambda: box.received == 2)
        assert box.latest == {"vehicle/a/state": b"a", "vehicle/b/state": b"b"}
        assert box.arrived.is_set()


def test_a_mailbox_keeps_the_newest_and_a_queue_keeps_all_in_order(router, client):
    box, queue = client.latest("clock"), client.queue("clock")
    publisher = router.publisher("clock")
    assert until(lambda: publisher.wanted)
    sent = [str(i).encode() for i in range(200)]
    for payload in sent:
        publisher.put(payload)
    assert until(lambda: queue.received == box.received == 200)
    assert box.latest == {"clock": sent[-1]}
    assert list(queue.drain()) == [("clock", payload) for payload in sent]
    assert list(queue.drain()) == []


def test_a_full_queue_lets_the_oldest_go(router, client):
    queue = client.queue("clock", size=10)
    publisher = router.publisher("clock")
    assert until(lambda: publisher.wanted)
    for i in range(50):
        publisher.put(bytes([i]))
    assert until(lambda: queue.received == 50)
    assert [payload[0] for _, payload in queue.drain()] == list(range(40, 50))


def test_a_publisher_knows_whether_anybody_listens(router, client):
    publisher = router.publisher("events")
    assert not publisher.wanted
    box = client.latest("events")
    assert until(lambda: publisher.wanted)
    client.close()
    assert until(lambda: not publisher.wanted)
    assert box.received == 0


def test_runs_on_one_router_do_not_hear_one_another(router, client, endpoint):
    with Bus.client(endpoint, "run2") as stranger:
        foreign, own = stranger.latest("**"), client.latest("**")
        publisher = router.publisher("clock")
        assert until(lambda: publisher.wanted)
        publisher.put(b"1")
        assert until(lambda: own.received == 1)
        assert foreign.received == 0


def test_tokens_tell_presence_also_to_those_who_come_late(router, client, endpoint):
    token = client.declare_token("vehicle/a/alive")
    with Bus.client(endpoint, "run1") as late:
        box = late.watch_tokens("vehicle/*/alive")
        assert until(lambda: box.latest == {"vehicle/a/alive": b"1"})
        token.undeclare()
        assert until(lambda: box.latest == {"vehicle/a/alive": b""})


def test_a_token_ends_with_its_session(router, client, endpoint):
    box = router.watch_tokens("vehicle/*/alive")
    with Bus.client(endpoint, "run1") as short_lived:
        short_lived.declare_token("vehicle/b/alive")
        assert until(lambda: box.latest.get("vehicle/b/alive") == b"1")
    assert until(lambda: box.latest.get("vehicle/b/alive") == b"")


def test_a_taken_port_is_a_link_error_that_names_it(router, endpoint):
    with pytest.raises(LinkError, match=f"cannot listen on {endpoint}"):
        Bus.router(endpoint, "run1")


def test_an_absent_router_is_a_link_error_that_names_it_and_no_source_lines(endpoint):
    with pytest.raises(LinkError) as caught:
        Bus.client(endpoint, "run1")
    assert f"no Zenoh router at {endpoint}" in str(caught.value)
    assert ".rs:" not in str(caught.value)


def test_closing_twice_is_harmless(endpoint):
    bus = Bus.router(endpoint, "run1")
    bus.close()
    bus.close()
    with Bus.router(endpoint, "run1"):
        pass  # the port is free again


def test_the_newest_sample_is_there_when_it_is_wanted(router, client):
    newest, publisher = client.newest("team"), router.publisher("team")
    assert newest.get() is None
    assert until(lambda: publisher.wanted)
    for payload in (b"1", b"2", b"3"):
        publisher.put(payload)
    assert until(lambda: newest.get() == b"3")
    assert newest.get() == b"3"  # as long as there is no newer one


@pytest.fixture
def clerk(router):
    """Somebody who repeats what he is asked, but not what is rude."""
    questions, over = router.questions("clock/command"), threading.Event()

    def serve():
        while not over.wait(0.002):
            for question in questions.drain():
                if question.text.startswith("rude"):
                    question.refuse(f"not {question.text!r}")
                else:
                    question.answer(question.text)

    thread = threading.Thread(target=serve)
    thread.start()
    yield questions
    over.set()
    thread.join()


@pytest.mark.usefixtures("clerk")
def test_a_question_is_answered_or_refused(client, endpoint):
    assert client.ask("clock/command", "pause", PATIENCE) == (True, "pause")
    assert client.ask("clock/command", "rude", PATIENCE) == (False, "not 'rude'")
    assert client.ask("clock/command", "y" * 10_000, PATIENCE) == (True, "y" * 200)
    with Bus.client(endpoint, "*") as stranger:  # who does not know the name of the run
        assert stranger.ask("clock/command", "step", PATIENCE) == (True, "step")


def test_where_nobody_answers_there_is_no_answer(router, client):
    assert client.ask("clock/command", "pause", PATIENCE) is None
    questions = router.questions("clock/command")
    assert client.ask("clock/command", "step", 0.05) is None
    assert until(lambda: [q.text for q in questions.drain()]) == ["step"]


def test_no_more_than_so_many_questions_wait(router, client):
    questions, last = router.questions("clock/command"), router.questions("last")
    asking = [
        threading.Thread(target=client.ask, args=("clock/command", str(n), 0.5)) for n in range(40)
    ]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    client.ask("last", "", 0.05)
    assert until(lambda: list(last.drain()))  # what was asked before has come as well
    assert [len(list(questions.drain())) for _ in range(2)] == [MAX_WAITING, 0]


FORGETFUL = f"""
import sys, time
from mavherd.transport import bus
bus.LEASE_MS = {LEASE_MS}
bus = bus.Bus.client(sys.argv[1], "run1")
queue = bus.queue("**")
tokens = bus.watch_tokens("**")
token = bus.declare_token("vehicle/a/alive")
while queue.received < 100:
    time.sleep(0.01)
print("end of main", flush=True)
"""


def test_processes_that_close_nothing_still_end_while_samples_arrive(router, endpoint):
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", FORGETFUL, endpoint],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(4)
    ]
    publisher = router.publisher("clock")
    try:
        while any(process.poll() is None for process in processes):
            publisher.put(bytes(100))
            time.sleep(0.0005)
        outputs = [process.communicate(timeout=PATIENCE) for process in processes]
    finally:
        for process in processes:
            process.kill()
    assert outputs == [("end of main\n", "")] * 4
    assert {process.returncode for process in processes} == {0}
