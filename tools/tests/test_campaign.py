"""`strix campaign`: what it flies, how it judges, and that nothing of it is lost."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from typer import Typer
from typer.testing import CliRunner

from strix.campaign import fly_campaign, run
from strix.campaign.cli import campaign as command_line
from strix.campaign.flight import Result, _failures, _Judge, fly_one
from strix.campaign.kinds import KINDS
from strix.campaign.page import write_page
from strix.campaign.plan import ARM_AT_S, MISSIONS, draw
from strix.campaign.run import FLIGHTS, SETTINGS, Campaign, Settings, fly_again
from strix.campaign.table import by_badness, rows
from strix.errors import BadInput
from strix.plant import Plant, Surroundings, Truth
from strix.vehicles import plant_numbers

ALL = list(KINDS)
# A flight that a kill ends is over soon: what the tests of the campaign itself fly.
SHORT, SEED = "kill", 3
APP = Typer()
APP.command()(command_line)


# What is flown.


def test_every_fault_is_flown_once_before_one_is_flown_twice() -> None:
    for first in (0, len(ALL), 5 * len(ALL)):
        kinds = [draw(SEED, first + i, ALL).kind for i in range(len(ALL))]
        assert Counter(kinds) == Counter(ALL)


def test_a_flight_is_drawn_from_its_seed_and_number_alone() -> None:
    alone = draw(SEED, 137, ALL)
    assert alone == [draw(SEED, i, ALL) for i in range(140)][137]
    assert alone.fault()[1] == draw(SEED, 137, ALL).fault()[1]
    assert alone != draw(SEED + 1, 137, ALL)


def test_faults_begin_anywhere_between_arming_and_landing_on_every_mission() -> None:
    begins: dict[str, list[float]] = {mission: [] for mission in MISSIONS}
    for i in range(400):
        drawn = draw(SEED, i, ALL)
        begins[drawn.mission].append((drawn.at_s - ARM_AT_S) / MISSIONS[drawn.mission])
    for shares in begins.values():
        assert min(shares) >= 0.0 and max(shares) <= 1.0
        # Of some 100 uniform draws none is in a tenth at an end once in 0.9^-100, 37000 times.
        assert min(shares) < 0.1 and max(shares) > 0.9


# How it is judged.


@pytest.fixture(scope="module")
def standing() -> Truth:
    return Plant(plant_numbers("Quad5in"), Surroundings(), 0.0, seed=1).truth


def seen(standing: Truth, *instants: tuple[float, float, float, bool]) -> _Judge:
    """Of height m, north m, speed down m/s, on ground."""
    judge = _Judge()
    for i, (height, north, down, ground) in enumerate(instants):
        judge.watch(
            replace(
                standing,
                time_us=1000 * i,
                position_ned_m=(north, 0.0, -height),
                velocity_ned_m_s=(0.0, 0.0, down),
                on_ground=ground,
            )
        )
    return judge


def failures(judge: _Judge, kind: str = "gps-jump", *, ended: bool = True) -> list[str]:
    drawn = next(d for i in range(99) if (d := draw(SEED, i, ALL)).kind == kind)
    return _failures(drawn, judge, ended=ended, rearmed=False)


def test_the_speed_of_a_contact_is_the_one_before_it(standing: Truth) -> None:
    judge = seen(standing, (1.0, 0.0, 4.0, False), (0.0, 0.0, 0.2, True))
    assert judge.contact_m_s == pytest.approx(4.0)
    assert failures(judge) == ["hit the ground with 4.0 m/s"]
    assert failures(seen(standing, (1.0, 0.0, 2.9, False), (0.0, 0.0, 0.2, True))) == []


def test_who_never_left_the_ground_has_not_hit_it(standing: Truth) -> None:
    judge = seen(standing, (0.1, 0.0, 4.0, False), (0.0, 0.0, 0.0, True))
    assert judge.contact_m_s is None


@pytest.mark.parametrize(("height", "north"), [(3.0, 35.5), (20.5, 0.0)])  # fence: 30 m and 15 m
def test_sideways_and_upwards_count_beyond_the_fence(
    height: float, north: float, standing: Truth
) -> None:
    judge = seen(standing, (height, north, 0.0, False))
    assert judge.beyond_m == pytest.approx(5.5)
    assert failures(judge) == ["5.5 m beyond the fence"]


def test_a_fall_is_not_judged_where_the_fault_itself_cuts_the_motors(standing: Truth) -> None:
    judge = seen(standing, (20.5, 0.0, 9.0, False), (0.0, 0.0, 0.0, True))
    for name, kind in KINDS.items():
        assert bool(failures(judge, name)) != kind.cuts_motors
        assert failures(judge, name, ended=False)[0].startswith("motors not off")


def test_a_killed_aircraft_falls_and_that_is_told() -> None:
    drawn = replace(draw(SEED, 0, [SHORT]), mission="hover", at_s=ARM_AT_S + 12.0)
    result, track = fly_one(drawn)
    height_m = -track.position_ned_m[track.time_s.searchsorted(drawn.at_s), 2]
    assert result.passes and result.flew and result.state == "SAFE"
    assert result.reaction_s is not None
    # A control tick, and the 10 ms in which both pilot and judge look.
    assert 0.0 <= result.reaction_s <= 0.03
    # A free fall; the air takes a little.
    assert result.contact_m_s == pytest.approx(math.sqrt(2 * 9.81 * height_m), rel=0.15)


# That nothing is lost.


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, Path]:
    out = tmp_path_factory.mktemp("whole")
    return fly_campaign(SHORT, 3, SEED, out, processes=2), out


def lines(out: Path) -> dict[int, dict[str, Any]]:
    text = (out / FLIGHTS).read_text(encoding="utf-8")
    return {row["index"]: row for row in map(json.loads, text.splitlines())}


def test_a_flight_flown_again_is_the_same_flight(
    whole: tuple[Campaign, Path], tmp_path: Path
) -> None:
    again = fly_again(SHORT, 1, SEED, tmp_path)
    assert again.to_dict() == lines(whole[1])[1]
    assert (tmp_path / "flight.ulg").stat().st_size > 0
    assert "<html" in (tmp_path / "report.html").read_text(encoding="utf-8")


def spied(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of the flights that are flown from now on."""
    numbers: list[int] = []
    flies: Callable[..., Iterator[Result]] = run._fly_all

    def spy(settings: Settings, indices: list[int], *rest: Any) -> Iterator[Result]:
        numbers.extend(indices)
        return flies(settings, indices, *rest)

    monkeypatch.setattr(run, "_fly_all", spy)
    return numbers


def test_a_resumed_campaign_flies_what_is_missing_and_what_was_cut_off(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / SETTINGS).write_text((whole[1] / SETTINGS).read_text())
    first, second, _ = (whole[1] / FLIGHTS).read_text().splitlines(keepends=True)
    (tmp_path / FLIGHTS).write_text(first + second[:100])
    numbers = spied(monkeypatch)
    found = fly_campaign(SHORT, 3, SEED, tmp_path, processes=1, resume=True)
    assert {json.loads(first)["index"], *numbers} == {0, 1, 2}
    assert len(numbers) == 2
    assert found.flights == whole[0].flights
    assert lines(tmp_path) == lines(whole[1])


@pytest.mark.parametrize(
    ("faults", "seed", "said"), [(SHORT, SEED + 1, "same --seed"), ("wind", SEED, "same --faults")]
)
def test_a_campaign_with_other_settings_is_not_resumed(
    faults: str, seed: int, said: str, whole: tuple[Campaign, Path]
) -> None:
    before = (whole[1] / FLIGHTS).read_bytes()
    with pytest.raises(BadInput, match=said):
        fly_campaign(faults, 3, seed, whole[1], resume=True)
    assert (whole[1] / FLIGHTS).read_bytes() == before


def test_a_campaign_does_not_overwrite_another(whole: tuple[Campaign, Path]) -> None:
    with pytest.raises(BadInput, match="--resume"):
        fly_campaign(SHORT, 3, SEED, whole[1])


def test_an_interrupted_campaign_keeps_what_was_flown(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> Iterator[Result]:
        yield whole[0].flights[0]
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "_fly_all", interrupted)
    options = ["--faults", SHORT, "--n", "3", "--seed", str(SEED), "--out", str(tmp_path)]
    said = CliRunner().invoke(APP, options)
    assert said.exit_code == 130
    assert "--resume" in said.output
    assert list(lines(tmp_path)) == [0]
    monkeypatch.undo()
    monkeypatch.setattr(run, "_fly_all", lambda *_: iter(whole[0].flights[1:]))
    said = CliRunner().invoke(APP, [*options, "--resume"])
    assert said.exit_code == 0, said.output
    assert "3 of 3 flights pass" in said.output


def test_a_cluster_flies_the_same_flights(whole: tuple[Campaign, Path], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        found = fly_campaign(SHORT, 3, SEED, tmp_path, scheduler=address)
    assert found.flights == whole[0].flights
    assert lines(tmp_path) == lines(whole[1])


def test_a_scheduler_that_is_not_there_is_told(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(BadInput, match="--scheduler"):
        fly_campaign(SHORT, 1, SEED, tmp_path, scheduler="nonsense")


@pytest.mark.parametrize(
    "options", [["--faults", "gremlins"], ["--jobs", "0"], ["--jobs", "many"]], ids=" ".join
)
def test_what_cannot_be_flown_is_refused(options: list[str], tmp_path: Path) -> None:
    said = CliRunner().invoke(APP, [*options, "--out", str(tmp_path)])
    assert said.exit_code not in (0, 1)
    assert not (tmp_path / FLIGHTS).exists()


# What is told.


def failed(flight: Result, index: int) -> Result:
    return replace(flight, index=index, fault="wind", failures=["hit the ground with 9.9 m/s"])


def test_a_flight_that_fails_makes_the_exit_code_and_leads_the_page(
    whole: tuple[Campaign, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flights = [*whole[0].flights[:2], failed(whole[0].flights[2], 2)]
    assert by_badness(flights)[0].index == 2
    monkeypatch.setattr(run, "_fly_all", lambda *_: iter(flights))
    options = ["--faults", f"{SHORT},wind", "--n", "3", "--seed", str(SEED)]
    said = CliRunner().invoke(APP, [*options, "--out", str(tmp_path)])
    assert said.exit_code == 1
    assert "2 of 3 flights pass" in said.output
    page = (tmp_path / "campaign.html").read_text(encoding="utf-8")
    command = f"strix campaign --faults {SHORT},wind --seed {SEED} --only 2"
    assert page.index(command) < page.index(command.replace("--only 2", "--only 0"))


def test_the_table_counts_each_fault(whole: tuple[Campaign, Path]) -> None:
    flights = [*whole[0].flights[:2], failed(whole[0].flights[2], 2)]
    found = {row.fault: (row.flights, row.passed, row.judged) for row in rows(flights)}
    assert found == {"kill": (2, 2, False), "wind": (1, 0, True)}


class Outside(HTMLParser):
    """Collects what a page would load."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        names = {name for name, _ in attributes}
        if tag in ("script", "link", "img", "iframe") or names & {"src", "href"}:
            self.found.append(tag)


def test_the_page_needs_nothing_else_and_shows_what_was_said_as_text(
    whole: tuple[Campaign, Path], tmp_path: Path
) -> None:
    loud = replace(whole[0].flights[0], said=["1.00 s: <img src=x> & more"])
    path = tmp_path / "campaign.html"
    write_page(path, replace(whole[0], flights=[loud]))
    page = path.read_text(encoding="utf-8")
    outside = Outside()
    outside.feed(page)
    assert outside.found == []
    assert "&lt;img src=x&gt; &amp; more" in page
    assert page.count("<polyline") == 2  # height and distance
