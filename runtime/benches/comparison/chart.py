"""A chart with logarithmic axes as SVG, the same bytes for the same figures."""

import math
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 720, 440
LEFT, RIGHT, TOP, BOTTOM = 70, 190, 40, 55
#: Colours that the colour-blind can tell apart (Okabe and Ito), then the same dashed.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
LABEL_HEIGHT = 15


def svg(title, x_label, y_label, lines):
    """`lines` is a list of names with their points (x, y), all above zero."""
    lines = [(name, sorted(points)) for name, points in lines if points]
    xs = [x for _, points in lines for x, _ in points]
    ys = [y for _, points in lines for _, y in points]
    x_axis = Axis(min(xs), max(xs), LEFT, WIDTH - RIGHT)
    y_axis = Axis(decade(min(ys), math.floor), decade(max(ys), math.ceil), HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        text(LEFT, 22, title, 'font-size="15" font-weight="bold"'),
        text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 12, x_label, 'text-anchor="middle"'),
        f'<text transform="translate(16 {(TOP + HEIGHT - BOTTOM) / 2:.0f}) rotate(-90)" text-anchor="middle">{escape(y_label)}</text>',
    ]
    parts += grid(x_axis, y_axis, sorted(set(xs)))
    labels = []
    for i, (name, points) in enumerate(lines):
        color = COLORS[i % len(COLORS)]
        dash = f' stroke-dasharray="{(6, 2)[i // len(COLORS) - 1]} 4"' if i >= len(COLORS) else ""
        places = [(x_axis.place(x), y_axis.place(y)) for x, y in points]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="2"{dash}/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{color}"/>' for x, y in places]
        labels.append((*places[-1], name, color))
    parts += spread(labels)
    return "\n".join([*parts, "</svg>", ""])


class Axis:
    """Places the logarithms of values from `low` to `high` between two coordinates."""

    def __init__(self, low, high, start, end):
        # A single value is in the middle.
        self.low, self.high = (low, high) if low < high else (low / 2, high * 2)
        self.start, self.end = start, end

    def place(self, value):
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return self.start + share * (self.end - self.start)


def decade(value, rounding):
    return 10.0 ** rounding(math.log10(value))


def grid(x_axis, y_axis, xs):
    """A line at each power of ten of y and at each x, where the labels leave room."""
    parts = []
    exponent = round(math.log10(y_axis.low))
    while 10.0**exponent <= y_axis.high * 1.001:
        y = y_axis.place(10.0**exponent)
        parts.append(f'<line x1="{LEFT}" y1="{y:.1f}" x2="{WIDTH - RIGHT}" y2="{y:.1f}" stroke="#dddddd"/>')
        parts.append(text(LEFT - 6, y + 4, f"{10.0**exponent:g}", 'text-anchor="end"'))
        exponent += 1
    last = -math.inf
    for value in xs:
        x = x_axis.place(value)
        parts.append(f'<line x1="{x:.1f}" y1="{TOP}" x2="{x:.1f}" y2="{HEIGHT - BOTTOM}" stroke="#eeeeee"/>')
        if x - last > 32:
            parts.append(text(x, HEIGHT - BOTTOM + 18, short(value), 'text-anchor="middle"'))
            last = x
    return parts


def spread(labels):
    """The names at the ends of their lines, moved apart where they would overlap."""
    parts, lowest = [], TOP - LABEL_HEIGHT
    tops = []
    for x, y, name, color in sorted(labels, key=lambda label: label[1]):
        lowest = max(y, lowest + LABEL_HEIGHT)
        tops.append([x, y, lowest, name, color])
    # What ran off the bottom pushes the others up again.
    limit = HEIGHT - BOTTOM
    for label in reversed(tops):
        label[2] = min(label[2], limit)
        limit = label[2] - LABEL_HEIGHT
    for x, y, top, name, color in tops:
        edge = WIDTH - RIGHT + 14
        parts.append(
            f'<line x1="{x + 4:.1f}" y1="{y:.1f}" x2="{edge - 3}" y2="{top:.1f}" stroke="{color}" stroke-width="0.6" opacity="0.6"/>'
        )
        parts.append(text(edge, top + 4, name, f'fill="{color}"'))
    return parts


def short(value):
    if value >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1000:g}K" if value >= 1000 else f"{value:g}"


def text(x, y, words, attributes):
    return f'<text x="{x:.1f}" y="{y:.1f}" {attributes}>{escape(words)}</text>'
