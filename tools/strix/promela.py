"""`strix promela`: the state machine as a model for Spin, with what is to be proven of it.

The model is made from the compiled table. In each control tick whoever sets the conditions - the
world, in Promela's terms - may set any of the 2^n sets there are: the sets of a state are cubes
(strix.state_table), and one of them is chosen. Only what the properties speak of is remembered from
tick to tick: the arm switch as a level, the kill, and one hazard that has come to stay.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from strix.errors import BadInput
from strix.state_table import Cube, Row, State, cubes, hazards_of, rows, states

# What comes with time in every flight: home, the ground, the end of blind flight.
IN_TIME = ("Arrived", "TouchDown", "BlindOver")
# Ticks in which it need not come: the proof is the same for any number, this one shows it.
PATIENCE = 3
# Ways in which people take a flight over that a hazard was ending.
TAKEN_OVER = ("SticksEdge", "HoldAsked")

# `done`: a tick is over. What holds within one, between two assignments, is not meant.
PROPERTIES = {
    "lands": "[] (endangered -> <> (state == SAFE || state == LAND))",
    "motors_off": "[] (endangered -> <> !motors)",
    "failsafe_ends_in_safe": "[] ((done && failsafe_before) -> state != IDLE)",
    "no_arming_by_power_up": "[] (state == ARMED -> seen_off)",
    "no_flight_by_power_up": "[] (flying -> seen_off)",
    "arming_is_an_edge": "[] ((done && state == ARMED && before != ARMED) -> edge)",
    "kill": "[] ((done && kill && motors_before) -> state == SAFE)",
    "killed_stays_off": "[] ((done && kill) -> !motors)",
    "disarm": "[] ((done && !on && motors_before && before != MOTOR_TEST) -> !motors)",
    "safe_is_left_by_an_edge": (
        "[] ((done && before == SAFE && state != SAFE) -> (state == ARMED && edge))"
    ),
}


def write_model(out: Path) -> Path:
    try:
        out.write_text(model(rows(), states()), encoding="utf-8")
    except OSError as error:
        raise BadInput(
            f"--out {out}: expected a file that can be written, found: {error.strerror}"
        ) from None
    return out


def model(table: Sequence[Row], known: Sequence[State]) -> str:
    hazards = hazards_of(table)
    tracked = [*hazards, "ArmEdge", "Disarm", "Failsafe", *TAKEN_OVER, *IN_TIME]
    if len(tracked) > 31:
        raise BadInput(f"the state machine: expected 31 conditions to track, found {len(tracked)}")
    return "\n".join([*_head(table, known, hazards, tracked), *_tick(table, known, tracked), ""])


def _head(
    table: Sequence[Row], known: Sequence[State], hazards: Sequence[str], tracked: Sequence[str]
) -> Iterator[str]:
    yield "/* Made by `strix promela` from the compiled state machine: do not edit. */"
    yield ""
    for number, state in enumerate(known):
        yield f"#define {state.name} {number}"
    yield ""
    for place, name in enumerate(tracked):
        yield f"#define {_bit(name)} {1 << place}"
    warns = [
        name
        for name in hazards
        if not any(name in row.when and "MANUAL" in row.from_states for row in table)
    ]
    yield ""
    yield "byte state = BOOT, before = BOOT;  /* after and before the last tick */"
    yield "bool failsafe, failsafe_before;"
    yield "bool done;         /* the last tick is over */"
    yield "bool on;           /* the arm switch */"
    yield "bool was = 1;      /* ... as the flight software saw it last: on, before it looked */"
    yield "bool seen_off;     /* since power-up */"
    yield "bool edge;"
    yield "bool kill;"
    yield "int held;          /* the hazard that has come to stay; 0: none yet */"
    yield "byte waited;       /* ticks since */"
    yield "bool hands;        /* people may take over a flight that a hazard ends */"
    yield "int yes, no;       /* conditions that must hold, and must not, in this tick */"
    yield ""
    yield f"#define motors ({_is_in('state', [s.name for s in known if s.motors])})"
    yield f"#define motors_before ({_is_in('before', [s.name for s in known if s.motors])})"
    yield f"#define flying ({_is_in('state', [s.name for s in known if s.flying])})"
    yield "/* By hand the pilot is warned of these and decides himself. */"
    yield f"#define WARNS ({' | '.join(map(_bit, warns)) or '0'})"
    yield (
        "#define endangered (flying && held != 0 && !hands && "
        "!(state == MANUAL && (held & WARNS) != 0))"
    )
    yield ""
    for name, formula in PROPERTIES.items():
        yield f"ltl {name} {{ {formula} }}"


def _tick(table: Sequence[Row], known: Sequence[State], tracked: Sequence[str]) -> Iterator[str]:
    hazards = hazards_of(table)
    over = " | ".join(map(_bit, TAKEN_OVER))
    yield ""
    yield "active proctype aircraft() {"
    yield "  if :: on = 0 :: on = 1 fi;  /* at power-up */"
    yield "  do"
    yield "  :: atomic {"
    yield "    done = 0;"
    yield "    if :: on = 1 - on :: skip fi;"
    yield "    if :: kill = 1 - kill :: skip fi;"
    yield "    if"
    yield "    :: held == 0 ->"
    yield "      if"
    for name in hazards:
        yield f"      :: held = {_bit(name)}"
    yield "      :: skip"
    yield "      fi;"
    yield "      if :: hands = 0 :: hands = 1 fi"
    yield f"    :: held != 0 && waited < {PATIENCE} -> waited++"
    yield f"    :: held != 0 && waited == {PATIENCE}"
    yield "    fi;"
    yield "    yes = held; no = 0;"
    yield "    /* Others may disarm at any time. */"
    yield (
        "    if :: !on && (was || (motors && state != MOTOR_TEST)) -> "
        f"yes = yes | {_bit('Disarm')} :: else fi;"
    )
    yield "    edge = on && !was;"
    yield "    was = on;"
    yield "    seen_off = seen_off || !on;"
    for flag, name in (("edge", "ArmEdge"), ("failsafe", "Failsafe")):
        yield f"    if :: {flag} -> yes = yes | {_bit(name)} :: else -> no = no | {_bit(name)} fi;"
    yield f"    if :: kill -> yes = yes | {_bit('Kill')}"
    yield f"    :: else -> if :: held != {_bit('Kill')} -> no = no | {_bit('Kill')} :: else fi fi;"
    yield f"    if :: held != 0 && !hands -> no = no | {over} :: else fi;"
    yield f"    if :: waited == {PATIENCE} -> yes = yes | {' | '.join(map(_bit, IN_TIME))}"
    yield "    :: else fi;"
    yield "    before = state; failsafe_before = failsafe;"
    yield "    if"
    for state in known:
        yield f"    :: before == {state.name} ->"
        yield "      if"
        yield from _options(table, known, state, frozenset(tracked))
        yield "      fi"
    yield "    fi;"
    yield "    yes = 0; no = 0; done = 1"
    yield "  }"
    yield "  od"
    yield "}"


def _options(
    table: Sequence[Row], known: Sequence[State], state: State, tracked: frozenset[str]
) -> Iterator[str]:
    """One choice of the world for each way that a tick can go, as far as it is remembered."""
    keeps = {s.name for s in known if s.keeps_failsafe}
    options: dict[str, list[int]] = {}
    for cube in cubes(table, state.name):
        guard = _guard(cube, tracked)
        if cube.row is None:
            options.setdefault(f"{guard}skip", [])
            continue
        row = table[cube.row]
        effect = [f"state = {row.to}"]
        if row.failsafe:
            effect.append("failsafe = 1")
        elif row.to not in keeps:
            effect.append("failsafe = 0")
        options.setdefault(guard + "; ".join(effect), []).append(cube.row + 1)
    for option, numbers in options.items():
        rows_of = ", ".join(map(str, sorted(set(numbers))))
        yield f"      :: {option}" + (f"  /* row {rows_of} */" if numbers else "")


def _guard(cube: Cube, tracked: frozenset[str]) -> str:
    parts = [
        f"({value} & ({' | '.join(_bit(name) for name in sorted(names & tracked))})) == 0"
        for value, names in (("yes", cube.none_of), ("no", cube.all_of))
        if names & tracked
    ]
    return f"{' && '.join(parts)} -> " if parts else ""


def _bit(condition: str) -> str:
    return f"c_{condition}"


def _is_in(variable: str, names: Sequence[str]) -> str:
    return " || ".join(f"{variable} == {name}" for name in names)
