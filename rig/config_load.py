"""From a YAML file and ``--set`` to a validated configuration, or one error that names the key."""

from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

import yaml
from pydantic import ValidationError

from drivers.errors import ConfigError
from rig.config import RigConfig, TargetKind
from rig.config_schema import check_keys, without_drivers

Tree = dict[str, Any]


def packaged_config(name: str) -> Path:
    """A file of ``configs/``, wherever the package is installed."""
    package = Path(str(files("rig")))
    packaged, in_source_tree = package / "configs" / name, package.parent / "configs" / name
    return packaged if packaged.is_file() else in_source_tree


def load_config(
    target: TargetKind,
    path: Path | None = None,
    assignments: list[str] | None = None,
    experiment: Tree | None = None,
) -> RigConfig:
    """Read ``path`` (default: the simulated rig); lay over it ``targets.<target>``, then the
    ``experiment``, then the ``--set`` assignments.

    Raises ConfigError that names the file and the key, before anything is opened.
    """
    path = packaged_config("sim.yaml") if path is None else path
    tree = read_yaml(path)
    overlays = tree.pop("targets", None) or {}
    _check_overlays(overlays, tree, path)
    _overlay(tree, overlays.get(target) or {})
    _overlay(tree, experiment or {})
    _validate(tree, str(path))
    return configured(tree, assignments or [], "the configuration")


def configured(tree: Tree, assignments: list[str], where: str) -> RigConfig:
    """``assignments`` laid over ``tree``, which is changed, and validated.

    Raises ConfigError that begins with ``where`` and names the key.
    """
    for assignment in assignments:
        _assign(tree, assignment)
    return _validate(tree, where)


def dump_config(config: RigConfig) -> str:
    """The resolved configuration as YAML that ``--rig`` reads back."""
    return yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False, default_flow_style=None)


def read_yaml(path: Path) -> Tree:
    """The keys and values of a YAML file; raises ConfigError when it has none to read."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read the rig file {path}: {error}") from error
    try:
        tree = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"{path} is not valid YAML: {error}") from error
    if tree is None:
        return {}
    if not isinstance(tree, dict):
        raise ConfigError(f"{path} must hold keys and values, not {type(tree).__name__}")
    return tree


def _check_overlays(overlays: object, tree: Tree, path: Path) -> None:
    kinds = get_args(TargetKind)
    if not isinstance(overlays, dict):
        raise ConfigError(f"{path}: targets must hold a section per target ({', '.join(kinds)})")
    for kind, overlay in overlays.items():
        if kind not in kinds:
            raise ConfigError(f"{path}: unknown target {kind!r} under targets; known: {kinds}")
        if not isinstance(overlay, dict | None):
            raise ConfigError(f"{path}: targets.{kind} must hold keys and values")
        merged = _copy(tree)
        _overlay(merged, overlay or {})
        _validate(merged, f"{path} (targets.{kind})")


def _copy(tree: Tree) -> Tree:
    return {k: _copy(v) if isinstance(v, dict) else v for k, v in tree.items()}


def _overlay(tree: Tree, overlay: Tree) -> None:
    """Lay ``overlay`` over ``tree`` in place, level by level."""
    for key, value in overlay.items():
        if isinstance(value, dict) and isinstance(tree.get(key), dict):
            _overlay(tree[key], value)
        else:
            tree[key] = _copy(value) if isinstance(value, dict) else value


def _assign(tree: Tree, assignment: str) -> None:
    """Apply one ``a.b=value``; the value is read as YAML."""
    name, equals, text = assignment.partition("=")
    keys = name.strip().split(".")
    if not equals or not all(keys):
        raise ConfigError(f"--set {assignment!r}: write it as a.b=value")
    check_keys(keys, tree)
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"--set {name}: {text!r} is not a value: {error}") from error
    if isinstance(value, str):
        value = _number_or_text(value)
    level = tree
    for key in keys[:-1]:
        if not isinstance(level.get(key), dict):
            level[key] = {}
        level = level[key]
    level[keys[-1]] = value


def _number_or_text(text: str) -> float | str:
    """YAML 1.1 reads ``1e-3`` as text; a user who writes it means the number."""
    try:
        return float(text)
    except ValueError:
        return text


def _validate(tree: Tree, where: str) -> RigConfig:
    try:
        return RigConfig.model_validate(tree)
    except ValidationError as error:
        lines = [_describe(dict(item), tree) for item in error.errors()]
        raise ConfigError(f"{where}: " + "; ".join(dict.fromkeys(lines))) from error


def _describe(item: Tree, tree: Tree) -> str:
    """One validation error as a sentence that starts with the key."""
    names = without_drivers(item["loc"])
    if item["type"] == "extra_forbidden":
        try:
            check_keys([name for name in names if not name.isdigit()], tree)
        except ConfigError as error:
            return str(error)
    message = str(item["msg"]).removeprefix("Value error, ")
    if not names:
        return message
    if isinstance(item["input"], dict):
        return f"{'.'.join(names)}: {message}"
    return f"{'.'.join(names)} = {item['input']!r}: {message}"
