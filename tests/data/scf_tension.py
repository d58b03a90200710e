"""Curves of least Σ∫(|κ|^ν + λ) ds through points, to 40 digits: the stationarity conditions of a whole curve as one system
of equations, solved by mpmath's secant method from rough starts.

    python scf_tension.py scf_tension_starts.json > all.json        needs mpmath, and a minute or two a row

scf_tension.json holds the costs of the first rows that it found, rounded to f64.

A row of STARTS has the points, ν, τ and for every span a rough first and last direction, pull (two numbers), length of the
straight piece, whether it has an inflection, and the signs of the curvature at its ends. They decide which of the stationary
curves is found, and nothing else: the unknowns are all directions and pulls, the equations the closure of every chord and the
moments at every point. Arcs are integrals of the radius of curvature over the tangent's angle, by tanh-sinh quadrature in the
power of the distance from an inflection in which the integrand is smooth.
"""

import json
import sys

from mpmath import mp, mpf, acos, atan2, cos, findroot, hypot, pi, quad, sin, sqrt

mp.dps = 50

def expj(angle):
    return mp.mpc(cos(angle), sin(angle))


# Whether arcs are measured by their lengths in place of their displacements.
LENGTH = False


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

    return quad(integrand, [mpf(start) ** (1 / power), mpf(stop) ** (1 / power)])


def plain(nu, tension, pull, a, b):
    """The same over θ from a to b on a pull below the tension."""
    radius = lambda angle: ((nu - 1) / (tension - pull[0] * cos(angle) - pull[1] * sin(angle))) ** (1 / nu)
    # Straightest along the pull.
    middle = turned(atan2(pull[1], pull[0]), (a + b) / 2)
    ends = sorted([a, b] + ([middle] if min(a, b) < middle < max(a, b) else []))
    return quad(lambda angle: radius(angle) * (1 if LENGTH else expj(angle)), ends)


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
                            if best is None or max(reach) < best[0]:
                                best = (max(reach), omega, side)
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

    def evaluate(x):
        out = []
        for k, span in enumerate(spans):
            angles = [
                x[place[(k + e) % n]] + shift[k][e] if (k + e) % n in place else span.angles[e] for e in (0, 1)
            ]
            own = [x[len(place) + 2 * k], x[len(place) + 2 * k + 1]]
            out.append(span.solve(own, angles))
        return out

    def equations(*x):
        found = evaluate(x)
        rows = []
        for k, (total, _, _) in enumerate(found):
            rows += [total.real - edges[k][0], total.imag - edges[k][1]]
        for dot in dots:
            before, after = found[(dot - 1) % count][1][1], found[dot % count][1][0]
            rows.append(before - after)
        return rows

    starts = [base[dot] for dot in dots] + [x for span in spans for x in span.starts]
    # First roughly.
    mp.dps = 16
    x = findroot(equations, starts, tol=mpf(10) ** -20, maxsteps=15)
    mp.dps = 30
    x = findroot(equations, list(x), tol=mpf(10) ** -46, maxsteps=8)
    mp.dps = 50
    x = findroot(equations, list(x), tol=mpf(10) ** -84, maxsteps=8)
    LENGTH = True
    found = evaluate(list(x))
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
        mp.dps = 50
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
