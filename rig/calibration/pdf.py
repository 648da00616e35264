"""A one-page PDF of filled rectangles and lines of text, in mm from the left top corner."""

from dataclasses import dataclass, field

_POINTS_PER_MM = 72.0 / 25.4


@dataclass
class PdfPage:
    """A page that is drawn on and then turned into the bytes of a file."""

    width_mm: float
    height_mm: float
    title: str
    _drawing: list[str] = field(default_factory=list, repr=False)

    def rectangle(self, x_mm: float, y_mm: float, width_mm: float, height_mm: float) -> None:
        """A black rectangle whose left top corner is at x, y."""
        self._fill(x_mm, y_mm, width_mm, height_mm, 0)

    def erase(self, x_mm: float, y_mm: float, width_mm: float, height_mm: float) -> None:
        """A white one."""
        self._fill(x_mm, y_mm, width_mm, height_mm, 1)

    def text(self, x_mm: float, y_mm: float, words: str, size_mm: float = 3.0) -> None:
        """One line in Helvetica whose baseline starts at x, y; Latin letters only."""
        clean = words.encode("latin-1", "replace").decode("latin-1")
        for sign in "\\()":
            clean = clean.replace(sign, "\\" + sign)
        size, x, y = size_mm * _POINTS_PER_MM, *self._point(x_mm, y_mm)
        self._drawing.append(f"BT 0 g /F1 {size:.3f} Tf {x:.4f} {y:.4f} Td ({clean}) Tj ET")

    def to_bytes(self) -> bytes:
        """The file's content; the same drawing gives the same bytes."""
        stream = "\n".join(self._drawing).encode("latin-1")
        width, height = self.width_mm * _POINTS_PER_MM, self.height_mm * _POINTS_PER_MM
        page = f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.4f} {height:.4f}] "
        page += "/Contents 4 0 R /Resources << /Font << /F1 5 0 R >> >> >>"
        font = "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>"
        title = self.title.encode("latin-1", "replace").hex()
        objects = [
            # Viewers that honour it print without scaling.
            b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            page.encode(),
            b"<< /Length %d >>\nstream\n%b\nendstream" % (len(stream), stream),
            font.encode(),
            f"<< /Title <{title}> >>".encode(),
        ]
        return _file(objects)

    def _fill(self, x_mm: float, y_mm: float, width_mm: float, height_mm: float, grey: int) -> None:
        x, y = self._point(x_mm, y_mm + height_mm)
        width, height = width_mm * _POINTS_PER_MM, height_mm * _POINTS_PER_MM
        self._drawing.append(f"{grey} g {x:.4f} {y:.4f} {width:.4f} {height:.4f} re f")

    def _point(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        return x_mm * _POINTS_PER_MM, (self.height_mm - y_mm) * _POINTS_PER_MM


def _file(objects: list[bytes]) -> bytes:
    """Header, numbered objects, the table of where they begin, trailer."""
    out = bytearray(b"%PDF-1.4\n")
    starts = []
    for number, body in enumerate(objects, start=1):
        starts.append(len(out))
        out += b"%d 0 obj\n%b\nendobj\n" % (number, body)
    table = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    for start in starts:
        out += b"%010d 00000 n \n" % start
    out += b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\n" % (len(objects) + 1, len(objects))
    out += b"startxref\n%d\n%%%%EOF\n" % table
    return bytes(out)
