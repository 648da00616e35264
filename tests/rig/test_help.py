"""What --help says: each command and option in words, with its default and its unit."""

import re
import subprocess
import sys
from functools import cache

import pytest
from typer.testing import CliRunner

from rig.cli import app

COMMANDS = [
    *("run", "measure", "replay", "reproduce", "report", "runs", "view", "compare", "doctor"),
    *("calibrate", "calibrate intrinsics", "calibrate latency", "calibrate board"),
    *("camera list", "camera show", "camera check"),
    *("arm status", "arm jog", "arm stop", "arm recover", "arm home"),
    *("log info", "log export", "log repair", "sim serve", "sim fault"),
]
# These choose another task, or may be given often: without them nothing is missing.
NO_VALUE_MISSING = {"--set", "--from-images", "--scheduler"}
UNITS = ("second", " ms", " s.", " m.")


@cache
def page(command: str) -> str:
    outcome = CliRunner().invoke(app, [*command.split(), "--help"], env={"COLUMNS": "100"})
    assert outcome.exit_code == 0
    return outcome.output


def options(command: str) -> list[tuple[str, str, str]]:
    """(--name, what stands for its value or "", the words) of each option on the page."""
    _, _, listed = page(command).partition("Options:\n")
    entries: list[str] = []
    for line in listed.splitlines():
        if re.match(r"  --\w", line):
            entries.append(line)
        elif line.startswith("        ") and entries:
            entries[-1] += "  " + line.strip()
        elif line and not line.startswith(" "):
            break  # the exit codes, or a list of commands
    found = []
    for entry in entries:
        head, _, words = entry.strip().partition("  ")
        name, _, value = head.partition(" ")
        found.append((name, "" if value.startswith("/") else value, " ".join(words.split())))
    return found


ALL = [
    pytest.param(*option, id=f"{command} {option[0]}")
    for command in COMMANDS
    for option in options(command)
]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_says_what_it_does_and_what_each_option_is_for(command: str) -> None:
    does = page(command).split("\n\n")[1].strip()
    assert does.endswith((".", ":"))
    assert "--help" in {name for name, _, _ in options(command)}
    assert all(words for _, _, words in options(command))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_says_how_it_may_end(command: str) -> None:
    end = " ".join(page(command).split("Exit codes: ")[-1].split())
    assert end.startswith("0 ") and "2 wrong usage or configuration" in end
    assert end.endswith("130 interrupted.")


@pytest.mark.parametrize(
    ("command", "codes"),
    [
        ("run", {0, 1, 2, 3, 4, 5, 6, 130}),
        ("calibrate", {0, 1, 2, 3, 5, 6, 130}),
        ("calibrate verify", {0, 1, 2, 3, 5, 6, 130}),
        ("arm jog", {0, 1, 2, 3, 5, 130}),
        ("log info", {0, 1, 2, 130}),
    ],
)
def test_the_ways_to_end_are_its_own(command: str, codes: set[int]) -> None:
    end = " ".join(page(command).split("Exit codes: ")[-1].split())
    assert {int(one.split()[0]) for one in end.split(", ")} == codes


@pytest.mark.parametrize(("name", "value", "words"), ALL)
def test_an_option_with_a_value_says_what_holds_without_it(
    name: str, value: str, words: str
) -> None:
    if value and name not in NO_VALUE_MISSING:
        assert "default" in words or "required]" in words


@pytest.mark.parametrize(("name", "value", "words"), ALL)
def test_a_measure_has_a_unit(name: str, value: str, words: str) -> None:
    if "float" in value.lower():
        assert any(unit in f" {words.lower()}" for unit in UNITS)


def test_python_m_rig_is_the_same_command():
    ran = subprocess.run(
        [sys.executable, "-m", "rig", "--help"], capture_output=True, text=True, check=True
    )
    assert "compare" in ran.stdout
    assert "python -m rig" in ran.stdout
