"""What telemetry looks like in print."""

from mavherd.gcs.script.values import Position, Velocity


def test_nothing_is_minus_zero():
    assert str(Position(-0.0, -0.004, -0.006)) == "east 0.00, north 0.00, up -0.01"
    assert str(Velocity(-1.0, -0.001, 0.0)) == "east -1.00, north 0.00, up 0.00"
