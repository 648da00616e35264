"""One run as it is handed to whoever does it, with all it needs: no file of this machine."""

from dataclasses import dataclass

from rig.campaign.cases import Case


@dataclass(frozen=True, slots=True)
class Job:
    """A case and the configuration it is laid over."""

    case: Case
    rig: str  # YAML, as ``dump_config`` writes it
    assignments: tuple[str, ...]  # on top of the case's own
    sources: str  # of the program that asks, see ``sources_here``
