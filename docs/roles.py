"""Sphinx's roles in docstrings, such as :func:`adapters`, as code."""

import re
from typing import Any

import griffe


class Roles(griffe.Extension):
    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = re.sub(r":[a-z]+:`~?([^`]+)`", r"`\1`", obj.docstring.value)
