"""Signals reach a script between two ticks, never within one."""

import os
import signal

import pytest

from mavherd.gcs.script.signals import Signals, Terminated


@pytest.fixture(autouse=True)
def _nobody_heeds_signals():
    """Have the handlers of a Python that was started from a terminal, whoever has started this."""
    usual = {signal.SIGINT: signal.default_int_handler}
    usual |= dict.fromkeys((signal.SIGTERM, signal.SIGHUP), signal.SIG_DFL)
    before = {signum: signal.signal(signum, handler) for signum, handler in usual.items()}
    yield
    for signum, handler in before.items():
        signal.signal(signum, handler)


@pytest.fixture
def signals():
    signals = Signals()
    signals.install()
    yield signals
    signals.remove()


def send(signum):
    os.kill(os.getpid(), signum)


@pytest.mark.parametrize(
    ("signum", "error", "code"),
    [
        (signal.SIGINT, KeyboardInterrupt, None),
        (signal.SIGTERM, Terminated, 143),
        (signal.SIGHUP, Terminated, 129),
    ],
)
def test_a_signal_is_kept_until_the_tick_is_whole(signals, signum, error, code):
    done = []
    with pytest.raises(error) as caught:  # noqa: PT012 - where it is raised is what is tested
        with signals.guard():
            send(signum)
            done.append("the tick")
        done.append("more")
    assert done == ["the tick"]
    assert getattr(caught.value, "code", None) == code
    with signals.guard():  # once
        pass


def test_outside_of_a_tick_it_comes_at_once(signals):
    with pytest.raises(KeyboardInterrupt):
        send(signal.SIGINT)


def test_a_tick_that_does_not_end_is_given_up(signals, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr("mavherd.gcs.script.signals.time.monotonic", lambda: clock[0])
    with pytest.raises(KeyboardInterrupt), signals.guard():  # noqa: PT012 - as above
        send(signal.SIGINT)
        assert not signals.interrupted()
        clock[0] += 1.5
        assert signals.interrupted()


def test_handlers_of_others_are_left_alone():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append("mine"))
    try:
        signals = Signals()
        signals.install()
        send(signal.SIGTERM)
        signals.remove()
        send(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == ["mine", "mine"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
