"""pydantic's findings in the words of the person who wrote the file.

What a key means, and which keys stand beside it, is read from the JSON Schema of the model:
the same text that an editor shows.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ValidationError

from rampe_guard.settings.problems import KeyPath, Problems, did_you_mean, show

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from rampe_guard.settings.source import Document

M = TypeVar("M", bound=BaseModel)
Schema = dict[str, Any]

_TYPES = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "finite_number": "a finite number",
}
_BOUNDS = {
    "greater_than": ("gt", "is not greater than"),
    "greater_than_equal": ("ge", "is less than"),
    "less_than": ("lt", "is not less than"),
    "less_than_equal": ("le", "is greater than"),
}
_LENGTHS = {
    "too_short": ("min_length", "too short: at least"),
    "too_long": ("max_length", "too long: at most"),
    "string_too_short": ("min_length", "too short, in characters: at least"),
    "string_too_long": ("max_length", "too long, in characters: at most"),
}


def validate(model: type[M], document: Document) -> M:
    """``document`` as a ``model``.

    Raises:
        SettingsError: every problem that the model finds.
    """
    problems = Problems(document)
    if not isinstance(document.data, dict):
        what = "is empty" if document.data is None else f"holds {show(document.data)}"
        required = [k for k, v in model.model_fields.items() if v.is_required()]
        problems.add((), what, f"give a mapping with the keys {', '.join(required)}")
        problems.raise_if_any()
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            if (
                detail["type"] == "too_short"
                and len(detail["input"]) >= detail["ctx"]["min_length"]
            ):
                continue  # items that were refused count as absent there
            problems.add(*_explain(schema_of(model), document.data, detail))
    problems.raise_if_any()
    raise AssertionError("pydantic refused a document without a reason")


@cache
def schema_of(model: type[BaseModel]) -> Schema:
    """JSON Schema of ``model``."""
    return model.model_json_schema(by_alias=True)


def _explain(root: Schema, data: Any, detail: ErrorDetails) -> tuple[KeyPath, str, str]:
    """(path, what is wrong, what to do) for one finding."""
    path, parent = _real_path(data, detail["loc"])
    kind, context = detail["type"], detail.get("ctx", {})
    if kind == "extra_forbidden":
        return path, "is not a known key", _neighbours(root, data, path, parent)
    if kind in {"union_tag_not_found", "union_tag_invalid"}:
        options = _tags(root, data, path)
        if kind == "union_tag_not_found":
            return (*path, "type"), "is missing", f"give one of {', '.join(options)}"
        tag = str(context["tag"])
        return (*path, "type"), f"{show(tag)} is not known", did_you_mean(tag, options)
    return path, _what(detail), f"give {_meaning(root, data, path)}"


def _what(detail: ErrorDetails) -> str:
    """What is wrong with one value."""
    kind, context = detail["type"], detail.get("ctx", {})
    if kind == "missing":
        return "is missing"
    if kind in _BOUNDS:
        name, words = _BOUNDS[kind]
        tail = f"{words} {context[name]:g}"
    elif kind in _LENGTHS:
        name, words = _LENGTHS[kind]
        tail = f"is {words} {context[name]}"
    elif kind in _TYPES:
        tail = f"is not {_TYPES[kind]}"
    elif kind == "literal_error":
        tail = f"is not {context['expected']}"
    elif kind == "value_error":
        tail = str(context["error"])
    elif kind == "string_pattern_mismatch":
        tail = f"has not the form {context['pattern']}"
    else:
        tail = f"is refused: {detail['msg']}"
    return f"{show(detail['input'])} {tail}"


def _tags(root: Schema, data: Any, path: KeyPath) -> list[str]:
    """Values of ``type`` that a union at ``path`` knows."""
    nodes = [option for node in _nodes(root, data, path) for option in _options(root, node, None)]
    return [node["properties"]["type"]["const"] for node in nodes]


def _real_path(data: Any, loc: KeyPath) -> tuple[KeyPath, Any]:
    """Path of keys that ``loc`` means, without the tags of unions, and the value above its end."""
    path: list[str | int] = []
    parent: Any = None
    for index, part in enumerate(loc):
        last = index == len(loc) - 1
        if isinstance(data, dict) and (part in data or (last and part != data.get("type"))):
            parent, data = data, data.get(str(part))
        elif isinstance(data, tuple) and isinstance(part, int) and part < len(data):
            parent, data = data, data[part]
        else:
            continue  # the tag of a union
        path.append(part)
    return tuple(path), parent


def _meaning(root: Schema, data: Any, path: KeyPath) -> str:
    """Description of ``path``, or of the nearest parent that has one."""
    for end in range(len(path), 0, -1):
        for node in _nodes(root, data, path[:end]):
            if text := node.get("description"):
                return str(text[0].lower() + text[1:]).rstrip(".")
    return "the keys of the documentation"


def _neighbours(root: Schema, data: Any, path: KeyPath, parent: Any) -> str:
    known = {
        name
        for node in _nodes(root, data, path[:-1])
        for option in _options(root, node, parent)
        for name in option.get("properties", {})
    }
    free = sorted(name for name in known if not (isinstance(parent, dict) and name in parent))
    hint = did_you_mean(str(path[-1]), free)
    return hint if hint.endswith("?") else f"remove it; {hint}"


def _nodes(root: Schema, data: Any, path: KeyPath) -> list[Schema]:
    """Schema nodes that describe ``path`` in ``data``."""
    nodes = [root]
    for part in path:
        options = [option for node in nodes for option in _options(root, node, data)]
        nodes = [step for option in options if (step := _step(option, part))]
        known = isinstance(data, dict) or (isinstance(data, tuple) and isinstance(part, int))
        try:
            data = data[part] if known else None
        except (KeyError, IndexError):
            data = None
    return nodes


def _step(node: Schema, part: str | int) -> Schema | None:
    """Schema of key or index ``part`` of an object or array schema."""
    if isinstance(part, int):
        found = node.get("items")
    else:
        found = node.get("properties", {}).get(part, node.get("additionalProperties"))
    return found if isinstance(found, dict) else None


def _options(root: Schema, node: Schema, data: Any) -> list[Schema]:
    """The object or array schemas behind references and unions, those of ``data``'s type first."""
    if "$ref" in node:
        return _options(root, root["$defs"][node["$ref"].rsplit("/", 1)[1]], data)
    inner = node.get("oneOf") or node.get("anyOf")
    if not inner:
        return [node]
    found = [option for part in inner for option in _options(root, part, data)]
    kind = data.get("type") if isinstance(data, dict) else None
    fitting = [o for o in found if o.get("properties", {}).get("type", {}).get("const") == kind]
    return fitting or found
