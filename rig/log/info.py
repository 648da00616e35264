"""What is in a log, counted."""

from dataclasses import dataclass, field
from typing import Any

from mcap.records import Channel, Message, Schema

from rig.log.header import PROGRAM
from rig.log.reader import Log


@dataclass(slots=True)
class ChannelInfo:
    """One channel's messages."""

    topic: str
    schema: str
    count: int = 0
    bytes: int = 0


@dataclass(slots=True)
class LogInfo:
    """A log in figures."""

    log: Log
    channels: list[ChannelInfo] = field(default_factory=list)
    first_ns: int | None = None
    last_ns: int | None = None

    @property
    def duration_s(self) -> float:
        """From the first message to the last."""
        if self.first_ns is None or self.last_ns is None:
            return 0.0
        return (self.last_ns - self.first_ns) * 1e-9

    def as_dict(self) -> dict[str, Any]:
        """The same for JSON."""
        return {
            "path": str(self.log.path),
            "bytes": self.log.path_bytes,
            "finished": self.log.finished,
            "unreadable_bytes": 0 if self.log.finished else self.log.path_bytes - self.log.end,
            "damaged_chunks": self.log.damaged_chunks,
            "duration_s": self.duration_s,
            "program": self.log.metadata.get(PROGRAM, {}),
            "run": self.log.metadata_values("run"),
            "attachments": {name: len(data) for name, data in self.log.attachments.items()},
            "channels": {
                one.topic: {"schema": one.schema, "count": one.count, "bytes": one.bytes}
                for one in self.channels
            },
        }


def describe(log: Log) -> LogInfo:
    """Read a log through and count."""
    info, names = LogInfo(log), dict[int, str]()
    channels: dict[int, ChannelInfo] = {}
    log.damaged_chunks = 0
    for item in log.raw():
        if isinstance(item, Schema):
            names[item.id] = item.name
        elif isinstance(item, Channel):
            if item.id not in channels:
                one = ChannelInfo(item.topic, names.get(item.schema_id, ""))
                channels[item.id] = one
                info.channels.append(one)
        elif isinstance(item, Message) and item.channel_id in channels:
            one = channels[item.channel_id]
            one.count, one.bytes = one.count + 1, one.bytes + len(item.data)
            first, last = info.first_ns, info.last_ns
            info.first_ns = item.log_time if first is None else min(first, item.log_time)
            info.last_ns = item.log_time if last is None else max(last, item.log_time)
    return info
