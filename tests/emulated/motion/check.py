"""The motion images against what they have to do.

    python check.py rp2040 IMAGE
    python check.py stm32f405 IMAGE

Lines are typed while the machine moves, holds and overrides requested. Every STEP edge is compared with a reckoning of its own
(`course.py`), DIR with the way that the line goes; no pulse is late, and where the machine says that it is, its edges have brought it.
When a request takes effect is not known beforehand, only that it does within the time that the image promises; so these instants are
fitted, one number for all edges that follow.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
from dataclasses import dataclass

from course import Course, Line, fitted

HERE = pathlib.Path(__file__).parent
# What a driver needs, in seconds: STEP high and low, DIR before and behind a rising STEP.
LEAST_LEVEL, LEAST_DIR = 1.9e-6, 0.2e-6
# How long an axis pauses before it goes back, in seconds.
PAUSE = 20e-6


@dataclass
class Machine:
    """As the image is built."""

    scale: list  # steps in a mm
    speeds: list  # steps/s
    accelerations: list  # steps/s²
    size: list  # steps of a line, by which the script is scaled
    feed: int  # um/s
    reach: float  # half of what a request may take, in s
    allowed: float  # how far an edge may be from its time, in s
    slice: float  # how long the longest slice of the background takes, in s
    wait: float = 0.0  # how long an edge may wait until the handler of another event has ended, in s


MACHINES = {
    # A step within 3/4 of a tick of 100 ns.
    "rp2040": Machine([80, 80], [5_000] * 2, [200_000] * 2, [240, 120], 60_000, 0.02, 75e-9, 0.01),
    # The interrupt computes for 1.5 us before it switches the pins, always the same way. Where a block ends it takes 3 us, and the next
    # event waits.
    "stm32f405": Machine(
        [80, 80, 400], [20_000, 20_000, 10_000], [400_000, 400_000, 200_000], [480, 240, 180], 100_000, 0.004, 200e-9, 0.003, 3e-6
    ),
}


class Script:
    """Places as multiples of the size of a line, and steps of the first axis."""

    def __init__(self, machine):
        self.machine = machine
        self.lines, self.before, self.steps = [], 0, 0
        self.at = [0] * len(machine.size)

    def type(self, text, **condition):
        self.lines.append((condition, text))

    def line(self, *by, **condition):
        """A line by so many sizes; the third axis goes as the second."""
        begin = self.at
        by = (*by, by[1])[: len(begin)]
        self.at = [at + int(part * size) for at, part, size in zip(begin, by, self.machine.size)]
        self.before, self.steps = self.steps, self.steps + abs(self.at[0] - begin[0])
        self.type(f"line {' '.join(map(str, self.at))} {self.machine.feed}", **condition)
        m = self.machine
        return Line(begin, self.at, m.scale, m.speeds, m.accelerations, m.feed / 1000)

    def within(self, text, part):
        """Types something once so many sizes of the last line have been made."""
        self.type(text, steps=self.before + int(part * self.machine.size[0]))


def load(result, axes):
    """Rising edges of STEP of each axis, as (seconds without what it waited for another handler, backwards), checked against what a
    driver needs."""
    hz, found = result["hz"], [[] for _ in range(axes)]
    level, changed, dir_changed = [0] * axes, [-1.0] * axes, [-1.0] * axes
    dirs, rose = [0] * axes, [-1.0] * axes
    for at, steps, reverse, *waited in result["edges"]:
        now = at / hz
        for axis in range(axes):
            step, backwards = steps >> axis & 1, reverse >> axis & 1
            if backwards != dirs[axis]:
                dirs[axis], dir_changed[axis] = backwards, now
                assert not found[axis] or now - rose[axis] >= LEAST_DIR, f"DIR {axis} behind STEP at {now}"
            if step == level[axis]:
                continue
            assert now - changed[axis] >= LEAST_LEVEL, f"STEP {axis} has been {level[axis]} for {now - changed[axis]} s only"
            level[axis], changed[axis] = step, now
            if step:
                rose[axis] = now
                assert now - dir_changed[axis] >= LEAST_DIR, f"DIR {axis} before STEP at {now}"
                found[axis].append((now - sum(waited) / hz, bool(backwards)))
    return found


class Edges:
    """The edges that were made, taken line by line."""

    def __init__(self, found):
        self.found, self.taken = found, [0] * len(found)

    def take(self, line, most=None):
        """The next edges, as (place on the line, seconds); those of the whole line, or those until an instant."""
        pairs = []
        for axis, steps in enumerate(line.steps):
            places = sorted(place for place, of, _ in line.places() if of == axis)
            made = self.found[axis][self.taken[axis] :][: len(places)]
            if most is not None:
                made = [edge for edge in made if edge[0] < most]
            else:
                assert len(made) == len(places), f"axis {axis}: {len(made)} steps of {len(places)}"
            assert all(backwards == (steps < 0) for _, backwards in made), f"axis {axis} goes the wrong way"
            self.taken[axis] += len(made)
            pairs += [(place, at) for place, (at, _) in zip(places, made)]
        return sorted(pairs)

    def position(self):
        """Where the edges so far have brought the axes."""
        return [sum(-1 if backwards else 1 for _, backwards in edges) for edges in self.found]


def off(course, pairs):
    """How far the edges are from their times: the greatest."""
    return max(abs(course.when(place) - at) for place, at in pairs)


class Judge:
    def __init__(self, name, result):
        self.machine = MACHINES[name]
        self.edges = Edges(load(result, len(self.machine.size)))
        self.typed = [(at / result["hz"], text) for at, text in result["typed"]]
        self.worst, self.reactions, self.count = 0.0, [], 0

    def fits(self, what, course_of, pairs, low, high):
        """The instant of a request, from the edges behind it."""
        when = fitted(low, high, lambda at: off(course_of(at), pairs))
        error = off(course_of(when), pairs)
        print(f"  {what}: {len(pairs)} edges within {error * 1e9:.0f} ns")
        assert len(pairs) > 20 and error <= self.machine.allowed, f"{what}: an edge is {error * 1e9:.0f} ns beside its time"
        self.worst, self.count = max(self.worst, error), self.count + len(pairs)
        return when

    def reacts(self, what, typed, when):
        """A request takes effect within twice the reach, and what a slice takes."""
        took = when - typed
        assert -1e-6 <= took <= 2 * self.machine.reach + self.machine.slice, f"{what} took {took * 1e3:.1f} ms"
        self.reactions.append(took)

    def at(self, text):
        """When a line was typed; it is of no more use then."""
        found = next(entry for entry in self.typed if entry[1].split()[0] == text)
        self.typed.remove(found)
        return found[0]


def straight(begin, lines):
    course = Course(begin, lines[0])
    course.finish(sum(line.length for line in lines), lines[0].speed)
    return course


def joined(edges, lines):
    """The edges of lines in one direction, one behind the other."""
    pairs, before = [], 0.0
    for line in lines:
        pairs += [(place + before, at) for place, at in edges.take(line)]
        before += line.length
    return pairs


def script(machine):
    """What is typed, and the lines in it."""
    s = Script(machine)
    s.type("hold")
    lines = {"out": [s.line(1, 1), s.line(1, 1)]}
    s.type("resume")
    lines["corner"] = [s.line(-0.5, 2), s.line(-0.5, 2)]
    lines["held"] = s.line(2, -2, rests=1)
    s.within("hold", 0.25)
    s.type("resume", rests=2)
    lines["override"] = s.line(-2, 2, rests=3)
    s.within("override 50", 0.25)
    s.within("override 100", 1.375)
    lines["stopped"] = s.line(2, -2, rests=4)
    s.within("stop", 0.5)
    return s.lines, lines


def judge(name, result, lines):
    j = Judge(name, result)
    judge_corner(j, lines)
    judge_hold(j, lines["held"])
    judge_override(j, lines["override"])
    judge_stop(j, lines["stopped"])
    return j


def judge_corner(j, lines):
    """Two lines in one direction are one; a corner is a rest."""
    first = min(edges[0][0] for edges in j.edges.found)
    pairs = joined(j.edges, lines["out"])
    begin = j.fits("two lines", lambda at: straight(at, lines["out"]), pairs, first - 0.02, first)
    j.at("hold")
    j.reacts("resume", j.at("resume"), begin)
    end = straight(begin, lines["out"]).time
    pairs = joined(j.edges, lines["corner"])
    corner = j.fits("a corner, two lines", lambda at: straight(at, lines["corner"]), pairs, end - 0.001, end + 0.001)
    # The first axis turns round there, and its driver and mechanics have their pause.
    pause = corner - end
    assert -2 * j.machine.allowed <= pause <= PAUSE + 2 * j.machine.allowed, f"{pause} s behind the line before"


def judge_hold(j, line):
    """A hold, and from there on."""
    hold, resume = j.at("hold"), j.at("resume")
    pairs = j.edges.take(line)
    held = changed(line, 0.0)
    before, during, _ = split(pairs, hold, resume)
    begin = j.fits("until the hold", held, before, pairs[0][1] - 0.02, pairs[0][1])
    at = j.fits("hold", lambda at: held(begin, at), during, hold, hold + 0.06)
    j.reacts("hold", hold, at)
    # What the image says of a rest may be ahead of its last pulses, which are in a FIFO.
    rest = held(begin, at)
    during, after = [[pair for pair in pairs if (pair[0] < rest.place) is still] for still in (True, False)]
    assert off(rest, during[len(before) :]) <= j.machine.allowed, "the end of the hold"
    again = j.fits("resume", lambda again: held(begin, at, again), after, resume, after[0][1])
    j.reacts("resume", resume, again)


def judge_override(j, line):
    """Half the speed, and the whole again."""
    half, whole = j.at("override"), j.at("override")
    pairs = j.edges.take(line)
    slowed = changed(line, line.speed / 2)
    before, during, after = split(pairs, half, whole)
    begin = j.fits("until the override", slowed, before, pairs[0][1] - 0.02, pairs[0][1])
    at = j.fits("override 50", lambda at: slowed(begin, at), during, half, half + 0.06)
    j.reacts("override 50", half, at)
    again = j.fits("override 100", lambda again: slowed(begin, at, again), after, whole, whole + 0.06)
    j.reacts("override 100", whole, again)


def judge_stop(j, line):
    """A stop ends it; nothing comes behind that."""
    stop = j.at("stop")
    pairs = j.edges.take(line, most=float("inf"))
    stopped = changed(line, 0.0)
    before, during, _ = split(pairs, stop, float("inf"))
    begin = j.fits("until the stop", stopped, before, pairs[0][1] - 0.02, pairs[0][1])
    at = j.fits("stop", lambda at: stopped(begin, at), during, stop, stop + 0.06)
    j.reacts("stop", stop, at)
    course = stopped(begin, at)
    assert off(course, pairs) <= j.machine.allowed, "the end of the stop"
    due = sum(place < course.place - 1e-3 for place, *_ in line.places())
    assert due <= len(pairs) < sum(map(abs, line.steps)), f"{len(pairs)} steps until the stop, {due} are due"
    assert all(taken == len(made) for taken, made in zip(j.edges.taken, j.edges.found)), "steps that nobody asked for"


def changed(line, speed):
    """Courses along a line that begin at its own speed; from `at` on it is another one, and from `again` on its own, to the end."""

    def course_of(begin, at=None, again=None):
        course = Course(begin, line)
        course.change(line.speed)
        if at is not None:
            course.until(at)
            course.change(speed)
        if again is not None:
            course.until(again)
            if speed == 0:
                course.time = again
            course.finish(line.length, line.speed)
        elif at is None or speed > 0:
            course.until(begin + 1)
        return course

    return course_of


def split(pairs, first, second):
    """Edges before an instant, from there to another, and behind it."""
    return (
        [pair for pair in pairs if pair[1] < first],
        [pair for pair in pairs if first <= pair[1] < second],
        [pair for pair in pairs if pair[1] >= second],
    )


def late(said):
    """The number of late pulses that was said last, and all places."""
    found = [re.fullmatch(r"rest at ([-\d ]+), (\d+) late", text) for _, text in said if text.startswith("rest")]
    assert all(found), said
    return int(found[-1][2]) if found else 0, [list(map(int, match[1].split())) for match in found]


def run(name, image, lines, rests, stall=None):
    """Types lines until the machine has come to rest so many times."""
    if name == "rp2040":
        script = {"lines": lines, "rests": rests, "stall": stall}
        command = ["node", str(HERE / "rp2040.mjs"), image, json.dumps(script)]
        return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    import stm32

    return stm32.run(image, lines, rests, stall)


def note(name, image, result):
    if "FIGURES" in os.environ:
        with open(os.environ["FIGURES"], "a", encoding="ascii") as figures:
            for what in ("stack", "interrupt"):
                figures.write(f"{pathlib.Path(image).name}\t{what}\t{result[what]}\n")


def main():
    name, image = sys.argv[1:]
    machine = MACHINES[name]
    typed, lines = script(machine)
    result = run(name, image, typed, 5)
    said = [text for _, text in result["said"]]
    answers = [text for text in said[1:] if not text.startswith("rest")]
    assert answers == ["ok"] * len(typed), said
    print(f"{name}: {said[0]}")
    j = judge(name, result, lines)
    count, places = late(result["said"])
    assert count == 0, f"{count} pulses were late"
    assert places[-1] == j.edges.position(), f"{places[-1]} is said, the edges have brought {j.edges.position()}"
    corners = [sum(line.steps[axis] for line in lines["out"] + lines["corner"]) for axis in range(len(machine.size))]
    assert places[0] == corners, (places, corners)
    slowest, waited = max(j.reactions), max(sum(edge[3:]) for edge in result["edges"]) / result["hz"]
    assert waited <= machine.wait, f"an edge has waited {waited * 1e9:.0f} ns for another handler"
    print(
        f"{name}: {j.count} STEP edges within {j.worst * 1e9:.0f} ns of their times, none late; {waited * 1e9:.0f} ns of waiting for another handler at the most; "
        f"requests took {slowest * 1e3:.1f} ms at the most; {result['stack']} bytes of stack, {result['interrupt']} instructions in an interrupt at the most"
    )
    note(name, image, result)

    # A processor that stands still for 3 ms in a line is noticed; what comes behind that comes later, and not in a burst.
    stall = {"steps": machine.size[0] // 2, "clocks": int(0.003 * result["hz"])}
    hurt = run(name, image, typed[:4], 1, stall)
    count, _ = late(hurt["said"])
    pairs = joined(Edges(load(hurt, len(machine.size))), lines["out"])
    head = pairs[:50]
    begin = fitted(head[0][1] - 0.02, head[0][1], lambda at: off(straight(at, lines["out"]), head))
    course = straight(begin, lines["out"])
    behind = [at - course.when(place) for place, at in pairs]
    slips = sum(after - before > 3 * machine.allowed for before, after in zip(behind, behind[1:]))
    print(f"{name}: of 3 ms without the processor it says {count} late; {behind[-1] * 1e3:.2f} ms behind after {slips} slips")
    assert count == slips > 0 and 0.002 < behind[-1] < 0.0035, "the image has not noticed when a pulse was late"
    assert all(after - before > -2 * machine.allowed for before, after in zip(behind, behind[1:])), "it hurries"


if __name__ == "__main__":
    main()
