"""Names of functions and classes in the text of pages become links to their entries in the API.

A page writes ``m.`` for ``veselova.mechanics.``, ``a.`` for ``veselova.analytic.`` and ``vs.`` for
``veselova.``. A name that begins with a point, or stands alone after another one in the same cell
of a table, belongs to the module or class of the name before it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes

import veselova

_SHORT = {
    "m.": "veselova.mechanics.",
    "a.": "veselova.analytic.",
    "vs.": "veselova.",
    "curves.": "veselova.curves.",
    "theta.": "veselova.theta.",
}

#: A name of Python, of which a call may show arguments.
_NAME = re.compile(r"(\.?[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\(.*\))?")

#: Pages whose words are not names of the API: those of the API itself.
_WITHOUT = ("docs/reference/api", "docs/gallery/")

#: The page whose cells name functions of the module before them.
_PAPER = "docs/paper"


class Names:
    """Finds the entry of a name among those that the pages of the API have."""

    def __init__(self, objects: dict[str, Any]) -> None:
        self.objects = objects
        #: The end of a name, of two parts or a class → the names that have it.
        self.ends: dict[str, set[str]] = {}
        for name in objects:
            parts = name.split(".")
            self.ends.setdefault(".".join(parts[-2:]), set()).add(name)
            if parts[-1][:1].isupper():
                self.ends.setdefault(parts[-1], set()).add(name)
        #: Where a public name is defined → the public name.
        self.public = {
            f"{home}.{name}": f"veselova.{name}" for name, home in veselova._HOMES.items()
        }

    def _candidates(self, name: str, before: str | None) -> Iterator[str]:
        if before is not None:
            # beside what stood before, a part of it, or in its module
            above = before.rpartition(".")[0]
            for parent in (above, before, above.rpartition(".")[0]):
                yield f"{parent}.{name.lstrip('.')}"
        if name.startswith("."):
            return
        for short, long in _SHORT.items():
            if name.startswith(short):
                full = long + name.removeprefix(short)
                yield full
                for home, public in self.public.items():
                    if full == home or full.startswith(f"{home}."):
                        yield public + full.removeprefix(home)
        # A single word in small letters may be one of the language, or of a command.
        if not (name.isalpha() and name.islower()):
            yield f"veselova.{name}"
            yield name
        found = self.ends.get(name, set())
        if len(found) == 1:
            yield from found

    def find(self, name: str, before: str | None) -> str | None:
        """Return the full name of an entry, or None."""
        return next((each for each in self._candidates(name, before) if each in self.objects), None)


def _write_again(app: Any, env: Any) -> list[str]:
    """Return the pages to be written anew: all that may have links, where there are new entries."""
    names = sorted(env.domains["py"].objects)
    if getattr(env, "guide_entries", names) == names:
        env.guide_entries = names
        return []
    env.guide_entries = names
    return [page for page in sorted(env.found_docs) if not page.startswith(_WITHOUT)]


def _link(app: Any, doctree: nodes.document, page: str) -> None:
    if page.startswith(_WITHOUT) or app.builder.format != "html":
        return
    objects = app.env.domains["py"].objects
    names = Names(objects)
    before: str | None = None
    cell: nodes.Node | None = None
    for literal in list(doctree.findall(nodes.literal)):
        inside = literal.parent
        while inside is not None and not isinstance(inside, (nodes.entry, nodes.paragraph)):
            if isinstance(inside, (nodes.reference, nodes.title)):
                break
            inside = inside.parent
        if isinstance(inside, (nodes.reference, nodes.title)) or inside is None:
            continue
        if page != _PAPER or _entry_of(literal) is not cell:
            before = None
        cell = _entry_of(literal)
        match = _NAME.fullmatch(literal.astext())
        found = names.find(match[1], before) if match else None
        if found is None:
            continue
        before = found
        entry = objects[found]
        target = app.builder.get_relative_uri(page, entry.docname) + f"#{entry.node_id}"
        link = nodes.reference("", "", internal=True, refuri=target, reftitle=found)
        literal.replace_self(link)
        link += literal


def _entry_of(node: nodes.Node) -> nodes.Node | None:
    while node is not None and not isinstance(node, nodes.entry):
        node = node.parent
    return node


def setup(app: Any) -> dict[str, bool]:
    """Connect the links to Sphinx."""
    app.connect("env-updated", _write_again)
    app.connect("doctree-resolved", _link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
