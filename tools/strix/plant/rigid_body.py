"""One rigid body on four feet over level ground, integrated by MuJoCo.

Outside this module everything is NED and FRD; conversion happens here, with frames.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco

from strix.plant.frames import Quaternion, Vector, turn_quaternion, turn_vector
from strix.plant.vehicle import STANDARD_GRAVITY_M_S2, VehicleNumbers

# Longest integration step. With Runge-Kutta 4 and the wrench fixed to the turning body, 1 ms is
# exact to rounding in free flight; the contact's 20 ms is the fastest thing left to resolve.
MAX_STEP_US = 1000

# A foot below each motor, its lowest point this far below the centre of mass.
_FOOT_DROP_M = 0.06
_FOOT_RADIUS_M = 0.01

# solref: a contact closes critically damped in 20 ms, as plastic legs on grass do, so a landing
# does not bounce. Elliptic cones: MuJoCo's pyramids would grip differently at each heading.
# impratio: stiffer friction than normal force, so that a standing vehicle does not creep in wind.
_MODEL = """
<mujoco>
  <option integrator="RK4" cone="elliptic" impratio="100" gravity="0 0 -{gravity!r}">
    <flag sensor="disable" autoreset="disable"/>
  </option>
  <default><geom solref="0.02 1" friction="0.8 0.005 0.0001"/></default>
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1"/>
    <body name="vehicle" pos="0 0 {foot_drop!r}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="{inertia}"/>
      <site name="centre"/>
      <geom name="hull" type="box" size="{hull} 0.02"/>
      {feet}
    </body>
  </worldbody>
  <actuator>
    {wrench}
  </actuator>
</mujoco>
"""


def _model_xml(vehicle: VehicleNumbers) -> str:
    def numbers(values: Sequence[float]) -> str:
        return " ".join(repr(value) for value in values)

    feet = [
        turn_vector((rotor.x_m, rotor.y_m, _FOOT_DROP_M - _FOOT_RADIUS_M))
        for rotor in vehicle.rotors
    ]
    axes = [[1.0 if i == axis else 0.0 for i in range(6)] for axis in range(6)]
    return _MODEL.format(
        gravity=STANDARD_GRAVITY_M_S2,
        foot_drop=_FOOT_DROP_M,
        mass=vehicle.mass_kg,
        inertia=numbers(vehicle.inertia_kg_m2),
        # The hull only matters in a crash: upside down it keeps the vehicle above the ground.
        hull=numbers((max(foot[0] for foot in feet), max(foot[1] for foot in feet))),
        feet="".join(
            f'<geom type="sphere" size="{_FOOT_RADIUS_M!r}" pos="{numbers(foot)}"/>'
            for foot in feet
        ),
        # Force and torque along the body's axes at the centre of mass. As actuators on a site
        # they turn with the body within a Runge-Kutta step; as applied forces they would not.
        wrench="".join(f'<general site="centre" gear="{numbers(axis)}"/>' for axis in axes),
    )


class RigidBody:
    """Position is that of the centre of mass, relative to where it rests on the ground."""

    def __init__(self, vehicle: VehicleNumbers, q_body_to_ned: Quaternion) -> None:
        self._model = mujoco.MjModel.from_xml_string(_model_xml(vehicle))
        self._data = mujoco.MjData(self._model)
        self._step_us = 0
        self._rest_height_m = 0.0
        self.position_ned_m: Vector
        self.velocity_ned_m_s: Vector
        self.q_body_to_ned: Quaternion
        self.rate_body_rad_s: Vector
        self._settle(q_body_to_ned)

    def _settle(self, q_body_to_ned: Quaternion) -> None:
        """Let the feet sink to where they carry the weight, and call that height zero."""
        none = (0.0, 0.0, 0.0)
        self.place((0.0, 0.0, -_FOOT_DROP_M), none, q_body_to_ned, none)
        for _ in range(1000):  # 1 s, fifty times the contact's time constant
            self.advance(none, none, MAX_STEP_US)
        self._rest_height_m = -self.position_ned_m[2]
        self.place(none, none, q_body_to_ned, none)

    def place(
        self,
        position_ned_m: Vector,
        velocity_ned_m_s: Vector,
        q_body_to_ned: Quaternion,
        rate_body_rad_s: Vector,
    ) -> None:
        """Put the body somewhere, for example in the air."""
        x, y, z = turn_vector(position_ned_m)
        self._data.qpos[:] = (x, y, z + self._rest_height_m, *turn_quaternion(q_body_to_ned))
        self._data.qvel[:] = (*turn_vector(velocity_ned_m_s), *turn_vector(rate_body_rad_s))
        mujoco.mj_forward(self._model, self._data)
        self._read()

    def advance(self, force_body_n: Vector, torque_body_n_m: Vector, duration_us: int) -> None:
        """Integrate with a constant body-fixed wrench (FRD), for at most MAX_STEP_US."""
        if duration_us != self._step_us:
            self._step_us = duration_us
            self._model.opt.timestep = duration_us * 1e-6
        fx, fy, fz = turn_vector(force_body_n)
        tx, ty, tz = turn_vector(torque_body_n_m)
        self._data.ctrl[:] = (fx, fy, fz, tx, ty, tz)
        mujoco.mj_step(self._model, self._data)
        self._read()

    def _read(self) -> None:
        # A free joint's velocity: linear in the world's axes, angular in the body's.
        x, y, z, *q = self._data.qpos.tolist()
        vx, vy, vz, wx, wy, wz = self._data.qvel.tolist()
        if not math.isfinite(x + y + z + wx + wy + wz):
            raise FloatingPointError("the rigid body's integration diverged")
        self.position_ned_m = turn_vector((x, y, z - self._rest_height_m))
        self.q_body_to_ned = turn_quaternion((q[0], q[1], q[2], q[3]))
        self.velocity_ned_m_s = turn_vector((vx, vy, vz))
        self.rate_body_rad_s = turn_vector((wx, wy, wz))

    @property
    def on_ground(self) -> bool:
        return bool(self._data.ncon)
