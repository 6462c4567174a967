"""The pilot of a campaign's flight: he arms, starts the mission, and lets go when it is over; or
flies by his sticks what he sees.
"""

from __future__ import annotations

import math
from collections import deque

from strix import _core
from strix.plant import Truth

START_AFTER_S = 2.0  # from arming to the start of the mission
RETRY_S = 2.0  # arming was refused
# Motors that went off have to stay off although the arm switch is still on: for so long.
HOLDS_ON_S = 3.0
REFUSED_S = 20.0  # of trying to arm: then he gives up, and nothing has flown
FRAME_S = 0.02  # of a receiver
LOOK_S = 0.01  # between two calls of look()

# As ChannelMap.h has them.
_CHANNELS = 10
_ROLL, _PITCH, _THROTTLE, _ARM, _KILL, _MODE, _START = 0, 1, 2, 4, 5, 6, 7
_LOW, _MIDDLE, _HIGH = 1000, 1500, 2000  # us


class StickHands:
    """Up, stay for a while, down: whatever the sticks mean. In position hold they are velocities;
    in altitude hold, which is left without GPS, angles and a velocity; in attitude mode, which is
    left without altimeter, angles and a thrust. One law flies all; the gains are ours, for 0.15 s
    of eye and hand.
    """

    HEIGHT_M = 3.0
    STAYS_S = 12.0
    _CLIMB_M_S, _SINK_M_S = 0.5, 0.4
    _REACTION = round(0.15 / LOOK_S)  # looks
    _PER_M, _PER_M_S, _MOST = 0.25, 0.4, 0.6  # of a stick's way
    _UP_PER_M, _UP_PER_M_S, _UP_MOST = 0.8, 0.5, 0.6
    _DOWN_S = 1.0  # on the ground until he disarms

    def __init__(self) -> None:
        self._seen: deque[Truth] = deque(maxlen=self._REACTION)
        self._wanted_m = 0.0
        self._arrived_s: float | None = None
        self._down_s: float | None = None
        self.landed = False

    def steer(self, truth: Truth, time_s: float) -> tuple[float, float, float]:
        """Forward, right and up, -1 to 1."""
        self._seen.append(truth)
        seen = self._seen[0]
        w, x, y, z = seen.q_body_to_ned
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        north, east = (
            -self._PER_M * seen.position_ned_m[i] - self._PER_M_S * seen.velocity_ned_m_s[i]
            for i in (0, 1)
        )
        forward = math.cos(yaw) * north + math.sin(yaw) * east
        right = math.cos(yaw) * east - math.sin(yaw) * north
        return _within(forward, self._MOST), _within(right, self._MOST), self._up(seen, time_s)

    def _up(self, seen: Truth, time_s: float) -> float:
        up_m, climbs_m_s = -seen.position_ned_m[2], -seen.velocity_ned_m_s[2]
        if self._arrived_s is None and up_m > 0.9 * self.HEIGHT_M:
            self._arrived_s = time_s
        wanted_m_s = 0.0
        if self._arrived_s is not None and time_s >= self._arrived_s + self.STAYS_S:
            wanted_m_s = -self._SINK_M_S
            if seen.on_ground:
                self._down_s = time_s if self._down_s is None else self._down_s
                self.landed = time_s >= self._down_s + self._DOWN_S
                return -1.0
            self._down_s = None
        elif self._wanted_m < self.HEIGHT_M:
            wanted_m_s = self._CLIMB_M_S
        self._wanted_m += wanted_m_s * LOOK_S
        return _within(
            self._UP_PER_M * (self._wanted_m - up_m) + self._UP_PER_M_S * (wanted_m_s - climbs_m_s),
            self._UP_MOST,
        )


class Pilot:
    """Looks a hundred times a second. Switches on wires, or a transmitter."""

    def __init__(self, arm_at_s: float, by_radio: bool, by_sticks: bool) -> None:
        self._arm_at_s = self._try_at_s = arm_at_s
        self._by_radio = by_radio or by_sticks
        self._hands = StickHands() if by_sticks else None
        self._armed_s: float | None = None  # the switch is on since then
        self._was_on = False
        self._off_s: float | None = None
        self._next_frame_s = 0.0
        self.kill = False
        self.radio_silent = self.radio_failsafe = False
        self.flew = False
        self.rearmed = False  # motors came on again after the flight, without an edge
        self.done = False

    def look(self, flight: _core.Flight, truth: Truth) -> None:
        """Moves switches, or sends a frame."""
        time_s = truth.time_us * 1e-6
        self._decide(time_s, flight.state_name, flight.motors_on)
        arm = self._armed_s is not None
        start = self._armed_s is not None and time_s >= self._armed_s + START_AFTER_S
        pulses = [_MIDDLE] * _CHANNELS
        pulses[_THROTTLE] = _LOW
        if self._hands is None:
            pulses[_MODE] = _HIGH  # the mission
        elif start and not self._hands.landed:
            forward, right, up = self._hands.steer(truth, time_s)
            pulses[_PITCH], pulses[_ROLL] = _stick(forward), _stick(right)
            pulses[_THROTTLE] = _stick(up)
        elif self._hands.landed:
            arm = False
        for channel, on in (
            (_ARM, arm),
            (_START, start and self._hands is None),
            (_KILL, self.kill),
        ):
            pulses[channel] = _HIGH if on else _LOW
        if not self._by_radio:
            flight.set_switches(arm=arm, start=start, kill=self.kill)
        elif time_s >= self._next_frame_s:
            self._next_frame_s = time_s + FRAME_S - 0.5 * LOOK_S
            if not self.radio_silent:
                flight.put_radio(pulses)
            elif self.radio_failsafe:
                flight.put_radio(pulses, failsafe=True)

    def _decide(self, time_s: float, state: str, motors_on: bool) -> None:
        if motors_on:
            self.flew = self.flew or state not in ("IDLE", "ARMED")
            self.rearmed = self.rearmed or self._off_s is not None
            self._was_on = True
        elif self._was_on and self._off_s is None:
            self._off_s = time_s
        if self._off_s is not None:
            if time_s >= self._off_s + HOLDS_ON_S:
                self._armed_s = None
                self.done = True
        elif self._armed_s is None:
            if time_s >= self._arm_at_s + REFUSED_S:
                self.done = True
            elif time_s >= self._try_at_s:
                self._armed_s = time_s
        elif not motors_on and time_s >= self._armed_s + 0.5:  # refused
            self._armed_s = None
            self._try_at_s = time_s + RETRY_S


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)


def _stick(share: float) -> int:
    return round(_MIDDLE + share * (_HIGH - _MIDDLE))
