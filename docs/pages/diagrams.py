"""The flowcharts of the handbook (Mermaid, which forges draw) as pictures that need no program in the page.

What the handbook uses of Mermaid is read: ``flowchart TB`` or ``LR``, ``name["text\\nmore"]``, ``a --> b``,
``a -- "text" --> b``, ``a -. text .-> b``. Boxes stand in layers, each after what leads to it; an edge back to an earlier
layer goes around. Anything else is refused, so that no diagram is drawn by half.
"""

import re
from html import escape

from pages.errors import PageError

_NODE = re.compile(r'(\w+)\["(.*)"\]')
_EDGE = re.compile(r'(\w+) (?:-- "(?P<text>.*)" -->|-\. (?P<dotted>.*) \.->|-->) (\w+)(?:\(\( \)\))?')
LETTER, LINE, PADDING = 7.4, 17.0, 14.0  # [px] width of a letter, height of a line, around a text
BETWEEN = {"TB": (28.0, 46.0), "LR": (44.0, 60.0)}  # [px] boxes of a layer, layers without a text between them
SMALLEST = 0.7  # [-] of its size, at which it can be read; a narrower screen scrolls


def html(source: str) -> str:
    """The diagram as a block of HTML. Raises PageError where it is none that this draws."""
    direction, boxes, edges = _parsed(source)
    layers = _layers(boxes, edges)
    between = {} if direction == "TB" else _widths(layers, edges)
    places, width, height = _placed(direction, boxes, layers, between)
    back = 60.0 if any(layers[a] > layers[b] for a, b, _, _ in edges) else 0.0
    lines = [_edge(direction, places[a], places[b], label, dotted, layers[a] > layers[b], height)
             for a, b, label, dotted in edges]
    shapes = [_box(*places[name], text) for name, text in boxes.items() if text]
    return (f'<div class="diagram"><svg viewBox="0 0 {width:.0f} {height + back:.0f}" '
            f'style="max-width:{width:.0f}px;min-width:{SMALLEST * width:.0f}px" '
            'role="img" aria-label="diagram"><defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
            'markerHeight="8" orient="auto"><path d="M0 0 L8 4 L0 8 z"></path></marker></defs>'
            f'{"".join(lines)}{"".join(shapes)}</svg></div>')


def _parsed(source):
    first, *rest = [line.strip() for line in source.strip().splitlines()]
    direction = first.removeprefix("flowchart ")
    boxes, edges = {}, []
    for line in rest:
        if found := _NODE.fullmatch(line):
            boxes[found[1]] = found[2].split("\\n")
        elif found := _EDGE.fullmatch(line):
            edges.append((found[1], found[4], (found["text"] or found["dotted"] or "").split("\\n"), bool(found["dotted"])))
        else:
            raise PageError(f"diagram: '{line}' is nothing that is drawn here")
    if direction not in BETWEEN:
        raise PageError(f"diagram: '{first}' is not drawn here; allowed: flowchart TB, flowchart LR")
    for name in (name for edge in edges for name in edge[:2]):
        boxes.setdefault(name, [])
    return direction, boxes, edges


def _layers(boxes, edges):
    """name -> number of its layer: after all that lead to it, but for edges to a box that was named before."""
    order = {name: number for number, name in enumerate(boxes)}
    layers = dict.fromkeys(boxes, 0)
    for name in boxes:
        before = [layers[a] for a, b, _, dotted in edges if b == name and order[a] < order[name] and not dotted]
        layers[name] = max(before, default=-1) + 1
    return layers


def _widths(layers, edges):
    """Layer -> width [px] of the longest text on an edge from it to the next."""
    found = {}
    for a, b, label, _ in edges:
        if layers[b] > layers[a]:
            found[layers[a]] = max(found.get(layers[a], 0.0), max(map(len, label)) * LETTER + 2 * PADDING)
    return found


def _placed(direction, boxes, layers, between):
    """name -> (x, y, width, height) [px] of the box, and width and height of all."""
    sizes = {name: (max(map(len, text), default=0) * LETTER + 2 * PADDING, len(text) * LINE + PADDING)
             for name, text in boxes.items()}
    aside, along = BETWEEN[direction]
    flow, cross = (1, 0) if direction == "TB" else (0, 1)
    rows = [[name for name in boxes if layers[name] == number] for number in range(max(layers.values()) + 1)]
    extents = [sum(sizes[name][cross] for name in row) + aside * (len(row) - 1) for row in rows]
    places, at = {}, 0.0
    for number, (row, extent) in enumerate(zip(rows, extents)):
        depth, side = max(sizes[name][flow] for name in row), (max(extents) - extent) / 2
        for name in row:
            corner = (side, at + (depth - sizes[name][1]) / 2) if direction == "TB" else (
                at + (depth - sizes[name][0]) / 2, side)
            places[name] = (*corner, *sizes[name])
            side += sizes[name][cross] + aside
        end = at + depth
        at = end + max(along, between.get(number, 0.0))
    total = (max(extents), end)
    return places, *(total if direction == "TB" else total[::-1])


def _edge(direction, a, b, label, dotted, is_back, height):
    (ax, ay), (bx, by) = ((x + w / 2, y + h / 2) for x, y, w, h in (a, b))
    if is_back:
        low = height + 40.0
        path = f"M{ax:.0f} {a[1] + a[3]:.0f} C{ax:.0f} {low:.0f} {bx:.0f} {low:.0f} {bx:.0f} {b[1] + b[3]:.0f}"
        middle = ((ax + bx) / 2, low - 14.0)
    elif direction == "TB" and a[1] == b[1]:
        path, middle = f"M{a[0] + a[2]:.0f} {ay:.0f} L{b[0]:.0f} {by:.0f}", None
    elif direction == "TB":
        path, middle = f"M{ax:.0f} {a[1] + a[3]:.0f} L{bx:.0f} {b[1]:.0f}", ((ax + bx) / 2, (ay + by) / 2)
    else:
        path = f"M{a[0] + a[2]:.0f} {ay:.0f} L{b[0]:.0f} {by:.0f}"
        middle = ((a[0] + a[2] + b[0]) / 2, (ay + by) / 2 - 6.0)
    middle = middle or ((a[0] + a[2] + b[0]) / 2, a[1] - 8.0)
    first = middle[1] - LINE * (len(label) - 1) / 2
    text = "".join(f'<text x="{middle[0]:.0f}" y="{first + LINE * number:.0f}" class="label">{escape(line)}</text>'
                   for number, line in enumerate(label) if line)
    return f'<path d="{path}" class="edge{" dotted" if dotted else ""}" marker-end="url(#tip)"></path>{text}'


def _box(x, y, width, height, text):
    first = y + PADDING / 2 + 0.75 * LINE
    lines = "".join(f'<text x="{x + width / 2:.0f}" y="{first + LINE * number:.0f}">{escape(line)}</text>'
                    for number, line in enumerate(text))
    return f'<rect x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" rx="6"></rect>{lines}'
