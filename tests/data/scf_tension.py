"""Curves of least Σ∫(|κ|^ν + λ) ds through points, to 40 digits: the stationarity conditions of a whole curve as one system
of equations, solved by Newton's method from rough starts.

    python scf_tension.py scf_tension_starts.json > all.json        needs mpmath; a second or three a row with gmpy2

scf_tension.json holds the costs of the rows that it found, rounded to f64. Rows whose rough start leads nowhere are left out.

A row of STARTS has the points, ν, τ and for every span a rough first and last direction, pull (two numbers), length of the
straight piece, whether it has an inflection, and the signs of the curvature at its ends. They decide which of the stationary
curves is found, and nothing else: the unknowns are all directions and pulls, the equations the closure of every chord and the
moments at every point. Arcs are integrals of the radius of curvature over the tangent's angle, by tanh-sinh quadrature in the
power of the distance from an inflection in which the integrand is smooth.
"""

import json
import sys

from mpmath import mp, mpf, acos, atan2, cos, hypot, pi, quad, sin, sqrt

mp.dps = 50


def expj(angle):
    return mp.mpc(cos(angle), sin(angle))


# Whether arcs are measured by their lengths in place of their displacements.
LENGTH = False


def integral(f, ends):
    """∫f by tanh-sinh quadrature, halved where that does not reach the working precision."""
    total = mpf(0)
    pieces = [(a, b, 12) for a, b in zip(ends, ends[1:])]
    while pieces:
        a, b, halvings = pieces.pop()
        if a == b:
            continue
        value, error = quad(f, [a, b], error=True)
        if error <= mpf(10) ** (3 - mp.dps) * max(abs(value), mpf(10) ** -6):
            total += value
        elif halvings == 0:
            raise ValueError(f"an integral is good to {mp.nstr(error, 2)} only")
        else:
            pieces += [(a, (a + b) / 2, halvings - 1), ((a + b) / 2, b, halvings - 1)]
    return total


def widths(points, closed):
    n = len(points)
    edges = [(points[(k + 1) % n][0] - points[k][0], points[(k + 1) % n][1] - points[k][1]) for k in range(n if closed else n - 1)]
    count = len(edges)
    size = [hypot(*edge) for edge in edges]
    out = []
    for k in range(count):
        neighbours, room = [size[k]], [mpf(1)]
        for other in (k - 1, k + 1):
            if closed or 0 <= other < count:
                other %= count
                neighbours.append(size[other])
                cosine = (edges[k][0] * edges[other][0] + edges[k][1] * edges[other][1]) / (size[k] * size[other])
                room.append((1 + cosine) / 2)
        out.append(max(min(neighbours) * min(room), size[k] / 10))
    return edges, out


def turned(angle, near):
    """The angle that differs by whole turns and is nearest to another."""
    return angle - 2 * pi * mp.nint((angle - near) / (2 * pi))


def arc(nu, tension, t, start, stop, axis, side):
    """∫ρ (cos θ, sin θ) du over the distances u from an inflection at the angle `axis`, θ = axis + side·u; with `LENGTH` ∫ρ du.

    With |P|² = λ² + t² the first integral there is (ν − 1)|κ|^ν = λ(1 − cos u) + t sin u; t = 0 is the critical pull.
    """
    power = 1 / (1 - (2 if t == 0 else 1) / nu)

    def integrand(x):
        if x == 0:
            return mpf(0)
        u = x**power
        f = 2 * sin(u / 2) * (tension * sin(u / 2) + t * cos(u / 2))
        radius = ((nu - 1) / f) ** (1 / nu) * power * x ** (power - 1)
        return radius * (1 if LENGTH else expj(axis + side * u))

    return integral(integrand, [mpf(start) ** (1 / power), mpf(stop) ** (1 / power)])


def plain(nu, tension, pull, a, b):
    """The same over θ from a to b on a pull below the tension."""
    radius = lambda angle: ((nu - 1) / (tension - pull[0] * cos(angle) - pull[1] * sin(angle))) ** (1 / nu)
    # Straightest along the pull.
    middle = turned(atan2(pull[1], pull[0]), (a + b) / 2)
    ends = sorted([a, b] + ([middle] if min(a, b) < middle < max(a, b) else []))
    return integral(lambda angle: radius(angle) * (1 if LENGTH else expj(angle)), ends)


class Span:
    def __init__(self, row, nu, tension, chord, free):
        self.nu, self.tension, self.chord, self.free = nu, tension, chord, free
        a, b, px, py, flat, inflection, signs = row
        self.angles = [mpf(a), mpf(b)]
        self.signs = signs
        strength = mp.hypot(px, py)
        # The straight piece's angle and length, or the pull.
        self.flat = flat > 0
        if self.flat:
            self.starts = [turned(atan2(py, px), self.angles[0]), mpf(flat)]
        else:
            self.starts = [mpf(px), mpf(py)]
        self.above = strength > tension
        self.inflection = inflection

    def solve(self, unknowns, angles):
        """Displacement, length, the signed curvature at both ends, the pull, and the angles (a free end has its own)."""
        nu, tension = self.nu, self.tension
        if self.flat:
            omega, flat = unknowns
            angles = [omega if end == self.free else angle for end, angle in enumerate(angles)]
            total = flat * (1 if LENGTH else expj(omega))
            for angle in angles:
                distance = abs(angle - omega)
                if distance > 0:
                    total += arc(nu, tension, mpf(0), 0, distance, omega, mp.sign(angle - omega))
            pull = [tension * cos(omega), tension * sin(omega)]
        else:
            pull = unknowns
            strength = hypot(*pull)
            if strength <= tension:
                total = plain(nu, tension, pull, *angles)
            else:
                t = sqrt(strength**2 - tension**2)
                opening, direction = acos(tension / strength), atan2(pull[1], pull[0])
                # The boundary of the angles at which the curvature is real that is nearer to the ends.
                best = None
                for side in (1, -1):
                    axis = direction + side * opening
                    given = [angle for end, angle in enumerate(angles) if end != self.free]
                    moved = [turned(axis, given[0] - side * shift) for shift in (0, 1, 2)]
                    for omega in moved:
                        reach = [side * (angle - omega) for angle in given]
                        if min(reach) > -mpf(10) ** -9 and max(reach) < 2 * (pi - opening):
                            # A free end is itself at the inflection: that of the rough start.
                            far = max(reach) if self.free is None else abs(omega - self.angles[self.free])
                            if best is None or far < best[0]:
                                best = (far, omega, side)
                if best is None:
                    raise ValueError("the pull of a span bends its ends the other way")
                _, omega, side = best
                angles = [omega if end == self.free else angle for end, angle in enumerate(angles)]
                reach = [abs(angle - omega) for angle in angles]
                if self.inflection:
                    total = sum(arc(nu, tension, t, 0, one, omega, side) for one in reach if one > 0)
                else:
                    total = arc(nu, tension, t, min(reach), max(reach), omega, side)
        moments = []
        for end, (angle, sign) in enumerate(zip(angles, self.signs)):
            f = tension - pull[0] * cos(angle) - pull[1] * sin(angle)
            moments.append(mpf(0) if end == self.free else sign * (f / (nu - 1)) ** (1 - 1 / nu))
        return total, moments, pull


def solve(row):
    global LENGTH
    closed, nu = row["closed"], mpf(repr(row["nu"]))
    points = [[mpf(repr(x)) for x in point] for point in row["points"]]
    edges, room = widths(points, closed)
    tau = mpf(repr(row["tension"]))
    n, count = len(points), len(edges)
    spans = []
    for k in range(count):
        tension = (2 * (1 - 1 / nu) * tau / room[k]) ** nu
        free = None if closed else 0 if k == 0 else 1 if k == count - 1 else None
        spans.append(Span(row["starts"][k], nu, tension, edges[k], free))
    dots = range(n) if closed else range(1, n - 1)
    place = {dot: i for i, dot in enumerate(dots)}
    # Directions as spans see them differ by whole turns from those of the unknowns.
    base = {dot: spans[dot].angles[0] for dot in dots}
    shift = [[2 * pi * mp.nint((spans[k].angles[e] - base.get((k + e) % n, spans[k].angles[e])) / (2 * pi)) for e in (0, 1)] for k in range(count)]

    unknowns = len(place) + 2 * count

    def places(k):
        """Where a span's four arguments stand among the unknowns; None where an end is free."""
        own = len(place) + 2 * k
        return [place.get((k + e) % n) for e in (0, 1)] + [own, own + 1]

    def arguments(x, k):
        first, last, *own = places(k)
        angles = [x[at] + shift[k][e] if at is not None else spans[k].angles[e] for e, at in enumerate((first, last))]
        return angles + [x[at] for at in own]

    def span_equations(k, given):
        """What is missing of the chord, and the moments at both ends."""
        total, moments, pull = spans[k].solve(given[2:], given[:2])
        return [total.real - edges[k][0], total.imag - edges[k][1], *moments], total, pull

    def rows(k):
        """The equations in which those values of a span stand, and their signs."""
        out = [(2 * k, 1), (2 * k + 1, 1)]
        for e, sign in ((0, -1), (1, 1)):
            at = place.get((k + e) % n)
            out.append((2 * count + at, sign) if at is not None else (None, 0))
        return out

    def residual(x):
        out = mp.matrix(unknowns, 1)
        for k in range(count):
            values, _, _ = span_equations(k, arguments(x, k))
            for (at, sign), value in zip(rows(k), values):
                if at is not None:
                    out[at] += sign * value
        return out

    def jacobian(x):
        """By differences, a span at a time: it depends on its own four unknowns alone."""
        step = mpf(10) ** -(mp.dps // 2)
        out = mp.matrix(unknowns, unknowns)
        for k in range(count):
            given = arguments(x, k)
            here, _, _ = span_equations(k, given)
            for number, column in enumerate(places(k)):
                if column is None:
                    continue
                moved = list(given)
                moved[number] += step * size[column]
                there, _, _ = span_equations(k, moved)
                for (at, sign), value, before in zip(rows(k), there, here):
                    if at is not None:
                        out[at, column] += sign * (value - before) / step
        return out

    def step(matrix, right):
        scale = [max(abs(matrix[i, j]) for j in range(unknowns)) for i in range(unknowns)]
        scaled = mp.matrix(unknowns, unknowns)
        for i in range(unknowns):
            for j in range(unknowns):
                scaled[i, j] = matrix[i, j] / scale[i]
        return mp.lu_solve(scaled, mp.matrix([-right[i] / scale[i] for i in range(unknowns)]))

    x = [base[dot] for dot in dots] + [start for span in spans for start in span.starts]
    # Sizes of the unknowns: of angles and lengths 1, of pulls the tension.
    size = [mpf(1)] * len(place)
    for span in spans:
        size += [mpf(1)] * 2 if span.flat else [max(span.tension, *map(abs, span.starts))] * 2
    # Newton's method in few digits; then in all of them with the last matrix, which gains 10 digits a step.
    mp.dps = 25
    for _ in range(25):
        matrix = jacobian(x)
        move = step(matrix, residual(x))
        most = max(abs(own) for own in move)
        part = min(mpf(1), mpf(2) / 10 / most)
        x = [was + part * of * own for was, of, own in zip(x, size, move)]
        if most < mpf(10) ** -11:
            break
    else:
        raise ValueError(f"steps are still {mp.nstr(most, 2)} long")
    mp.dps = 55
    for _ in range(12):
        move = step(matrix, residual(x))
        most = max(abs(own) for own in move)
        x = [was + of * own for was, of, own in zip(x, size, move)]
        if most < mpf(10) ** -43:
            break
    else:
        raise ValueError(f"the last steps are still {mp.nstr(most, 2)} long")
    LENGTH = True
    found = [span.solve(*((given := arguments(x, k))[2:], given[:2])) for k, span in enumerate(spans)]
    LENGTH = False
    # By the first integral: ∫(|κ|^ν + λ) ds = (νλ·length − P·chord)/(ν − 1).
    total = sum(
        (nu * span.tension * total - pull[0] * span.chord[0] - pull[1] * span.chord[1]) / (nu - 1)
        for span, (total, _, pull) in zip(spans, found)
    )
    directions = [turned(x[place[dot]], 0) for dot in dots]
    return total, directions


def main():
    rows = json.load(open(sys.argv[1]))
    out = []
    for row in rows:
        mp.dps = 60
        try:
            cost, directions = solve(row)
        except (ValueError, ZeroDivisionError, TypeError) as problem:
            print("left out:", row["points"], row["nu"], problem, file=sys.stderr)
            continue
        mp.dps = 40
        print(len(out), row["nu"], float(cost), row["check"], float(cost) / row["check"] - 1, file=sys.stderr, flush=True)
        out.append(
            {
                "closed": row["closed"], "nu": row["nu"], "tension": row["tension"], "points": row["points"],
                "cost": mp.nstr(cost, 40), "directions": [mp.nstr(x, 40) for x in directions],
            }
        )
    print("[\n " + ",\n ".join(json.dumps(row) for row in out) + "\n]")


main()
