"""`strix identify`: a vehicle's numbers from logs, stands, scales and strings.

docs/identification.md says how to measure and from which equations the numbers come.
"""
