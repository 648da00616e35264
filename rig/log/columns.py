"""Records as rows of a table: arrays become one column an element, named by their indices."""

from collections.abc import Iterator
from typing import Any

from rig.log.topics import Schema, Topic

# What only viewers need of an event.
FOR_VIEWERS = ("timestamp", "level", "message", "name", "file", "line")


def columns(topic: Topic) -> list[str]:
    """The columns of a topic's table; every instant first."""
    names = ["t_s", "logged_ns", "true_ns"]
    for key, schema in topic.schema["properties"].items():
        if key != "t_s" and key not in FOR_VIEWERS:
            names += _names(key, schema)
    return names


def row(values: dict[str, Any], logged_ns: int, t_ns: int) -> dict[str, Any]:
    """One record by column; columns that it says nothing about are left out."""
    out: dict[str, Any] = {"logged_ns": logged_ns, "true_ns": t_ns}
    for key, value in values.items():
        if key not in FOR_VIEWERS:
            out.update(_cells(key, value))
    return out


def is_number(topic: Topic, column: str) -> bool:
    """Whether a column holds floating-point numbers."""
    if column.endswith("_ns"):
        return False
    schema = topic.schema["properties"].get(column)
    if schema is None or "items" in schema:  # an element of an array
        return not (schema and schema["items"].get("type") == "string")
    return schema.get("type") in ("number", ["number", "null"])


def _names(key: str, schema: Schema) -> list[str]:
    if "minItems" not in schema:
        return [key]
    inner = _names("", schema["items"])
    return [f"{key}_{k}{rest}" for k in range(schema["minItems"]) for rest in inner]


def _cells(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    if value is None:
        return
    if isinstance(value, list) and all(isinstance(one, str) for one in value) and key == "reasons":
        yield key, "; ".join(value)
    elif isinstance(value, list):
        for k, one in enumerate(value):
            yield from _cells(f"{key}_{k}", one)
    else:
        yield key, value
