"""The parts of a behaviour tree: what is ticked, in which order, and how the tree is drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field


@dataclass(eq=False)
class Behaviour:
    """A part of a behaviour tree; nothing here takes longer than a tick.

    Attributes:
        name: for drawings and timelines.
        children: the parts below, in the order in which they are ticked.
        succeeded: whether the last tick of the tree succeeded here; none if it did not come here.
    """

    name: str
    children: tuple[Behaviour, ...] = ()
    symbol = ""
    succeeded: bool | None = field(default=None, init=False)

    def tick(self) -> bool:
        """Tick; return whether it succeeded."""
        self.succeeded = self._tick()
        return self.succeeded

    def _tick(self) -> bool:
        raise NotImplementedError

    def all(self) -> Iterator[Behaviour]:
        """Go through this part and those below, depth first."""
        yield self
        for child in self.children:
            yield from child.all()


class Sequence(Behaviour):
    """Ticks its children until one fails."""

    symbol = "->"

    def _tick(self) -> bool:
        return all(child.tick() for child in self.children)


class Fallback(Behaviour):
    """Ticks its children until one succeeds."""

    symbol = "?"

    def _tick(self) -> bool:
        return any(child.tick() for child in self.children)


class Parallel(Behaviour):
    """Ticks all its children."""

    symbol = "=>"

    def _tick(self) -> bool:
        ticked = [child.tick() for child in self.children]
        return all(ticked)


@dataclass(eq=False)
class Condition(Behaviour):
    """Succeeds while something holds."""

    holds: Callable[[], bool] = bool

    def _tick(self) -> bool:
        return self.holds()


@dataclass(eq=False)
class SetMode(Behaviour):
    """Requests a mode of a function; always succeeds."""

    request: Callable[[], object] = bool
    symbol = "!"

    def _tick(self) -> bool:
        self.request()
        return True


def tick(root: Behaviour) -> bool:
    """Tick a tree from its root."""
    for each in root.all():
        each.succeeded = None
    return root.tick()


def drawing(root: Behaviour) -> str:
    """Draw a tree as text, a line for each part: ? fallback, -> sequence, => parallel, ! mode."""
    return "\n".join(_lines(root, "", ""))


def _lines(part: Behaviour, first: str, further: str) -> Iterator[str]:
    yield f"{first}{part.symbol} {part.name}" if part.symbol else f"{first}{part.name}"
    for child in part.children:
        is_last = child is part.children[-1]
        yield from _lines(child, further + ("└─ " if is_last else "├─ "), further + ("   " if is_last else "│  "))


def last_tick(root: Behaviour) -> str:
    """Summarise the last tick: each mode that was requested, with the conditions that held on the way to it."""
    return "; ".join(_requests(root, ()))


def _requests(part: Behaviour, held: tuple[str, ...]) -> Iterator[str]:
    for child in part.children:
        if child.succeeded is None:
            continue
        if isinstance(child, SetMode):
            yield f"{child.name}" + (f" ({', '.join(held)})" if held else "")
        elif isinstance(child, Condition):
            held = (*held, child.name) if child.succeeded and isinstance(part, Sequence) else held
        else:
            yield from _requests(child, held)
