"""The images of a log, each decoded when somebody asks for it."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader

from drivers.errors import ConfigError
from drivers.interfaces import GreyImage
from rig.log.pixels import image_of
from rig.log.reader import Log, Record
from rig.log.topics import BY_KIND

IMAGE_KINDS = ("image", "raw_image")


def loader(log: Log, record: Record) -> Callable[[], GreyImage]:
    """What decodes the image of ``record``; it raises ConfigError when that is not possible.

    A log that was closed in order has an index to find it by; another one is searched.
    """
    find = _indexed if log.finished else _searched
    return partial(find, log, record.kind, record.logged_ns, record.t_ns)


def _indexed(log: Log, kind: str, logged_ns: int, t_ns: int) -> GreyImage:
    topic = BY_KIND[kind]
    assert topic.message is not None  # images are protobuf
    try:
        with log.path.open("rb") as file:
            found = make_reader(file).iter_messages(
                [topic.name], starting_at=logged_ns, ending_at=logged_ns
            )
            for _, _, message in found:
                if message.publish_time == t_ns:
                    return image_of(topic.message.FromString(message.data))
    except (OSError, McapError) as error:
        raise ConfigError(f"{log.path} cannot be read: {error}") from error
    raise ConfigError(_missing(log.path))


def _searched(log: Log, kind: str, logged_ns: int, t_ns: int) -> GreyImage:
    for record in log.records([kind]):
        if (record.logged_ns, record.t_ns) == (logged_ns, t_ns):
            return record.image()
    raise ConfigError(_missing(log.path))


def _missing(path: Path) -> str:
    return f"{path} no longer holds an image that it held before: was it replaced meanwhile?"
