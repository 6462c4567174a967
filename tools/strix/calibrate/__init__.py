"""`strix calibrate`: what a sensor adds to the truth, from a log made on the bench.

Each module turns readings into one result, which knows its words, its JSON, its figure and the
members of include/Calibration.h that it fills.
"""
