"""The manager that stands for a client of `suave-des serve --rosbridge` in a mission."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from suave_des.domain import Task
from suave_des.errors import InputError
from suave_des.managing.simple import NoManager

if TYPE_CHECKING:
    from suave_des.scenario.loader import LoadedScenario

REQUEST_TASK = "/task/request"
CANCEL_TASK = "/task/cancel"


class ClientManager(NoManager):
    """client:NAME: a client of `suave-des serve --rosbridge`.

    A task begins with the default modes of its functions unless a client offers /task/request, and
    ends with fd_unground unless one offers /task/cancel.

    Attributes:
        bridges: those that serve in this process.
        call: calls a service that a client offers, or returns False; the bridge that flies the
            mission sets it.
    """

    bridges: ClassVar[set[object]] = set()
    call: Callable[[str, Task], bool] | None = None

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that a bridge serves."""
        if not cls.bridges:
            raise _without_server()

    def task_requested(self, task: Task) -> None:
        """Pass a task that begins on, or set its modes."""
        if not self._offered(REQUEST_TASK, task):
            super().task_requested(task)

    def task_cancelled(self, task: Task) -> None:
        """Pass a task that is over on, or set its functions to fd_unground."""
        if not self._offered(CANCEL_TASK, task):
            super().task_cancelled(task)

    def _offered(self, service: str, task: Task) -> bool:
        """Call a service; return whether a client offers it."""
        if self.call is None:
            raise _without_server()
        return self.call(service, task)


def _without_server() -> InputError:
    remedy = "fly their missions by suave-des serve SCENARIO --rosbridge"
    return InputError("managers client:NAME are clients of a server", remedy=remedy)


def client_manager(name: str) -> type[ClientManager]:
    """Return the class of the manager `client:NAME`, whatever its name: results have it."""
    return ClientManager
