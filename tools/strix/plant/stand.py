"""The attitude stand: the vehicle on a gimbal that lets it turn every way and go nowhere."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stand:
    """The pivot is at the IMU. Numbers are ours: no figure is published; rings have no mass.

    Coulomb: a shielded and greased 8 mm ball bearing starts to turn at about 0.001 N m. Viscous:
    its grease, small beside the controller's damping, so that a push does not ring on for ever
    with motors off.
    """

    centre_below_pivot_m: float = 0.002  # of mass; negative: the vehicle is upright on its head
    coulomb_n_m: float = 0.001  # about each axis
    viscous_n_m_s: float = 0.001
