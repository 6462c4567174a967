"""The controller's gains, designed from the numbers in include/vehicles/.

model     the aircraft at hover, channel by channel
design    weights, Riccati equation, the four designs
loop      a channel as it runs: sampled, delayed, with lagging motors
margins   phase and gain margin
analysis  margins, steps, wind and noise of a design; corners: of aircraft that differ
report, header, figures, command: what comes out
"""

from strix.gains.command import run_gains

__all__ = ["run_gains"]
