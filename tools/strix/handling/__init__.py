"""How the aircraft handles: step responses, hover and wind as flown, and a Monte Carlo."""

from strix.handling.run import print_handling, print_replay, replay_robust, run_handling

__all__ = ["print_handling", "print_replay", "replay_robust", "run_handling"]
