"""What several tests of the simulated rig need."""

import pytest

from sim_backend.gl_context import why_no_gl


@pytest.fixture
def gl() -> None:
    """Skip, saying why, where no OpenGL context can be made."""
    reason = why_no_gl()
    if reason:
        pytest.skip(f"no OpenGL here: {reason}")
