"""What the vehicle itself writes is always true."""

from mavherd.vehicles.missions.items import Item


def test_totals_follow_the_lists(quad):
    p, missions = quad.vehicle.parameters, quad.vehicle.missions
    assert (p["MIS_TOTAL"], p["FENCE_TOTAL"], p["RALLY_TOTAL"]) == (0, 0, 0)
    item = Item(command=16, frame=3, x=473977000, y=85456000, z=10.0)
    missions.mission.replace([item, item])
    missions.rally.replace([item._replace(command=5100)])
    assert (p["MIS_TOTAL"], p["FENCE_TOTAL"], p["RALLY_TOTAL"]) == (3, 0, 1)  # home counts


def test_statistics_tell_time_and_boots(quad):
    quad.run(2.5)
    assert quad.vehicle.parameters["STAT_RUNTIME"] == 2
    assert quad.vehicle.parameters["STAT_BOOTCNT"] == 1
