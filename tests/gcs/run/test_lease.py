"""Two runs at the same time do not send as the same systems to the same ports."""

import os
from contextlib import ExitStack

import pytest

from mavherd.gcs.run import lease
from mavherd.gcs.run.lease import leased
from mavherd.gcs.run.ports import PortPlan
from mavherd.transport.errors import LinkError

OURS = 1_000_000 * os.getpid()  # far above every port: no run on this machine has or wants it


@pytest.fixture(autouse=True)
def _private(monkeypatch):
    monkeypatch.setattr(lease, "GCS_UDP", OURS + 20)
    monkeypatch.setattr(lease, "API_UDP", OURS + 10)


def test_the_first_has_the_standard_ports_and_the_next_others():
    with leased(PortPlan()) as first, leased(PortPlan(tcp=0)) as second:
        assert first == PortPlan()
        assert second == PortPlan(gcs_udp=OURS + 1020, api_udp=OURS + 1010, tcp=0)
        with leased(PortPlan(gcs_udp=5)) as third:
            assert third == PortPlan(gcs_udp=5, api_udp=OURS + 2010)


def test_ports_are_free_again_when_a_run_has_ended():
    for _ in range(2):
        with leased(PortPlan()) as plan:
            assert plan == PortPlan()


def test_what_was_set_by_hand_stays():
    by_hand = PortPlan(gcs_udp=14550, api_udp=0)
    with leased(by_hand) as one, leased(by_hand) as other:
        assert one == other == by_hand


def test_when_there_are_none_left_it_says_so():
    with ExitStack() as stack:
        plans = [stack.enter_context(leased(PortPlan())) for _ in range(18)]
        assert len({plan.gcs_udp for plan in plans}) == 18
        with pytest.raises(LinkError, match="set --gcs-udp and --api-udp"):
            stack.enter_context(leased(PortPlan()))
