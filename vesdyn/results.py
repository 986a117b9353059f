"""A run as its user reads it from Python, finished or still going on.

    run = vesdyn.open_run("runs/typical")
    run.history["time"], run.history["binding_area"]     columns of the history; run.history.units tells their units
    run.frame(0.128).density, run.final.position         stored shapes
    run.profile(0.128)                                   density and height along the membrane, from pole to pole
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vesdyn.case import SAME_TIME, Case
from vesdyn.errors import CaseError
from vesdyn.refusals import shown
from vesdyn.storage import Frame, RunDirectory
from vesdyn.units import Scales


class History(dict):
    """Columns of a history, name to array (n_steps,), in the order in which they are stored.

    ``units`` and ``meanings`` map the names of those columns that are described to text; ``scales`` are those of the
    case, `vesdyn.units.Scales`, or None.
    """

    def __init__(
        self, columns: dict[str, np.ndarray], units: dict[str, str], meanings: dict[str, str], scales: Scales | None = None
    ):
        super().__init__(columns)
        self.units, self.meanings, self.scales = units, meanings, scales

    def to(self, column: str, unit: str) -> np.ndarray:
        """The ``column`` in a ``unit`` of SI such as "um^2" or "s", an array (n_steps,).

        Raises CaseError where the case gives no units, the column has none, or it is of another dimension.
        """
        if column not in self:
            raise CaseError(f"{shown(column)}: unknown column; there are {', '.join(self)}.")
        if self.scales is None:
            raise CaseError("units: are not given in this case; give units: {diameter: 10 um, diffusivity: 0.01 um^2/s}.")
        return self.scales.to(self[column], self.units.get(column, ""), unit)


class Profile(NamedTuple):
    """Membrane from the lower to the upper pole, averaged over the azimuth: arrays (n,)."""

    arc: np.ndarray  # length along the membrane from the first point [a0]
    radius: np.ndarray  # distance from the axis [a0]
    height: np.ndarray  # above the substrate [a0]
    density: np.ndarray  # of receptors [c_r0]


class Run:
    """A run in a directory, read when it is asked for; made by `open_run`."""

    def __init__(self, path: str | Path):
        self._directory = RunDirectory(path)
        self.path: Path = self._directory.path
        self.case: Case = self._directory.stored_case()

    def __repr__(self) -> str:
        return f"<run {self.case.name} in {self._directory}: {self.status.get('state', 'not begun')}>"

    @property
    def status(self) -> dict:
        """State (running, interrupted, finished or failed), reason and wall time [s]; empty before the first step."""
        return self._directory.status()

    @property
    def history(self) -> History:
        """Every column of the history, as far as the run has come.

        Raises vesdyn.storage.DamagedRunError if it is not as it was written.
        """
        self._directory.verify_history()
        described = self._directory.described_columns()
        units = {row["column"]: row["unit"] for row in described}
        meanings = {row["column"]: row["meaning"] for row in described}
        return History(self._directory.history(), units, meanings, self.case.scales)

    @property
    def frames(self) -> Sequence[Frame]:
        """Stored shapes in the order of time, each read when it is asked for.

        Raises vesdyn.storage.DamagedRunError if one is gone or is not the one that the run stored.
        """
        return self._directory.frames()

    @property
    def times(self) -> list[float]:
        """Times of the stored shapes [a0^2/D]."""
        return self._directory.frame_times()[: len(self.frames)]

    @property
    def final(self) -> Frame:
        """The last stored shape; of a finished run that of its last state."""
        frames = self.frames
        return frames[-1] if len(frames) else self._no_frame("at all")

    def frame(self, time: float) -> Frame:
        """The shape stored at ``time`` [a0^2/D]; raise CaseError, with the times there are, if there is none."""
        frames = self.frames
        for number, stored in enumerate(self._directory.frame_times()[: len(frames)]):
            if abs(stored - time) <= SAME_TIME * max(1.0, abs(time)):
                return frames[number]
        return self._no_frame(f"at t = {time:g}")

    def _no_frame(self, when):
        there = ", ".join(f"{t:g}" for t in self.times) or "none"
        raise CaseError(f"{self._directory}: holds no frame {when}; there are {there}; name others under output.frames.")

    def profile(self, time: float) -> Profile:
        """Density and height along the membrane at ``time``, which must be that of a stored shape.

        A meridian gives its nodes. On a surface, rings of equally many vertices, which were at one height at t = 0,
        are averaged, and the vertices at the poles stand for themselves; the arc is the length of the curve through
        these means.
        """
        frame = self.frame(time)
        x, density = frame.position, frame.density
        if x.shape[1] == 2:
            radius, height = x.T
        else:
            lower, *between, upper = np.argsort(self.frames[0].position[:, 2], kind="stable")
            rings = [[lower], *np.array_split(between, int(np.sqrt(len(between)))), [upper]]
            radius, height, density = (
                np.array([values[ring].mean() for ring in rings]) for values in (np.hypot(*x.T[:2]), x[:, 2], density)
            )
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radius), np.diff(height)))])
        return Profile(arc, radius, height, density)


def open_run(path: str | Path) -> Run:
    """Open the run in the directory ``path``, which may still be going on.

    Raises vesdyn.storage.RunDirectoryError if there is none that can be read.
    """
    return Run(path)
