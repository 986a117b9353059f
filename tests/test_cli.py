"""The command line: exit status, sentences instead of tracebacks, and quick help."""

import subprocess
import sys

import pytest

import vesdyn
from vesdyn import planning, run
from vesdyn.case import Case
from vesdyn.case_file import load_case
from vesdyn.cli import main
from vesdyn.run import Outcome
from vesdyn.storage import RunDirectory

FINISHED = Outcome("finished", "", 1.2, 600, 83.2, 0.67, 3e-13, 1e-15)


@pytest.fixture
def case_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text("name: a\n")
    return "a.yaml"


@pytest.fixture
def calls(monkeypatch):
    """Put a recorder in the place of run_case; its ``outcome`` can be set."""

    class Calls(list):
        outcome = FINISHED

    calls = Calls()

    def run_case(case, directory, progress, restart, decisions):
        calls.append((case, str(directory), progress, restart))
        return calls.outcome

    monkeypatch.setattr(run, "run_case", run_case)
    return calls


def test_run_passes_on_what_was_asked(case_file, calls):
    assert main(["run", case_file]) == 0
    assert main(["run", case_file, "--out", "b", "--set", "drag=0.1", "--set", "time.step=1e-3", "--quiet"]) == 0
    assert main(["run", case_file, "--restart"]) == 0
    changed = load_case(case_file, ["drag=0.1", "time.step=1e-3"])
    assert calls == [
        (Case(name="a"), "runs/a", True, False),
        (changed, "b", False, False),
        (Case(name="a"), "runs/a", True, True),
    ]


def test_resume_takes_the_stored_case(case_file, calls):
    with RunDirectory("b").claim(Case(name="a", drag=0.1)):
        pass
    assert main(["resume", "b"]) == 0
    assert calls == [(Case(name="a", drag=0.1), "b", True, False)]


def test_figures_and_files_are_told_in_the_end(case_file, calls, capsys):
    main(["run", case_file])
    out = capsys.readouterr().out
    for part in ("600 steps", "1 min 23.2 s", "0.67", "3.0e-13", "1.0e-15", "summary.png", "runs/a"):
        assert part in out


def test_interrupted(case_file, calls, capsys):
    calls.outcome = Outcome("interrupted", "stopped by SIGINT.", 0.1, 50, 2.0, 0.3, 0.0, 0.0)
    assert main(["run", case_file]) == 130
    assert "vesdyn resume runs/a" in capsys.readouterr().out


def test_failed(case_file, calls, capsys):
    calls.outcome = Outcome("failed", "it stalls; shorten time.step.", 0.1, 50, 2.0, 0.3, 0.0, 0.0)
    assert main(["run", case_file, "--quiet"]) == 1
    assert capsys.readouterr() == ("", "vesdyn: runs/a: it stalls; shorten time.step.\n")


def test_quiet_says_nothing(case_file, calls, capsys):
    main(["run", case_file, "--quiet"])
    calls.outcome = Outcome("interrupted", "stopped by SIGINT.", 0.1, 50, 2.0, 0.3, 0.0, 0.0)
    main(["run", case_file, "--quiet"])
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    "arguments, part",
    [
        (["run", "none.yaml"], "none.yaml: No such file"),
        (["run", "a.yaml", "--set", "drga=1"], "did you mean drag?"),
        (["resume", "none"], "none: No such file or directory; give the directory of a run"),
        (["info", "none"], "none: No such file or directory; give the directory of a run"),
        (["run", "a.yaml", "--out", "."], "no run in it"),
    ],
)
def test_bad_input_is_a_sentence_and_status_2(case_file, capsys, arguments, part):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == "" and part in err
    assert all(line.startswith("vesdyn: ") for line in err.splitlines())


def test_directory_of_another_case_is_status_2(case_file, capsys):
    with RunDirectory("runs/a").claim(Case(name="a", drag=0.1)):
        pass
    assert main(["run", case_file]) == 2
    assert "--restart" in capsys.readouterr().err


def test_info_of_a_killed_run(case_file, capsys):
    directory = RunDirectory("b")
    with directory.claim(Case(name="a", drag=0)):
        directory.write_status("running", wall_time=1.0)
        columns = "time binding_area pressure density_min density_max residual volume_error receptor_number_error"
        directory.append_history(dict.fromkeys(columns.split(), 0.25))
        assert main(["info", "b"]) == 0
        assert "a: running" in capsys.readouterr().out
    assert main(["info", "b"]) == 0
    out = capsys.readouterr().out
    for part in ("a: killed", "vesdyn resume b", "t = 0.25 of 1.2 after 1 steps", "numba", "warning: drag"):
        assert part in out


@pytest.mark.parametrize("out", ["a.yaml", "a.yaml/b/c"])
@pytest.mark.parametrize("command", ["run", "batch"])
def test_out_that_is_a_file_is_told_before_anything_is_planned(case_file, monkeypatch, capsys, command, out):
    monkeypatch.setattr(planning, "plan", lambda case: pytest.fail("planned"))
    assert main([command, case_file, "--out", out, "--set", "model=auto"]) == 2
    printed, told = capsys.readouterr()
    assert printed == "" and told.startswith(f"vesdyn: {out}: ") and len(told.splitlines()) == 1
    assert told.endswith("a.yaml is a file, not a directory; choose another --out.\n")


def test_a_shipped_case_is_run_by_its_name(case_file, calls, capsys):
    assert main(["run", "quick", "--set", "time.end=0.05"]) == 0
    assert calls[0][0].name == "quick" and calls[0][0].time.end == 0.05
    assert "output.frames: 0.06 is after the end of the run, 0.05, and left out." in capsys.readouterr().err
    assert main(["run", "quick", "--set", "time.end=0.05", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_template_is_a_case(case_file, capsys, tmp_path):
    assert main(["template"]) == 0
    (tmp_path / "b.yaml").write_text(capsys.readouterr().out)
    assert load_case(tmp_path / "b.yaml") == Case(name="typical")


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"vesdyn {vesdyn.__version__}\n"


def test_no_command_is_status_2():
    with pytest.raises(SystemExit) as stop:
        main([])
    assert stop.value.code == 2


@pytest.mark.parametrize("argument", ["--help", "template"])
def test_light_commands_import_nothing_heavy(argument):
    code = (
        "import sys\nfrom vesdyn.cli import main\n"
        f"try: main([{argument!r}])\nexcept SystemExit: pass\n"
        "print([m for m in ('numba', 'scipy', 'matplotlib', 'trimesh') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"
