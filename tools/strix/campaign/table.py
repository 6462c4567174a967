"""A campaign as a table for eyes, and as a file for spreadsheets."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from rich.console import Console
from rich.table import Table

from strix.campaign.flight import MOST_BEYOND_M, MOST_CONTACT_M_S, Result
from strix.campaign.kinds import KINDS
from strix.campaign.run import Campaign

WORST = 10
NOT_JUDGED = "fall not judged"
CRITERIA = (
    f"Every flight has to end with its motors off, on the ground, in time, and to stay disarmed. "
    f"While the motors work none leaves the fence by more than {MOST_BEYOND_M:g} m or hits the "
    f"ground with more than {MOST_CONTACT_M_S:g} m/s. Faults that cut the motors by what they are "
    f"({', '.join(kind.name for kind in KINDS.values() if kind.cuts_motors)}) are told, and their "
    f"fall is not judged."
)


@dataclass(frozen=True)
class Row:
    """All flights of one fault."""

    fault: str
    flights: int
    passed: int
    contact_m_s: float | None  # the hardest
    beyond_m: float  # the furthest; negative: inside
    judged: bool


def rows(flights: Sequence[Result]) -> list[Row]:
    """In the order of the faults."""
    found = []
    for name, kind in KINDS.items():
        of_kind = [flight for flight in flights if flight.fault == name]
        if not of_kind:
            continue
        contacts = [f.contact_m_s for f in of_kind if f.contact_m_s is not None]
        found.append(
            Row(
                name,
                len(of_kind),
                sum(flight.passes for flight in of_kind),
                max(contacts, default=None),
                max(flight.beyond_m for flight in of_kind),
                not kind.cuts_motors,
            )
        )
    return found


def by_badness(flights: Sequence[Result]) -> list[Result]:
    """Worst first: what failed, then what came nearest to a limit."""

    def key(flight: Result) -> tuple[int, float, int]:
        contact = (flight.contact_m_s or 0.0) / MOST_CONTACT_M_S
        beyond = flight.beyond_m / MOST_BEYOND_M
        judged = not KINDS[flight.fault].cuts_motors
        near = max(contact, beyond) if judged else 0.0
        return -len(flight.failures), -near, flight.index

    return sorted(flights, key=key)


def command(campaign: Campaign, flight: Result) -> str:
    """Flies it again."""
    names = campaign.settings.faults
    faults = "" if names == tuple(KINDS) else f" --faults {','.join(names)}"
    return f"strix campaign{faults} --seed {flight.seed} --only {flight.index}"


def sentence(campaign: Campaign) -> str:
    passed = sum(flight.passes for flight in campaign.flights)
    text = f"{passed} of {len(campaign.flights)} flights pass"
    if not campaign.complete:
        text += f"; {campaign.wanted - len(campaign.flights)} of {campaign.wanted} are not flown"
    return text


def speed(row: Row) -> str:
    return "-" if row.contact_m_s is None else f"{row.contact_m_s:.2f}"


def print_campaign(campaign: Campaign, console: Console | None = None) -> None:
    console = console or Console(highlight=False)
    table = Table.grid(padding=(0, 2))
    for justify in ("left", "right", "right", "right", "right", "left"):
        table.add_column(justify=justify, no_wrap=True)
    table.add_row("[bold]fault[/]", "flights", "passed", "contact m/s", "beyond m", "")
    for row in rows(campaign.flights):
        verdict = "" if row.passed == row.flights else "[bold red]FAILS[/]"
        if not row.judged:
            verdict = (verdict + " " + NOT_JUDGED).strip()
        table.add_row(
            *(row.fault, str(row.flights), str(row.passed), speed(row), f"{row.beyond_m:.1f}"),
            verdict,
        )
    console.print(table)
    console.print(CRITERIA)
    console.print(sentence(campaign))
    for flight in by_badness(campaign.flights)[:WORST]:
        if not flight.passes:
            print_flight(flight, console)
            console.print("    " + command(campaign, flight), soft_wrap=True)


def print_flight(flight: Result, console: Console | None = None) -> None:
    console = console or Console(highlight=False)
    verdict = "passes" if flight.passes else f"FAILS: {'; '.join(flight.failures)}"
    console.print(
        f"flight {flight.index}: {flight.fault}, {flight.detail}, at {flight.at_s:.1f} s of "
        f"{flight.mission}: {flight.reaction or 'flies on'}; {verdict}",
        soft_wrap=True,
    )


def write_csv(path: Path, campaign: Campaign) -> None:
    """A line a flight, without its track."""
    names = [field.name for field in fields(Result) if field.name != "track"]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for flight in campaign.flights:
            values = [getattr(flight, name) for name in names]
            writer.writerow(["; ".join(v) if isinstance(v, list) else v for v in values])
