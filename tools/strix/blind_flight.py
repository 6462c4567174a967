"""What flight without an IMU is worth: `python -m strix.blind_flight` makes docs/blind-flight.md's
table and figure.

In a hover the IMU falls silent for good, at a random time. Each flight is made twice: down on the
model of the aircraft, and with its motors off at once (BLIND_TIME 0).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from strix import _core
from strix.missions import parse_mission
from strix.plant import Plant, SensorSuite, Surroundings, Variation
from strix.plant.earth import MAGNETIC_DECLINATION_RAD
from strix.simulation import MAG_MOUNTING, STEP_US, Pilot, _deliver
from strix.vehicles import plant_numbers

VEHICLE = "Quad5in"
ARM_AT_S = 15.0  # GPS origin and calibration are done
SETTLED_S = 6.0  # hovers so long at the least before its IMU falls silent
SPREAD_S = 4.0
GIVE_UP_S = 20.0  # after that
RESTS_M_S = 0.2
HEIGHTS_M = (2.0, 5.0, 10.0)
WINDS_M_S = (0.0, 5.0)


@dataclass(frozen=True)
class Loss:
    """One flight: where it hovers, what blows, and what becomes of it."""

    height_m: float
    wind_m_s: float
    blind_s: float  # BLIND_TIME
    seed: int


@dataclass(frozen=True)
class Fall:
    """From the moment the IMU falls silent to the ground, by the truth."""

    loss: Loss
    contact_m_s: float  # speed at the first touch
    drift_m: float
    tilt_deg: float  # most in the air
    time_s: float
    track: tuple[tuple[float, float], ...]  # time s, height m


def fly(loss: Loss) -> Fall:
    """One flight from power-up to the ground."""
    rng = np.random.default_rng(loss.seed)
    variation = Variation(
        mass=rng.uniform(0.9, 1.1),
        rotor_strength=tuple(rng.uniform(0.95, 1.05, 4).tolist()),
        centre_of_mass_m=tuple(rng.uniform(-0.003, 0.003, 3).tolist()),
    )
    angle = rng.uniform(0.0, 2.0 * math.pi)
    wind = (loss.wind_m_s * math.cos(angle), loss.wind_m_s * math.sin(angle), 0.0)
    around = Surroundings(wind_mean_ned_m_s=wind, gusts=loss.wind_m_s > 0.0)
    climb_s = loss.height_m / 0.5 + 6.0  # the ramp's least speed on the way up, and the start
    silent_s = ARM_AT_S + climb_s + SETTLED_S + rng.uniform(0.0, SPREAD_S)
    text = f"takeoff {loss.height_m} 60\n"
    vehicle = variation.applied_to(plant_numbers(VEHICLE))
    plant = Plant(vehicle, around, rng.uniform(0.0, 2.0 * math.pi), loss.seed)
    sensors = SensorSuite(around, loss.seed, mag_mounting=MAG_MOUNTING)
    options = _core.FlightOptions(VEHICLE)
    options.set_parameter("BLIND_TIME", loss.blind_s)
    flight = _core.Flight(
        vehicle=VEHICLE,
        mission=parse_mission("hover", text, "hover").name,
        mission_text=text,
        declination_rad=MAGNETIC_DECLINATION_RAD,
        log_path="",
        boot_id=loss.seed,
        start_time_us=0,
        options=options,
    )
    pilot = Pilot(ARM_AT_S)
    commands = flight.loop(0)
    track: list[tuple[float, float]] = []
    start: tuple[float, float, float] | None = None
    most_tilt_rad = 0.0
    speed_m_s = 0.0
    while True:
        plant.step(commands, STEP_US)
        truth = plant.truth
        time_s = truth.time_us * 1e-6
        samples = sensors.sample(truth)
        silent = time_s >= silent_s
        _deliver(flight, replace(samples, imu=None) if silent else samples)
        commands = flight.loop(truth.time_us)
        arm, begin = pilot.switches(time_s, flight.state_name, flight.motors_on)
        flight.set_switches(arm=arm, start=begin, kill=False)
        if not silent:
            continue
        start = start or truth.position_ned_m
        if truth.on_ground or time_s > silent_s + GIVE_UP_S:
            break
        speed_m_s = math.hypot(*truth.velocity_ned_m_s)
        _, x, y, _ = truth.q_body_to_ned
        most_tilt_rad = max(most_tilt_rad, 2.0 * math.asin(min(1.0, math.hypot(x, y))))
        track.append((time_s - silent_s, -truth.position_ned_m[2]))
    flight.close()
    north, east, _ = truth.position_ned_m
    drift_m = math.hypot(north - start[0], east - start[1])
    return Fall(
        loss,
        speed_m_s if truth.on_ground else math.inf,
        drift_m,
        math.degrees(most_tilt_rad),
        time_s - silent_s,
        tuple(track[::10]),
    )


def table(falls: Sequence[Fall]) -> list[str]:
    """Markdown; each row a height and a wind."""
    lines = [
        "| hover | wind | | time to the ground | speed there: median, worst | tilt, worst "
        "| drift, worst |",
        "|---|---|---|---|---|---|---|",
    ]
    rows = sorted({(f.loss.height_m, f.loss.wind_m_s, f.loss.blind_s > 0.0) for f in falls})
    for height_m, wind_m_s, model in rows:
        some = [
            f
            for f in falls
            if (f.loss.height_m, f.loss.wind_m_s, f.loss.blind_s > 0.0)
            == (height_m, wind_m_s, model)
        ]
        speed = [f.contact_m_s for f in some]
        lines.append(
            f"| {height_m:g} m | {wind_m_s:g} m/s | {'on the model' if model else 'motors off'} "
            f"| {np.median([f.time_s for f in some]):.1f} s "
            f"| {np.median(speed):.1f}, {max(speed):.1f} m/s "
            f"| {max(f.tilt_deg for f in some):.0f} deg | {max(f.drift_m for f in some):.1f} m |"
        )
    return lines


def draw(falls: Sequence[Fall], path: Path) -> None:
    """Height over time, each flight a line."""
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axes = figure.subplots(1, len(HEIGHTS_M))
    for height_m, ax in zip(HEIGHTS_M, axes, strict=True):
        for fall in falls:
            if fall.loss.height_m != height_m:
                continue
            time_s, up_m = zip(*fall.track, strict=True)
            model = fall.loss.blind_s > 0.0
            ax.plot(time_s, up_m, color="#0072B2" if model else "#D55E00", linewidth=0.8, alpha=0.7)
        ax.set_xlabel("time since the IMU's last sample (s)", fontsize=8)
        ax.tick_params(labelsize=8)
        ax.grid(color="0.85", linewidth=0.5)
        ax.spines[["top", "right"]].set_visible(False)
        ax.set_ylim(bottom=0.0)
    axes[0].set_ylabel("height (m)", fontsize=8)
    figure.suptitle("Without an IMU: on the model (blue), motors off at once (orange)", fontsize=10)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="strix.blind_flight", description=__doc__)
    parser.add_argument("--figure", type=Path, default=Path("docs/figures/blind_flight.png"))
    parser.add_argument("--n", type=int, default=10, help="flights of each kind")
    parser.add_argument("--blind-time", type=float, default=6.0, help="BLIND_TIME, s")
    given = parser.parse_args(arguments)
    losses = [
        Loss(height_m, wind_m_s, blind_s, seed)
        for height_m in HEIGHTS_M
        for wind_m_s in WINDS_M_S
        for blind_s in (given.blind_time, 0.0)
        for seed in range(1, given.n + 1)
    ]
    with ProcessPoolExecutor() as pool:
        falls = list(pool.map(fly, losses))
    print("\n".join(table(falls)))
    draw(falls, given.figure)


if __name__ == "__main__":
    main()
