"""Who may be let in: this machine, or whoever knows the token."""

import pytest

from drivers.errors import ConfigError
from rig.page.address import PageAddress, page_address
from tests.rig.command_line import rig

TOKEN = "0123456789abcdef"


def test_without_options_only_this_machine_gets_in() -> None:
    assert page_address(None, None, None) == PageAddress("127.0.0.1", None, None)
    assert page_address("localhost", 9000, None).local


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.7", "::"])
def test_others_get_in_only_with_a_token(host: str) -> None:
    with pytest.raises(ConfigError, match="--view-token"):
        page_address(host, None, None)
    assert page_address(host, None, TOKEN).token == TOKEN


@pytest.mark.parametrize("token", ["short", "with spaces in it", "semi;colons;in;it"])
def test_tokens_that_could_be_guessed_or_break_an_address_are_refused(token: str) -> None:
    with pytest.raises(ConfigError, match="letters and digits"):
        page_address("127.0.0.1", None, token)


def test_a_name_is_no_address() -> None:
    with pytest.raises(ConfigError, match="lab-pc"):
        page_address("lab-pc", None, TOKEN)


def test_a_refused_address_leaves_no_run_behind(tmp_path) -> None:
    out = tmp_path / "run"
    options = ("--view", "--view-host", "0.0.0.0", "--out", str(out))
    result = rig("run", "--target", "sphere", *options)
    assert result.exit_code == 2
    assert "--view-token" in result.stderr
    assert not out.exists()
