"""The ring hands images over whole, or says that they are gone."""

import os

import numpy as np
import pytest

from rig.vision.images import SLOTS, ImageRing

SHAPE = (6, 9)


@pytest.fixture
def ends() -> tuple[ImageRing, ImageRing]:
    """The writer's ring and the reader's, on one file that both have closed."""
    writer, file = ImageRing.create(SHAPE)
    reader = ImageRing(file, SHAPE)
    os.close(file)
    return writer, reader


def picture(number: int) -> np.ndarray:
    return np.random.default_rng(number).integers(0, 256, SHAPE).astype(np.uint8)


def test_every_image_still_held_is_read_as_it_was_written(
    ends: tuple[ImageRing, ImageRing],
) -> None:
    writer, reader = ends
    for number in range(3 * SLOTS):
        assert writer.put(picture(number)) == number
        for held in range(max(0, number - SLOTS + 2), number + 1):
            np.testing.assert_array_equal(reader.get(held), picture(held))


def test_an_image_whose_place_is_taken_or_next_to_be_taken_is_none(
    ends: tuple[ImageRing, ImageRing],
) -> None:
    writer, reader = ends
    for number in range(SLOTS):
        writer.put(picture(number))
    assert reader.get(0) is None  # the writer may be at work on it right now
    assert reader.get(1) is not None
    writer.put(picture(SLOTS))
    assert reader.get(0) is None


def test_what_was_read_does_not_change_with_the_ring(ends: tuple[ImageRing, ImageRing]) -> None:
    writer, reader = ends
    writer.put(picture(0))
    image = reader.get(0)
    for number in range(1, 2 * SLOTS):
        writer.put(picture(number))
    np.testing.assert_array_equal(image, picture(0))
    assert image is not None and image.flags.writeable  # a copy of its own


def test_the_ring_has_no_name_in_the_file_system() -> None:
    _, file = ImageRing.create(SHAPE)
    try:
        assert os.fstat(file).st_nlink == 0
    finally:
        os.close(file)
