"""Generated parts of pages in docs, between markers."""

from pathlib import Path

_BEGIN, _END = "<!-- begin {} -->\n", "<!-- end {} -->\n"


def write(path: Path, part: str, text: str) -> None:
    """Put `text` between the markers of a part; SystemExit when the page has none."""
    begin, end = _BEGIN.format(part), _END.format(part)
    before, found, rest = path.read_text(encoding="utf-8").partition(begin)
    _, also, after = rest.partition(end)
    if not (found and also):
        raise SystemExit(f"{path}: the lines {begin.strip()} and {end.strip()} are missing")
    path.write_text(f"{before}{begin}{text}{end}{after}", encoding="utf-8")
