"""Quick looks at a log of any size: what is in it, its last records, a plot."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strix.errors import BadInput
from strix.flightlog import Message
from strix.log.convert import open_log, unread
from strix.log.stream import Chunk, LogSource, Records

Progress = Callable[[int], None]
IDENTITY = ("sys_name", "vehicle", "ver_hw", "ver_sw", "ver_sw_git")
MOST_MESSAGES = 1000  # that info keeps
ROW_FRAME = 5  # bytes of a ULog data message around its record
POINTS = 1000  # of a curve that are kept of a chunk, about; with one chunk, a figure's pixels


@dataclass
class TopicSummary:
    """Of one instance of a topic. Times in s since power-up."""

    name: str
    count: int = 0
    bytes: int = 0
    first_s: float = np.inf
    last_s: float = -np.inf

    @property
    def rate_hz(self) -> float:
        """Mean; 0 where one record or no time between says nothing."""
        span_s = self.last_s - self.first_s
        return (self.count - 1) / span_s if span_s > 0.0 else 0.0


@dataclass
class LogSummary:
    """What `strix log info` says."""

    path: str
    size: int  # bytes
    identity: dict[str, str]
    boot_id: int | None = None  # of the last block
    topics: list[TopicSummary] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)  # the first MOST_MESSAGES
    message_count: int = 0
    dropped: int = 0  # records that did not fit into the logger's rings, by its own count
    dropouts_ms: int = 0  # as PX4's logger reports them
    unread: int = 0  # bytes behind damage

    @property
    def begin_s(self) -> float:
        return min((topic.first_s for topic in self.topics), default=0.0)

    @property
    def duration_s(self) -> float:
        """From the first record to the last."""
        return max((topic.last_s for topic in self.topics), default=0.0) - self.begin_s

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            **asdict(self),
            "messages": [{**asdict(m), "time_s": round(m.time_s, 6)} for m in self.messages],
            "begin_s": round(self.begin_s, 6),
            "duration_s": round(self.duration_s, 6),
            "topics": [
                {
                    "name": topic.name,
                    "count": topic.count,
                    "rate_hz": round(topic.rate_hz, 3),
                    "bytes": topic.bytes,
                    "first_s": round(topic.first_s, 6),
                    "last_s": round(topic.last_s, 6),
                }
                for topic in self.topics
            ],
        }


def summarise(path: Path, progress: Progress = lambda _: None) -> LogSummary:
    """Reads the log once."""
    source = open_log(path, progress)
    found = LogSummary(str(path), path.stat().st_size, {})
    topics: dict[str, TopicSummary] = {}
    for chunk in source.chunks():
        for number, rows in chunk.records.items():
            topic = source.topics[number]
            its = topics.setdefault(topic.label, TopicSummary(topic.label))
            its.count += rows.size
            its.bytes += rows.size * (rows.itemsize + ROW_FRAME)
            its.first_s = min(its.first_s, float(rows["timestamp"].min()) * 1e-6)
            its.last_s = max(its.last_s, float(rows["timestamp"].max()) * 1e-6)
            if topic.name == "log_block" and "boot_id" in topic.columns:
                found.boot_id = int(rows["boot_id"][-1])
            if topic.name == "log_status" and "dropped" in topic.columns:
                found.dropped = int(rows["dropped"][-1])
        found.message_count += len(chunk.messages)
        found.messages += chunk.messages[: MOST_MESSAGES - len(found.messages)]
        found.dropouts_ms += chunk.dropouts_ms
    found.identity = {key: source.info[key] for key in IDENTITY if key in source.info}
    found.topics = sorted(topics.values(), key=lambda topic: -topic.bytes)
    found.unread = unread(source)
    return found


def tail(
    path: Path, topic: str | None, count: int, progress: Progress = lambda _: None
) -> tuple[list[str], list[list[Any]]]:
    """The last records of a topic, or the last messages: names of the columns, and the rows."""
    source = open_log(path, progress)
    if topic is None:
        messages: deque[Message] = deque(maxlen=count)
        for chunk in source.chunks():
            messages.extend(chunk.messages)
        return ["time_s", "level", "message"], [[m.time_s, m.level, m.text] for m in messages]
    last: Records | None = None
    for chunk in source.chunks():
        for rows in _records_of(source, chunk, topic):
            last = rows[-count:] if last is None else np.concatenate([last, rows])[-count:]
    if last is None:
        raise _no_records(source, topic)
    names = list(last.dtype.names or ())
    return ["time_s", *names[1:]], [
        [int(row["timestamp"]) * 1e-6, *(row[name].item() for name in names[1:])] for row in last
    ]


def _records_of(source: LogSource, chunk: Chunk, label: str) -> list[Records]:
    return [rows for n, rows in chunk.records.items() if source.topics[n].label == label]


def _no_records(source: LogSource, label: str) -> BadInput:
    labels = ", ".join(sorted(topic.label for topic in source.topics.values())) or "no topic"
    return BadInput(f"{source.path}: expected records of topic {label}, found {labels}")


@dataclass
class Curve:
    """One element of a field over time; of a long log, the least and the largest of many."""

    name: str
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]


def curves(path: Path, fields: Sequence[str], progress: Progress = lambda _: None) -> list[Curve]:
    """Reads the fields asked for: topic.field, topic.field[0], topic.3.field of instance 3."""
    source = open_log(path, progress)
    wanted = [_parse_field(text) for text in fields]
    parts: dict[str, list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = {}
    found: dict[str, list[str]] = {label: [] for label, _ in wanted}
    for chunk in source.chunks():
        for label, name in wanted:
            for rows in _records_of(source, chunk, label):
                found[label] = list(rows.dtype.names or ())
                for column in _columns(found[label], name):
                    time_s = rows["timestamp"] * 1e-6
                    part = _envelope(time_s, rows[column].astype(np.float64))
                    parts.setdefault(f"{label}.{column}", []).append(part)
    out = []
    for label, name in wanted:
        if not found[label]:
            raise _no_records(source, label)
        columns = _columns(found[label], name)
        if not columns:
            listed = ", ".join(found[label][1:])
            raise BadInput(f"{path}: topic {label}: expected a field {name}, found {listed}")
        for column in columns:
            pieces = parts[f"{label}.{column}"]
            time_s, values = (np.concatenate([piece[i] for piece in pieces]) for i in (0, 1))
            out.append(Curve(f"{label}.{column}", time_s, values))
    return out


def _parse_field(text: str) -> tuple[str, str]:
    parsed = re.fullmatch(r"([^.]+(?:\.\d+)?)\.(.+)", text)
    if parsed is None:
        raise BadInput(f"{text}: expected topic.field, as vehicle_local_position.z, found no point")
    return parsed[1], parsed[2]


def _columns(names: list[str], wanted: str) -> list[str]:
    """One column, or all elements of an array."""
    return [name for name in names if name == wanted or re.sub(r"\[\d+\]$", "", name) == wanted]


def _envelope(
    time_s: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Thins out a longer curve to the least and the largest value of each part: peaks stay."""
    if values.size <= POINTS:
        return time_s, values
    parts = values[: values.size // (POINTS // 2) * (POINTS // 2)].reshape(POINTS // 2, -1)
    gaps = np.isnan(parts)
    least = np.argmin(np.where(gaps, np.inf, parts), axis=1)
    largest = np.argmax(np.where(gaps, -np.inf, parts), axis=1)
    pairs = np.sort(np.stack([least, largest], axis=1), axis=1)
    keep = (pairs + np.arange(POINTS // 2)[:, None] * parts.shape[1]).ravel()
    keep = np.append(keep, np.arange(parts.size, values.size))  # less than one more part each
    return time_s[keep], values[keep]


def plot(
    path: Path, fields: Sequence[str], out: Path, progress: Progress = lambda _: None
) -> list[Curve]:
    """Draws the fields into a PNG, one above the other; elements of an array share axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if out.suffix.lower() != ".png":
        raise BadInput(f"-o {out}: expected a name that ends in .png, found {out.suffix!r}")
    if not fields:
        raise BadInput("expected at least one topic.field, found none")
    found = curves(path, fields, progress)
    figure = Figure(figsize=(10.0, 0.8 + 2.2 * len(fields)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(fields), 1, sharex=True, squeeze=False)[:, 0]
    for axis, wanted in zip(axes, fields, strict=True):
        label, name = _parse_field(wanted)
        for curve in found:
            column = curve.name.removeprefix(f"{label}.")
            if curve.name.startswith(f"{label}.") and _columns([column], name):
                axis.plot(curve.time_s, curve.values, linewidth=0.8, label=column)
        axis.set_title(wanted, loc="left", fontsize="medium")
        axis.grid(visible=True, alpha=0.3)
        if len(axis.lines) > 1:
            axis.legend(loc="upper right", fontsize="small", ncols=4)
    axes[-1].set_xlabel("time since power-up, s")
    figure.suptitle(path.name)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out, dpi=120)
    except OSError as error:
        raise BadInput(f"-o {out}: expected to write there, found: {error.strerror}") from None
    return found
