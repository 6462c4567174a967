"""The Earth under the sensors: position, air and field against independent figures."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from strix.plant.earth import (
    HOME_ALTITUDE_M,
    HOME_LATITUDE_DEG,
    HOME_LONGITUDE_DEG,
    MAGNETIC_DECLINATION_RAD,
    MAGNETIC_FIELD_NED_UT,
    geodetic_from_ned,
    pressure_pa,
    temperature_degc,
)


def earth_centred(latitude_deg: float, longitude_deg: float, altitude_m: float) -> np.ndarray:
    """WGS-84 geodetic to Earth-centred coordinates, exact, in metres."""
    a, b = 6378137.0, 6356752.314245
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    n = a * a / math.hypot(a * math.cos(latitude), b * math.sin(latitude))
    return np.array(
        [
            (n + altitude_m) * math.cos(latitude) * math.cos(longitude),
            (n + altitude_m) * math.cos(latitude) * math.sin(longitude),
            (n * (b / a) ** 2 + altitude_m) * math.sin(latitude),
        ]
    )


def ned_from_geodetic(latitude_deg: float, longitude_deg: float, altitude_m: float) -> np.ndarray:
    home = (HOME_LATITUDE_DEG, HOME_LONGITUDE_DEG, HOME_ALTITUDE_M)
    latitude, longitude = math.radians(home[0]), math.radians(home[1])
    sl, cl, so, co = (
        math.sin(latitude),
        math.cos(latitude),
        math.sin(longitude),
        math.cos(longitude),
    )
    to_ned = np.array([[-sl * co, -sl * so, cl], [-so, co, 0.0], [-cl * co, -cl * so, -sl]])
    offset = earth_centred(latitude_deg, longitude_deg, altitude_m) - earth_centred(*home)
    return np.asarray(to_ned @ offset)


metres = st.floats(-100.0, 100.0)


@given(st.tuples(metres, metres, metres))
def test_geodetic_coordinates_lead_back_to_the_place(place: tuple[float, float, float]) -> None:
    # 100 m away the meridians converge by n e tan(lat) / R = 2 mm, the plane leaves the
    # ellipsoid by r^2 / 2R = 1.6 mm, and 100 m of height scale the rest by h / R = 1.6 mm.
    np.testing.assert_allclose(ned_from_geodetic(*geodetic_from_ned(place)), place, atol=6e-3)


def test_north_is_a_larger_latitude_east_a_larger_longitude_up_a_larger_altitude() -> None:
    home = geodetic_from_ned((0.0, 0.0, 0.0))
    assert home == (HOME_LATITUDE_DEG, HOME_LONGITUDE_DEG, HOME_ALTITUDE_M)
    there = geodetic_from_ned((1.0, 1.0, -1.0))
    assert all(b > a for a, b in zip(home, there, strict=True))


@pytest.mark.parametrize(
    ("altitude_m", "pressure", "temperature"),
    # ISO 2533, table 1 (geopotential altitude).
    [(0, 101325.0, 15.0), (1000, 89874.6, 8.5), (5000, 54019.9, -17.5), (11000, 22632.0, -56.5)],
)
def test_the_atmosphere_is_the_standard_one(
    altitude_m: float, pressure: float, temperature: float
) -> None:
    assert pressure_pa(altitude_m) == pytest.approx(pressure, abs=0.1)
    assert temperature_degc(altitude_m) == pytest.approx(temperature, abs=1e-9)


def test_the_field_points_east_of_north_and_steeply_down() -> None:
    north, east, down = MAGNETIC_FIELD_NED_UT
    assert math.atan2(east, north) == pytest.approx(MAGNETIC_DECLINATION_RAD, abs=1e-12)
    # World Magnetic Model 2025 at 52 N 13 E, 40 m, 2026.0: D 4.918 deg, I 67.673 deg, F 49.906 uT;
    # the constants are rounded to 0.01.
    assert math.degrees(MAGNETIC_DECLINATION_RAD) == pytest.approx(4.918, abs=0.005)
    inclination = math.atan2(down, math.hypot(north, east))
    assert math.degrees(inclination) == pytest.approx(67.673, abs=0.01)
    assert math.hypot(north, east, down) == pytest.approx(49.906, abs=0.01)
