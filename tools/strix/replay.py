"""A flight over again on the laptop: the logged inputs through the same flight software.

With nothing changed every control tick must have the hash that the aircraft logged. With another
tuning, filter or gain it shows what would have been estimated and commanded - not what would have
been flown, as the aircraft's motion stays the logged one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from strix import _core
from strix.errors import BadInput

ALIASES = {"nav.tilt_noise": "nav.tilt.density"}
STATES = (9, 18)
GAIN_ROWS, GAIN_COLUMNS = 4, 12


@dataclass(frozen=True)
class Replayed:
    """What a replay found; times in s of the log."""

    begin_s: float
    end_s: float
    log_end_s: float
    ticks: int  # control ticks compared
    first_difference_s: float | None
    field: str  # in which that tick differs first
    stopped_at_gap: bool  # the log lost inputs from there on
    changed: tuple[str, ...]  # what was not flown so

    @property
    def same(self) -> bool:
        """Every tick compared had the logged hash."""
        return self.first_difference_s is None and self.ticks > 0

    def to_dict(self) -> dict[str, Any]:
        """By name, as --json prints it."""
        return {**asdict(self), "same": self.same}

    def sentences(self) -> list[str]:
        """What it means."""
        said = [f"{self.ticks} control ticks, {self.begin_s:.3f} to {self.end_s:.3f} s"]
        if self.stopped_at_gap:
            said.append(
                f"stopped at {self.end_s:.3f} s of {self.log_end_s:.3f} s: "
                "the log has lost inputs after it"
            )
        if self.first_difference_s is not None:
            said.append(f"first differs at {self.first_difference_s:.6f} s, in {self.field}")
        else:
            said.append("every tick is the logged one, bit for bit")
        return said


def replay(
    path: Path,
    sets: Sequence[str] = (),
    states: int = 18,
    gains: Path | None = None,
    out: Path | None = None,
    stop_at_difference: bool = False,
) -> Replayed:
    """Replay a log.

    `sets` are changes of the navigation, "nav.gpsPositionSigma=2"; `gains` is a header as
    `strix gains` writes it; `out` takes the replay's own log.
    """
    if states not in STATES:
        raise BadInput(f"--states: expected 9 or 18, found {states}")
    if out is not None and out.exists() and out.samefile(path):
        raise BadInput(f"{out}: expected another file than the log that is replayed, found it")
    try:
        log = _core.FlightLogReader(str(path))
        navigation = _core.replayNavigation(log)
        for change in sets:
            _set(navigation, change)
        found = _core.replay(
            log,
            navigation=navigation,
            states=states,
            gains=None if gains is None else read_gains(gains),
            out="" if out is None else str(out),
            compare=stop_at_difference,
        )
    except ValueError as error:  # std::invalid_argument
        raise BadInput(str(error)) from None
    changed = list(sets)
    if states != 18:
        changed.append(f"states={states}")
    if gains is not None:
        changed.append(f"gains={gains}")
    return Replayed(
        begin_s=found.begin * 1e-6,
        end_s=found.end * 1e-6,
        log_end_s=found.logEnd * 1e-6,
        ticks=found.ticks,
        first_difference_s=found.firstBad * 1e-6 if found.differences else None,
        field=found.field,
        stopped_at_gap=found.gap,
        changed=tuple(changed),
    )


def read_gains(path: Path) -> list[list[float]]:
    """The flown design of a gain header, its first: four rows of twelve gains, that of the lag and
    that of the integral.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{path}: expected a gain header, found: {error.strerror}") from None
    first = re.search(r"constexpr Gains \w+\{(.*?)\};", text, re.DOTALL)
    body = "" if first is None else first[1]
    numbers = [float(n) for n in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?=F)", body)]
    per_row = GAIN_COLUMNS + 2
    if len(numbers) != GAIN_ROWS * per_row:
        raise BadInput(
            f"{path}: expected {GAIN_ROWS} rows of {GAIN_COLUMNS} gains, of the lag and of the "
            f"integrals, {GAIN_ROWS * per_row} numbers, found {len(numbers)}"
        )
    lag, integral = numbers[-2 * GAIN_ROWS : -GAIN_ROWS], numbers[-GAIN_ROWS:]
    return [
        [*numbers[GAIN_COLUMNS * row : GAIN_COLUMNS * (row + 1)], lag[row], integral[row]]
        for row in range(GAIN_ROWS)
    ]


def _set(navigation: _core.NavigationConfig, change: str) -> None:
    """Apply 'nav.tilt.density=0.8'. Names as in NavigationConfig.h; case and _ do not matter."""
    name, equals, text = (part.strip() for part in change.partition("="))
    parts = ALIASES.get(name, name).split(".")
    if not equals or parts[0] != "nav" or len(parts) < 2:
        raise BadInput(f"--set: expected nav.NAME=VALUE, found {change!r}")
    target: Any = navigation
    owners: list[tuple[Any, str]] = []
    for part in parts[1:]:
        owners.append((target, _field(target, part, change)))
        target = getattr(*owners[-1])
    value: Any = _value(target, text, change)
    for owner, field in reversed(owners):  # a part of it is a copy: it goes back into its owner
        setattr(owner, field, value)
        value = owner


def _field(owner: object, wanted: str, change: str) -> str:
    fields = [name for name in dir(owner) if not name.startswith("_")]
    plain = wanted.replace("_", "").lower()
    for field in fields:
        if field.lower() == plain:
            return field
    raise BadInput(f"--set: expected one of {', '.join(fields)}, found {wanted!r} in {change!r}")


def _value(now: object, text: str, change: str) -> object:
    """The text as a value of the kind that is there now."""
    kind = type(now)
    try:
        if kind is bool:
            return {"true": True, "false": False, "1": True, "0": False}[text.lower()]
        if kind in (int, float):
            return kind(float(text))
        names = {name for name in dir(kind) if name[:1].isupper()}
        if text in names:
            return getattr(kind, text)
        expected = f"one of {', '.join(sorted(names))}"
    except (KeyError, ValueError):
        expected = "true or false" if kind is bool else "a number"
    raise BadInput(f"--set: expected {expected}, found {text!r} in {change!r}")
