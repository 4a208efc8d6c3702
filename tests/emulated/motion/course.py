"""What a machine has to do, reckoned from lengths, limits and the instants of requests: pieces of constant acceleration in floating point.
Shares nothing with `step-motion`.
"""

import math


class Line:
    """A straight line of several axes, from the steps where it begins to those where it ends."""

    def __init__(self, begin, end, scale, speeds, accelerations, feed):
        self.steps = [after - before for before, after in zip(begin, end)]
        self.length = math.sqrt(sum((steps / per_mm) ** 2 for steps, per_mm in zip(self.steps, scale)))
        moving = [axis for axis, steps in enumerate(self.steps) if steps]
        per_step = [self.length / abs(self.steps[axis]) for axis in moving]
        self.acceleration = min(accelerations[axis] * mm for axis, mm in zip(moving, per_step))
        self.speed = min([feed] + [speeds[axis] * mm for axis, mm in zip(moving, per_step)])

    def places(self):
        """Of each step: how far along the line, the axis, and which way. Step k is at k - 1/2."""
        for axis, steps in enumerate(self.steps):
            for k in range(abs(steps)):
                yield (k + 0.5) / abs(steps) * self.length, axis, steps < 0


class Course:
    """A motion along something straight, from rest: seconds and mm."""

    def __init__(self, begin, line):
        self.acceleration = line.acceleration
        self.time, self.place, self.speed = begin, 0.0, 0.0
        self.pieces = []

    def piece(self, acceleration, duration):
        if duration > 0:
            self.pieces.append((self.time, self.place, self.speed, acceleration, duration))
            self.time += duration
            self.place += self.speed * duration + acceleration * duration**2 / 2
            self.speed += acceleration * duration

    def change(self, speed):
        """To another speed, as fast as the limit allows."""
        acceleration = math.copysign(self.acceleration, speed - self.speed)
        self.piece(acceleration, (speed - self.speed) / acceleration)

    def until(self, time):
        """At the same speed."""
        self.piece(0.0, time - self.time)

    def finish(self, place, speed):
        """To rest at a place, with this speed at the most."""
        left, a = place - self.place, self.acceleration
        peak = min(speed, math.sqrt(max(0.0, a * left + self.speed**2 / 2)))
        self.change(peak)
        self.piece(0.0, (place - self.place - peak**2 / 2 / a) / peak)
        self.change(0.0)

    def when(self, place):
        """When it is there; a day and more later if it does not come so far."""
        for time, begin, speed, acceleration, duration in self.pieces:
            end = begin + speed * duration + acceleration * duration**2 / 2
            if place <= end:
                left = place - begin
                root = math.sqrt(max(0.0, speed**2 + 2 * acceleration * left))
                return time + 2 * left / (speed + root) if left > 0 else time
        return 86_400.0 * (1.0 + place - self.place)


def fitted(low, high, fault):
    """The instant between two at which `fault` is least; it falls until there, and grows, or at last stays, from there on."""
    ratio = (math.sqrt(5) - 1) / 2
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    at_a, at_b = fault(a), fault(b)
    while high - low > 1e-11:
        if at_a <= at_b:
            high, b, at_b = b, a, at_a
            a = high - ratio * (high - low)
            at_a = fault(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + ratio * (high - low)
            at_b = fault(b)
    return (low + high) / 2
