"""Docstrings for the site: Sphinx's roles, such as :func:`adapters`, are code, and so are doctests outside sections."""

import re
from typing import Any

import griffe


class Docstrings(griffe.Extension):
    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if not obj.docstring:
            return
        text = re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", obj.docstring.value)
        head, *examples = re.split(r"(?=^Examples\n-)", text, maxsplit=1, flags=re.M)
        head = re.sub(r"^>>> .*(?:\n.+)*", r"```pycon\n\g<0>\n```", head, flags=re.M)
        obj.docstring.value = head + "".join(examples)
