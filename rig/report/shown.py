"""The runs of one report: each with its figures, a name and a colour."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis import Analysis, analyse
from rig.recorded.record import RunRecord

FloatArray = NDArray[np.float64]

COLOURS = ("#1f5fa8", "#d1495b", "#2e8b57", "#e09f1f", "#7b4fa3", "#3aa6b9", "#8c564b", "#6b7280")


@dataclass(frozen=True, slots=True)
class Shown:
    """One run as a report shows it."""

    name: str
    colour: str
    record: RunRecord
    analysis: Analysis


def shown(records: Sequence[RunRecord]) -> list[Shown]:
    """The runs with their analysis; names are the directories', as long as makes them differ."""
    names = _names(records)
    return [
        Shown(
            name,
            COLOURS[number % len(COLOURS)],
            record,
            analyse(record.data, record.config, record.setup.radius_true_m),
        )
        for number, (name, record) in enumerate(zip(names, records, strict=True))
    ]


def _names(records: Sequence[RunRecord]) -> list[str]:
    parts = [record.directory.resolve().parts for record in records]
    for length in range(1, max(map(len, parts)) + 1):
        names = ["/".join(part[-length:]) for part in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{part[-1]} ({n})" for n, part in enumerate(parts, 1)]  # given twice
