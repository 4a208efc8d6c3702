"""Part programs beside the interpreter `pygcode` 0.2.1 of PyPI, which shares nothing with this tool.

    python referee.py [COUNT [SEED]]

Random programs with straight lines and arcs in three planes, absolute and relative, in mm and inches, with line numbers and comments:
where the axes end and how far each of them goes in between must be the same, to a step and to what the chords of either may be off.
In the planes G18 and G19 only the ends are compared: there pygcode turns the wrong way round where the third axis is not at 0.
"""

import json
import math
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import pygcode
from pygcode.transform import ArcLinearizeInside, linearize_arc
from tool import built

PER_MM = 80
# Chords within 2 um here and within 5 um there, and half a step, in mm.
SLACK = 0.007 + 0.5 / PER_MM
AXES = "XYZ"
PLANES = {"G17": "XYIJ", "G18": "ZXKI", "G19": "YZJK"}


def number(draw, most):
    return round(draw.uniform(-most, most), 3)


def program(draw):
    """A program; it knows where it is only to place the centers of arcs."""
    unit, relative, plane, at = draw.choice([1.0, 25.4]), False, "G17", dict.fromkeys(AXES, 0.0)
    # The referee does not convert its place where the unit changes, so it changes once.
    lines = [f"{'G21' if unit == 1.0 else 'G20'} G90 G17", "G0 X0 Y0 Z0", f"G1 F{3000 / unit:.1f}"]
    for count in range(draw.randint(3, 15)):
        kind = draw.random()
        if kind < 0.15:
            relative = draw.random() < 0.5
            lines.append("G91" if relative else "G90")
        elif kind < 0.3:
            plane = draw.choice(list(PLANES))
            lines.append(plane)
        elif kind < 0.7:
            words = []
            for axis in draw.sample(AXES, draw.randint(1, 3)):
                value = number(draw, 40 / unit)
                at[axis] = value * unit + (at[axis] if relative else 0.0)
                words.append(f"{axis}{value:.3f}")
            lines.append(f"N{10 * count} {draw.choice(['G0', 'G1'])} {' '.join(words)} (straight)")
        else:
            first, second, i, j = PLANES[plane]
            radius, begin, sweep = draw.uniform(1, 15), draw.uniform(0, math.tau), draw.uniform(0.3, 5.5)
            center = (round(-radius * math.cos(begin) / unit, 4), round(-radius * math.sin(begin) / unit, 4))
            turned = begin + sweep * (1 if (left := draw.random() < 0.5) else -1)
            away = (radius * (math.cos(turned) - math.cos(begin)), radius * (math.sin(turned) - math.sin(begin)))
            words = []
            for axis, by in zip((first, second), away):
                value = round((by if relative else at[axis] + by) / unit, 4)
                at[axis] = value * unit + (at[axis] if relative else 0.0)
                words.append(f"{axis}{value:.4f}")
            lines.append(f"{'G3' if left else 'G2'} {' '.join(words)} {i}{center[0]:.4f} {j}{center[1]:.4f} ; an arc")
    return [*lines, "M2"]


def theirs(lines):
    """The places of the referee, in mm."""
    machine = pygcode.Machine()
    places = []

    def note():
        factor = 25.4 if isinstance(machine.mode.units, pygcode.GCodeUseInches) else 1.0
        places.append([machine.pos.values[axis] * factor for axis in AXES])

    for text in lines:
        for code in pygcode.Line(text).block.gcodes:
            if isinstance(code, pygcode.GCodeArcMove):
                chords = linearize_arc(
                    code,
                    machine.pos,
                    method_class=ArcLinearizeInside,
                    plane=machine.mode.plane_selection,
                    dist_mode=machine.mode.distance,
                    arc_dist_mode=machine.mode.arc_ijk_distance,
                    max_error=0.0002,
                    decimal_places=6,
                )
                for chord in chords:
                    machine.process_gcodes(chord)
                    note()
            else:
                machine.process_gcodes(code)
                note()
    return places


def ours(servowire, lines):
    """The places of the tool, in steps."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.nc"
        path.write_text("\n".join(lines) + "\n")
        command = [servowire, "profile", "--gcode", str(path), "--steps-per-mm", str(PER_MM), "--json"]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    at, places = [0, 0, 0], [[0, 0, 0]]
    for step in map(json.loads, told.splitlines()):
        at[AXES.index(step["axis"])] = step["position"]
        places.append(list(at))
    return places


def main():
    count, seed = (int(text) for text in (sys.argv[1:] + ["200", "1"][len(sys.argv) - 1 :])[:2])
    draw, servowire, arcs = random.Random(seed), built(), 0
    for at in range(count):
        lines = program(draw)
        arcs += sum(line.startswith(("G2 ", "G3 ")) for line in lines)
        want, got = theirs(lines), ours(servowire, lines)
        for axis, name in enumerate(AXES):
            line, steps = [0.0, *(place[axis] for place in want)], [place[axis] / PER_MM for place in got]
            compared = [("end", line[-1], steps[-1])]
            if not {"G18", "G19"} & set(lines):
                compared += [("least", min(line), min(steps)), ("greatest", max(line), max(steps))]
            for what, one, other in compared:
                told = f"program {at}: {name}, {what}: {one} and {other} mm"
                assert abs(one - other) <= SLACK, told + "\n" + "\n".join(lines)
    assert arcs > count
    print(f"referee: {count} programs with {arcs} arcs lead where pygcode says")


main()
