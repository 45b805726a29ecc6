"""The state diagram of a pilot's phases as SVG: one arrow for each pair of phases, with the rows of the table."""

from __future__ import annotations

from collections import defaultdict
from math import hypot

from flockwire_core.pilot.phases import transitions
from flockwire_core.wire.phase import PILOT_PHASES, Phase

Point = tuple[float, float]
ANY = "any phase"
PLACES: dict[str, Point] = {  # px, of the centres
    Phase.READY: (90, 110), Phase.TAKEOFF: (310, 110), Phase.HOLD: (530, 110), Phase.FORMATION: (750, 110),
    Phase.GROUNDED: (90, 330), Phase.LANDING: (530, 330), Phase.STOPPED: (750, 430), ANY: (530, 430),
}  # fmt: skip
WIDTH, HEIGHT = 840, 480  # px
HALF = (54, 20)  # px, of a box
BOW, WIDE_BOW = 16.0, 78.0  # px beside the straight line; wide where another box is in the way
HEAD = f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}"
font-family="sans-serif" font-size="14">
<rect width="{WIDTH}" height="{HEIGHT}" rx="6" fill="#ffffff"/>
<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto">
<path d="M0 0L10 5L0 10z" fill="#57606a"/></marker></defs>
"""
COLOURS = {
    Phase.GROUNDED: "#eaeef2",
    Phase.READY: "#eaeef2",
    Phase.STOPPED: "#ffd8d3",
    ANY: "#ffffff",
}  # else: in flight
IN_FLIGHT = "#d3e8ff"
DASHED = ' stroke-dasharray="4 3"'


def phases_picture() -> str:
    """Return the picture."""
    rows = defaultdict(list)
    for number, one in enumerate(transitions(), 1):
        every = one.before == frozenset(PILOT_PHASES)
        for before in (ANY,) if every else (phase for phase in PILOT_PHASES if phase in one.before):
            if before != one.after:
                rows[before, one.after].append(number)
    arrows = [_arrow(before, after, numbers) for (before, after), numbers in rows.items()]
    return (
        HEAD
        + "".join(path for path, _ in arrows)
        + "".join(map(_box, PLACES))
        + "".join(label for _, label in arrows)
        + "</svg>\n"
    )


def _box(name: str) -> str:
    """Return the box of a phase, and its name."""
    (x, y), (w, h) = PLACES[name], HALF
    look = f'fill="{COLOURS.get(name, IN_FLIGHT)}" stroke="#57606a"{DASHED if name == ANY else ""}'
    box = f'<rect x="{x - w:g}" y="{y - h:g}" width="{2 * w}" height="{2 * h}" rx="9" {look}/>\n'
    return box + _text(name, x, y, "#1f2328")


def _text(text: str, x: float, y: float, colour: str) -> str:
    return f'<text x="{x:.1f}" y="{y + 5:.1f}" text-anchor="middle" fill="{colour}">{text}</text>\n'


def _arrow(before: str, after: str, numbers: list[int]) -> tuple[str, str]:
    """Return the curve from one box to another, and its label."""
    start, end = PLACES[before], PLACES[after]
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    dx, dy = end[0] - start[0], end[1] - start[1]
    bow = (WIDE_BOW if _blocked(before, after) else BOW) * 2 / hypot(dx, dy)
    control = (middle[0] + bow * dy, middle[1] - bow * dx)
    tail, tip = _border(start, control), _border(end, control)
    place = ((tail[0] + 2 * control[0] + tip[0]) / 4, (tail[1] + 2 * control[1] + tip[1]) / 4)
    text = ", ".join(map(str, numbers))
    curve = " ".join(f"{x:.1f} {y:.1f}" for x, y in (control, tip))
    path = (
        f'<path d="M{tail[0]:.1f} {tail[1]:.1f}Q{curve}" fill="none" stroke="#57606a" stroke-width="1.4"'
        ' marker-end="url(#tip)"/>\n'
    )
    (x, y), half = place, 4 + 4.2 * len(text)
    ground = f'<rect x="{x - half:.1f}" y="{y - 9:.1f}" width="{2 * half:.1f}" height="18" rx="4" fill="#ffffff"/>\n'
    label = ground + _text(text, x, y, "#0550ae")
    return path, label


def _blocked(before: str, after: str) -> bool:
    """Return whether another box lies on the straight line between two boxes."""
    (x, y), (u, v) = PLACES[before], PLACES[after]
    length = hypot(u - x, v - y)
    for name, (p, q) in PLACES.items():
        along = ((p - x) * (u - x) + (q - y) * (v - y)) / length
        beside = abs((p - x) * (v - y) - (q - y) * (u - x)) / length
        if name not in (before, after) and 0 < along < length and beside < HALF[1] + 10:
            return True
    return False


def _border(box: Point, towards: Point) -> Point:
    """Return where the line from a box's centre leaves it."""
    dx, dy = towards[0] - box[0], towards[1] - box[1]
    share = min(HALF[0] / max(abs(dx), 1e-9), HALF[1] / max(abs(dy), 1e-9))
    return box[0] + dx * share, box[1] + dy * share
