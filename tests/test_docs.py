"""What the docs show is run word for word: the tour, and the examples of docs/extending.md."""

import re
import runpy
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from vesdyn import adhesion

DOCS = Path(__file__).parents[1] / "docs"


def test_the_reference_is_what_the_schema_says(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")  # of a terminal: no matter
    written = runpy.run_path(str(DOCS / "reference.py"))
    assert written["PAGE"].read_text() == written["page"](), "run `python docs/reference.py`"


def test_links_between_pages_lead_somewhere():
    for page in (*DOCS.glob("*.md"), DOCS.parent / "README.md"):
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), (page.name, target)


def test_tour_runs_word_for_word(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shown = runpy.run_path(str(DOCS / "tour.py"))
    told = capsys.readouterr().out
    assert "adhesion.tracton: unknown key, did you mean traction?" in told
    assert "interrupted - stopped by A = 0.3. A = 0.30" in told  # at a step that passes 0.3 by a little
    moment, history = shown["moment"], shown["history"]
    assert float(re.search(r"\nfinished - A = (\d\.\d+)", told)[1]) == pytest.approx(history["binding_area"][-1], abs=1e-3)
    at = list(history["time"]).index(moment.time)  # the run met the same times as the simulation
    assert history["binding_area"][at] == moment["binding_area"] > 0.3 >= history["binding_area"][at - 1]
    assert history["gathered"][at] == moment["gathered"]
    picture = matplotlib.image.imread(tmp_path / "tour" / "tour.png")
    assert picture.shape[1] > 1000 and np.ptp(picture[..., 0]) == 1.0


def test_examples_of_extending_run_in_order(tmp_path, monkeypatch, capsys):
    blocks = re.findall(
        r"^```python\n(.*?)^```", (DOCS / "extending.md").read_text(), re.DOTALL | re.MULTILINE
    )
    assert len(blocks) == 5
    script = tmp_path / "examples.py"  # a file: compiled code is kept beside one
    script.write_text("\n\n".join(blocks))
    monkeypatch.chdir(tmp_path)
    shown = runpy.run_path(str(script))
    assert "stopped by less than 49 % of the membrane above the middle." in capsys.readouterr().out
    law = shown["Quadratic"](0.1)
    gaps = np.linspace(0.0, 0.12, 13)
    area = [adhesion.integral(law, gap) for gap in gaps]
    assert area == pytest.approx([0.1 / 3.0 * max(0.0, 1.0 - gap / 0.1) ** 3 for gap in gaps], abs=1e-15)
