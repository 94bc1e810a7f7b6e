"""The magnetic field and the air are roughly those of the Earth."""

from math import atan2, degrees, hypot

import pytest

from mavherd.vehicles.earth import magnetic_field, pressure_hpa, temperature_celsius

# gauss (north, east, down) of the World Magnetic Model 2025, rounded
PLACES = {
    "Zurich": ((47.4, 8.5), (0.213, 0.011, 0.433)),
    "Canberra": ((-35.36, 149.17), (0.230, 0.050, -0.530)),
    "Boston": ((42.4, -71.1), (0.194, -0.050, 0.476)),
}


@pytest.mark.parametrize("place", PLACES)
def test_the_field_is_about_that_of_the_place(place):
    where, real = PLACES[place]
    field = magnetic_field(*where)
    strength = hypot(*field)
    assert strength == pytest.approx(hypot(*real), rel=0.25)
    declination = degrees(atan2(field.east, field.north) - atan2(real[1], real[0]))
    assert abs(declination) < 20
    inclination = degrees(atan2(field.down, hypot(*field[:2])) - atan2(real[2], hypot(*real[:2])))
    assert abs(inclination) < 10


def test_at_the_magnetic_pole_the_field_points_straight_down():
    field = magnetic_field(80.8, -72.8)
    assert hypot(field.north, field.east) == pytest.approx(0, abs=1e-9)
    assert field.down == pytest.approx(2 * 0.297)


def test_the_field_of_a_dipole_turns_round_with_the_place():
    north, south = magnetic_field(47.4, 8.5), magnetic_field(-47.4, 8.5 - 180)
    assert south.down == pytest.approx(-north.down)
    assert hypot(*south) == pytest.approx(hypot(*north))


@pytest.mark.parametrize(
    ("altitude", "hpa", "celsius"),
    [(0, 1013.25, 15.0), (1000, 898.75, 8.5), (5000, 540.2, -17.5), (-500, 1074.8, 18.25)],
)
def test_the_air_is_the_standard_atmosphere(altitude, hpa, celsius):
    assert pressure_hpa(altitude) == pytest.approx(hpa, rel=1e-3)
    assert temperature_celsius(altitude) == pytest.approx(celsius, abs=0.01)


def test_beyond_the_air_there_is_no_pressure():
    assert pressure_hpa(1e6) == 0.0
