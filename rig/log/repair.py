"""A log whose writer was killed, written anew with everything that can be read and an index."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import Writer

from drivers.errors import ConfigError
from rig.log.reader import Log, open_log


@dataclass(frozen=True, slots=True)
class Repair:
    """What was done."""

    path: Path
    needed: bool  # False: the log was whole, nothing was written
    messages: int = 0
    lost_bytes: int = 0  # after the last whole record
    damaged_chunks: int = 0  # left out


def repair(path: Path, out: Path | None = None) -> Repair:
    """Rebuild a log, in place unless ``out`` is given.

    The new file takes the old one's place only when it is complete. Raises ConfigError when
    nothing can be read, or the new file cannot be written.
    """
    log = open_log(path)
    if log.finished and _undamaged(log):
        return Repair(log.path, needed=False)
    to = log.path if out is None else out
    draft = to.with_name(to.name + ".repairing")
    try:
        with draft.open("wb") as file:
            messages = _copy(log, Writer(file))
            file.flush()
            os.fsync(file.fileno())
        draft.replace(to)
    except OSError as error:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        raise ConfigError(f"cannot write {to}: {error}; {log.path} is as it was") from error
    lost = 0 if log.finished else log.path_bytes - log.end
    return Repair(to, True, messages, lost, log.damaged_chunks)


def _undamaged(log: Log) -> bool:
    for _ in log.raw():
        pass
    return log.damaged_chunks == 0


def _copy(log: Log, writer: Writer) -> int:
    """Copy everything readable; the number of messages."""
    writer.start(profile="", library="activerig repair")
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    messages = 0
    log.damaged_chunks = 0
    for item in log.raw():
        if isinstance(item, Schema) and item.id not in schemas:
            schemas[item.id] = writer.register_schema(item.name, item.encoding, item.data)
        elif isinstance(item, Channel) and item.id not in channels:
            if item.schema_id in schemas:
                channels[item.id] = writer.register_channel(
                    item.topic, item.message_encoding, schemas[item.schema_id], item.metadata
                )
        elif isinstance(item, Message) and item.channel_id in channels:
            channel = channels[item.channel_id]
            writer.add_message(channel, item.log_time, item.data, item.publish_time, item.sequence)
            messages += 1
        elif isinstance(item, Metadata):
            writer.add_metadata(item.name, item.metadata)
        elif isinstance(item, Attachment):
            writer.add_attachment(
                item.create_time, item.log_time, item.name, item.media_type, item.data
            )
    writer.finish()
    return messages
