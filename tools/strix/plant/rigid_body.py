"""One rigid body, on four feet over level ground or on a gimbal, integrated by MuJoCo.

Outside this module everything is NED and FRD; conversion happens here, with frames.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco

from strix.plant.frames import ZERO, Quaternion, Vector, turn_quaternion, turn_vector
from strix.plant.stand import Stand
from strix.plant.vehicle import STANDARD_GRAVITY_M_S2, VehicleNumbers

# Longest integration step. With Runge-Kutta 4 and the wrench fixed to the turning body, 1 ms is
# exact to rounding in free flight; the contact's 20 ms is the fastest thing left to resolve.
MAX_STEP_US = 1000

# A foot below each motor, its lowest point this far below the frame's centre.
_FOOT_DROP_M = 0.06
_FOOT_RADIUS_M = 0.01

# The body's origin is the frame's centre, where the IMU is; the centre of mass may be elsewhere.
# The wrench acts at the origin along the body's axes: as actuators on a site, force and torque
# turn with the body within a Runge-Kutta step; as applied forces they would not.
_MODEL = """
<mujoco>
  <option integrator="RK4" {contact} gravity="0 0 -{gravity!r}">
    <flag sensor="disable" autoreset="disable"/>
  </option>
  <default><geom solref="0.02 1" friction="0.8 0.005 0.0001"/></default>
  <worldbody>
    {ground}
    <body name="vehicle" pos="0 0 {height!r}">
      {joint}
      <inertial pos="{centre_of_mass}" mass="{mass!r}" diaginertia="{inertia}"/>
      <site name="centre"/>
      {geoms}
    </body>
  </worldbody>
  <actuator>
    {wrench}
  </actuator>
</mujoco>
"""

# solref: a contact closes critically damped in 20 ms, as plastic legs on grass do, so a landing
# does not bounce. Elliptic cones: MuJoCo's pyramids would grip differently at each heading.
# impratio: stiffer friction than normal force, so that a standing vehicle does not creep in wind.
_CONTACT = 'cone="elliptic" impratio="100"'
_GROUND = '<geom name="ground" type="plane" size="0 0 1"/>'

# solimpfriction: MuJoCo's dry friction is soft and creeps; so stiff, 1e-4 of what it did.
_GIMBAL = (
    '<joint type="ball" frictionloss="{coulomb!r}" damping="{viscous!r}" '
    'solimpfriction="0.9999 0.9999 0.001"/>'
)


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(value) for value in values)


def _model(
    vehicle: VehicleNumbers,
    joint: str,
    centre_of_mass_m: Vector,
    *,
    contact: str = "",
    ground: str = "",
    height_m: float = 0.0,
    geoms: str = "",
) -> mujoco.MjModel:
    axes = [[1.0 if i == axis else 0.0 for i in range(6)] for axis in range(6)]
    return mujoco.MjModel.from_xml_string(
        _MODEL.format(
            contact=contact,
            gravity=STANDARD_GRAVITY_M_S2,
            ground=ground,
            height=height_m,
            joint=joint,
            centre_of_mass=_numbers(turn_vector(centre_of_mass_m)),
            mass=vehicle.mass_kg,
            inertia=_numbers(vehicle.inertia_kg_m2),
            geoms=geoms,
            wrench="".join(f'<general site="centre" gear="{_numbers(axis)}"/>' for axis in axes),
        )
    )


def _feet_and_hull(vehicle: VehicleNumbers) -> str:
    feet = [
        turn_vector((rotor.x_m, rotor.y_m, _FOOT_DROP_M - _FOOT_RADIUS_M))
        for rotor in vehicle.rotors
    ]
    # The hull only matters in a crash: upside down it keeps the vehicle above the ground.
    hull = _numbers((max(foot[0] for foot in feet), max(foot[1] for foot in feet)))
    return f'<geom name="hull" type="box" size="{hull} 0.02"/>' + "".join(
        f'<geom type="sphere" size="{_FOOT_RADIUS_M!r}" pos="{_numbers(foot)}"/>' for foot in feet
    )


class _Body:
    """What both bodies have: MuJoCo's model, and a wrench that moves it."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._data = mujoco.MjData(model)
        self._step_us = 0
        self.position_ned_m: Vector = ZERO
        self.velocity_ned_m_s: Vector = ZERO
        self.q_body_to_ned: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.rate_body_rad_s: Vector = ZERO

    def advance(self, force_body_n: Vector, torque_body_n_m: Vector, duration_us: int) -> None:
        """Integrate with a constant wrench at the frame's centre (FRD), at most MAX_STEP_US."""
        if duration_us != self._step_us:
            self._step_us = duration_us
            self._model.opt.timestep = duration_us * 1e-6
        fx, fy, fz = turn_vector(force_body_n)
        tx, ty, tz = turn_vector(torque_body_n_m)
        self._data.ctrl[:] = (fx, fy, fz, tx, ty, tz)
        mujoco.mj_step(self._model, self._data)
        self._read()

    def _read(self) -> None:
        raise NotImplementedError

    @property
    def on_ground(self) -> bool:
        return bool(self._data.ncon)


class RigidBody(_Body):
    """Free. Position is that of the frame's centre, relative to where it rests on the ground."""

    def __init__(self, vehicle: VehicleNumbers, q_body_to_ned: Quaternion) -> None:
        super().__init__(
            _model(
                vehicle,
                "<freejoint/>",
                vehicle.centre_of_mass_m,
                contact=_CONTACT,
                ground=_GROUND,
                height_m=_FOOT_DROP_M,
                geoms=_feet_and_hull(vehicle),
            )
        )
        self._rest_height_m = 0.0
        self._settle(q_body_to_ned)

    def _settle(self, q_body_to_ned: Quaternion) -> None:
        """Let the feet sink to where they carry the weight, and call that height zero."""
        self.place((0.0, 0.0, -_FOOT_DROP_M), ZERO, q_body_to_ned, ZERO)
        for _ in range(1000):  # 1 s, fifty times the contact's time constant
            self.advance(ZERO, ZERO, MAX_STEP_US)
        self._rest_height_m = -self.position_ned_m[2]
        self.place(ZERO, ZERO, q_body_to_ned, ZERO)

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


class GimballedBody(_Body):
    """On a stand, with its IMU at the pivot: position and velocity are zero for ever."""

    def __init__(self, vehicle: VehicleNumbers, q_body_to_ned: Quaternion, stand: Stand) -> None:
        x, y, z = vehicle.centre_of_mass_m
        joint = _GIMBAL.format(coulomb=stand.coulomb_n_m, viscous=stand.viscous_n_m_s)
        super().__init__(_model(vehicle, joint, (x, y, z + stand.centre_below_pivot_m)))
        self.place(ZERO, ZERO, q_body_to_ned, ZERO)

    def place(
        self,
        position_ned_m: Vector,
        velocity_ned_m_s: Vector,
        q_body_to_ned: Quaternion,
        rate_body_rad_s: Vector,
    ) -> None:
        """Turn the body."""
        if any(position_ned_m) or any(velocity_ned_m_s):
            raise ValueError(
                "a vehicle on the stand stays at (0, 0, 0), at rest; "
                f"found {position_ned_m} m, {velocity_ned_m_s} m/s"
            )
        self._data.qpos[:] = turn_quaternion(q_body_to_ned)
        self._data.qvel[:] = turn_vector(rate_body_rad_s)
        mujoco.mj_forward(self._model, self._data)
        self._read()

    def _read(self) -> None:
        w, x, y, z = self._data.qpos.tolist()
        wx, wy, wz = self._data.qvel.tolist()
        if not math.isfinite(w + wx + wy + wz):
            raise FloatingPointError("the rigid body's integration diverged")
        self.q_body_to_ned = turn_quaternion((w, x, y, z))
        self.rate_body_rad_s = turn_vector((wx, wy, wz))
