"""Raw buffers to grey images: the luminance exactly, damaged buffers not at all."""

import cv2
import numpy as np
import pytest

from drivers.camera.grey import RAW_FORMATS, jpeg_to_grey, raw_to_grey

WIDTH, HEIGHT = 8, 6
Y = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8)


def packed(luminance_first: bool) -> np.ndarray:
    colour = np.full_like(Y, 128)
    return np.stack([Y, colour] if luminance_first else [colour, Y], axis=-1)


def planar(colour_bytes: int) -> np.ndarray:
    return np.concatenate([Y.ravel(), np.full(colour_bytes, 128, np.uint8)])


@pytest.mark.parametrize(
    ("fourcc", "buffer"),
    [
        ("YUYV", packed(True)),
        ("UYVY", packed(False)),
        ("GREY", Y),
        ("NV12", planar(Y.size // 2)),
        ("422P", planar(Y.size)),
        ("GREY", np.concatenate([Y.ravel(), np.zeros(100, np.uint8)])),  # padded
    ],
)
def test_the_luminance_is_exact_and_owned(fourcc: str, buffer: np.ndarray) -> None:
    image = raw_to_grey(buffer, fourcc, WIDTH, HEIGHT)
    assert image is not None
    assert np.array_equal(image, Y)
    assert image.flags.c_contiguous
    assert not np.shares_memory(image, buffer)


@pytest.mark.parametrize("fourcc", RAW_FORMATS)
def test_a_buffer_cut_short_is_damaged(fourcc: str) -> None:
    assert raw_to_grey(Y.ravel()[:-1], fourcc, WIDTH, HEIGHT) is None


def test_an_unknown_format_is_an_error_that_lists_the_known_ones() -> None:
    with pytest.raises(ValueError, match="YUYV"):
        raw_to_grey(Y, "H264", WIDTH, HEIGHT)


def jpeg(image: np.ndarray) -> bytes:
    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 100])[1])


def test_a_jpeg_decodes_even_when_padded_with_zeros() -> None:
    smooth = np.tile(np.arange(64, dtype=np.uint8) * 3, (48, 1))
    for data in (jpeg(smooth), jpeg(smooth) + bytes(50)):
        image = raw_to_grey(np.frombuffer(data, np.uint8), "MJPG", 64, 48)
        assert image is not None
        assert np.abs(image.astype(int) - smooth).max() <= 3


def test_a_jpeg_cut_short_of_another_size_or_none_at_all_is_damaged() -> None:
    data = jpeg(np.random.default_rng(0).integers(0, 255, (48, 64)).astype(np.uint8))
    assert jpeg_to_grey(data[: len(data) // 2]) is None
    assert jpeg_to_grey(b"") is None
    assert jpeg_to_grey(b"nonsense\xff\xd9") is None
    assert raw_to_grey(np.frombuffer(data, np.uint8), "MJPG", 32, 48) is None
