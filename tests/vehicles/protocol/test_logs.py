"""A vehicle without logs says so at once, instead of letting a client wait."""

from mavherd.transport.mavlink import mav
from mavherd.vehicles.protocol.logs import LogService


def test_a_list_of_no_logs_is_one_entry_that_says_so():
    service = LogService()
    request = mav.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF)
    (entry,) = service.handlers["LOG_REQUEST_LIST"](request)
    assert (entry.get_type(), entry.num_logs, entry.last_log_num) == ("LOG_ENTRY", 0, 0)
    assert (entry.id, entry.size, entry.time_utc) == (0, 0, 0)


def test_nothing_else_is_claimed_to_be_done():
    service = LogService()
    assert set(service.handlers) == {"LOG_REQUEST_LIST"}
