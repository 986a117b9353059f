"""The command line: ``vesdyn run``, ``batch``, ``infer``, ``explain``, ``scales``, ``resume``, ``info``, ``compare``, ``movie``, ``template``.

Exit status 0: done; 1: the run failed; 2: the case or the command cannot be used; 130: interrupted.
"""

import argparse
import errno
import math
import sys
import warnings
from collections import Counter
from pathlib import Path

from vesdyn import interrupts

# Imports of the parts are inside the commands, so that each command waits for what it uses only.


def main(argv=None):
    """Carry out the command line ``argv`` (by default that of the process); return the exit status."""
    try:
        if argv is None:
            interrupts.open_standard_streams()
            interrupts.watch()
        status = _obey(argv)
    except SystemExit as end:  # of --help, and where the command line cannot be understood
        if argv is not None:
            raise
        status = end.code or 0
    except (KeyboardInterrupt, Exception) as error:
        if interrupts.came() or isinstance(error, KeyboardInterrupt):  # a library may make its own error of it
            return interrupts.end() if argv is None else 130
        raise
    if argv is None:
        if status == 130:
            interrupts.end()
        sys.stdout.abandon()
        sys.stderr.abandon()
        fault = sys.stdout.fault
        if fault and fault.errno not in (errno.EPIPE, errno.EIO):  # else the reader has ended, or the terminal is gone
            return _refuse(f"standard output: {fault.strerror}; let the words go elsewhere.", status or 1)
    return status


def _obey(argv):
    """Carry out the command line ``argv``; return its exit status."""
    from vesdyn.errors import CaseError, RunError

    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, *_: _refuse(f"warning: {message}", None)
            arguments = _parser().parse_args(argv)
            return arguments.command(arguments)
    except CaseError as error:
        return _refuse(error, 2)
    except RunError as error:
        return _refuse(error, getattr(error, "exit_status", 1))
    except OSError as error:
        return _refuse(error, 1)


def _refuse(error, exit_status):
    """Print the sentences of ``error`` to stderr, control characters escaped; return ``exit_status``."""
    from vesdyn.refusals import printable

    for sentence in str(error).splitlines():
        print(f"vesdyn: {printable(sentence, len(sentence))}", file=sys.stderr)
    return exit_status


def _parser():
    parser = argparse.ArgumentParser(prog="vesdyn", description="A vesicle spreads on a substrate.")
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name, function, summary, operand, meaning):
        command = commands.add_parser(name, help=summary, description=summary)
        command.set_defaults(command=function)
        if operand:
            command.add_argument(operand.lower(), metavar=operand, type=Path, help=meaning)
        return command

    quiet = {"action": "store_true", "help": "print nothing but errors"}
    case_file = "the case file (YAML), or the name of a shipped case"
    run = add("run", _run, "run a case, or go on with it if it was interrupted", "CASE", case_file)
    run.add_argument("--out", type=Path, metavar="DIR", help="where the run is stored (default: runs/<name>)")
    run.add_argument(
        "--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="replace a key of the case: --set time.end=0.5"
    )
    run.add_argument("--restart", action="store_true", help="remove an earlier run in the directory first")
    run.add_argument("--quiet", **quiet)
    batch = add("batch", _batch, "run many cases at once, or go on with them", None, None)
    batch.add_argument("configs", metavar="CONFIG", nargs="+", type=Path, help="a case file, also with a sweep")
    batch.add_argument("--jobs", type=_count, metavar="N", help="processes on this machine (default: one a core)")
    batch.add_argument("--out", type=Path, default=Path("runs"), metavar="DIR", help="runs go to DIR/<name>")
    batch.add_argument("--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler, in a network that is trusted")
    batch.add_argument("--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="replace a key")
    batch.add_argument("--restart", action="store_true", help="compute finished runs anew, too")
    batch.add_argument("--quiet", **quiet)
    infer = add("infer", _infer, "infer unknown parameters from data, or go on with it", "FILE", "the inference file (YAML)")
    infer.add_argument("--out", type=Path, metavar="DIR", help="where runs and results go (default: runs/<name>)")
    infer.add_argument("--jobs", type=_count, metavar="N", help="processes on this machine (default: one a core)")
    infer.add_argument("--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler")
    infer.add_argument("--hold", nargs="+", default=[], metavar="KEY=VALUE", help="tell also of the rest with these held")
    infer.add_argument("--direct", type=_count, metavar="N", help="compare with a sampler that runs N points, no emulator")
    infer.add_argument("--trials", type=_count, metavar="N", help="N synthetic experiments: are the unknowns recovered?")
    infer.add_argument("--no-claims", action="store_true", help="leave out what each claim is worth without itself")
    explain = add("explain", _explain, "say what a case will compute and leave out", "CASE", case_file)
    explain.add_argument("--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="replace a key of the case")
    scales = add("scales", _scales, "say what a case is in SI, and which ratios decide its motion", "CASE", case_file)
    scales.add_argument("--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="replace a key of the case")
    resume = add("resume", _resume, "go on with an interrupted run", "DIR", "the directory of the run")
    resume.add_argument("--until", metavar="TIME", help="go on to this later end: short for --set time.end=TIME")
    resume.add_argument(
        "--set", action="extend", nargs="+", default=[], metavar="KEY=VALUE", help="change a key that changes nothing computed so far"
    )
    resume.add_argument("--quiet", **quiet)
    add("info", _info, "say how a run stands", "DIR", "the directory of the run")
    compare = add("compare", _compare, "put runs side by side", None, None)
    compare.add_argument("runs", metavar="RUN", nargs="+", type=Path, help="the directory of a run")
    compare.add_argument("--plot", type=Path, metavar="FILE", help="also draw their binding areas over time (PNG)")
    compare.add_argument("--csv", action="store_true", help="print a CSV file, numbers in full")
    movie = add("movie", _movie, "draw the stored shapes of a run as a movie", "DIR", "the directory of the run")
    movie.add_argument("--out", type=Path, metavar="FILE", help="an .mp4 (by ffmpeg) or .gif (default: DIR/movie.*)")
    movie.add_argument("--seconds", type=float, default=6.0, metavar="S", help="how long it lasts (default: 6)")
    movie.add_argument("--elevation", type=float, metavar="DEG", help="of the camera; -90: from below (default: 13)")
    movie.add_argument("--turn", type=float, default=0.0, metavar="DEG", help="the vesicle about its axis")
    add("template", _template, "print a commented case file with every key", None, None)
    return parser


def commands():
    """The parser of each command, by name."""
    (found,) = (action.choices for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    return found


def _count(text):
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"{text} is not a number of processes; give 1 or more")
    return int(text)


class _Version(argparse.Action):
    def __call__(self, parser, *_):
        from vesdyn import __version__

        print(f"vesdyn {__version__}")
        parser.exit()


def _run(arguments):
    from vesdyn.case_file import load_case
    from vesdyn.planning import needs_planning, plan
    from vesdyn.storage import RunDirectory

    if arguments.quiet:
        warnings.simplefilter("ignore")
    case, decisions = load_case(arguments.case, arguments.set), ()
    directory = arguments.out or Path("runs", case.name)
    RunDirectory(directory).check_usable()
    if needs_planning(case):
        case, decisions = plan(case)
        if not arguments.quiet:
            print(*decisions, sep="\n")
    return _compute(case, directory, arguments.quiet, arguments.restart, decisions)


def _batch(arguments):
    from vesdyn.batch import check_directory, read_cases, run_batch
    from vesdyn.refusals import LONGEST, printable

    if arguments.quiet:
        warnings.simplefilter("ignore")
    check_directory(arguments.out)
    cases = read_cases(arguments.configs, arguments.set)
    options = (arguments.jobs, arguments.scheduler, arguments.restart, not arguments.quiet)
    results = run_batch(cases, arguments.out, *options)
    counts = Counter(outcome.state for _, outcome in results)
    if not arguments.quiet:
        print(f"{printable(str(arguments.out), LONGEST)}: {', '.join(f'{number} {state}' for state, number in counts.items())}.")
        if counts["interrupted"]:
            print("Go on by the same command.")
    for case, outcome in results:
        if outcome.state == "failed":
            _refuse(f"{arguments.out / case.name}: {outcome.reason}", 1)
    return 130 if counts["interrupted"] else 1 if counts["failed"] else 0


def _infer(arguments):
    from vesdyn.inference_file import Inference, read_held
    from vesdyn.inference_report import carry_out

    inference = Inference(arguments.file)
    directory = arguments.out or Path("runs", inference.name)
    carry_out(
        inference,
        directory,
        jobs=arguments.jobs,
        scheduler=arguments.scheduler,
        held=read_held(inference, arguments.hold),
        n_direct=arguments.direct or 0,
        n_trials=arguments.trials or 0,
        with_claims=not arguments.no_claims,
        tell=lambda line: print(line, flush=True),
    )
    print((directory / "report.md").read_text())
    return 0


def _explain(arguments):
    from vesdyn.case_file import load_case
    from vesdyn.planning import plan

    case = load_case(arguments.case, arguments.set)
    planned, decisions = plan(case)
    print(f"{case.name}: accuracy wish {case.accuracy:.2%} of the binding area", *decisions, sep="\n  ")
    for sentence in planned.warnings():
        print(f"  warning: {sentence}")
    return 0


def _scales(arguments):
    from vesdyn.case_file import load_case
    from vesdyn.scales import told

    print(told(load_case(arguments.case, arguments.set)))
    return 0


def _resume(arguments):
    from vesdyn.case_file import load_case

    from vesdyn.storage import RunDirectory

    directory = RunDirectory(arguments.dir)
    directory.check_there()
    changes = arguments.set + ([f"time.end={arguments.until}"] if arguments.until else [])
    case = directory.stored_case()
    if changes:
        case = load_case(directory.case_file, changes)
    return _compute(case, arguments.dir, arguments.quiet)


def _compute(case, directory, quiet, restart=False, decisions=()):
    from vesdyn.run import run_case

    if quiet:
        warnings.simplefilter("ignore")
    outcome = run_case(case, directory, progress=not quiet, restart=restart, decisions=decisions)
    _tell(outcome, directory, quiet, case.scales)
    return outcome.exit_status


def _tell(outcome, directory, quiet, scales):
    """Print how the run ended."""
    from vesdyn.refusals import LONGEST, argument, printable

    shown = printable(str(directory), LONGEST)
    if outcome.state == "failed":
        _refuse(f"{shown}: {outcome.reason}", 1)
    elif not quiet:
        print(f"{shown}: {outcome.reason}" if outcome.reason else f"{shown}: finished.")
    if not quiet:
        print(_figures(outcome, scales))
        if outcome.state == "finished":
            files = ("summary.png", "history.csv", "frames.xdmf", "frames.h5", "case.yaml")
            print(f"  files: {', '.join(files)} in {shown}")
        if outcome.note:
            print(f"  note: {outcome.note}.")
    if outcome.state == "interrupted" and not quiet:
        print(f"Go on with it by: vesdyn resume {argument(directory)}")


def _believed(error):
    """What a run believes of its binding area, in brackets."""
    return " (error not known)" if math.isnan(error) else f" (believed to {error:.1%})"


def _figures(outcome, scales):
    from vesdyn.units import beside

    minutes, seconds = divmod(outcome.wall_time, 60)
    time, area = beside(outcome.time, "a0^2/D", scales), beside(outcome.binding_area, "a0^2", scales)
    return "\n".join(
        (
            f"  t = {outcome.time:g}{time} after {outcome.steps} steps in {minutes:.0f} min {seconds:04.1f} s",
            f"  binding area                  {outcome.binding_area:.6g} a0^2{area}{_believed(outcome.area_error)}",
            f"  largest volume error          {outcome.volume_error:.1e}",
            f"  largest receptor-number error {outcome.receptor_number_error:.1e}",
        )
    )


def _info(arguments):
    from vesdyn.refusals import argument
    from vesdyn.storage import RunDirectory
    from vesdyn.units import beside

    directory = RunDirectory(arguments.dir)
    directory.check_there()
    case = directory.stored_case()
    scales = case.scales
    status, faults, origin = directory.status(), directory.faults(), directory.origin() or {}
    history = {} if faults else directory.history()
    units = {} if faults else {row["column"]: row["unit"] for row in directory.described_columns()}
    state = status.get("state") or ("unknown" if history else "not begun")
    if state == "running" and not directory.busy():
        state = "killed"
    advice = {"finished": "", "running": ""}.get(state, f"  (vesdyn resume {argument(arguments.dir)})")
    print(f"{case.name}: {'damaged' if faults else state + advice}")
    if status.get("reason"):
        print(f"  {status['reason']}")
    if history:
        reached = beside(history["time"][-1], "a0^2/D", scales)
        print(f"  t = {history['time'][-1]:g}{reached} of {case.time.end:g} after {len(history['time'])} steps")
        print(f"  wall time {status.get('wall_time', 0.0):.1f} s up to the last checkpoint")
        for column in ("binding_area", "pressure", "density_min", "density_max", "residual"):
            if column in history:
                value = history[column][-1]
                print(f"  {column:<24} {value:.6g}{beside(value, units.get(column, ''), scales)}")
        for column in ("volume_error", "receptor_number_error"):
            if column in history:
                print(f"  {column:<24} {max(abs(history[column])):.1e} at most")
    print(f"  frames at t = {', '.join(f'{t:g}' for t in directory.frame_times()) or 'none yet'}")
    parts = ("vesdyn", "commit", "python", "numba", "numpy", "scipy")
    print(f"  computed by {', '.join(f'{part} {origin[part]}' for part in parts if part in origin)}")
    for sentence in origin.get("warnings", ()):
        print(f"  warning: {sentence}")
    for fault in faults:
        _refuse(fault, 1)
    return 1 if faults else 0


def _compare(arguments):
    from vesdyn import comparison

    runs = comparison.open_runs(arguments.runs)
    histories = comparison.histories(runs)
    rows = comparison.rows(runs, histories)
    if arguments.csv:
        print(comparison.as_csv(rows), end="")
    else:
        print(comparison.as_text(rows, [run.case.scales for run in runs]))
    if arguments.plot:
        comparison.draw(runs, histories, arguments.plot.parent, arguments.plot.name)
    return 0


def _movie(arguments):
    from vesdyn import movie
    from vesdyn.results import open_run

    run = open_run(arguments.dir)
    elevation = movie.ABOVE if arguments.elevation is None else arguments.elevation
    file = arguments.out or run.path / movie.default_name()
    print(movie.write_movie(run, file, arguments.seconds, elevation, arguments.turn))
    return 0


def _template(arguments):
    from vesdyn.case_file import template

    print(template(), end="")
    return 0
