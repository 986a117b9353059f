"""What travels in the wheel and in the source archive, and that the wheel alone is enough to run a shipped case."""

import email
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
SOURCES = ("vesdyn", "configs", "plots", "docs", "tests", "setup.cfg", "pyproject.toml", "MANIFEST.in", "README.md",
           "CHANGELOG.md", "CITATION.cff", "LICENSE", "Makefile")  # fmt: skip
CASES = {file.relative_to(ROOT / "configs").as_posix() for kind in ("yaml", "csv") for file in (ROOT / "configs").rglob(f"*.{kind}")}


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """The wheel and the source archive, built from a copy of the sources."""
    copy = tmp_path_factory.mktemp("sources")
    for name in SOURCES:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, copy / name, ignore=shutil.ignore_patterns("__pycache__", "out"))
        else:
            shutil.copy(source, copy / name)
    build = "from setuptools import build_meta as b; print(b.build_wheel('dist')); print(b.build_sdist('dist'))"
    done = subprocess.run([sys.executable, "-c", build], cwd=copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    [wheel], [sources] = (copy / "dist").glob("*.whl"), (copy / "dist").glob("*.tar.gz")
    return wheel, sources


def test_wheel_holds_package_cases_and_licence(archives):
    with zipfile.ZipFile(archives[0]) as wheel:
        names = set(wheel.namelist())
        [metadata] = [name for name in names if name.endswith(".dist-info/METADATA")]
        about = email.message_from_bytes(wheel.read(metadata))
    modules = {f"vesdyn/{file.name}" for file in (ROOT / "vesdyn").glob("*.py")}
    inside = {name for name in names if ".dist-info/" not in name}
    assert inside == modules | {"vesdyn/py.typed"} | {f"vesdyn/configs/{case}" for case in CASES}
    assert any(name.endswith("/LICENSE") for name in names)
    assert (about["License"] or about["License-Expression"]) == "MIT"
    assert about["Author"] == "The vesdyn authors"
    assert about.get_payload().startswith((ROOT / "README.md").read_text()[:40])


def test_source_archive_holds_what_is_needed_to_build_test_and_draw(archives):
    with tarfile.open(archives[1]) as sources:
        names = {name.partition("/")[2] for name in sources.getnames()}
    wanted = {"LICENSE", "CITATION.cff", "README.md", "CHANGELOG.md", "Makefile", "setup.cfg", "pyproject.toml"}
    wanted |= {f"configs/{case}" for case in CASES}
    scripts = [*(ROOT / "plots").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]
    wanted |= {file.relative_to(ROOT).as_posix() for file in scripts}
    wanted |= {f"tests/data/{file.name}" for file in (ROOT / "tests" / "data").iterdir()}
    assert wanted <= names


def test_versions_agree():
    version = re.search(r"^version = (.+)$", (ROOT / "setup.cfg").read_text(), re.MULTILINE)[1]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert str(citation["version"]) == version
    assert citation["license"] == "MIT"


@pytest.mark.verify
def test_a_shipped_case_runs_from_the_wheel_in_an_empty_directory(archives, tmp_path):
    with zipfile.ZipFile(archives[0]) as wheel:
        wheel.extractall(tmp_path / "site")
    empty = tmp_path / "empty"
    empty.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    brief = ("--set", "model=axisymmetric", "mesh.front_edge=0.05", "mesh.far_edge=0.1", "time.step=0.002",
             "time.end=0.008", "output.frames=[0.004]")  # fmt: skip
    command = [sys.executable, "-m", "vesdyn", "run", "typical", *brief]
    done = subprocess.run(command, cwd=empty, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "finished" in done.stdout
    assert (empty / "runs" / "typical" / "summary.png").exists()
    where = [sys.executable, "-c", "import vesdyn; print(vesdyn.__file__)"]
    found = subprocess.run(where, cwd=empty, env=environment, capture_output=True, text=True, check=True).stdout
    assert Path(found.strip()).is_relative_to(tmp_path / "site")


def test_make_draws_every_figure_and_any_script():
    scripts = {file.stem for file in (ROOT / "plots").glob("*.py")} - {"looks"}
    figures = {name for name in scripts if name.startswith("figure")}

    def commands(*targets):
        command = ["make", "--dry-run", "--assume-old=.venv/ready", *targets]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        return re.findall(r"python plots/(\w+)\.py ?(.*)", done.stdout)

    assert {name for name, _ in commands("figures")} == figures
    assert dict(commands(*sorted(scripts), "JOBS=2")) == dict.fromkeys(scripts, "--jobs 2")
