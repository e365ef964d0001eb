"""The `kb` commands: checks and edits rules, and shows what they do.

KnowledgeBase is loaded when the name is first used, and Java starts with its first reasoner.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from suave_des.kb.knowledge_base import KnowledgeBase

__all__ = ["KnowledgeBase"]


def __getattr__(name: str) -> Any:
    if name == "KnowledgeBase":
        from suave_des.kb.knowledge_base import KnowledgeBase

        return KnowledgeBase
    raise AttributeError(name)
