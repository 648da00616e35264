"""Makes recordings whose pictures tell their number."""

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT = 64, 48
COUNT = 20
RATE_HZ = 25.0


def picture(index: int) -> np.ndarray:
    """Grey level 10·(index + 1) with a darker left half."""
    image = np.full((HEIGHT, WIDTH), 10 * (index + 1), np.uint8)
    image[:, : WIDTH // 2] //= 2
    return image


def number_in(image: np.ndarray) -> int:
    return round(float(image[HEIGHT // 2, WIDTH - 8]) / 10) - 1


def make_folder(folder: Path, count: int = COUNT) -> Path:
    folder.mkdir()
    for index in range(count):
        cv2.imwrite(str(folder / f"frame{index}.png"), picture(index))
    (folder / "notes.txt").write_text("not an image")
    return folder


def make_video(path: Path) -> Path:
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE_HZ, (WIDTH, HEIGHT), isColor=False
    )
    for index in range(COUNT):
        writer.write(picture(index))
    writer.release()
    return path
