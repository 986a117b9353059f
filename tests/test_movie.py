"""The movie of a run: as many pictures as shapes, of both bodies, and what is refused."""

import pytest
from PIL import Image

import vesdyn
from vesdyn import movie
from vesdyn.case import Case
from vesdyn.cli import main
from vesdyn.errors import CaseError
from vesdyn.run import run_case

pytestmark = pytest.mark.filterwarnings("ignore:adhesion.cutoff")  # coarse on purpose


@pytest.fixture(scope="module", params=["axisymmetric", "surface"])
def run(request, tmp_path_factory):
    path = tmp_path_factory.mktemp(request.param)
    mesh, time = {"front_edge": 0.1, "far_edge": 0.2}, {"end": 0.006, "step": 0.001}
    case = Case(name="a", model=request.param, mesh=mesh, time=time, output={"frames": {"count": 3}})
    assert run_case(case, path, progress=False).state == "finished"
    return vesdyn.open_run(path)


def test_a_picture_for_each_shape(run, tmp_path, capsys):
    file = movie.write_movie(run, tmp_path / "a.gif", seconds=2.0, elevation=30.0, turn=45.0)
    with Image.open(file) as pictures:
        assert pictures.n_frames == 4 and pictures.size == (880, 440)
        assert pictures.info["duration"] == 500  # [ms]
        first = pictures.convert("RGB").tobytes()
        pictures.seek(3)
        assert pictures.convert("RGB").tobytes() != first
    assert [f.name for f in tmp_path.iterdir()] == ["a.gif"]
    assert main(["movie", str(run.path), "--out", str(tmp_path / "b.gif")]) == 0
    assert capsys.readouterr().out.strip() == f"{tmp_path}/b.gif"


def test_what_is_refused(run, tmp_path, monkeypatch, capsys):
    with pytest.raises(CaseError, match="is neither .mp4 nor .gif"):
        movie.write_movie(run, tmp_path / "a.avi")
    monkeypatch.setattr(movie.FFMpegWriter, "isAvailable", lambda: False)
    assert movie.default_name() == "movie.gif"
    with pytest.raises(CaseError, match="ffmpeg, which is not here; install it, or write a .gif"):
        movie.write_movie(run, tmp_path / "a.mp4")
    assert main(["movie", str(run.path), "--out", str(tmp_path / "no" / "b.gif")]) == 1
    assert "No such file or directory (b.gif)" in capsys.readouterr().err
    assert main(["movie", str(run.path), "--seconds", "0"]) == 2
    assert "seconds: 0 is not a duration; give one greater than 0." in capsys.readouterr().err
    with pytest.raises(CaseError, match="seconds: nan is not a duration"):
        movie.write_movie(run, tmp_path / "a.gif", seconds=float("nan"))
    assert not list(tmp_path.iterdir())
