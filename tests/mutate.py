"""Breaks the sources in one place at a time and tells which fast test turns red; writes docs/mutations.md.

    python tests/mutate.py docs/mutations.md [--jobs N] [-k NAME]

The table is tests/mutations.py. Each mutation is applied to a scratch copy of the tree, never to the tree itself, and
the tests that are named with it, those under `verify` left out, must fail at one of them at least. The exit status is 1
where a mutation survives, where the text to be replaced does not stand exactly once in its file, or where the tests
named do not pass without the mutation. With -k, which takes a part of what is broken or of the name of a file, the other
lines of the page stay as they are.
"""

import argparse
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from mutations import TABLE

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("vesdyn", "tests", "configs", "plots", "docs", "benchmarks", "setup.cfg", "pyproject.toml", "README.md")
LIMIT = 300  # [s] for the tests of one mutation, ten times that for all of them: what takes longer has not seen it
PAGE = """\
# Mutations: what is broken on purpose, and the test that sees it

Written by `make mutate` from `tests/mutations.py`: the sources are broken in one place at a time, in a copy, and the
fast tests named there are run. {caught} of {all} were seen, {untried} were not tried since they changed.
"""
NOTHING, UNTRIED = "nothing", "not tried yet"


class Mutation(NamedTuple):
    """One line of the table: a text of one source file and what it is replaced by."""

    kind: str
    what: str  # is broken, in words
    file: str  # in vesdyn/
    old: str
    new: str
    tests: tuple  # arguments of pytest, paths from tests/ on; first the environment, NAME=VALUE


class Result(NamedTuple):
    """What a run of pytest came to."""

    passed: bool
    seen_by: str | None  # the first test that failed, file::name
    words: str  # the end of what pytest printed


def mutations(part=""):
    """The `Mutation` of each line of the table with ``part`` in its words or its file."""
    listed = [
        Mutation(kind, what, file, old, new, tuple(tests.split()))
        for kind, files in TABLE.items()
        for file, lines in files.items()
        for what, old, new, tests in lines
    ]
    return [mutation for mutation in listed if part in mutation.what or part in mutation.file]


def times_found(mutation, package=ROOT / "vesdyn"):
    """How often the text that is to be replaced stands in its file."""
    return (package / mutation.file).read_text(encoding="utf-8").count(mutation.old)


class Copy:
    """A scratch copy of the tree in ``directory``, with compiled code of its own."""

    def __init__(self, directory):
        self.tree = directory / "tree"
        for name in COPIED:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, self.tree / name, ignore=shutil.ignore_patterns("__pycache__", "out"))
            else:
                shutil.copy2(source, self.tree / name)
        cache = directory / "cache"
        cache.mkdir(mode=0o700)
        self.environment = os.environ | {"PYTHONPATH": str(self.tree), "NUMBA_CACHE_DIR": str(cache)}

    def run(self, tests, to_the_end=False):
        """Run the ``tests`` (see `Mutation`) up to the first that fails, or ``to_the_end``; return a `Result`."""
        command = [sys.executable, "-m", "pytest", "-q", "-rfE", "--tb=no", "--no-header", "-p", "no:cacheprovider"]
        command += ["-p", "no:xdist", "-m", "not verify", *([] if to_the_end else ["-x"])]
        environment = dict(word.split("=") for word in tests if is_setting(word))
        command += [word for word in tests if not is_setting(word)]
        process = subprocess.Popen(
            command, cwd=self.tree / "tests", env=self.environment | environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        try:
            words, _ = process.communicate(timeout=LIMIT * (10 if to_the_end else 1))
        except subprocess.TimeoutExpired:
            return Result(False, None, f"no answer in {LIMIT} s")
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        failed = re.search(r"^(?:FAILED|ERROR) (?:tests/)?(\S+::\w+)", words, re.MULTILINE)
        return Result(process.returncode == 0, failed and failed[1], words[-1500:])

    def run_mutated(self, mutation):
        """Run the tests of ``mutation`` with it; the copy is then as it was."""
        file = self.tree / "vesdyn" / mutation.file
        status, text = file.stat(), file.read_text(encoding="utf-8")
        file.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
        try:
            return self.run(mutation.tests)
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))  # else its kernels are compiled anew


def groups(chosen, most):
    """The tests of the mutations ``chosen``, each once, in at most ``most`` groups for each environment."""
    by_environment = {}
    for mutation in chosen:
        environment = tuple(word for word in mutation.tests if is_setting(word))
        by_environment.setdefault(environment, {}).update(dict.fromkeys(mutation.tests))
    for environment, words in by_environment.items():
        tests = [word for word in words if not is_setting(word)]
        for first in range(min(most, len(tests))):
            yield [*environment, *tests[first::most]]


def is_setting(word):
    """True for NAME=VALUE, part of an environment."""
    return re.fullmatch(r"[A-Z_]+=\S+", word) is not None


def stored(page):
    """What the file ``page`` says of each mutation of the table: the test that saw it, NOTHING or UNTRIED."""
    rows = re.findall(r"^\| (.+) \| `(\w+\.py)` \| `?([^`]+)`? \|$", page.read_text(encoding="utf-8") if page.exists() else "", re.MULTILINE)
    found = {(what, file): test for what, file, test in rows}
    return {mutation: found.get((mutation.what, mutation.file), UNTRIED) for mutation in mutations()}


def page(seen):
    """The page, as text; ``seen`` maps each mutation to the test that saw it, NOTHING or UNTRIED."""
    caught = sum(test not in (NOTHING, UNTRIED) for test in seen.values())
    lines = [PAGE.format(caught=caught, all=len(seen), untried=list(seen.values()).count(UNTRIED))]
    for kind in TABLE:
        lines += [f"## {kind}", "", "| broken | in | seen by |", "|---|---|---|"]
        lines += [
            f"| {mutation.what} | `{mutation.file}` | {test if test in (NOTHING, UNTRIED) else f'`{test}`'} |"
            for mutation, test in seen.items()
            if mutation.kind == kind
        ]
        lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("page", type=Path, nargs="?", help="page to write")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes side by side (default: 2)")
    parser.add_argument("-k", default="", metavar="NAME", help="only those with this in their words or file")
    arguments = parser.parse_args()
    began, chosen = time.monotonic(), mutations(arguments.k)
    lost = [mutation for mutation in chosen if times_found(mutation) != 1]
    for mutation in lost:
        print(f"{mutation.file}: {mutation.what}: the text to be replaced stands {times_found(mutation)} times in it, not once.")
    if lost or not chosen:
        raise SystemExit(1)

    with tempfile.TemporaryDirectory(prefix="vesdyn-mutate-") as scratch, ThreadPoolExecutor(arguments.jobs) as pool:
        copies = queue.SimpleQueue()
        for job in range(arguments.jobs):
            copies.put(Copy(Path(scratch, str(job))))

        def borrow(work):
            copy = copies.get()
            try:
                return work(copy)
            finally:
                copies.put(copy)

        together = groups(chosen, arguments.jobs)
        sound = list(pool.map(lambda tests: borrow(lambda copy: copy.run(tests, to_the_end=True)), together))
        for result in sound:
            if not result.passed:
                print(f"These tests do not pass without a mutation.\n{result.words}", flush=True)
        if not all(result.passed for result in sound):
            raise SystemExit(1)
        print(f"The tests named pass without a mutation ({time.monotonic() - began:.0f} s).", flush=True)

        results = pool.map(lambda mutation: borrow(lambda copy: copy.run_mutated(mutation)), chosen)
        seen = {}
        for mutation, result in zip(chosen, results):
            seen[mutation] = result.seen_by or NOTHING
            told = f"seen by {result.seen_by}" if result.seen_by else f"SURVIVES\n{result.words}"
            print(f"{mutation.file}: {mutation.what}: {told}", flush=True)
    survivors = [mutation for mutation, test in seen.items() if test == NOTHING]
    print(f"{len(chosen) - len(survivors)} of {len(chosen)} mutations are seen ({time.monotonic() - began:.0f} s).")
    for mutation in survivors:
        print(f"survives: {mutation.file}: {mutation.what}")
    if arguments.page:
        arguments.page.write_text(page(stored(arguments.page) | seen), encoding="utf-8")
    raise SystemExit(bool(survivors))


if __name__ == "__main__":
    main()
