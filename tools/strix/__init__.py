"""Strix: simulator, replay, report, calibration and gains of the quadcopter."""
