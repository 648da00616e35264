"""Which keys each level of the configuration has: for messages that list them."""

from typing import Any, get_args

from pydantic import BaseModel

from drivers.errors import ConfigError
from rig.config import RigConfig
from rig.config_devices import driver_of

Section = type[BaseModel]


def check_keys(keys: list[str], tree: dict[str, Any]) -> None:
    """Walk the schema along ``keys``, choosing drivers as ``tree`` does.

    Raises ConfigError at the first unknown key, with the keys its level has.
    """
    section: Section | None = RigConfig
    level: object = tree
    for depth, key in enumerate(keys):
        where = ".".join(keys[:depth]) or "the top level"
        if section is None:
            raise ConfigError(f"{'.'.join(keys)}: {where} is a value and has no keys below it")
        if key not in section.model_fields:
            raise ConfigError(
                f"unknown key {'.'.join(keys[: depth + 1])!r}; "
                f"keys of {where}: {', '.join(section.model_fields)}"
            )
        level = level.get(key) if isinstance(level, dict) else None
        section = _section(section.model_fields[key].annotation, level)


def without_drivers(location: tuple[int | str, ...]) -> list[str]:
    """The keys of a validation error's place, without the drivers' names pydantic inserts."""
    names: list[str] = []
    sections: list[Section] = [RigConfig]
    for part in location:
        if len(sections) > 1:  # the name of the chosen driver stands here
            sections = [one for one in sections if one.model_fields["driver"].default == part]
            continue
        names.append(str(part))
        field = sections[0].model_fields.get(str(part)) if sections else None
        sections = [] if field is None else _sections(field.annotation)
    return names


def _section(annotation: object, level: object) -> Section | None:
    """The section that ``annotation`` stands for, or the one of the driver ``level`` names."""
    sections = _sections(annotation)
    if len(sections) <= 1:
        return sections[0] if sections else None
    driver = driver_of(level if isinstance(level, dict) else {})
    named = [one for one in sections if one.model_fields["driver"].default == driver]
    return named[0] if named else None


def _sections(annotation: object) -> list[Section]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [section for part in get_args(annotation) for section in _sections(part)]
