"""A physics that is a chaotic map: one wrong bit anywhere shows in every later row of a run."""

import signal
import sys
import types
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vesdyn import files, run, stepping
from vesdyn.storage import RunDirectory


class Chaos(NamedTuple):
    """Stands in for State."""

    time: float
    steps: int
    x: np.ndarray
    dt_wanted: float = 0.0
    step_error: float = 0.0


class Physics:
    """Stands in for Spreading; calls ``before_step(steps)`` ahead of each step."""

    def __init__(self, case):
        self.case = case

    before_step = staticmethod(lambda steps: None)

    def start(self):
        return Chaos(0.0, 0, np.array([0.1, 0.2, 0.3]))

    def advance(self, state, until, pause):
        self.before_step(state.steps)
        x = 3.9 * state.x * (1 - state.x) + (until - state.time) * 1e-3
        return Chaos(until, state.steps + 1, x)

    def folded_area(self, state):
        return 0.0

    def stored(self, state):
        return state._asdict()

    def restored(self, stored):
        return Chaos(**stored)


class Measured:
    """Stands in for Moment."""

    def __init__(self, sim, state, columns=()):
        self.time, self.state, self.x = state.time, state, state.x

    def row(self):
        names = ("binding_area", "volume_error", "receptor_number_error", "residual")
        return {"time": self.time} | dict.fromkeys(names, float(self.x[0])) | {"iterations": self.state.steps}

    def frame(self):
        return np.array([[0, 1, 2]]), {"position": np.eye(3), "density": self.x}, {"tension_1": self.x[:1]}


def put_in_place(monkeypatch):
    """Put Physics in the place of the real one, and an empty picture in that of the summary."""
    monkeypatch.setattr(run, "Spreading", Physics)
    monkeypatch.setattr(run, "Moment", Measured)
    monkeypatch.setattr(stepping, "_check_fold", lambda sim, state: None)  # it has no membrane
    monkeypatch.setattr(Physics, "before_step", staticmethod(lambda steps: None))
    pictures = types.ModuleType("vesdyn.pictures")
    pictures.summary = lambda path: files.replace_file(Path(path), "summary.png", b"a picture")
    monkeypatch.setitem(sys.modules, "vesdyn.pictures", pictures)
    return Physics


def interrupt_at(step, signals=(signal.SIGINT,)):
    """Signals that arrive one by one before the step goes on; those of ``os.kill`` may do so later, or merge."""

    def before_step(steps):
        if steps == step:
            for number in signals:
                signal.raise_signal(number)

    return staticmethod(before_step)


def frames_of(path):
    return [
        (frame.time, frame.connectivity.tolist(), *({n: v.tolist() for n, v in part.items()} for part in frame[2:]))
        for frame in RunDirectory(path).frames()
    ]


def assert_same(path, reference):
    """The same bits in history and frames, and series that name the same."""
    assert (path / "history.csv").read_bytes() == (reference / "history.csv").read_bytes()
    assert frames_of(path) == frames_of(reference)
    for name in ("frames.xdmf", "frames.h5"):
        assert (path / name).read_bytes() == (reference / name).read_bytes()
