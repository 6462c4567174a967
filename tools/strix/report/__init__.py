"""The flight report: one HTML page, made from a log and, in simulation, the truth beside it."""

from strix.report.page import write_report

__all__ = ["write_report"]
