"""Where the flights take place, and the Earth there: shape, atmosphere, magnetic field."""

from __future__ import annotations

import math

from strix.plant.frames import Vector

# A field in Brandenburg; the point where a vehicle stands before take-off.
HOME_LATITUDE_DEG = 52.0
HOME_LONGITUDE_DEG = 13.0
HOME_ALTITUDE_M = 40.0  # above mean sea level

# World Magnetic Model 2025 there, at the start of 2026: 18.96 uT horizontally, 4.92 deg east of
# true north, 46.16 uT down (inclination 67.7 deg).
MAGNETIC_DECLINATION_RAD = math.radians(4.92)
MAGNETIC_FIELD_NED_UT: Vector = (
    18.96 * math.cos(MAGNETIC_DECLINATION_RAD),
    18.96 * math.sin(MAGNETIC_DECLINATION_RAD),
    46.16,
)

# WGS-84 ellipsoid.
_SEMI_MAJOR_AXIS_M = 6378137.0
_FLATTENING = 1.0 / 298.257223563


def _radii_of_curvature(latitude_rad: float) -> tuple[float, float]:
    """Meridian M = a (1 - e^2) / s^3 and prime vertical N = a / s, s^2 = 1 - e^2 sin^2(lat)."""
    eccentricity_squared = _FLATTENING * (2.0 - _FLATTENING)
    s = math.sqrt(1.0 - eccentricity_squared * math.sin(latitude_rad) ** 2)
    return _SEMI_MAJOR_AXIS_M * (1.0 - eccentricity_squared) / s**3, _SEMI_MAJOR_AXIS_M / s


_MERIDIAN_M, _PRIME_VERTICAL_M = _radii_of_curvature(math.radians(HOME_LATITUDE_DEG))
_NORTH_M_PER_DEG = math.radians(1.0) * (_MERIDIAN_M + HOME_ALTITUDE_M)
_EAST_M_PER_DEG = (
    math.radians(1.0)
    * (_PRIME_VERTICAL_M + HOME_ALTITUDE_M)
    * math.cos(math.radians(HOME_LATITUDE_DEG))
)


def geodetic_from_ned(position_ned_m: Vector) -> tuple[float, float, float]:
    """Latitude and longitude (deg) and altitude (m) of a point near home.

    The radii are those at home: 1 km away this is off by less than 0.3 m, at 100 m by 3 mm.
    """
    return (
        HOME_LATITUDE_DEG + position_ned_m[0] / _NORTH_M_PER_DEG,
        HOME_LONGITUDE_DEG + position_ned_m[1] / _EAST_M_PER_DEG,
        HOME_ALTITUDE_M - position_ned_m[2],
    )


# International Standard Atmosphere (ISO 2533), troposphere.
_SEA_LEVEL_PRESSURE_PA = 101325.0
_SEA_LEVEL_TEMPERATURE_K = 288.15
_LAPSE_RATE_K_M = 0.0065
_EXPONENT = 9.80665 / (287.05287 * _LAPSE_RATE_K_M)  # g / (R L), R in J/(kg K)


def temperature_degc(altitude_m: float) -> float:
    return _SEA_LEVEL_TEMPERATURE_K - _LAPSE_RATE_K_M * altitude_m - 273.15


def pressure_pa(altitude_m: float) -> float:
    """p0 (1 - L h / T0)^(g / (R L)); about -12 Pa a metre."""
    ratio = 1.0 - _LAPSE_RATE_K_M * altitude_m / _SEA_LEVEL_TEMPERATURE_K
    return _SEA_LEVEL_PRESSURE_PA * float(ratio**_EXPONENT)
