"""Every case of configs/ for a few steps on a coarse mesh."""

from pathlib import Path

import numpy as np
import pytest

from vesdyn.case_file import load_case
from vesdyn.study import Study

CONFIGS = Path(__file__).parents[2] / "configs"
NAMES = sorted(file.stem for file in CONFIGS.glob("*.yaml"))
COARSE = {"mesh.front_edge": 0.03, "mesh.far_edge": 0.1, "solver.tolerance": 1e-3}
BRIEF = {"time.end": 0.008, "time.step": 0.002, "output.frames": [0.004]}


@pytest.mark.parametrize("name", NAMES)
def test_case_takes_a_few_steps(name, tmp_path, monkeypatch):
    monkeypatch.setattr("vesdyn.run._draw", lambda directory: None)
    displaced = load_case(CONFIGS / f"{name}.yaml").perturbation.restarts
    changes = {**COARSE, **BRIEF, **({"perturbation.at": 0.004} if displaced else {})}
    study = Study(tmp_path, CONFIGS, jobs=1)
    history = study.history(name, changes)
    assert list(history["time"]) == pytest.approx([0.002, 0.004, 0.006, 0.008], rel=1e-12)
    assert np.all(np.diff(history["binding_area"]) > 0.0)
    assert np.all(np.abs(history["receptor_number_error"]) < 1e-10)
    assert [frame["time"] for frame in study.frames(name, changes)] == [0.0, 0.004, 0.008]  # the last state always
