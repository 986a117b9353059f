"""Thousands of inputs made from the schema: each is a case that works, or refused by sentences that say where.

Every key takes every value below, from a file, from `--set`, from a sweep and from Python; whole files are the ones
that a YAML reader trips over. An input that is accepted has warnings, a hash and a way to YAML and back; one that is
refused is refused with CaseError, each line of which names its source and key, is short, holds no control character,
and none of the words of the libraries underneath.
"""

import itertools
import pickle
import warnings

import pytest

from vesdyn import plain_yaml
from vesdyn.case import SECTIONS, Case
from vesdyn.case_file import load_case, load_sweep
from vesdyn.errors import CaseError

KEYS = [f"{section}.{key}" if key else section for section in SECTIONS for key in SECTIONS[section] or [""]]
PLACES = [*KEYS, *(section for section in SECTIONS if SECTIONS[section]), "membrane.thicknes", "x", "drag.x", "time.end.x"]
VALUES = [  # as they are written
    "", "~", "null", "true", "false", "yes", "text", "auto", "''", "' '", "'1'", "'auto'", "[]", "[1]", "[0.1, 0.2]",
    "[0.2, 0.1]", "[[1]]", "[x]", "[null]", "[.nan]", "[-1]", "[1e300]", "[5e-324]", "{}", "{a: 1}", "{1: 2}",
    "{end: 1}", "-1", "-0.0", "0", "0.0", "1", "2", "1.0", "0.3", "3.5", "100", "-1e300", "1e300", "-5e-324", "5e-324",
    "1e-300", "1e-12", ".nan", ".inf", "-.inf", "1e999", "-1e999", "9" * 30, "9" * 500, "9" * 5000, "0." + "3" * 5000,
    "010", "0x10", "0o10", "9_6", "1:30", "1e", "--1", "1%", "x%", "1e999%", "2001-01-01", "a" * 500, "../a", "a/b",
    '"a\\0b"', '"\\e[31m"', '"a\\nb"', '"\\u202e"', "é", "surface", "rings", "kinetic", "double_well", "stripes",
    "[" + "0.1, " * 1500 + "0.2]", "[" * 40 + "]" * 40,
]  # fmt: skip
OBJECTS = [None, True, object(), b"a", 1 + 2j, set(), (1, 2), range(3), float("nan"), float("inf"), 10**400, -(10**400),
           5e-324, Case, lambda: 1, {1: 2}, {None: 1}, "\ud800", "\0", [float("nan")], [[]], Case(name="a"),
           Case(name="a").mesh]  # fmt: skip
DOCUMENTS = {
    name: text if isinstance(text, bytes) else text.encode()
    for name, text in {
        "list as key": "name: a\n? [a]\n: 1", "mapping as key": "{a: b}: 1", "null as key": "~: 1",
        "empty key": "name: a\n: 1", "tag int": "name: a\ndrag: !!int ''", "tag float": "drag: !!float x",
        "tag timestamp": "name: !!timestamp abc", "tag bool": "name: !!bool abc", "tag map": "mesh: !!map [1]",
        "tag set": "mesh: !!set {a}", "tag omap": "mesh: !!omap [a]", "tag pairs": "mesh: !!pairs [a]",
        "tag binary": "name: !!binary '@'", "tag null": "name: !!null x", "tag seq": "mesh: !!seq {a: 1}",
        "tag python": "name: !!python/object/apply:os.system ['true']", "own tag": "name: !mine a",
        "long tag": f"name: !{'t' * 500} a", "unknown handle": "name: !e!x a", "tag merge": "mesh: !!merge x",
        "tag value": "name: !!value x", "base with nul": 'name: a\nbase: "a\\0b"', "base is a list": "base: [a]",
        "base is empty": "name: a\nbase: ''", "base is a folder": "name: a\nbase: .", "long base": f"base: {'a' * 5000}",
        "long base path": f"base: {'a/' * 3000}", "base with escape": 'base: "\\e[31m.yaml"', "base is a number": "base: 3",
        "base is itself": "name: a\nbase: case.yaml", "base is a device": "base: /dev/zero",
        "mesh is a device": "name: a\nmesh: {file: /dev/zero}", "mesh is a folder": "name: a\nmesh: {file: .}",
        "mesh with nul": 'name: a\nmesh: {file: "a\\0b"}', "long mesh": f"name: a\nmesh: {{file: {'a' * 5000}}}",
        "sweep 3": "name: a\nsweep: 3", "sweep list": "name: a\nsweep: [1]", "sweep of 3": "name: a\nsweep: {3: [1]}",
        "sweep of null": "name: a\nsweep: {~: [1]}", "sweep of list": "name: a\nsweep: {? [a] : [1]}",
        "sweep no list": "name: a\nsweep: {drag: 1}", "sweep empty": "name: a\nsweep: {drag: []}",
        "sweep into a value": "name: a\nsweep: {drag.x: [1]}", "sweep of an empty key": "name: a\nsweep: {'': [1]}",
        "sweep of dots": "name: a\nsweep: {..: [1]}", "sweep of names": "name: a\nsweep: {name: [a, 3]}",
        "sweep of the sweep": "name: a\nsweep: {sweep: [1]}", "sweep of base": "name: a\nsweep: {base: [a]}",
        "long sweep": f"name: a\nsweep: {{drag: [{'1, ' * 500}]}}", "deep sweep": "name: a\nsweep: {a.b.c.d: [1]}",
        "unclosed": "name: {a", "unclosed text": "name: 'a", "unclosed list": "a: [1", "two documents": "name: a\n---\nb: 1",
        "document end": "name: a\n...\nb", "tab": "name: a\n\tdrag: 1", "colon": "name: a: b", "percent": "%FOO\n---\nname: a",
        "directive": "%YAML 3.0\n---\nname: a", "bad directive": "%YAML x\n---\na", "alias": "name: *a", "at": "name: @a",
        "backtick": "name: `a`", "bad escape": 'name: "\\q"', "bad unicode": 'name: "\\ud800"', "block": "name: |\n a\n b",
        "huge unicode": 'name: "\\UFFFFFFFF"', "bad block": "name: |9x\n a", "dashes": "- a\n-b: 1", "anchor twice": "a: &a 1\nb: &a 2",
        "self reference": "name: &a [*a]", "self reference as key": "&a {*a : 1}", "merge": "<<: {drag: 1}\nname: a",
        "merge of text": "<<: a\nname: a", "deep list": "name: " + "[" * 3000, "deep mapping": "{a: " * 3000,
        "deep block": "\n".join(" " * i + "a:" for i in range(300)), "question marks": "? " * 3000, "dash dash": "- " * 3000,
        "many keys": "\n".join(f"k{i}: 1" for i in range(3000)), "long key": f"{'k' * 2000}: 1", "very long key": f"{'k' * 99000}: 1",
        "key twice": "name: a\nname: b", "key twice, long": f"{'k' * 900}: 1\n{'k' * 900}: 1", "nothing": "", "spaces": "  \n ",
        "comment": "# a", "null": "null", "dots": "...", "document": "---", "text": "a", "number": "1", "list": "- 1",
        "nul": b"name: a\0", "escape": b"name: \x1b[31m", "latin": b"name: \xe9", "utf-16": "name: a".encode("utf-16"),
        "utf-32": "name: a".encode("utf-32"), "bom": b"\xef\xbb\xbfname: a", "random": bytes(range(256)), "surrogate": b"name: \xed\xa0\x80",
        "noncharacter": "name: \ufffe", "next line": "name: a\x85drag: 1", "separator": "name: a\u2028drag: 1",
        "carriage return": "name: a\rdrag: 1", "dotted twice": "name: a\ntime.end: 1\ntime: {end: 2}", "dotted": "name: a\ntime.end: 1",
        "dots as key": "name: a\n..: 1", "dotted deep": "name: a\ntime.end.x.y: 1", "key with colon": "name: a\n'a: b': 1",
        "provenance": "name: a\nprovenance: 3", "defaults": "name: a\ndefaults: [1]", "defaults of text": "name: a\ndefaults: {drag: x}",
        "defaults in defaults": "name: a\ndefaults: {defaults: 1}", "integer of 5000 digits": f"name: a\nx: {'9' * 5000}",
    }.items()
}  # fmt: skip
FOREIGN = ("pydantic", "yaml.org", "Traceback", "Error", "validation", "Input should", "construct", "scanning",
           "parsing", "<stream", "<block", "<scalar", "<unicode", "NoneType", "unhashable", "codec", "recursion")  # fmt: skip


def check_accepted(case):
    """The case does what a case does."""
    assert all(0 < len(doubt) < 300 and "nan" not in doubt and "inf" not in doubt.split() for doubt in case.warnings())
    again = Case(**case.given_keys())
    assert again == case and again.hash == case.hash and len(case.hash) == 64
    assert pickle.loads(pickle.dumps(case)) == case


def check_refused(refused, begins, *places):
    """Each line of the refusal says where, in our words."""
    lines = str(refused).splitlines()
    assert 1 <= len(lines) <= 20
    for line in lines:
        assert line.startswith(begins), line
        assert any(place in line for place in places), line
        assert len(line) < 300 and line.isprintable() and line.endswith((".", "?")), line
        text = line.removeprefix(begins if isinstance(begins, str) else next(b for b in begins if line.startswith(b)))
        assert not any(word in text for word in FOREIGN), line


def tried(make, begins, *places):
    """How an input went: the accepted cases, or nothing."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            cases = make()
        except CaseError as refused:
            check_refused(refused, begins, *places)
            return []
    assert all(str(warning.message).startswith(begins) for warning in caught)
    return cases


@pytest.fixture
def write(tmp_path):
    """Return a function that writes a case file and returns its path."""
    path = tmp_path / "case.yaml"

    def write(text):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def nested(place, value):
    """YAML that has ``value`` at the dotted ``place``."""
    name = "" if place == "name" else "name: a\n"
    *sections, key = place.split(".")
    return name + "".join(f"{'  ' * i}{section}:\n" for i, section in enumerate(sections)) + "  " * len(sections) + f"{key}: {value}"


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.fault("n13")
def test_every_value_at_every_key_of_a_file(write, place):
    first = place.split(".")[0]
    for value in VALUES:
        path = write(nested(place, value))
        for case in tried(lambda: [load_case(path)], f"{path}: ", first, "line "):
            check_accepted(case)
            assert load_case(write(case.to_yaml())) == case


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.fault("n21")
def test_every_value_at_every_key_by_set_and_sweep(write, place):
    first = place.split(".")[0]
    path = write("name: a\ntime: {end: 1}\noutput: {frames: [0.1]}\nperturbation: {front: 0.01, at: 0.2}")
    for value in VALUES:
        for case in tried(lambda: [load_case(path, [f"{place}={value}"])], ("--set ", f"{path}: "), first):
            check_accepted(case)
        for case in tried(lambda: load_sweep(path, [f"sweep={{{place}: [{value or 'null'}]}}"]), ("--set ", f"{path}: "), first,
                          "name"):  # fmt: skip
            check_accepted(case)


@pytest.mark.parametrize("place", PLACES)
def test_every_object_at_every_key_in_python(place):
    first = place.split(".")[0]
    for value in [*OBJECTS, *(plain_yaml.read(value, "") for value in VALUES)]:
        for case in tried(lambda: [Case(**{"name": "a"} | {place: value})], "", first, "name"):
            check_accepted(case)
        for case in tried(lambda: [Case(name="a").changed(**{place: value})], "", first, "name"):
            check_accepted(case)


@pytest.mark.parametrize("document", DOCUMENTS)
@pytest.mark.fault("n12")
def test_every_file_that_is_none(write, document):
    path = write(DOCUMENTS[document])
    for make in (lambda: [load_case(path)], lambda: load_sweep(path)):
        for case in tried(make, f"{path}: ", ""):
            check_accepted(case)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_such_text_as_an_override(write, document):
    text = DOCUMENTS[document].decode("utf-8", "surrogateescape")
    path = write("name: a")
    for override in (text, f"mesh={text}", f"drag={text}", f"{text}=1"):
        for case in tried(lambda: [load_case(path, [override])], ("--set ", f"{path}: "), ""):
            check_accepted(case)


def test_pairs_of_extreme_values():
    """Every two keys at their limits."""
    extreme = {}
    for key in KEYS:
        for value in (1e-15, 1e-9, 1e-6, 1e-5, 0, 0.01, 0.5, 1, 10, 1000, 1e6, 1e9, 1e12, 2**63 - 1):
            try:
                Case(**{"name": "a", key: value})
            except CaseError:
                continue
            extreme.setdefault(key, []).append(value)
    for a, b in itertools.combinations(extreme, 2):
        for x, y in itertools.product({extreme[a][0], extreme[a][-1]}, {extreme[b][0], extreme[b][-1]}):
            for case in tried(lambda: [Case(**{"name": "a", a: x, b: y})], "", a, b):
                check_accepted(case)


def test_the_inputs_are_many():
    assert 3 * len(PLACES) * len(VALUES) + 5 * len(DOCUMENTS) > 10_000
