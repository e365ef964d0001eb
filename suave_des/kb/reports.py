"""What components can report, where interchangeable ones count by their number."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from math import factorial, perm, prod

#: (component, c_status) of those that report.
Reports = tuple[tuple[str, str], ...]


def component_reports(
    groups: Sequence[Sequence[str]], statuses: Sequence[str], most: int
) -> dict[Reports, int]:
    """All that at most so many components can report, up to an exchange in their group, fewest
    reports first.

    Returns:
        reports of the first ones of each group of interchangeable components, with the number for
        which they stand.
    """
    found = {}
    for chosen in itertools.product(*(_reported(group, statuses, most) for group in groups)):
        if sum(map(len, chosen)) <= most:
            reports = sorted(itertools.chain.from_iterable(map(zip, groups, chosen)))
            found[tuple(reports)] = prod(map(_number_alike, groups, chosen))
    return found


def _reported(
    group: Sequence[str], statuses: Sequence[str], most: int
) -> Iterator[tuple[str, ...]]:
    """What at most so many components of a group can report, without who reports it."""
    for count in range(min(most, len(group)) + 1):
        yield from itertools.combinations_with_replacement(statuses, count)


def _number_alike(group: Sequence[str], reported: Sequence[str]) -> int:
    """In how many ways components of a group can report some statuses: which component reports
    each, where it does not matter who of those with one status is which.
    """
    return perm(len(group), len(reported)) // prod(map(factorial, Counter(reported).values()))
