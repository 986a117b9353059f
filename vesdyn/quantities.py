"""Numbers read off the history of a run, and formulas of such numbers.

A quantity is a function of one curve, written as in

    final(soft)                        last value of the binding area [a0^2]
    at(soft, 0.14, contact_radius)     value at a time [a0^2/D]; once the run has ended, its last one
    largest(typical, density_max)      over all times; smallest(...) likewise
    time_of(typical, 0.95)             when that part of the final binding area is reached first [a0^2/D]
    exponent(typical, 0.1)             local exponent d ln A / d ln t, the slope from t/1.1 to 1.1 t
    fitted_exponent(typical, 0.95)     slope of ln A on ln t from t = 0.01 until that part of the final area

the column being the binding area where none is named. A formula combines quantities and numbers by + - * / **,
parentheses, min, max, log and abs: `final(strong) / final(weak) - 1`.
"""

import ast
import operator
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from vesdyn.errors import CaseError

START = 0.01  # before this time [a0^2/D] the accuracy wish promises nothing
SLOPE_FACTOR = 1.1  # of time, to either side of a local exponent
COLUMNS = "binding_area", "contact_radius", "density_min", "density_max"  # of a history, that formulas may use
_FIT_POINTS = 60


def value_at(rows, column, times):
    """A column of a history at ``times`` [a0^2/D]; once the run has ended, its last value.

    Between the steps it is interpolated by a cubic spline in sqrt(t), in which it is smooth at the start.
    """
    return CubicSpline(np.sqrt(rows["time"]), rows[column])(np.sqrt(np.clip(times, rows["time"][0], rows["time"][-1])))


def final(rows, column="binding_area"):
    return rows[column][-1]


def at(rows, time, column="binding_area"):
    return value_at(rows, column, time)


def largest(rows, column):
    return np.max(rows[column])


def smallest(rows, column):
    return np.min(rows[column])


def time_of(rows, part):
    area = np.maximum.accumulate(rows["binding_area"])
    return np.interp(part * rows["binding_area"][-1], area, rows["time"])


def exponent(rows, time):
    before, after = value_at(rows, "binding_area", np.array([time / SLOPE_FACTOR, time * SLOPE_FACTOR]))
    return np.log(after / before) / (2.0 * np.log(SLOPE_FACTOR))


def fitted_exponent(rows, part):
    times = np.geomspace(START, max(time_of(rows, part), 2.0 * START), _FIT_POINTS)
    return np.polyfit(np.log(times), np.log(value_at(rows, "binding_area", times)), 1)[0]


# function: whether its values are positive and vary by ratios, so that their logarithm is emulated
_READINGS = {final: True, at: True, largest: True, smallest: True, time_of: True, exponent: False, fitted_exponent: False}
READINGS = {function.__name__: function for function in _READINGS}
_OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow}
_FUNCTIONS = {"min": np.minimum, "max": np.maximum}
_UNARY = {"log": np.log, "abs": np.abs}


class Quantity(NamedTuple):
    """One number of one curve: the name of a function of this module, the name of a case, further arguments."""

    function: str
    case: str
    arguments: tuple

    def __str__(self):
        return f"{self.function}({', '.join(str(part) for part in (self.case, *self.arguments))})"

    @property
    def by_ratio(self):
        """True where the quantity is positive and its logarithm is the better number to interpolate."""
        return _READINGS[READINGS[self.function]]

    def of(self, rows):
        """The number, from the history ``rows`` (columns as arrays) of the case."""
        return float(READINGS[self.function](rows, *self.arguments))


class Formula:
    """A formula of quantities, read from ``text``; ``cases`` are the names of cases it may use.

    Raises CaseError with a sentence where it cannot be read.
    """

    def __init__(self, text, cases):
        self.text, self.quantities = str(text), []
        try:
            tree = ast.parse(self.text, mode="eval").body
        except SyntaxError:
            raise CaseError(f"{self.text}: not a formula; write for instance final(typical) / 2.") from None
        self._value = self._read(tree, cases)

    def __repr__(self):
        return f"Formula({self.text!r})"

    @classmethod
    def of(cls, quantity):
        """The formula that is one quantity."""
        return cls(str(quantity), (quantity.case,))

    def value(self, numbers):
        """The value where ``numbers`` maps each of ``quantities`` to a number or to an array of them."""
        return self._value(numbers)

    def _read(self, node, cases):
        match node:
            case ast.Constant(value=int() | float() as number):
                return lambda _: number
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = self._read(operand, cases)
                return lambda numbers: -inner(numbers)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                combine, a, b = _OPERATORS[type(op)], self._read(left, cases), self._read(right, cases)
                return lambda numbers: combine(a(numbers), b(numbers))
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in _UNARY:
                function, inner = _UNARY[name], self._read(argument, cases)
                return lambda numbers: function(inner(numbers))
            case ast.Call(func=ast.Name(id=name), args=[first, *others], keywords=[]) if name in _FUNCTIONS:
                function, parts = _FUNCTIONS[name], [self._read(part, cases) for part in (first, *others)]

                def folded(numbers):
                    value = parts[0](numbers)
                    for part in parts[1:]:
                        value = function(value, part(numbers))
                    return value

                return folded
            case ast.Call(func=ast.Name(id=name), args=[ast.Name(id=curve), *arguments], keywords=[]) if name in READINGS:
                quantity = self._quantity(name, curve, arguments, cases)
                return lambda numbers: numbers[quantity]
        raise CaseError(
            f"{self.text}: {ast.unparse(node)} is no part of a formula; use numbers, + - * / **, min, max, log, abs and"
            f" {', '.join(READINGS)} of a case."
        )

    def _quantity(self, name, curve, arguments, cases):
        if curve not in cases:
            raise CaseError(f"{self.text}: there is no case {curve}; there are {', '.join(cases)}.")
        values = tuple(_argument(part, self.text) for part in arguments)
        quantity = Quantity(name, curve, values)
        try:
            quantity.of(_SPECIMEN)
        except (TypeError, ValueError, KeyError):
            raise CaseError(
                f"{self.text}: {quantity} has wrong arguments; write for instance at(typical, 0.14, contact_radius)."
            ) from None
        if quantity not in self.quantities:
            self.quantities.append(quantity)
        return quantity


def _argument(node, text):
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=column) if column in COLUMNS:
            return column
    raise CaseError(f"{text}: {ast.unparse(node)} is neither a number nor one of {', '.join(COLUMNS)}.")


_SPECIMEN = {"time": np.linspace(0.001, 1.0, 50), **{column: np.linspace(0.1, 1.0, 50) for column in COLUMNS}}
