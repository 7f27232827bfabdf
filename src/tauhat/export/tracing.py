"""Arithmetic written down instead of done: straight-line C of any calculation that Python can run.

A `Scalar` stands for a number of the C function. Calculating with it notes the operation; what is known already (zero,
one, two constants) is done at once, what was calculated before is used again, and what no result needs is not written.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

_BINDING = {
    "add": 1,
    "sub": 1,
    "neg": 2,
    "mul": 3,
    "div": 3,
}  # how strongly an operation binds; names and calls: strongest
_STRONGEST = 4
_LONGEST_LINE = 100
_READS = re.compile(r"\w\[")  # an entry of an argument


class _Node(NamedTuple):
    """One operation on earlier nodes; a leaf has its C text, a constant its value."""

    operation: str
    operands: tuple[int, ...] = ()
    text: str = ""
    value: float = 0.0


class Scalar:
    """A number of the C function; arithmetic with it and with floats is traced."""

    __slots__ = ("index", "trace")

    def __init__(self, trace: Trace, index: int) -> None:
        self.trace = trace
        self.index = index

    def __add__(self, other: Scalar | float) -> Scalar:
        return self.trace.add(self, self.trace.scalar(other))

    def __sub__(self, other: Scalar | float) -> Scalar:
        return self.trace.subtract(self, self.trace.scalar(other))

    def __mul__(self, other: Scalar | float) -> Scalar:
        return self.trace.multiply(self, self.trace.scalar(other))

    def __truediv__(self, other: Scalar | float) -> Scalar:
        return self.trace.divide(self, self.trace.scalar(other))

    def __neg__(self) -> Scalar:
        return self.trace.negate(self)

    def __radd__(self, other: float) -> Scalar:
        return self.trace.scalar(other) + self

    def __rsub__(self, other: float) -> Scalar:
        return self.trace.scalar(other) - self

    def __rmul__(self, other: float) -> Scalar:
        return self.trace.scalar(other) * self


class Trace:
    """The operations of one C function, each noted once."""

    def __init__(self) -> None:
        self._nodes: list[_Node] = []
        self._known: dict[_Node, int] = {}
        self._names: dict[int, str] = {}

    def scalar(self, value: Scalar | float) -> Scalar:
        """Return a constant, or the scalar itself."""
        if isinstance(value, Scalar):
            return value
        return self._noted(_Node("constant", value=float(value) + 0.0))

    def variable(self, text: str) -> Scalar:
        """Return what C calls `text`, an argument of the function."""
        return self._noted(_Node("variable", text=text))

    def call(self, function: str, *operands: Scalar | float) -> Scalar:
        """Return the value of a C function."""
        return self._noted(_Node("call", tuple(self.scalar(operand).index for operand in operands), text=function))

    def named(self, scalar: Scalar, name: str) -> Scalar:
        """Return the scalar, which gets a line and a name of its own unless it is a constant or has one already."""
        if self._nodes[scalar.index].operation in {"add", "sub", "mul", "div", "call"}:
            self._names.setdefault(scalar.index, name)
        return scalar

    def add(self, left: Scalar, right: Scalar) -> Scalar:
        """Return the sum."""
        first, second = self._nodes[left.index], self._nodes[right.index]
        if first.operation == second.operation == "constant":
            return self.scalar(first.value + second.value)
        if _is(first, 0.0):
            return right
        if _is(second, 0.0):
            return left
        if second.operation == "neg":
            return self.subtract(left, self._operand(second))
        if first.operation == "neg":
            return self.subtract(right, self._operand(first))
        return self._noted(_Node("add", (min(left.index, right.index), max(left.index, right.index))))

    def subtract(self, left: Scalar, right: Scalar) -> Scalar:
        """Return the difference."""
        first, second = self._nodes[left.index], self._nodes[right.index]
        if left.index == right.index:
            return self.scalar(0.0)
        if _is(first, 0.0):
            return self.negate(right)
        if second.operation in {"constant", "neg"}:
            return self.add(left, self.negate(right))
        if first.operation == "neg":
            return self.negate(self.add(self._operand(first), right))
        if _Node("sub", (right.index, left.index)) in self._known:
            return self.negate(self._noted(_Node("sub", (right.index, left.index))))
        return self._noted(_Node("sub", (left.index, right.index)))

    def multiply(self, left: Scalar, right: Scalar) -> Scalar:
        """Return the product."""
        first, second = self._nodes[left.index], self._nodes[right.index]
        if first.operation == second.operation == "constant":
            return self.scalar(first.value * second.value)
        if second.operation == "constant":
            return self.multiply(right, left)
        if _is_negative(first):
            return self.negate(self.multiply(self.negate(left), right))
        if _is_negative(second):
            return self.negate(self.multiply(left, self.negate(right)))
        if first.operation == "constant" and first.value in {0.0, 1.0}:
            return right if first.value else left
        return self._noted(_Node("mul", (min(left.index, right.index), max(left.index, right.index))))

    def divide(self, left: Scalar, right: Scalar) -> Scalar:
        """Return the quotient."""
        first, second = self._nodes[left.index], self._nodes[right.index]
        if second.operation == "constant" and second.value != 0.0:
            return self.multiply(left, self.scalar(1.0 / second.value))
        return left if _is(first, 0.0) else self._noted(_Node("div", (left.index, right.index)))

    def negate(self, scalar: Scalar) -> Scalar:
        """Return the negative."""
        node = self._nodes[scalar.index]
        if node.operation == "constant":
            return self.scalar(-node.value)
        return self._operand(node) if node.operation == "neg" else self._noted(_Node("neg", (scalar.index,)))

    def _operand(self, node: _Node) -> Scalar:
        return Scalar(self, node.operands[0])

    def _noted(self, node: _Node) -> Scalar:
        index = self._known.setdefault(node, len(self._nodes))
        if index == len(self._nodes):
            self._nodes.append(node)
        return Scalar(self, index)

    def statements(self, results: Mapping[str, Scalar]) -> tuple[str, ...]:
        """Return lines of C that calculate the results; every result is assigned after all are calculated.

        Parameters
        ----------
        results : what C assigns to -> its value
        """
        return _Writer(self._nodes, self._names, results).lines()


def _is_negative(node: _Node) -> bool:
    return node.operation == "neg" or (node.operation == "constant" and node.value < 0.0)


def _is(node: _Node, value: float) -> bool:
    return node.operation == "constant" and node.value == value


class _Writer:
    """Turns what the results need of a trace into lines."""

    def __init__(self, nodes: list[_Node], names: Mapping[int, str], results: Mapping[str, Scalar]) -> None:
        self._nodes = nodes
        self._results = results
        self._uses = self._counted()
        self._names = dict(names)
        self._written: dict[int, tuple[str, int]] = {}

    def _counted(self) -> list[int]:
        uses = [0] * len(self._nodes)
        for result in self._results.values():
            uses[result.index] += 1
        for index in range(len(self._nodes) - 1, -1, -1):
            if uses[index]:
                # A sign costs nothing: who uses the negative uses the number itself.
                times = uses[index] if self._nodes[index].operation == "neg" else 1
                for operand in self._nodes[index].operands:
                    uses[operand] += times
        return uses

    def lines(self) -> tuple[str, ...]:
        lines = []
        for index, node in enumerate(self._nodes):
            if not self._uses[index]:
                continue
            text, binding = self._expression(node)
            shared = self._uses[index] > 1 or len(text) > _LONGEST_LINE
            if node.operation in _BINDING.keys() - {"neg"} | {"call"} and (shared or index in self._names):
                name = self._names.setdefault(index, f"t{index}")
                lines.append(f"const double {name} = {text};")
                text, binding = name, _STRONGEST
            self._written[index] = (text, binding)
        texts = [self._written[value.index][0] for value in self._results.values()]
        # A result that reads an argument waits in a name of its own: the results before it may be written over it.
        waiting = {text: f"y{place}" for place, text in enumerate(dict.fromkeys(texts)) if _READS.search(text)}
        lines += [f"const double {name} = {text};" for text, name in waiting.items()]
        values = (waiting.get(text, text) for text in texts)
        return (*lines, *(f"{target} = {value};" for target, value in zip(self._results, values, strict=True)))

    def _expression(self, node: _Node) -> tuple[str, int]:
        if node.operation == "constant":
            return repr(node.value), _STRONGEST if node.value >= 0.0 else _BINDING["neg"]
        if node.operation == "variable":
            return node.text, _STRONGEST
        if node.operation == "call":
            return f"{node.text}({', '.join(self._written[k][0] for k in node.operands)})", _STRONGEST
        binding = _BINDING[node.operation]
        if node.operation == "neg":
            return f"-{self._bound(node.operands[0], _BINDING['mul'])}", binding
        sign = {"add": "+", "sub": "-", "mul": "*", "div": "/"}[node.operation]
        # The right operand of a difference or quotient, and one that binds no stronger, keeps its brackets.
        return f"{self._bound(node.operands[0], binding)} {sign} {self._bound(node.operands[1], binding + 1)}", binding

    def _bound(self, index: int, binding: int) -> str:
        text, own = self._written[index]
        return text if own >= binding else f"({text})"
