"""The flights of a campaign: thirty of them, and what single faults have to lead to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from strix.campaign import fly_campaign
from strix.campaign.flight import Result, fly_one
from strix.campaign.plan import ARM_AT_S, MISSIONS, Draw, draw
from strix.plant.faults import Fault

SEED = 1
COUNT = 30
IDLING_REV_S = 20.0  # armed rotors turn with 40 and more
IN_HOVER_S = ARM_AT_S + 9.0  # at 3 m, since about 2 s


def of_kind(kind: str, words: str = "") -> Draw:
    """The first draw of this fault that is described so."""
    draws = (draw(SEED, i, [kind]) for i in range(200))
    return next(d for d in draws if words in d.fault()[1])


def in_hover(drawn: Draw, mission: str = "hover") -> Draw:
    return replace(drawn, mission=mission, at_s=IN_HOVER_S)


def flown(drawn: Draw, mission: str) -> Result:
    """With the fault in hover, or on the way; it has to end well."""
    result, _ = fly_one(in_hover(drawn, mission))
    assert result.failures == []
    return result


def test_thirty_flights_with_a_fault_each_end_well(tmp_path: Path) -> None:
    campaign = fly_campaign("all", COUNT, SEED, tmp_path)
    assert len({flight.fault for flight in campaign.flights}) == COUNT
    failed = [(f.index, f.fault, f.detail, f.failures) for f in campaign.flights if not f.passes]
    assert failed == []
    assert campaign.passes


@pytest.mark.parametrize("mission", MISSIONS)
def test_a_flight_without_a_fault_passes_and_takes_as_long_as_the_plan_thinks(
    mission: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Draw, "fault", lambda self: (Fault(self.at_s), "none"))
    calm = replace(draw(SEED, 0, ["kill"]).surroundings, wind_mean_ned_m_s=(0.0, 0.0, 0.0))
    result, track = fly_one(replace(draw(SEED, 0, ["kill"]), mission=mission, surroundings=calm))
    assert result.flew
    assert result.failures == []
    assert result.reaction is None
    turning_s = track.time_s[track.rotor_speed.max(axis=1) > IDLING_REV_S]
    # Rather too long than too short: a fault after the landing meets nobody.
    assert turning_s[-1] - ARM_AT_S == pytest.approx(MISSIONS[mission], abs=3.0)


def test_a_restart_in_flight_comes_back_disarmed_although_the_arm_switch_is_still_on() -> None:
    drawn = in_hover(of_kind("brown-out"))
    result, track = fly_one(drawn)
    assert result.flew
    assert result.failures == []
    later = track.time_s > drawn.at_s + 0.5  # twelve time constants of the motors
    assert track.rotor_speed[later].max() < IDLING_REV_S
    assert result.end_s > drawn.at_s + 3.0


@pytest.mark.parametrize("how", ["fails", "busy"])
def test_a_dead_card_sends_the_aircraft_home(how: str) -> None:
    result = flown(of_kind("card-death", how), "square")
    assert result.reaction == "log card failed: returning home"
    assert result.state == "SAFE"


@pytest.mark.parametrize("mission", ["hover", "sticks"])
@pytest.mark.parametrize(
    ("words", "within_s"),
    # At once with the next frame, or after RC_TIMEOUT; and 20 ms of looks of pilot and judge.
    [("says that it hears nothing for ever", 0.04), ("is silent for ever", 0.54)],
)
def test_a_transmitter_that_is_lost_for_ever_brings_the_aircraft_home(
    words: str, within_s: float, mission: str
) -> None:
    result = flown(of_kind("radio-loss", words), mission)
    assert result.reaction == "transmitter lost: returning home"
    assert result.reaction_s is not None
    assert result.reaction_s <= within_s
    assert result.state == "SAFE"


def test_a_lost_altimeter_leaves_a_pilot_who_can_land_by_his_sticks() -> None:
    result = flown(of_kind("alt-dropout", "for ever"), "sticks")
    assert result.contact_m_s is not None
    assert result.contact_m_s < 1.0  # he wants 0.4 m/s


def test_a_lost_rotor_ends_the_flight_and_its_fall_is_told() -> None:
    drawn = in_hover(of_kind("motor-loss"))
    result, track = fly_one(drawn)
    assert result.failures == []
    assert result.state == "SAFE"
    height_m = -float(np.interp(drawn.at_s, track.time_s, track.position_ned_m[:, 2]))
    assert result.contact_m_s is not None
    # At least as fast as from half the height: three rotors carry for a while.
    assert result.contact_m_s > (9.81 * height_m) ** 0.5
